"""Pages in a browser: nothing breaks, nothing is fetched, and everything on them can be used."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from samples.make import HERE
from tests.strategies import START_US, frame

Look = Callable[[Path], Page]
Written = Callable[..., tuple[Path, str]]

ROOT = Path(__file__).parents[3]
CORPUS = ROOT / "../shared/corpus/sitl"
FLOWN = ("fault_copter_vision_enu", "fault_copter_vision_stamp_ms", "clean_copter_auto_rtl")
SAMPLE = str(HERE / "degrees_in_scaled_field.tlog")
HOSTILE = "</script><script>window.hurt=1</script><img src=x onerror=window.hurt=2>{{7*7}}\u202e"


@pytest.mark.parametrize(
    "sample",
    ["degrees_in_scaled_field.tlog", "clean_link.raw", "damaged_link.tlog"],
)
def test_numbers_are_those_of_the_json_report(sample: str, look: Look, written: Written) -> None:
    """Whatever is counted on the page is counted alike in the JSON report of the same run."""
    path, text = written(str(HERE / sample))
    compare(look(path), json.loads(text))


@pytest.mark.parametrize("name", FLOWN)
def test_flown_recordings(name: str, look: Look, written: Written) -> None:
    """Recordings of real autopilots open without a sound, and their numbers agree."""
    if not CORPUS.exists():
        pytest.skip("no recordings here (../shared/corpus)")
    path, text = written(str(CORPUS / f"{name}.tlog"))
    page = look(path)
    compare(page, json.loads(text))
    page.click("[data-cards=open]")
    for chart in page.locator("details.card .chart").all():
        expect(chart.locator("canvas")).to_have_count(1)  # drawn a moment after its card opens
    assert path.stat().st_size < 2_000_000


def compare(page: Page, report: dict[str, list[dict[str, object]]]) -> None:
    """Compare counts, findings, verdicts and what was read."""
    (file,) = report["files"]
    severities = Counter(str(finding["severity"]) for finding in report["findings"])
    for severity in ("error", "warning", "info"):
        shown = page.locator(f"[data-count={severity}]").inner_text()
        assert int(shown) == severities[severity]
    assert page.locator("[data-key=messages]").inner_text() == str(file["messages"])
    for key in ("bad_crc", "unknown", "skipped_bytes"):
        shown_key = page.locator(f"[data-key={key}]")
        assert (int(shown_key.inner_text()) if shown_key.count() else 0) == file[key]
    cards = {
        (c.get_attribute("data-fingerprint"), int(c.get_attribute("data-times") or 0))
        for c in page.locator("details.card").all()
    }
    assert cards == {(f["fingerprint"], f["count"]) for f in report["findings"]}
    for finding in report["findings"]:
        anchor = f"#finding-{report['findings'].index(finding) + 1}"
        said = page.locator(f"{anchor} .said").text_content() or ""
        assert said == finding["text"]
        location = finding["location"]
        assert isinstance(location, dict)
        assert f"byte {location['offset']}" in (page.locator(anchor).text_content() or "")
    runs = file["runs"]
    assert isinstance(runs, list)
    rows = page.locator("#runs tbody tr").evaluate_all(
        "rows => rows.map(r => [r.cells[0].textContent, r.dataset.status, Number(r.cells[3].textContent)])"
    )
    assert rows == [[run["code"], run["status"], run["checked"]] for run in runs]


def widths(page: Page) -> list[float]:
    """Return the widths of the bands of the first vehicle's modes, per cent."""
    widths: list[float] = page.locator(".band").evaluate_all(
        "bands => bands.map(b => b.hidden ? 0 : parseFloat(b.style.width))"
    )
    return widths


def becomes(page: Page, wanted: Callable[[list[float]], bool]) -> None:
    """Wait until the widths of the bands are as `wanted`: curves are drawn a moment after."""
    for _ in range(250):
        if wanted(widths(page)):
            return
        page.wait_for_timeout(20)
    raise AssertionError(widths(page))


def test_the_flight_zooms_and_moves(look: Look, written: Written) -> None:
    """By keys, buttons and dragging; all comes back with 0."""
    page = look(written(SAMPLE)[0])
    whole = widths(page)
    page.focus("#flight")
    page.keyboard.press("+")
    becomes(page, lambda now: max(now) > 1.2 * max(whole))
    page.keyboard.press("0")
    becomes(page, lambda now: now == pytest.approx(whole, abs=0.1))
    box = page.locator("#heights .u-over").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] * 0.5, box["y"] + 50)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.7, box["y"] + 50, steps=5)
    page.mouse.up()
    becomes(page, lambda now: max(now) > max(whole) and min(now) == 0)
    zoomed = widths(page)
    page.click("[data-move=left]")
    becomes(page, lambda now: now != zoomed)
    page.click("[data-move=all]")
    becomes(page, lambda now: now == pytest.approx(whole, abs=0.1))


def test_times_are_utc_since_start_or_since_boot(look: Look, written: Written) -> None:
    """The sample begins at 10:00:00 UTC, 20 s after its vehicle was started."""
    page = look(written(SAMPLE)[0])

    def first_band() -> str:
        return page.locator(".band").first.get_attribute("title") or ""

    assert "10:00:00" in first_band()
    page.click("[data-clock=start]")
    assert "0:00.0 to" in first_band()
    page.click("[data-clock=boot]")
    assert "0:20." in first_band()


def test_heights_are_brought_to_one_level(look: Look, written: Written) -> None:
    """12 m above home and origin is 500 m above the sea, 547.6 above the ellipsoid."""
    page = look(written(SAMPLE)[0])
    data = json.loads(page.locator("#data").text_content() or "")
    tops = {each["role"]: (max(each["y"]), max(each["sea"])) for each in data["heights"]}
    assert tops["home"] == (12.0, 500.0)
    assert tops["origin"] == (12.0, 500.0)
    said, sea = tops["ellipsoid"]
    assert (said, sea) == (pytest.approx(547.75, abs=0.01), pytest.approx(500.0, abs=1.5))
    page.click("[data-level=said]")
    assert page.locator("[data-level=said]").get_attribute("aria-pressed") == "true"


def test_cards_open_and_marks_lead_to_them(look: Look, written: Written) -> None:
    page = look(written(str(HERE / "scaled_degrees_in_float_field.tlog"))[0])
    cards = page.locator("details.card")
    assert cards.count() > 1
    opened = [card.get_attribute("open") is not None for card in cards.all()]
    assert opened == [True] + [False] * (len(opened) - 1)
    cards.nth(1).locator("summary").first.click()
    assert cards.nth(1).get_attribute("open") is not None
    page.click("[data-cards=close]")
    page.locator(".mark-at").first.click()
    target = page.evaluate("location.hash")
    page.wait_for_function(f"document.querySelector('{target}').open")
    assert page.locator(f"{target} pre").first.text_content()


def test_search_and_status_filter(look: Look, written: Written) -> None:
    page = look(written(SAMPLE)[0])
    every = page.locator("#fields tbody tr:visible").count()
    page.fill("[data-filter=fields]", "gps_raw ellipsoid")
    texts = page.locator("#fields tbody tr:visible").all_text_contents()
    assert 0 < len(texts) < every
    assert all("GPS_RAW_INT" in text and "ellipsoid" in text for text in texts)
    assert page.locator("[data-shown=fields]").inner_text() == f"{len(texts)} of {every}"
    page.click("button[data-status=not-applicable]")
    rows = page.locator("#runs tbody tr:visible")
    assert {row.get_attribute("data-status") for row in rows.all()} == {"not-applicable"}


def test_the_map_zooms_and_its_bar_stays_true(look: Look, written: Written) -> None:
    """The length of the bar on the screen is the length that it says, at any zoom."""
    page = look(written(SAMPLE)[0])

    def bar() -> tuple[float, float]:
        """Return metres as the bar says, and pixels per metre times its metres."""
        said = page.locator("#map .scale text").text_content() or ""
        drawn: list[float] = page.evaluate(
            "(() => { const s = document.querySelector('#map svg'); const p = s.querySelector('.scale path');"
            "return [p.getBoundingClientRect().width, s.getScreenCTM().a * Number(s.dataset.perM)]; })()"
        )
        return float(said.removesuffix(" m")), drawn[0] / drawn[1]

    for button in ("in", "in", "out", "all"):
        page.click(f"[data-map={button}]")
        said, drawn = bar()
        assert drawn == pytest.approx(said, rel=0.02)


def test_hostile_texts_inject_nothing(look: Look, written: Written, tmp_path: Path) -> None:
    """In a file name, in a text of the recording, in what a rule says of it."""
    rules = tmp_path / "rules"
    rules.mkdir()
    (rules / "FLY001-texts.toml").write_text(RULE, "utf-8")
    records = b""
    for k in range(8):
        said = {"severity": 2, "text": HOSTILE[k * 20 : k * 20 + 48].encode()[:50]}
        beat = frame("HEARTBEAT", {"type": 2, "autopilot": 3}, seq=2 * k)
        for one in (beat, frame("STATUSTEXT", said, seq=2 * k + 1)):
            records += (START_US + k * 10**6).to_bytes(8, "big") + one
    recording = tmp_path / "a\"><img src=x onerror='window.hurt=3'>.tlog"
    recording.write_bytes(records)
    page = look(written(str(recording), "--rules", str(rules))[0])
    page.click("[data-cards=open]")
    for bytes_shown in page.locator("details.bytes > summary").all():
        bytes_shown.click()
    assert page.evaluate("window.hurt") is None
    assert page.locator("img").count() == 0
    assert page.locator("script").count() == 2
    words = page.locator("#finding-1").text_content() or ""
    assert "<img src=x" in words
    assert "{{7*7}}" in words
    assert "\u202e" not in page.content()
    assert "\\u202e" in words
    assert "onerror='window.hurt=3'" in (page.locator("p.path").text_content() or "")


RULE = """
code = "FLY001"
name = "texts"
severity = "error"
confidence = "high"
status = "stable"
since = "0.1.0"
summary = "<b>Any text</b>."
[applies]
message = ["STATUSTEXT"]
[detect]
flag = "raw(severity) == 2"
[evidence]
observed = "</script><img src=x onerror=window.hurt=4>{{7*7}}"
[explain]
text = "It says {words(text)}."
why = "</style><script>window.hurt=5</script>"
fix = "Do not say <img src=x onerror=window.hurt=6> {{{{7*7}}}} \\u202e."
"""


def test_the_index_sorts_searches_and_links(look: Look, written: Written) -> None:
    path, text = written(SAMPLE, str(HERE / "clean_px4.tlog"), str(HERE / "damaged_link.tlog"))
    page = look(path)
    report = json.loads(text)
    errors = Counter(f["severity"] for f in report["findings"])["error"]
    assert int(page.locator("[data-count=error]").inner_text()) == errors
    rows = page.locator("#recordings tbody tr")
    assert rows.count() == 3
    page.click("#recordings th:nth-child(1) button")
    names = rows.locator("td:first-child").all_inner_texts()
    assert names == sorted(names)
    page.click("#recordings th:nth-child(1) button")
    assert rows.locator("td:first-child").all_inner_texts() == names[::-1]
    page.fill("[data-filter=recordings]", "px4")
    assert page.locator("#recordings tbody tr:visible").count() == 1
    page.locator("#recordings tbody tr:visible a").click()
    page.wait_for_selector("#runs")
    assert "clean_px4.tlog" in (page.locator("p.path").text_content() or "")


def test_a_page_is_printed_whole_and_in_the_dark(look: Look, written: Written) -> None:
    """Printing opens every card; dark colours keep text readable."""
    page = look(written(SAMPLE)[0])
    page.emulate_media(color_scheme="dark")
    ink, sheet = page.evaluate(
        "[getComputedStyle(document.body).color, getComputedStyle(document.body).backgroundColor]"
    )
    assert contrast(ink, sheet) > 7
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert all(d.get_attribute("open") is not None for d in page.locator("details").all())


def contrast(ink: str, sheet: str) -> float:
    """Return the contrast of two colours as WCAG defines it."""
    lights = []
    for colour in (ink, sheet):
        shares = [int(c) / 255 for c in colour[4:-1].split(",")]
        linear = [s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in shares]
        lights.append(0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2])
    return (max(lights) + 0.05) / (min(lights) + 0.05)
