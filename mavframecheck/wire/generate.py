"""Write the layouts of the default dialect into the package: ``python -m mavframecheck.wire.generate``."""

from __future__ import annotations

from pathlib import Path

import msgspec

from mavframecheck.wire.definitions import read_definitions
from mavframecheck.wire.dialect import DEFAULT_DIALECT, pymavlink_definitions

TARGET = Path(__file__).parent / "data" / f"{DEFAULT_DIALECT}.json"


def generated() -> bytes:
    """Return the content that the generated file must have: one message a line."""
    layouts = read_definitions(pymavlink_definitions() / f"{DEFAULT_DIALECT}.xml")
    return b"[\n" + b",\n".join(msgspec.json.encode(layout) for layout in layouts) + b"\n]\n"


if __name__ == "__main__":
    TARGET.write_bytes(generated())
