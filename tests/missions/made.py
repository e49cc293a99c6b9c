"""Mission files made for tests."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from mavframecheck.missions.planned import Planned
from mavframecheck.missions.upload import Upload
from mavframecheck.wire import load_dialect

DIALECT = load_dialect()
HOME = [47.397742, 8.545594, 488.0]


def item(command: int = 16, frame: int = 3, **more: Any) -> dict[str, Any]:
    """Return a simple item near home; `lat`, `lon`, `alt` and `params` replace what it holds."""
    place = [more.pop("lat", 47.3978), more.pop("lon", 8.5457), more.pop("alt", 30.0)]
    params = [*more.pop("params", [0, 0, 0, None]), *place]
    kept = {"autoContinue": True, "command": command, "frame": frame, "params": params}
    return kept | {"type": "SimpleItem"} | more


def plan(*items: dict[str, Any], **mission: Any) -> dict[str, Any]:
    """Return a plan for a PX4 quadrotor."""
    return {
        "fileType": "Plan",
        "mission": {"firmwareType": 12, "vehicleType": 2, "plannedHomePosition": HOME}
        | {"items": list(items)}
        | mission,
        "version": 1,
    }


def written(folder: Path, content: Any, name: str = "m.plan") -> Path:
    """Return a file with `content`: bytes or text as they are, anything else as JSON."""
    file = folder / name
    if not isinstance(content, bytes | str):
        content = json.dumps(content, indent=2)
    file.write_bytes(content.encode() if isinstance(content, str) else content)
    return file


def uploaded(planned: Planned, family: str | None = None) -> Upload:
    """Return the upload of a mission."""
    return Upload(planned, DIALECT, family)
