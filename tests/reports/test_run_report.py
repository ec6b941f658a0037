"""Reports of runs in a real browser."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import frictionsim as fs
from tests.support.belt_results import TWO, belt_run
from tests.support.browser import opened, wait_until, without_scripts
from tests.support.scenarios import SCENARIOS

WIDE = {"width": 1400, "height": 1000}
LINES = """async (name) => {
  const chart = frictionsim.charts.charts.find((one) => one.chart.name === name);
  chart.details.open = true;
  chart.draw();
  await chart.chartOf.work;
  const numbers = (values) => [...values].map((value) => (value === value ? value : null));
  return chart.plot.data.map((trace) => [numbers(trace.x), numbers(trace.y)]);
}"""
CURSORS = """frictionsim.charts.charts.filter((chart) => chart.details.open)
  .map((chart) => chart.cursor.getBoundingClientRect().x)"""
RANGES = """frictionsim.charts.charts.filter((chart) => chart.details.open)
  .map((chart) => chart.plot.layout.xaxis.range)"""
# What was asked for is done, and drawn.
SETTLED = """async () => {
  for (let again = 0; again < 2; again++) {
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    await Promise.all(frictionsim.charts.charts.map((chart) => chart.chartOf.work));
  }
}"""
# Where the first curve of each chart is drawn, against where its axes say: the largest difference.
MISPLACED = """() => frictionsim.charts.charts.filter((chart) => chart.details.open).map(({ plot }) => {
  const { xaxis, yaxis } = plot._fullLayout;
  const along = (axis, value) => axis._length * (value - axis.range[0]) / (axis.range[1] - axis.range[0]);
  const path = plot.querySelector(".js-line").getAttribute("d").match(/-?[0-9.]+/g).map(Number);
  const { x, y } = plot.data[0];
  let worst = 0;
  for (let k = 0; k < path.length; k += 2) {
    let nearest = Infinity;
    for (let i = 0; i < x.length; i++) {
      const away = Math.hypot(along(xaxis, x[i]) - path[k], yaxis._length - along(yaxis, y[i]) - path[k + 1]);
      if (away < nearest) nearest = away;
    }
    worst = Math.max(worst, nearest);
  }
  return worst;
})"""  # noqa: E501


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the result of the pulley that is raised and comes to rest, and its report."""
    folder = tmp_path_factory.mktemp("reports")
    changes = {"solver.rtol": 1e-6}
    result = fs.solve(SCENARIOS / "pulley_return.toml", changes, output=folder / "pulley.h5")
    fs.report(result, folder / "pulley.html")
    return folder


@pytest.fixture(scope="module")
def opened_once(browser: Any, files: Path) -> Iterator[Any]:
    with opened(browser, files / "pulley.html", viewport=WIDE) as report:
        yield report


@pytest.fixture
def page(opened_once: Any) -> Any:
    """The report of the pulley as it is opened: the clock stands at the start."""
    opened_once.evaluate(
        """() => {
          const { clock, charts } = frictionsim;
          clock.pause();
          clock.setSpeed(1);
          clock.set(clock.start);
          charts.zoom([clock.start, clock.end]);
          document.activeElement.blur();
          charts.charts.forEach(({ chart, details }) => { details.open = chart.first; });
        }"""
    )
    opened_once.evaluate(SETTLED)
    return opened_once


@pytest.fixture
def clock(page: Any) -> Callable[[], float]:
    """Return the time of the clock, after all have followed it."""

    def time() -> float:
        page.evaluate(SETTLED)
        return float(page.evaluate("frictionsim.clock.time"))

    return time


def test_charts_hold_the_numbers_of_the_file(page: Any, files: Path) -> None:
    assert page.title() == "Pulley on a dry shaft, up and back to rest"
    with h5py.File(files / "pulley.h5") as file:
        events = file["events/time"][:]
        for name in ("drive_force", "friction_torque", "angle"):
            ((time, values),) = page.evaluate(LINES, name)
            shown = [pair for pair in zip(time, values, strict=True) if pair[0] not in events]
            stored = zip(file["time"][:].tolist(), file[name][:].tolist(), strict=True)
            assert shown == [pair for pair in stored if pair[0] not in events]
        energies = page.evaluate(LINES, "energy")
        assert energies[0][1] == file["energy_input"][:].tolist()
        ((time, values),) = page.evaluate(LINES, "friction_torque")
        for number, at in enumerate(events):  # both sides of a jump
            place = time.index(at)
            sides = (file[f"events/friction_torque_{side}"] for side in ("before", "after"))
            before, after = (side[number] for side in sides)
            assert values[place : place + 3] == [before, None, after]


def test_zooming_one_chart_zooms_all_and_curves_stay_where_the_axes_say(page: Any) -> None:
    def zoomed(to: list[float]) -> None:
        page.evaluate(SETTLED)
        ranges, misplaced = page.evaluate(f"[{RANGES}, ({MISPLACED})()]")
        assert ranges == [to] * 4
        assert max(misplaced) < 0.1  # pixels; a path has two decimals

    whole = page.get_by_role("button", name="Show the whole run")
    nearer = page.get_by_role("button", name="Zoom in about the time of the clock")
    zoomed([0, 12])
    page.evaluate("Plotly.relayout(frictionsim.charts.charts[0].plot, {'xaxis.range': [1, 2]})")
    zoomed([1, 2])
    for time, clicks, range_ in ((6, 1, [3, 9]), (0, 2, [0, 3]), (12, 2, [9, 12])):
        whole.click()
        page.evaluate("(time) => frictionsim.clock.set(time)", time)
        for _ in range(clicks):
            nearer.click()
        zoomed(range_)
    whole.click()
    zoomed([0, 12])


@pytest.mark.slow
def test_on_a_touch_screen_buttons_are_over_a_chart_only_under_a_pointer_and_events_fit(
    browser: Any, files: Path
) -> None:
    # Plotly hides them only where a pointer can hover, which a touch screen has not.
    touched = {"viewport": {"width": 1100, "height": 900}, "has_touch": True, "is_mobile": True}
    with opened(browser, files / "pulley.html", **touched) as page:
        page.evaluate(SETTLED)
        buttons = page.locator(".plot .modebar").first
        assert buttons.evaluate("(bar) => getComputedStyle(bar).opacity") == "0"
        page.locator(".plot").first.hover()
        wait_until(
            page, "getComputedStyle(document.querySelector('.plot .modebar')).opacity === '1'"
        )
        region = page.locator("#events .scrolled")
        assert region.locator("thead th").last.text_content() == "angle, rad"
        wide, needed = region.evaluate("(div) => [div.clientWidth, div.scrollWidth]")
        assert needed <= wide
        titles = "(buttons) => buttons.map((button) => button.dataset.title)"
        assert page.locator(".plot").first.locator(".modebar-btn").evaluate_all(titles) == [
            *("Zoom", "Pan", "Zoom in", "Zoom out", "Reset axes", "Download plot as a PNG")
        ]


def test_dragging_on_a_chart_zooms_all_and_a_double_click_resets(page: Any) -> None:
    box = page.locator(".plot .nsewdrag").first.bounding_box()
    middle = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] / 4, middle)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 2, middle, steps=4)
    page.mouse.up()
    page.evaluate(SETTLED)
    ranges = np.array(page.evaluate(RANGES))
    np.testing.assert_allclose(ranges, [[3.0, 6.0]] * 4, atol=0.1)
    page.mouse.dblclick(box["x"] + box["width"] / 3, middle)
    wait_until(page, "frictionsim.charts.range[1] === 12")
    page.evaluate(SETTLED)
    assert page.evaluate(RANGES) == [[0, 12]] * 4


def test_the_slider_moves_cursors_and_values(page: Any, clock: Any) -> None:
    before = page.evaluate(CURSORS)
    page.evaluate(
        "(slider => { slider.value = 3; slider.dispatchEvent(new Event('input')); })"
        "(document.getElementById('time'))"
    )
    assert clock() == 3.0
    width = page.evaluate("frictionsim.charts.charts[0].plot._fullLayout.xaxis._length")
    moved = np.array(page.evaluate(CURSORS)) - before
    np.testing.assert_allclose(moved, np.full(4, width / 4), atol=0.1)
    assert page.get_attribute("#time", "aria-valuetext") == "3.00 s"
    assert page.text_content("#clock output") == "3.00 s of 12 s"
    assert page.text_content(".chart[data-name=drive_force] .key output") == "3113.75 N"


def test_a_click_sets_the_clock_to_a_sample_and_an_event_is_marked(
    page: Any, clock: Any, files: Path
) -> None:
    with h5py.File(files / "pulley.h5") as file:
        times, events = file["time"][:], file["events/time"][:]
    box = page.locator(".plot .nsewdrag").first.bounding_box()
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    assert clock() == pytest.approx(6.0, abs=0.02)
    assert clock() in times
    page.locator("#events button").nth(1).click()
    assert clock() == events[1]
    assert page.locator("#events tr[aria-current]").count() == 1
    assert "comes to rest" in page.text_content("#events tr[aria-current]")


def test_keys_move_the_clock(page: Any, clock: Any, files: Path) -> None:
    with h5py.File(files / "pulley.h5") as file:
        time, events = file["time"][:], file["events/time"][:]
    steps = [
        ("ArrowRight", time[1]),
        ("ArrowRight", time[2]),
        ("ArrowLeft", time[1]),
        ("Shift+ArrowRight", events[0]),
        ("Shift+ArrowRight", events[1]),
        ("Shift+ArrowLeft", events[0]),
        ("End", 12.0),
        ("Home", 0.0),
    ]
    for key, expected in steps:
        page.keyboard.press(key)
        assert clock() == expected, key
    between = 0.5 * (time[1] + time[2])
    page.evaluate(f"frictionsim.clock.set({between})")
    page.keyboard.press("ArrowLeft")
    assert clock() == time[1]
    assert page.evaluate("frictionsim.clock.speed") == 1.0
    page.keyboard.press("+")
    assert page.input_value("#speed") == "2"
    page.keyboard.press("-")
    page.keyboard.press("-")
    assert page.input_value("#speed") == "0.5"
    page.keyboard.press("?")
    assert page.locator("#keys").is_visible()
    page.keyboard.press("Escape")
    assert not page.locator("#keys").is_visible()


def test_the_space_plays_and_pauses_and_nothing_plays_by_itself(page: Any, clock: Any) -> None:
    assert clock() == 0.0
    page.keyboard.press("Space")
    wait_until(page, "frictionsim.clock.time > 0.1")
    assert page.get_by_role("button", name="Pause").count() == 1
    page.keyboard.press("Space")
    stopped = clock()
    page.wait_for_timeout(100)
    assert clock() == stopped
    assert page.get_by_role("button", name="Play").count() == 1
    # It stops at the end, and begins again.
    page.evaluate("frictionsim.clock.set(11.99); frictionsim.clock.play()")
    wait_until(page, "!frictionsim.clock.playing")
    assert clock() == 12.0
    page.keyboard.press("Space")
    wait_until(page, "frictionsim.clock.playing && frictionsim.clock.time < 6")


def test_lines_can_be_hidden_and_more_charts_opened(page: Any) -> None:
    assert page.locator(".chart[open]").count() == 4
    page.locator(".chart[data-name=energy] summary").click()
    page.wait_for_selector(".chart[data-name=energy] .main-svg")
    first = page.locator(".chart[data-name=energy] .key button").first
    first.click()
    page.evaluate(SETTLED)
    energy = "frictionsim.charts.charts.find((one) => one.chart.name === 'energy')"
    shown = f"{energy}.plot.data.map((trace) => trace.visible)"
    assert page.evaluate(shown) == [False, True, True, True, True]
    assert first.get_attribute("aria-pressed") == "false"


@pytest.mark.slow
def test_a_comparison_overlays_its_results_and_follows_system_and_button(
    browser: Any, files: Path
) -> None:
    look = (
        "[getComputedStyle(document.body).backgroundColor,"
        " frictionsim.charts.charts[0].plot.layout.font.color]"
    )
    light, dark = ["rgb(255, 255, 255)", "#333333"], ["rgb(22, 24, 27)", "#d8d8d8"]
    fs.solve(SCENARIOS / "pulley.toml", {"solver.rtol": 1e-6}, output=files / "heavy.h5")
    two = fs.report([files / "pulley.h5", files / "heavy.h5"], files / "two.html")
    with opened(browser, two, color_scheme="dark", viewport=WIDE) as page:
        assert page.evaluate(look) == dark
        page.emulate_media(color_scheme="light")
        wait_until(page, f"{look}.join() === {','.join(light)!r}")
        for after in (dark, light):
            page.locator("#theme").click()
            page.evaluate(SETTLED)
            assert page.evaluate(look) == after
        lines = page.evaluate(LINES, "drive_force")
        assert [time[-1] for time, _ in lines] == [12.0, 3.0]
        key = page.locator(".chart[data-name=drive_force] .key .name").all_inner_texts()
        assert [name.strip() for name in key] == ["pulley", "heavy"]
        styles = "frictionsim.charts.charts[0].plot.data.map((t) => [t.line.color, t.line.dash])"
        (a, dash_a), (b, dash_b) = page.evaluate(styles)
        assert (a != b, dash_a != dash_b) == (True, True)
        assert page.evaluate("[frictionsim.clock.start, frictionsim.clock.end]") == [0, 12]
        assert page.locator("#drawings > figure").count() == 2
        page.evaluate("frictionsim.clock.set(6)")
        page.evaluate(SETTLED)
        values = page.locator(".chart[data-name=drive_force] .key output").all_inner_texts()
        assert values[1] == "\N{EN DASH}"


def test_without_scripts_the_tables_are_there(browser: Any, files: Path) -> None:
    with without_scripts(browser, files / "pulley.html") as page:
        for words in ("force_to_lift", "energy_balance", "comes to rest", "mu_s = 0.2"):
            assert page.get_by_text(words).first.is_visible(), words
        assert page.locator("noscript p").is_visible()


HARM = "</script><script>window.harm = 1</script>\"'<img src=x onerror=alert(1)> %{y} <b>$x$</b>"


def test_texts_of_files_stay_text(browser: Any, tmp_path: Path) -> None:
    pulleys = [pulley._replace(name=f"{HARM}{i}") for i, pulley in enumerate(TWO)]
    record = fs.Result(belt_run(pulleys, bodies=24, samples=21)).record
    changes = {"title": f"{HARM}\x1b[0m", "warnings": HARM, "source": HARM, "reason": HARM}
    record = record._replace(
        attributes=record.attributes | changes,
        long_names=dict.fromkeys(record.long_names, HARM),
        units=dict.fromkeys(record.units, HARM),
    )
    file = fs.report(fs.Result(record), tmp_path / "harm.html")
    with opened(browser, file, viewport=WIDE) as page:
        assert page.title() == f"{HARM}\\x1b[0m"
        assert page.text_content("h1") == f"{HARM}\\x1b[0m"
        assert page.text_content("#warnings li") == HARM
        box = page.locator(".plot .nsewdrag").first.bounding_box()
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        page.wait_for_selector(".plot .hoverlayer text")
        assert HARM in page.text_content(".plot .hoverlayer")
        title = page.text_content(".plot .ytitle")
        assert HARM.replace(" ", "") in title.replace(" ", "")  # in two lines
        names = page.locator(".chart .key .name").all_text_contents()
        assert f"{HARM}0" in names
        assert page.evaluate("window.harm") is None
        assert page.locator("img").count() == 0
