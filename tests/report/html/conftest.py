"""A browser for pages, and a command that writes them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner
from playwright.sync_api import Browser, Page, Request

from mavframecheck.cli import main
from tools.browser import MISSING, browser, chromium


@pytest.fixture(scope="session")
def opened() -> Iterator[Browser]:
    """Return the browser of the system."""
    path = chromium()
    if path is None:
        pytest.skip(MISSING)
    with browser(path) as found:
        yield found


@pytest.fixture
def look(opened: Browser) -> Iterator[Callable[[Path], Page]]:
    """Return what opens a page; whatever the console or the network sees makes the test fail."""
    context = opened.new_context(viewport={"width": 1280, "height": 900})
    trouble: list[str] = []

    def asked(request: Request) -> None:
        if not request.url.startswith(("file:", "data:")):
            trouble.append(request.url)

    def open_page(path: Path) -> Page:
        page = context.new_page()
        page.on("console", lambda message: trouble.append(message.text))
        page.on("pageerror", lambda error: trouble.append(str(error)))
        page.on("request", asked)
        page.goto(path.as_uri())
        page.wait_for_selector("html[data-ready=yes]")
        return page

    yield open_page
    context.close()
    assert trouble == []


@pytest.fixture(scope="session")
def written(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., tuple[Path, str]]:
    """Return what judges recordings once; it returns the page and the JSON report of the same run."""
    done: dict[tuple[str, ...], tuple[Path, str]] = {}

    def write(*arguments: str) -> tuple[Path, str]:
        if arguments not in done:
            path = tmp_path_factory.mktemp("page") / "report.html"
            command = ["check", *arguments, "--format", "json", "--output", f"html={path}"]
            result = CliRunner().invoke(main, command)
            assert result.exit_code in (0, 1), result.output
            done[arguments] = path, result.stdout
        return done[arguments]

    return write
