"""A headless browser for tests of reports, and what happens in its pages."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import Any

import pytest

# Names of the program on Debian and elsewhere.
PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
# Else it looks for updates, and root may not start it.
OPTIONS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
# Set where tests without a browser would be none, as in CI.
REQUIRED = "FRICTIONSIM_TESTS_NEED_BROWSER"


LOADED = 180e3  # ms, of a page of some MB on a machine whose cores are taken


@contextmanager
def browser() -> Iterator[Any]:
    """Return the context with a browser; tests are skipped where there is none."""
    program = next(filter(None, map(shutil.which, PROGRAMS)), None)
    if program is None:
        assert not os.environ.get(REQUIRED), "there is no chromium"
        pytest.skip("chromium is not installed")
    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=program, args=OPTIONS)
        try:
            yield chromium
        finally:
            chromium.close()


@contextmanager
def opened(browser: Any, file: Path, **options: Any) -> Iterator[Any]:
    """Open a report, and check that it logs no error and asks for no other file.

    Options are those of the page, as color_scheme="dark"; its scripts have started.
    """
    page = browser.new_page(**options)
    page.set_default_timeout(LOADED)
    messages: list[str] = []
    requests: list[str] = []
    page.on("console", lambda message: messages.append(f"{message.type}: {message.text}"))
    page.on("pageerror", lambda error: messages.append(str(error)))
    page.on("request", lambda request: requests.append(request.url))
    try:
        page.goto(file.as_uri())
        wait_until(page, "frictionsim.ready")
        yield page
        assert messages == []
        assert [url for url in requests if not url.startswith(("data:", "blob:"))] == [
            file.as_uri()
        ]
    finally:
        page.close()


def check_sorting(page: Any, table: str, column: str, values: list[Any]) -> None:
    """Sort a table by a column with the keyboard, both ways, and check its values."""
    shown = f"""[...document.querySelectorAll("{table} tbody tr")].map((row) =>
        Number(row.cells[document.querySelector("[aria-sort]").cellIndex].dataset.value))"""
    heading = page.locator(f"{table} th", has_text=column).first
    heading.get_by_role("button").focus()
    page.keyboard.press("Enter")
    assert page.evaluate(shown) == sorted(values)
    assert heading.get_attribute("aria-sort") == "ascending"
    page.keyboard.press("Enter")
    assert page.evaluate(shown) == sorted(values)[::-1]


def wait_until(page: Any, expression: str, seconds: float = 120.0) -> None:
    """Wait until an expression is true in a page.

    Playwright's own `wait_for_function` evaluates text in the page, which a report forbids.
    """
    latest = monotonic() + seconds
    while not page.evaluate(expression):
        assert monotonic() < latest, f"not within {seconds:g} s: {expression}"
        page.wait_for_timeout(20)
