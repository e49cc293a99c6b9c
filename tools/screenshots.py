"""Pictures of the HTML report for the README, of recordings that `samples/` makes: `make screenshots`.

Needs the Chromium of the system. The pictures differ a little between machines, as fonts do.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from playwright.sync_api import FloatRect, Page

from samples.flight import PX4, Flight
from samples.make import changed, pack, tlog, with_global_setpoints
from tools.browser import MISSING, browser, chromium

ROOT = Path(__file__).parents[1]
TARGET = ROOT / "docs" / "images"
SETPOINT = "SET_POSITION_TARGET_GLOBAL_INT"


def recording() -> bytes:
    """Return a flight with two mistakes: odometry in ENU that says NED, and heights above the sea that say home."""
    traffic = with_global_setpoints(Flight(PX4, sides=2, odometry=True))
    traffic = changed(traffic, "ODOMETRY", in_enu, (0.0, 1e9))
    traffic = changed(traffic, SETPOINT, lambda _: {"coordinate_frame": 6}, (0.0, 1e9))
    return tlog(pack(changed(traffic, SETPOINT, above_sea, (24.0, 29.0))))


def in_enu(fields: dict[str, Any]) -> dict[str, Any]:
    """Return a position as east, north, up under the label of north, east, down."""
    return {"x": fields["y"], "y": fields["x"], "z": -fields["z"], "frame_id": 1}


def above_sea(fields: dict[str, Any]) -> dict[str, Any]:
    """Return a height above mean sea level."""
    return {"alt": fields["alt"] + 488.0}


def picture(page: Page, path: Path, selector: str, *, height: int | None = None) -> None:
    """Write what `selector` shows, with some room around it, the upper `height` pixels of it."""
    box = page.locator(selector).first.bounding_box()
    if box is None:
        raise SystemExit(f"there is no {selector} on the page")
    clip: FloatRect = {
        "x": max(box["x"] - 16, 0),
        "y": max(box["y"] - 12, 0),
        "width": box["width"] + 32,
        "height": (height or box["height"]) + 24,
    }
    page.screenshot(path=path, full_page=True, clip=clip)
    print(f"wrote {path}")


def main() -> None:
    """Write the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--to", type=Path, default=TARGET)
    target = parser.parse_args().to
    target.mkdir(parents=True, exist_ok=True)
    path = chromium()
    if path is None:
        raise SystemExit(MISSING)
    with tempfile.TemporaryDirectory() as folder, browser(path) as opened:
        Path(folder, "flight.tlog").write_bytes(recording())
        command = [sys.executable, "-m", "mavframecheck", "report", "flight.tlog", "--isolated"]
        subprocess.run(command, cwd=folder, check=True)
        page = opened.new_page(viewport={"width": 1180, "height": 900}, color_scheme="light")
        page.goto(Path(folder, "report.html").as_uri())
        page.wait_for_selector("html[data-ready=yes]")
        picture(page, target / "report.png", "body", height=1110)
        picture(page, target / "report-motion.png", "details.card[data-code=MFC401]", height=620)


if __name__ == "__main__":
    main()
