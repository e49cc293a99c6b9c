"""The first bad example of a rule: what is sent, one frame of it byte by byte, what is printed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from io import BytesIO
from typing import Any, NamedTuple

from mavframecheck import __version__
from mavframecheck.engine import Pack, Settings
from mavframecheck.engine.check import check_mission, check_recording
from mavframecheck.engine.examples import ground_of, recording, sender_of
from mavframecheck.model import ByteLocation, Example, Rule, Step
from mavframecheck.report import Checked, Context
from mavframecheck.report.text import render
from mavframecheck.report.words import plural, scalar
from mavframecheck.semantics.names import FAMILY_NAMES
from mavframecheck.sources import Recording
from mavframecheck.wire import load_dialect
from tools.pages.frames import Tlog, field_table, hexadecimal, samples
from tools.pages.markdown import code, fence, table, text

_RECORDING, _MISSION = "example.tlog", "example.plan"
_MOST_STEPS = 8
_MOST_RAW = 48
_SENDERS = {"gcs": "the ground station"}


class Judged(NamedTuple):
    """The first example that a rule finds fault with, as a file and its report."""

    example: Example
    name: str
    data: bytes
    checked: Checked


def judged(rule: Rule) -> Judged:
    """Return the first bad example of `rule`, judged by it alone."""
    example = next(each for each in rule.example if each.expect == "bad")
    dialect = load_dialect()
    data = example.file.encode() if example.file else recording(example, dialect)
    name = _MISSION if example.file else _RECORDING
    pack, settings = Pack((rule,), {rule.code: rule.code}), Settings(preview=True)
    check = check_mission if example.file else check_recording
    opened, ground = Recording(name, BytesIO(data), None), ground_of(example)
    checked = Checked(*check(opened, pack, settings, dialect, ground=ground))
    return Judged(example, name, data, checked)


def shown(rule: Rule, found: Judged) -> Iterator[str]:
    """Yield what is sent, one message of it byte by byte, and what the tool prints for it."""
    yield _before(found.example)
    if found.example.file:
        yield fence(found.example.file.strip(), "json")
    else:
        yield from _sent(found)
    yield "What the tool prints for it:"
    options = " --preview" if rule.status == "preview" else ""
    options += " --dem ground.tif" if ground_of(found.example) else ""
    command = f"$ mavframecheck check --select {rule.code}{options} {found.name}"
    report = "".join(render([found.checked], _context()))
    yield fence(f"{command}\n{report}")


def _sent(found: Judged) -> Iterator[str]:
    example, tlog = found.example, Tlog(found.data)
    if sum(step.repeat for step in example.step) > 1 or example.raw:
        yield _steps(example)
    where = found.checked.findings[0].location
    if isinstance(where, ByteLocation):
        yield from _frame(tlog, where)


def _context() -> Context:
    return Context(version=__version__)


def _before(example: Example) -> str:
    """Return what the recording said before, in a sentence."""
    parts = [_known(key, value) for key, value in example.context.items()]
    note = f"{text(example.note)[:1].upper()}{text(example.note)[1:]}." if example.note else ""
    before = f"Before it: {'; '.join(parts)}." if parts else ""
    return " ".join(filter(None, (note, before)))


def _known(key: str, value: Any) -> str:
    """Return one thing of the context in words."""
    if key == "ground_msl":
        return f"flat ground {scalar(value)} m above the sea"
    if not isinstance(value, Mapping):
        return FAMILY_NAMES.get(value, text(str(value)))
    place = f"{key} at {scalar(value['lat'])}, {scalar(value['lon'])}"
    heights = {"alt_msl": "above the sea", "relative_alt": "above home"}
    said = [f"{scalar(value[name])} m {words}" for name, words in heights.items() if name in value]
    return ", ".join(filter(None, [place, " and ".join(said)]))


def _steps(example: Example) -> str:
    """Return a table of what is sent, in the order of the example."""
    rows = [_step(step) for step in example.step[:_MOST_STEPS]]
    parts = [table(("s", "from", "message", "fields (others are zero)", "how often"), rows)]
    if len(example.step) > _MOST_STEPS:
        parts.append(f"and {plural(len(example.step) - _MOST_STEPS, 'more row')} like these.")
    if example.raw:
        extra = bytes.fromhex(example.raw)
        more = " ..." if len(extra) > _MOST_RAW else ""
        parts.append(f"Then these bytes: {code(extra[:_MOST_RAW].hex(' ') + more)}")
    return "\n\n".join(filter(None, parts))


def _step(step: Step) -> tuple[str, ...]:
    fields = ", ".join(f"{name} {_value(value)}" for name, value in step.fields.items())
    grows = [
        f"{name} {'+' if more >= 0 else '-'} {scalar(abs(more))}"
        for name, more in step.each.items()
    ]
    often = f"{step.repeat} times, every {step.every:g} s" if step.repeat > 1 else "once"
    each = f"; each time {', '.join(grows)}" if grows else ""
    mangled = {"checksum": ", its checksum broken", "lost": ", lost on the way", "twice": ", twice"}
    often += each + mangled.get(step.mangle, "")
    system, component = sender_of(step.sender)
    sender = f"{system}/{component}"
    return f"{step.t:g}", sender, code(step.message), text(fields), text(often)


def _value(value: Any) -> str:
    """Return a field value; an entry of an enumeration without its name, long arrays shortened."""
    if isinstance(value, list):
        shown = ", ".join(map(_value, value[:4]))
        return f"[{shown}{', ...' if len(value) > 4 else ''}]"
    return value.partition(".")[2] or value if isinstance(value, str) else scalar(value)


def _frame(tlog: Tlog, where: ByteLocation) -> Iterator[str]:
    """Yield the message of the first hit as a table, its bytes, and how its stream goes on."""
    stream = tlog.stream(where)
    if stream is None:
        yield "The first bytes that it is about:"
    else:
        yield f"{code(stream.name)}, the first that the finding is about:"
        yield field_table(stream, where, tlog.fields(where))
        yield f"As bytes ({where.length}, at {where.offset} of the recording):"
    yield hexadecimal(tlog.frame(where))
    shown = samples(stream) if stream is not None else ""
    if shown:
        yield "The stream from its beginning to its end, some messages of it:"
        yield shown
