"""The JSON Schema of the report, made from the structs and the docstrings of their fields.

``python -m mavframecheck.report.schema`` writes `docs/report.schema.json` again.
"""

from __future__ import annotations

import ast
import inspect
from itertools import pairwise
from pathlib import Path
from typing import Any, get_type_hints

import msgspec

from mavframecheck.model import (
    ByteLocation,
    FileReport,
    Finding,
    MissionLocation,
    Report,
    Suppressed,
    finding,
)
from mavframecheck.report.json import document

PATH = Path(__file__).parents[2] / "docs" / "report.schema.json"
"""Where the schema is kept in a checkout."""
_REF = "#/$defs/{name}"


def schema() -> dict[str, Any]:
    """Return the schema of the document that ``--format json`` writes."""
    opened = _with(Finding, location=None)
    parts = (FileReport, opened, _with(Suppressed, finding=opened), ByteLocation, MissionLocation)
    _, defs = msgspec.json.schema_components(parts, ref_template=_REF)
    defs["Finding"]["properties"]["location"] = {
        "anyOf": [_ref("ByteLocation"), _ref("MissionLocation"), {"type": "null"}]
    }
    defs["Finding"]["description"] = inspect.getdoc(Finding)
    defs["Suppressed"]["description"] = inspect.getdoc(Suppressed)
    defs["Report"] = {
        "type": "object",
        "description": inspect.getdoc(Report),
        "properties": {
            "version": {"type": "string"},
            "files": {"type": "array", "items": _ref("FileReport")},
            "findings": {"type": "array", "items": _ref("Finding")},
            "suppressed": {"type": "array", "items": _ref("Suppressed")},
        },
    }
    _describe(defs)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "mavframecheck report",
        **_ref("Report"),
        "$defs": dict(sorted(defs.items())),
    }


def _with(struct: type[msgspec.Struct], **types: Any) -> type[msgspec.Struct]:
    """Return a struct like `struct` but for the `types` of some fields.

    The location of a finding is left open: msgspec describes no union of untagged structs.
    """
    known = get_type_hints(struct) | types
    fields = [(name, known[name]) for name in struct.__struct_fields__]
    return msgspec.defstruct(struct.__name__, fields, kw_only=True)


def _ref(name: str) -> dict[str, Any]:
    return {"$ref": _REF.format(name=name)}


def _describe(defs: dict[str, Any]) -> None:
    """Give every property its docstring, and require all: a report always writes every key."""
    docs = _field_docs()
    for name, part in defs.items():
        properties = part.get("properties", {})
        for key, value in properties.items():
            value.pop("default", None)
            owners = [base.__name__ for base in getattr(finding, name).__mro__]
            value["description"] = next(docs[o, key] for o in owners if (o, key) in docs)
        if properties:
            part["required"] = list(properties)


def _field_docs() -> dict[tuple[str, str], str]:
    """Return (struct, field) to the string that follows the field in the source of the model."""
    docs = {}
    for node in ast.parse(inspect.getsource(finding)).body:
        if not isinstance(node, ast.ClassDef):
            continue
        for field, text in pairwise(node.body):
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name):
                docs[node.name, field.target.id] = _string(text)
    return docs


def _string(node: ast.stmt) -> str:
    """Return the text of a statement that is a plain string, else nothing."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return str(node.value.value).replace("``", "`").replace("None", "null")
    return ""


if __name__ == "__main__":
    PATH.write_bytes(document(schema()))
