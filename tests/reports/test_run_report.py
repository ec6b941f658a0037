"""Reports of runs in a real browser."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import frictionsim as fs
from frictionsim.reports.charts import MAX_SAMPLES
from tests.support.belt_results import TWO, belt_run
from tests.support.browser import opened, wait_until
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
    heavy = fs.solve(SCENARIOS / "pulley.toml", changes, output=folder / "heavy.h5")
    fs.report([result, heavy], folder / "two.html")
    return folder


@pytest.fixture(scope="module")
def opened_once(browser: Any, files: Path) -> Iterator[Any]:
    with opened(browser, files / "pulley.html", viewport=WIDE) as found:
        yield found


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
            # At events there may be both sides, of which the next test is.
            shown = [pair for pair in zip(time, values, strict=True) if pair[0] not in events]
            stored = zip(file["time"][:].tolist(), file[name][:].tolist(), strict=True)
            assert shown == [pair for pair in stored if pair[0] not in events]
        energies = page.evaluate(LINES, "energy")
        assert energies[0][1] == file["energy_input"][:].tolist()


def test_both_sides_of_a_jump_are_drawn(page: Any, files: Path) -> None:
    ((time, values),) = page.evaluate(LINES, "friction_torque")
    with h5py.File(files / "pulley.h5") as file:
        events = file["events"]
        for number, at in enumerate(events["time"]):
            place = time.index(at)
            sides = [events[f"friction_torque_{side}"][number] for side in ("before", "after")]
            assert values[place : place + 3] == [sides[0], None, sides[1]]


def test_zooming_one_chart_zooms_all(page: Any) -> None:
    page.evaluate("Plotly.relayout(frictionsim.charts.charts[0].plot, {'xaxis.range': [1, 2]})")
    page.evaluate(SETTLED)
    assert page.evaluate(RANGES) == [[1, 2]] * 4
    page.get_by_role("button", name="Show the whole run").click()
    page.evaluate(SETTLED)
    assert page.evaluate(RANGES) == [[0, 12]] * 4
    for time, range_ in ((6, [3, 9]), (0, [0, 3]), (12, [9, 12])):
        page.get_by_role("button", name="Show the whole run").click()
        page.evaluate("(time) => frictionsim.clock.set(time)", time)
        for _ in range_[:: 1 if time in (0, 12) else 2]:
            page.get_by_role("button", name="Zoom in about the time of the clock").click()
        page.evaluate(SETTLED)
        assert page.evaluate(RANGES) == [range_] * 4


def test_curves_are_where_the_axes_say(page: Any) -> None:
    assert max(page.evaluate(MISPLACED)) < 0.1  # pixels; a path has two decimals
    for button in ("Zoom in about the time of the clock", "Show the whole run"):
        page.evaluate("frictionsim.clock.set(3)")
        page.get_by_role("button", name=button).click()
        page.evaluate(SETTLED)
        assert max(page.evaluate(MISPLACED)) < 0.1


def test_the_buttons_of_a_chart_are_those_that_stay_in_the_page(page: Any) -> None:
    titles = (
        page.locator(".plot")
        .first.locator(".modebar-btn")
        .evaluate_all("(buttons) => buttons.map((button) => button.dataset.title)")
    )
    assert titles == ["Zoom", "Pan", "Zoom in", "Zoom out", "Reset axes", "Download plot as a PNG"]


def test_the_buttons_of_a_chart_are_over_it_only_under_a_pointer(browser: Any, files: Path) -> None:
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


def test_the_events_fit_beside_the_charts(browser: Any, files: Path) -> None:
    with opened(browser, files / "pulley.html", viewport={"width": 1100, "height": 900}) as page:
        region = page.locator("#events .scrolled")
        assert region.locator("thead th").last.text_content() == "angle, rad"
        wide, needed = region.evaluate("(div) => [div.clientWidth, div.scrollWidth]")
        assert needed <= wide


def test_dragging_on_a_chart_zooms_all_and_a_double_click_resets(page: Any) -> None:
    box = page.locator(".plot .nsewdrag").first.bounding_box()
    middle = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] / 4, middle)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 2, middle, steps=4)
    page.mouse.up()
    page.evaluate(SETTLED)
    found = np.array(page.evaluate(RANGES))
    np.testing.assert_allclose(found, [[3.0, 6.0]] * 4, atol=0.1)
    page.mouse.dblclick(box["x"] + box["width"] / 3, middle)
    wait_until(page, "frictionsim.charts.range[1] === 12")
    page.evaluate(SETTLED)
    assert page.evaluate(RANGES) == [[0, 12]] * 4


def test_the_slider_moves_cursors_values_and_drawing(page: Any, clock: Any) -> None:
    before = page.evaluate(CURSORS)
    drawn = page.evaluate("document.querySelector('canvas').toDataURL()")
    page.evaluate(
        "(slider => { slider.value = 3; slider.dispatchEvent(new Event('input')); })"
        "(document.getElementById('time'))"
    )
    assert clock() == 3.0
    width = page.evaluate("frictionsim.charts.charts[0].plot._fullLayout.xaxis._length")
    moved = np.array(page.evaluate(CURSORS)) - before
    np.testing.assert_allclose(moved, np.full(4, width / 4), atol=0.1)
    assert page.evaluate("document.querySelector('canvas').toDataURL()") != drawn
    assert page.get_attribute("#time", "aria-valuetext") == "3.00 s"
    assert page.text_content("#clock output") == "3.00 s of 12 s"
    assert page.text_content(".chart[data-name=drive_force] .key output") == "3113.75 N"


def test_a_click_on_a_chart_sets_the_clock_to_a_sample(page: Any, clock: Any, files: Path) -> None:
    box = page.locator(".plot .nsewdrag").first.bounding_box()
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    assert clock() == pytest.approx(6.0, abs=0.02)
    with h5py.File(files / "pulley.h5") as file:
        assert clock() in file["time"][:]


def test_an_event_sets_the_clock_and_is_marked(page: Any, clock: Any, files: Path) -> None:
    page.locator("#events button").nth(1).click()
    with h5py.File(files / "pulley.h5") as file:
        assert clock() == file["events/time"][1]
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


def test_the_clock_stops_at_the_end_and_begins_again(page: Any, clock: Any) -> None:
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


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_follows_the_system_and_a_button(browser: Any, files: Path, scheme: str) -> None:
    background = "getComputedStyle(document.body).backgroundColor"
    text = "frictionsim.charts.charts[0].plot.layout.font.color"
    light, dark = ("rgb(255, 255, 255)", "#333333"), ("rgb(22, 24, 27)", "#d8d8d8")
    pairs = [light, dark] if scheme == "light" else [dark, light]
    with opened(browser, files / "pulley.html", color_scheme=scheme, viewport=WIDE) as page:
        assert (page.evaluate(background), page.evaluate(text)) == pairs[0]
        page.locator("#theme").click()
        page.evaluate(SETTLED)
        assert (page.evaluate(background), page.evaluate(text)) == pairs[1]


def test_a_comparison_overlays_its_results(browser: Any, files: Path) -> None:
    with opened(browser, files / "two.html", viewport=WIDE) as page:
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
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto((files / "pulley.html").as_uri())
    for words in ("force_to_lift", "energy_balance", "comes to rest", "mu_s = 0.2"):
        assert page.get_by_text(words).first.is_visible(), words
    assert page.locator("noscript p").is_visible()
    context.close()


HARM = "</script><script>window.harm = 1</script>\"'<img src=x onerror=alert(1)> %{y} <b>$x$</b>"


def test_texts_of_files_stay_text(browser: Any, tmp_path: Path) -> None:
    pulleys = [pulley._replace(name=f"{HARM}{i}") for i, pulley in enumerate(TWO)]
    record = fs.Result.of_run(belt_run(pulleys)).record
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
        assert HARM in page.text_content(".plot .ytitle")
        names = page.locator(".chart .key .name").all_text_contents()
        assert f"{HARM}0" in names
        assert page.evaluate("window.harm") is None
        assert page.locator("img").count() == 0


def test_a_long_channel_is_thinned_and_keeps_its_peak(browser: Any, files: Path) -> None:
    record = fs.open(files / "pulley.h5").record
    count = 50_000
    time = np.linspace(0.0, 12.0, count)
    channels = {
        name: np.interp(time, record.channels["time"], v) for name, v in record.channels.items()
    }
    channels["angle"][33_333] = 1e3
    channels["mode"] = np.ones(count, dtype=int)
    events = {name: values[:0] for name, values in record.events.items()}
    long = fs.Result(record._replace(channels=channels | {"time": time}, events=events))
    file = fs.report(long, files / "long.html")
    with opened(browser, file, viewport=WIDE) as page:
        ((times, values),) = page.evaluate(LINES, "angle")
        assert MAX_SAMPLES / 2 < len(times) <= MAX_SAMPLES
        assert values[times.index(time[33_333])] == 1e3
        assert set(zip(times, values, strict=True)) <= set(
            zip(time.tolist(), channels["angle"].tolist(), strict=True)
        )
