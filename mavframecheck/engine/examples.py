"""The examples in rule files as recordings, so that every rule is tested on its own words."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from typing import Any

from mavframecheck.engine.check import check_mission, check_recording
from mavframecheck.engine.compiled import Pack
from mavframecheck.engine.settings import Settings
from mavframecheck.geo.terrain import Level
from mavframecheck.model import Example, FileReport, Finding, Rule, Step
from mavframecheck.semantics.constants import constant
from mavframecheck.semantics.names import usual_vehicle
from mavframecheck.sources import Recording
from mavframecheck.wire import Dialect, load_dialect
from mavframecheck.wire.encode import encode_frame, encode_payload, stamped

START_US = 1_700_000_000_000_000
CONTEXT_S = 0.5
"""Context is said this long before the first step."""

SENDERS = {"autopilot": (1, 1), "gcs": (255, 190), "companion": (1, 191), "camera": (1, 100)}


class _Writer:
    """Writes records with running sequence numbers."""

    def __init__(self, dialect: Dialect) -> None:
        self._dialect = dialect
        self._seq: dict[tuple[int, int], int] = {}
        self.data = bytearray()

    def send(self, step: Step, t: float, repetition: int = 0) -> None:
        """Append the message of `step` at `t` seconds."""
        layout = self._dialect.by_name[step.message]
        fields = {name: number(value) for name, value in step.fields.items()}
        for name, more in step.each.items():
            fields[name] = grown(fields.get(name, 0), more * repetition)
        sender = sender_of(step.sender)
        if sender[1] != SENDERS["autopilot"][1]:
            fields = {"target_system": 1, "target_component": 1} | fields
        fields = {n: v for n, v in fields.items() if n in layout.by_name or n in step.fields}
        seq = self._seq[sender] = self._seq.get(sender, -1) + 1
        frame = encode_frame(
            layout,
            encode_payload(layout, fields),
            sysid=sender[0],
            compid=sender[1],
            seq=seq,
            version=step.version,
        )
        if step.mangle == "checksum":
            frame = frame[:-1] + bytes([frame[-1] ^ 0xFF])
        copies = {"lost": 0, "twice": 2}.get(step.mangle, 1)
        self.data += stamped(frame, START_US + round(t * 1e6)) * copies


def sender_of(name: str) -> tuple[int, int]:
    """Return system and component of a sender: a role, or ``2/1`` for any other."""
    if name in SENDERS:
        return SENDERS[name]
    system, _, component = name.partition("/")
    return int(system), int(component)


def number(value: Any) -> Any:
    """Return a field value of an example; ``ENUM.NAME`` stands for its number."""
    if (
        isinstance(value, str)
        and "." in value
        and value.partition(".")[0].replace("_", "").isupper()
    ):
        return constant(value)
    return value


def grown(value: Any, more: float) -> Any:
    """Return a field with something added; whole numbers stay whole."""
    return value + (round(more) if isinstance(value, int) else more)


def recording(example: Example, dialect: Dialect) -> bytes:
    """Return `example` as a tlog: its context, then its steps."""
    writer = _Writer(dialect)
    for step in _context_steps(example.context):
        writer.send(step, 0.0)
    sent = [
        (CONTEXT_S + step.t + k * step.every, k, step)
        for step in example.step
        for k in range(step.repeat)
    ]
    for t, repetition, step in sorted(sent, key=lambda it: it[0]) if example.interleave else sent:
        writer.send(step, t, repetition)
    return bytes(writer.data) + bytes.fromhex(example.raw)


def _context_steps(context: dict[str, Any]) -> Iterator[Step]:
    """Yield the messages that say what `context` tells: autopilot, position, home."""
    if "autopilot" in context:
        autopilot, mav_type = usual_vehicle(context["autopilot"])
        fields = {"autopilot": autopilot, "type": mav_type, "mavlink_version": 3}
        yield Step(message="HEARTBEAT", sender="autopilot", fields=fields)
    if "home" in context:
        home = context["home"]
        fields = {"latitude": round(home["lat"] * 1e7), "longitude": round(home["lon"] * 1e7)}
        fields["altitude"] = round(home.get("alt_msl", 0) * 1e3)
        yield Step(message="HOME_POSITION", sender="autopilot", fields=fields)
    if "position" in context:
        at = context["position"]
        fields = {"lat": round(at["lat"] * 1e7), "lon": round(at["lon"] * 1e7)}
        fields |= {
            "alt": round(at.get("alt_msl", 0) * 1e3),
            "relative_alt": round(at.get("relative_alt", 0) * 1e3),
        }
        yield Step(message="GLOBAL_POSITION_INT", sender="autopilot", fields=fields)


def ground_of(example: Example) -> Level | None:
    """Return the ground that `example` is flown over, None where it says nothing of it."""
    height_m = example.context.get("ground_msl")
    return None if height_m is None else Level(float(height_m))


def run_example(
    rule: Rule, example: Example, source: str
) -> tuple[FileReport, tuple[Finding, ...]]:
    """Judge `example` with `rule` alone."""
    dialect = load_dialect()
    pack = Pack((rule,), {rule.code: source})
    settings = Settings(preview=True)
    ground = ground_of(example)
    if example.file:
        written = Recording(rule.code, BytesIO(example.file.encode()), None)
        return check_mission(written, pack, settings, dialect, ground)
    opened = Recording(rule.code, BytesIO(recording(example, dialect)), None)
    return check_recording(opened, pack, settings, dialect, ground=ground)
