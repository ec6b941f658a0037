"""Reports of runs in a real browser, one of each kind: play, seek, event, zoom, print."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.support.browser import opened, wait_until
from tests.support.cases import slow
from tests.support.html_elements import panels_of
from tests.support.records import shown
from tests.support.scenarios import shipped

WIDE, NARROW = {"width": 1280, "height": 900}, {"width": 390, "height": 844}
KINDS = (
    "pulley_return",
    slow("lift"),
    "marble_machine",
    slow("epicyclic"),
    slow("shaft"),
    "belt_drive",
)
# Where the player has put the parts of the drawing, and what stands beside it.
STATE = """() => [...document.querySelectorAll("#m0 > *, #key output")].map((part) =>
  part.getAttribute("d") || part.getAttribute("transform") || part.textContent)"""
CURSORS = """() => [...document.querySelectorAll(".js-plotly-plot")]
  .filter((chart) => chart.offsetParent).map((chart) => chart.layout.shapes.at(-1).x0)"""
# How long the arrow of the weight is in each of two drawings, in units of its box.
ARROWS = """() => ["m0", "m1"].map((name) => {
  const box = document.querySelector(`#${name} path.arrow.fill-load`).getBBox();
  return Math.max(box.width, box.height); })"""
BUTTONS = """() => [...document.querySelectorAll(".modebar-btn")].map((one) =>
  one.getAttribute("data-title") ?? one.title ?? "")"""
BELOW_LEGEND = """() => { const [bar, legend] = [".modebar", ".legend"].map((one) =>
  document.querySelector(one).getBoundingClientRect()); return bar.top > legend.bottom; }"""
RANGES = "[...document.querySelectorAll('.js-plotly-plot')].map((one) => one.layout.xaxis.range)"
# Elements that scroll by themselves, or are wider than the page.
SCROLLED = """() => [...document.querySelectorAll("body *:not(svg, svg *)")].filter((one) =>
  one.scrollHeight > one.clientHeight + 2 && getComputedStyle(one).overflowY === "auto"
  && one.clientHeight > 0 || one.scrollWidth > document.documentElement.clientWidth + 1
  && !one.closest("pre")).map((one) => `${one.tagName} ${one.id}`)"""


@pytest.fixture(scope="module", params=KINDS)
def made(request: Any, tmp_path_factory: pytest.TempPathFactory) -> tuple[fs.Result, Path]:
    """A result and its report."""
    if request.param == "belt_drive":
        result = fs.Result(shown("belt_string", output__interval=0.005))
    else:
        result = fs.solve(shipped(request.param, solver__rtol=1e-6))
    path = tmp_path_factory.mktemp("reports") / "a.html"
    return result, fs.report(result, path)


@pytest.mark.dev
def test_a_report_plays_seeks_marks_events_zooms_fits_its_window_and_prints(
    browser: Any, made: tuple[fs.Result, Path]
) -> None:
    result, path = made
    record = result.record
    with opened(browser, path, viewport=WIDE) as page:
        start = page.evaluate(STATE)
        titles = page.evaluate(BUTTONS)
        assert any("Download" in title for title in titles)  # the bar of buttons is there
        assert not [t for t in titles if any(w in t.lower() for w in ("share", "cloud", "studio"))]
        numbers = page.locator("[class$='tick'] text").all_text_contents()
        assert numbers
        assert not any("," in number for number in numbers)  # as in tables
        assert page.locator(".modebar--hover").count() == page.locator(".modebar").count() > 0
        assert page.evaluate(BELOW_LEGEND)
        page.click("#play")
        wait_until(page, f"frictionsim.time > {float(record.channels['time'][2])!r}")
        page.keyboard.press("Space")  # the button has the focus: this is a click on it
        wait_until(page, "document.getElementById('play').textContent === 'play'")

        middle = float(record.channels["time"][len(record.channels["time"]) // 2])
        page.evaluate(
            "(t) => { const slider = document.getElementById('time'); slider.value = t;"
            " slider.dispatchEvent(new Event('input')); }",
            middle,
        )
        # A slider that is a decimal text may lose the last digit.
        assert page.evaluate("frictionsim.time") == pytest.approx(middle)
        assert page.evaluate(CURSORS) == [pytest.approx(middle)]
        assert page.evaluate(STATE) != start
        shown = dict(
            page.evaluate("""() => [...document.querySelectorAll("#key tr")].map((row) =>
          [row.cells[1].textContent, row.cells[2]?.textContent])""")
        )
        for words, channel in (("angle", "angle"), ("angular velocity", "angular_velocity")):
            if words in shown and channel in record.channels:
                value = float(shown[words].split()[0].replace("\N{MINUS SIGN}", "-"))
                wanted = np.interp(middle, record.channels["time"], record.channels[channel])
                size = float(np.abs(record.channels[channel]).max())
                assert value == pytest.approx(wanted, abs=1e-3 * size)

        page.keyboard.press("ArrowRight")
        after = page.evaluate("frictionsim.time")
        assert after > middle
        page.evaluate("frictionsim.show(frictionsim.time + 1e-6)")
        page.keyboard.press("ArrowLeft")  # from between two samples
        assert page.evaluate("frictionsim.time") == after
        if record.transitions:
            event = record.transitions[0]
            page.click(f"#events button[data-time='{event.time!r}']")
            assert page.evaluate("frictionsim.time") == event.time
            assert page.locator("#events tr[aria-current]").count() >= 1

        low, high = float(record.channels["time"][0]), float(record.channels["time"][-1])
        page.evaluate(
            "(to) => Plotly.relayout('charts', {'xaxis.range': to})", [low, 0.5 * (low + high)]
        )
        wait_until(page, f"{RANGES}.every((range) => range[1] < {0.6 * high})")
        if page.locator("#more").count():
            page.locator("summary", has_text="More channels").click()
            wait_until(page, "document.querySelectorAll('.js-plotly-plot').length === 2")

        page.emulate_media(color_scheme="dark")
        background = page.evaluate("getComputedStyle(document.body).backgroundColor")
        assert background == "rgb(22, 24, 27)"
        for size in (WIDE, NARROW):
            page.set_viewport_size(size)
            wait_until(page, f"document.documentElement.scrollWidth <= {size['width']}")
            assert page.evaluate(SCROLLED) == []

        page.emulate_media(media="print")
        assert page.pdf().startswith(b"%PDF")
        assert page.locator("#clock").is_hidden()


@pytest.mark.dev
def test_a_comparison_has_both_drawings_on_one_clock(browser: Any, tmp_path: Path) -> None:
    data = shipped("pulley", solver__rtol=1e-6)
    two = [fs.solve(data), fs.solve(data, {"mechanism.load": 2300.0})]
    report = fs.report(two, tmp_path / "two.html")
    lines = panels_of(report.read_text("utf-8"))["force on the cord, N"]
    assert len({line["line"]["color"] for line in lines}) == 2
    with opened(browser, report, viewport=WIDE) as page:
        assert page.locator("#drawings > figure").count() == 2
        page.evaluate("frictionsim.show(2.0)")
        heads = page.locator("#key thead th").all_inner_texts()
        assert heads == ["load = 2224.1 N", "load = 2300 N"]
        # On one scale: the same box, and travels that are drawn as much smaller.
        boxes = page.locator("#drawings svg.drawing[role]").evaluate_all(
            "(all) => all.map((one) => one.getAttribute('viewBox'))"
        )
        assert boxes[0] == boxes[1]
        size = page.evaluate(ARROWS)
        assert size[0] * 2300.0 == pytest.approx(size[1] * 2224.1, rel=0.02)


HARM = "</script><script>window.harm = 1</script>\"'<img src=x onerror=alert(1)> %{y} <b>$x$</b>"


@pytest.mark.dev
def test_texts_of_files_stay_text(browser: Any, tmp_path: Path) -> None:
    record = shown("belt_string", output__interval=0.015)
    changes = {"title": f"{HARM}\x1b[0m", "warnings": HARM, "source": HARM, "reason": HARM}
    record = record._replace(
        attributes=record.attributes | changes,
        members=record.members | {"pulley": (f"{HARM}0", f"{HARM}1")},
        long_names=dict.fromkeys(record.long_names, HARM),
        units=dict.fromkeys(record.units, HARM),
    )
    file = fs.report(fs.Result(record), tmp_path / "harm.html")
    with opened(browser, file, viewport=WIDE) as page:
        assert page.title() == f"{HARM}\\x1b[0m"
        assert page.text_content("h1") == f"{HARM}\\x1b[0m"
        assert page.text_content("#warnings li") == HARM
        assert "<b>" in page.text_content(".js-plotly-plot .annotation-text >> nth=0")
        assert any("<img" in text for text in page.locator(".legendtext").all_text_contents())
        assert page.evaluate("window.harm") is None
        assert page.locator("img").count() == 0
