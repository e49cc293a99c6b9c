"""`make accuracy`, second part: errors and warnings on real recordings and missions, against what people confirmed.

`expectations.toml` lists every error and warning on the real recordings with the reason why it is true,
read from the bytes; a file that cannot be read is listed as `failed`. One that it does not list is new: look at the bytes, then list it or mend the rule.
It names a recording by its folder and the start of its SHA-256, since file names carry people's accounts.
"""

from __future__ import annotations

import hashlib
import sys
import tomllib
from collections import Counter
from pathlib import Path
from typing import NamedTuple

from benchmarks.corpus import Checked, check_all, check_arguments, is_absent

EXPECTATIONS = Path(__file__).parent / "expectations.toml"
FOLDERS = ("tlog", "raw", "pcap", "plan", "wpl")
DIGITS = 16


class Key(NamedTuple):
    """What tells findings on one recording apart."""

    file: str
    code: str
    subject: str


def confirmed() -> set[Key]:
    """Return the findings that people confirmed."""
    listed = tomllib.loads(EXPECTATIONS.read_text("utf-8"))["finding"]
    return {Key(entry["file"], entry["code"], entry["subject"]) for entry in listed}


def name_of(recording: Path) -> str:
    """Return the name that `expectations.toml` has for a recording: folder and start of its SHA-256."""
    with recording.open("rb") as stream:
        digest = hashlib.file_digest(stream, "sha256").hexdigest()
    return f"{recording.parent.name}/{digest[:DIGITS]}"


def loud(checked: Checked, file: str) -> set[Key]:
    """Return the errors and warnings on the recording `file`, and say when it could not be checked."""
    if checked.failure:
        print(f"failed        {checked.path}  {checked.failure}")
        reason = checked.failure.replace(f"{checked.path}, ", "")
        return {Key(file, "failed", reason)}
    return {
        Key(file, finding["code"], finding["subject"])
        for finding in checked.findings
        if finding["severity"] != "info"
    }


def main() -> int:
    """Judge every real recording; 1 when a finding is not confirmed, or a confirmed one is gone."""
    options = check_arguments(__doc__ or "").parse_args()
    root = options.corpus / "real"
    if is_absent(root):
        return 0
    paths = sorted(p for folder in FOLDERS for p in (root / folder).iterdir())
    found: set[Key] = set()
    path_of: dict[str, Path] = {}
    for checked in check_all(paths, options):
        file = name_of(checked.path)
        path_of[file] = checked.path
        found |= loud(checked, file)
    known = confirmed()
    for word, keys in (("unconfirmed", found - known), ("gone", known - found)):
        for key in sorted(keys):
            print(
                f"{word:14}{key.file}  {key.code} {key.subject}".rstrip(), path_of.get(key.file, "")
            )
    by_code = Counter(key.code for key in found & known)
    said = ", ".join(f"{code} on {count}" for code, count in sorted(by_code.items()))
    print(
        f"\n{len(paths)} real recordings: {len(found & known)} confirmed ({said}), "
        f"{len(found - known)} unconfirmed, {len(known - found)} gone"
    )
    return int(found != known)


if __name__ == "__main__":
    sys.exit(main())
