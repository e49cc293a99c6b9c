"""What pages are made of: short curves, true maps, bounded size, nothing unescaped."""

from __future__ import annotations

import json
import re
from collections import Counter

import numpy as np
import pytest
from markupsafe import Markup

from mavframecheck.model import Severity
from mavframecheck.model.survey import FileSurvey
from mavframecheck.model.trace import Band, Detail, Figure, Flight, Proof, Trace, key_of
from mavframecheck.report import Checked, Context
from mavframecheck.report.html import page as pages
from mavframecheck.report.html import render
from mavframecheck.report.html.curves import thin, torn
from mavframecheck.report.html.frame import inline
from mavframecheck.report.html.plan import Mark, Path, distance, plan, round_length
from tests.report import made_up

CONTEXT = Context(version="1")


def test_thin_keeps_extremes() -> None:
    """A spike stays whatever is left out."""
    t, y = np.arange(10_000.0), np.zeros(10_000)
    y[[1234, 8765]] = 5.0, -7.0
    short_t, short_y = thin(t, y, 200)
    assert len(short_t) <= 200
    assert set(short_t[short_y != 0].tolist()) == {1234.0, 8765.0}


def test_lines_are_torn_in_long_gaps_only() -> None:
    t = np.array([0.0, 1, 2, 3, 60, 61, 62])
    at, values = torn(t, np.ones(7))
    assert at[np.isnan(values)].tolist() == [31.5]
    assert not np.isnan(torn(np.arange(0.0, 28, 4), np.ones(7))[1]).any()


SQUARE = Path("track", "vehicle", np.array([0.0, 100, 100]), np.array([0.0, 0, 50]))


def test_the_bar_of_a_map_is_as_long_as_it_says() -> None:
    """In the units of the drawing, by the scale that the drawing states."""
    svg = str(plan([SQUARE], [], 800, 400, "map"))
    ((scale,),) = (re.findall(r'data-per-m="([^"]+)"', svg),)
    ((bar, said),) = re.findall(r"v8h([\d.]+)v-8.*?>(\d+) m<", svg)
    per_m = float(scale)
    assert float(bar) / per_m == pytest.approx(float(said), rel=1e-3)
    x = [float(each) for each in re.findall(r"[ML]([\d.]+) ", svg.split('class="path vehicle"')[1])]
    assert (x[1] - x[0]) / per_m == pytest.approx(100, rel=1e-2)


def test_what_is_far_is_an_arrow_with_its_distance_and_bearing() -> None:
    """It must not shrink the flight to a dot."""
    far = Path("sent", "sent", np.array([50.0, 3e6]), np.array([25.0, 4e6]), must=False, dots=True)
    svg = str(plan([SQUARE, far], [Mark("home", "<home>", 0, 0)], 800, 400, "map"))
    assert "sent: 5000 km away, 37" in svg
    assert svg.count("h0") == 1
    assert "&lt;home&gt;" in svg


@pytest.mark.parametrize(("most", "length"), [(1.0, 1), (4.9, 2), (5.0, 5), (99, 50), (0.3, 0.2)])
def test_round_lengths(most: float, length: float) -> None:
    assert round_length(most) == pytest.approx(length)


def test_distances() -> None:
    assert [distance(each) for each in (50.0, 12.34567, 2500.0, 5_316_600.0)] == [
        *("50 m", "12 m", "2.5 km", "5317 km")
    ]


def test_data_cannot_end_its_element() -> None:
    """And reads as what it was."""
    data = {"label": "</script><!-- \u2028 & <script>"}
    text = inline(data)
    assert not set("<>&\u2028") & set(text)
    assert json.loads(text) == data


def long_trace(k: int) -> Trace:
    """Return a trace of 2 000 points with long numbers."""
    t = np.arange(2000) * 1.7 + 1_772_445_600
    y = np.random.default_rng(k).normal(size=2000)
    return Trace(label=f"trace {k}", t=tuple(t.tolist()), y=tuple(y.tolist()))


def detail(
    checked: Checked, heights: tuple[Trace, ...] = (), bands: tuple[Band, ...] = ()
) -> Detail:
    """Return a flight with some heights and bands, and long proofs of every finding."""
    summary = {name: getattr(checked.file, name) for name in FileSurvey.__struct_fields__[:9]}
    survey = FileSurvey(**summary, senders=(), references=(), heights=())
    figures = tuple(
        Figure(title=f"{k}", kind="time", unit="m", traces=(long_trace(k), long_trace(k + 100)))
        for k in range(4)
    )
    flight = Flight(timed=True, bands=bands, heights=heights, boots=(), tracks=(), points=())
    proofs = {key_of(finding): Proof(figures=figures) for finding in checked.findings}
    return Detail(flight=flight, proofs=proofs, survey=survey)


def test_a_page_is_bounded() -> None:
    """Forty findings with long proofs, and thirty heights."""
    findings = tuple(made_up.finding(count=k + 1) for k in range(40))
    checked = Checked(made_up.file(), findings)
    drawn = detail(checked, heights=tuple(long_trace(k) for k in range(30)))
    text = pages.page_of(checked._replace(detail=drawn), CONTEXT)
    assert len(text.encode()) <= pages.MAX_BYTES
    assert text.count('<details class="card') == 40


def test_what_comes_from_a_log_is_escaped_and_visible() -> None:
    """Markup, templates, and characters that turn or hide text."""
    hostile = "<img src=x>{{7*7}}\u202e\x1b[31m"
    band = Band(system=1, kind="mode", label=hostile, start=0.0, end=9.0)
    checked = Checked(made_up.file(path=hostile), (made_up.finding(text=hostile, fix=hostile),))
    text = pages.page_of(checked._replace(detail=detail(checked, bands=(band,))), CONTEXT)
    assert "<img" not in text
    assert "&lt;img src=x&gt;{{7*7}}\\u202e\\x1b[31m" in text
    assert not set("\u202e\x1b") & set(text)


def test_the_policy_allows_what_is_in_the_page_alone() -> None:
    text = pages.page_of(made_up.clean(), CONTEXT)
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', text)
    assert policy
    assert policy[1].startswith("default-src &#39;none&#39;; script-src &#39;sha256-")
    assert "unsafe" not in policy[1]
    assert not re.search(r"\s(on\w+|style)=", text.split("<body>")[1].split("<script")[0])
    assert not re.search(r"(src|href)=\"(https?:)?//", text)


def test_formats_of_one_and_of_several() -> None:
    """`--format html` writes a page; of several, an index without links."""
    (only,) = render([made_up.clean()], CONTEXT)
    (several,) = render([made_up.clean(), Checked(made_up.file(), (made_up.finding(),))], CONTEXT)
    assert 'id="runs"' in only
    assert 'id="recordings"' in several
    assert '<a href="0' not in several


def test_the_verdict_is_a_sentence() -> None:
    """For errors, warnings, information, nothing, and a file that holds no frame."""
    finding = made_up.finding
    said = [
        pages.verdict(made_up.file(), Counter(each.severity for each in found))
        for found in ([finding()], [finding(severity=Severity.WARNING)], [])
    ]
    assert said[0].startswith(
        "Numbers in this recording do not mean what somebody thinks: 1 error;"
    )
    assert said[1].startswith("This recording is worth a second look: 1 warning;")
    assert said[2].startswith("Nothing wrong was found; ")
    empty = made_up.file(messages=0)
    assert pages.verdict(empty, Counter()) == "Nothing in this file could be decoded."
    assert isinstance(plan([SQUARE], [], 10, 10, "x"), Markup)
