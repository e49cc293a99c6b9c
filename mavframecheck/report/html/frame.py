"""Filling templates into one file: styles, scripts and data inline, and a policy that lets nothing else run."""

from __future__ import annotations

import base64
import functools
import hashlib
from importlib.resources import files
from typing import Any

import jinja2
import msgspec

from mavframecheck.report.escape import terminal


class Trusted(str):
    """Text that templates do not escape: our own, or made harmless."""

    __slots__ = ()

    def __html__(self) -> str:
        """Return the text as it is."""
        return self


_HERE = files("mavframecheck.report.html") / "data"


def fill(
    template: str,
    *,
    scripts: tuple[str, ...],
    styles: tuple[str, ...],
    data: dict[str, Any],
    **values: Any,
) -> str:
    """Return a template filled with `values`; `data` is for its scripts."""
    script, style = (_joined(names) for names in (scripts, styles))
    policy = (
        f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )
    trusted = {"script": Trusted(script), "style": Trusted(style), "data": inline(data)}
    return _templates().get_template(template).render(policy=policy, **trusted, **values)


def inline(data: dict[str, Any]) -> Trusted:
    """Return JSON that ends no script element, whatever texts are in it."""
    text = msgspec.json.encode(data).decode()
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return Trusted(text)


@functools.cache
def _templates() -> jinja2.Environment:
    """Return the templates: what they are filled with is escaped, for HTML and for the eye."""
    return jinja2.Environment(
        loader=jinja2.FunctionLoader(lambda name: (_HERE / name).read_text("utf-8")),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_visible,
    )


def _visible(value: Any) -> Any:
    """Return a text with every character that is no visible one as an escape; lines may end."""
    if hasattr(value, "__html__") or not isinstance(value, str):
        return value
    return "\n".join(terminal(line) for line in value.split("\n"))


@functools.cache
def _joined(names: tuple[str, ...]) -> str:
    return "\n".join((_HERE / name).read_text("utf-8") for name in names)


def _hash(text: str) -> str:
    """Return what a content security policy calls a script or style."""
    digest = hashlib.sha256(text.encode()).digest()
    return f"sha256-{base64.b64encode(digest).decode()}"
