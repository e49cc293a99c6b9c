"""Rules for people and machines: the list of them, and one explained from its file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import msgspec

from mavframecheck.model import Applies, Detect, Example, Rule, Step, setting
from mavframecheck.report import Context
from mavframecheck.report.escape import sentence
from mavframecheck.report.json import document
from mavframecheck.report.layout import SEVERITY_COLOURS, Page
from mavframecheck.report.words import plural, scalar

_LISTED = ("code", "name", "severity", "confidence", "status", "since", "summary", "params")
_MOST_STEPS = 4


def listing(rules: Sequence[Rule], context: Context) -> Iterator[str]:
    """Yield two lines a rule: what it is called and what it finds."""
    page = Page(context)
    width = max((len(rule.name) for rule in rules), default=0)
    yield page.dim(f"{'CODE':8}{'SEVERITY':10}{'NAME':{width + 2}}STATUS")
    for rule in rules:
        severity = page.paint(f"{rule.severity:8}", SEVERITY_COLOURS[rule.severity])
        name = page.bold(f"{sentence(rule.name):{width}}")
        yield f"{sentence(rule.code):6}  {severity}  {name}  {rule.status}"
        yield from page.wrap(rule.summary, " " * 8)
    yield page.dim(f"{plural(len(rules), 'rule')}; mavframecheck rule CODE explains one")


def listing_json(rules: Sequence[Rule]) -> bytes:
    """Return the list as JSON: what `listing` shows, with confidence and parameters."""
    return document([{key: getattr(rule, key) for key in _LISTED} for rule in rules])


def explanation_json(rule: Rule) -> bytes:
    """Return the whole rule file as JSON."""
    return document(rule)


def explanation(rule: Rule, context: Context) -> Iterator[str]:
    """Yield what the rule looks for, why it matters and how to mend it, from the rule file."""
    page = Page(context)
    yield page.bold(f"{sentence(rule.code)} {sentence(rule.name)}")
    yield from page.wrap(
        f"{rule.severity}, {rule.confidence} confidence, {rule.status}, since {rule.since}"
    )
    yield ""
    yield from page.paragraphs(rule.summary, "")
    yield from _section("What it looks for", _looks_for(rule, page), page)
    yield from _section("Why it matters", page.paragraphs(rule.explain.why, "  "), page)
    yield from _section("How to mend it", page.paragraphs(rule.explain.fix, "  "), page)
    yield from _section("Parameters", _parameters(rule, page), page)
    yield from _section("Examples", _examples(rule, page), page)
    references = (
        line for text in rule.explain.references for line in page.wrap(text, "  ", "    ")
    )
    yield from _section("References", references, page)


def _section(title: str, lines: Iterator[str], page: Page) -> Iterator[str]:
    """Yield a title and its lines, or nothing when there are none."""
    for number, line in enumerate(lines):
        if not number:
            yield ""
            yield page.bold(title)
        yield line


def _looks_for(rule: Rule, page: Page) -> Iterator[str]:
    """Yield what is judged, the names used, and the condition as the file has it."""
    for label, words in _judged(rule.applies):
        yield from page.wrap(f"{label} {words}", "  ", "    ")
    for name, expression in rule.let.items():
        yield from page.wrap(f"{name} = {expression}", "  ", "    ")
    for label, words in _detects(rule.detect):
        yield from page.wrap(f"{label} {words}", "  ", "    ")
    for each in rule.severity_when:
        yield from page.wrap(f"{each.severity} where {each.condition}", "  ", "    ")


def _judged(applies: Applies) -> list[tuple[str, str]]:
    """Return which rows the rule judges, in words."""
    lists = {
        "in": applies.message,
        "with": applies.has,
        "of command": applies.command,
        "in frame": applies.frame,
        "when the vehicle is": applies.autopilot,
        "sent by": applies.sender,
    }
    tag = [f"{key} {_alternatives(value)}" for key, value in applies.tag.items()]
    rows = [("every field of", " and ".join(tag))] if tag else []
    return rows + [(label, _alternatives(words)) for label, words in lists.items() if words]


def _alternatives(words: str | int | tuple[str, ...]) -> str:
    """Return ``a, b or c``; what has a leading ``!`` reads as ``anything but a``."""
    items = words if isinstance(words, tuple) else (str(words),)
    wanted = [word for word in items if not word.startswith("!")]
    refused = [word[1:] for word in items if word.startswith("!")]
    parts = [_either(wanted), f"anything but {_either(refused)}" if refused else ""]
    return ", ".join(filter(None, parts))


def _either(words: Sequence[str]) -> str:
    *front, last = words or [""]
    return f"{', '.join(front)} or {last}" if front else last


def _detects(detect: Detect) -> list[tuple[str, str]]:
    """Return the condition, and how much of it makes a finding."""
    persist = detect.persist
    lasting = [
        plural(persist.count, "hit") if persist.count > 1 else "",
        f"{scalar(persist.seconds)} s" if persist.seconds else "",
        f"{persist.share:.0%} of the rows in between" if persist.share else "",
    ]
    rows = {
        "by the check": detect.check,
        "judged where": detect.when,
        "wrong where": detect.flag,
        "for at least": " and ".join(filter(None, lasting)),
    }
    return [(label, words) for label, words in rows.items() if words]


def _parameters(rule: Rule, page: Page) -> Iterator[str]:
    """Yield each parameter as ``--set`` takes it."""
    for name, value in rule.params.items():
        yield from page.wrap(f"--set {rule.code}.{name}={setting(value)}", "  ", "    ")


def _examples(rule: Rule, page: Page) -> Iterator[str]:
    for example in rule.example:
        words = "; ".join(filter(None, _example(example)))
        yield from page.wrap(f"{example.expect}: {words}", "  ", "    ")


def _example(example: Example) -> Iterator[str]:
    yield example.note
    if example.context:
        yield "with " + _pairs(example.context)
    for step in example.step[:_MOST_STEPS]:
        yield _step(step)
    if len(example.step) > _MOST_STEPS:
        yield f"and {plural(len(example.step) - _MOST_STEPS, 'more message')}"
    if example.raw:
        yield f"bytes {example.raw}"


def _step(step: Step) -> str:
    """Return one message of an example in words."""
    often = f", {step.repeat} times, every {step.every:g} s" if step.repeat > 1 else ""
    fields = f" with {_pairs(step.fields)}" if step.fields else ""
    return f"{step.sender} sends {step.message}{fields}{often}"


def _pairs(values: Mapping[str, object]) -> str:
    """Return ``a=1, b.c=2``: tables are flattened."""
    parts = []
    for key, value in values.items():
        if isinstance(value, Mapping):
            parts += [f"{key}.{part}" for part in _pairs(value).split(", ")]
        else:
            text = value if isinstance(value, str) else msgspec.json.encode(value).decode()
            parts.append(f"{key}={text}")
    return ", ".join(parts)
