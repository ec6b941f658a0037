"""Drawings in a real browser: where things are, what is seen, which text stands beside it."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import frictionsim as fs
from tests.support.belt_results import TWO, belt_run
from tests.support.browser import opened, set_time, wait_until
from tests.support.cases import one_in
from tests.support.scenarios import shipped

# Of bodies in the plane: a guided string has points between its bodies.
IN_PLANE = {"belt_friction": {"mu_s": 1.0}, "contact": {}}
MAIN = {"epicyclic": "crank", "pulley": "pulley", "marble_machine": "gear", "shaft": "body"}
# Of the page: a drawing of its own, so that nothing here depends on how a report shows its own.
MAKE = """() => {
  const canvas = document.createElement("canvas");
  document.body.prepend(canvas);
  window.drawing = new frictionsim.Drawing(canvas, frictionsim.data.results[0].motion);
  frictionsim.clock.follow((time) => drawing.draw(time));
}"""
PIXELS = "drawing.canvas.toDataURL()"
CALLS = """() => {
  let calls = 0;
  const prototype = CanvasRenderingContext2D.prototype;
  for (const name of ["stroke", "fill", "lineTo", "moveTo", "arc", "fillText", "clip", "save"]) {
    const method = prototype[name];
    prototype[name] = function (...values) { calls += 1; return method.apply(this, values); };
  }
  const { start, end } = frictionsim.clock;
  for (let k = 0; k < 100; k++) drawing.draw(start + ((end - start) * k) / 100);
  return calls / 100;
}"""


ALL_KINDS = [*MAIN, "belt_drive"]
of_some_kinds = pytest.mark.parametrize("drawn", one_in(4, ALL_KINDS), indirect=True)


@pytest.fixture(scope="module", params=ALL_KINDS)
def drawn(
    request: Any, browser: Any, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[str, Any, Any]]:
    """The kind, the page with a drawing, the open result."""
    result = tmp_path_factory.mktemp("drawings") / "a.h5"
    if request.param == "belt_drive":
        fs.Result(belt_run(TWO, effects=IN_PLANE)).save(result)
    else:
        fs.solve(shipped(request.param, solver__rtol=1e-6), output=result)
    report = fs.report(result, result.with_suffix(".html"))
    with (
        opened(browser, report, color_scheme="light", device_scale_factor=2) as page,
        h5py.File(result) as file,
    ):
        page.evaluate(MAKE)
        yield request.param, page, file


def times_of(file: Any) -> list[float]:
    time = file["time"][()]
    return [float(time[0]), float(time[len(time) // 3]), float(time[-1])]


@of_some_kinds
def test_the_pose_is_that_of_the_file(drawn: tuple[str, Any, Any]) -> None:
    kind, page, file = drawn
    times = times_of(file)
    poses = page.evaluate("(times) => times.map((time) => drawing.pose(time))", times)
    for i, pose in zip(np.searchsorted(file["time"][()], times), poses, strict=True):
        bodies = {body["name"]: body for body in pose["bodies"] if body["name"]}
        if kind == "belt_drive":
            (band,) = pose["bands"]
            assert band["x"] == pytest.approx(file["x"][i, :5], abs=2e-5)
            assert band["y"] == pytest.approx(file["y"][i, :5], abs=2e-5)
            assert band["touching"] == np.sum(file["pulley_index"][i] >= 0)
            stuck = (file["pulley_index"][i] >= 0) & (file["sticking"][i] > 0)
            assert band["sticking"] == np.sum(stuck)
            assert bodies["driven"]["angle"] == pytest.approx(file["pulley_angle"][i, 1])
            continue
        angle = file["angle"][i]
        assert bodies[MAIN[kind]]["angle"] == pytest.approx(angle)
        shown = {readout["name"]: readout["value"] for readout in pose["readouts"]}
        assert shown["angle"] == pytest.approx(angle)
        assert shown["angular velocity"] == pytest.approx(file["angular_velocity"][i])
        if kind == "epicyclic":
            planet = bodies["planet"]
            assert complex(planet["x"], planet["y"]) == pytest.approx(0.18 * np.exp(1j * angle))
            (trail,) = pose["trails"]
            tip = [file["tracer_x"][i], file["tracer_y"][i]]
            assert trail["tip"] == pytest.approx(tip, abs=1e-6)
        if kind == "marble_machine":
            carried = file["carried_marbles"][i]
            others = 3 + (shown["marbles delivered"] + 1)  # gear, shaft, pinion; rail and marbles
            assert pose["visible"] == carried + others
    if kind == "epicyclic":  # between frames it is on its circle, not on a chord of it
        time, angle = file["time"][()], file["angle"][()]
        i = len(time) - 5
        pose = page.evaluate("(time) => drawing.pose(time)", 0.5 * (time[i] + time[i + 1]))
        planet = next(body for body in pose["bodies"] if body["name"] == "planet")
        assert planet["angle"] == pytest.approx(1.5 * (angle[i] + angle[i + 1]))
        assert np.hypot(planet["x"], planet["y"]) == pytest.approx(0.18, rel=1e-12)


@pytest.mark.slow
def test_a_belt_with_few_frames_and_markup_in_a_name_has_all_samples_and_text_beside_it(
    browser: Any, tmp_path: Path
) -> None:
    pulleys = (TWO[0]._replace(name="<img src=x onerror=alert(1)>"), TWO[1])
    run = belt_run(pulleys, bodies=600, samples=1001)
    fs.Result(run).save(tmp_path / "belt.h5")
    with opened(browser, fs.report(tmp_path / "belt.h5", tmp_path / "belt.html")) as page:
        at = 0.7 * run.time[1] + 0.3 * run.time[2]
        frames, readouts = page.evaluate(
            "(time) => [frictionsim.drawings[0].motion.time.length,"
            " frictionsim.drawings[0].pose(time).readouts]",
            at,
        )
        assert frames < 400  # of 1001 samples
        shown = {readout["name"]: readout["value"] for readout in readouts}
        for pulley, speed in zip(pulleys, run.channels["pulley_speed"].T, strict=True):
            expected = np.interp(at, run.time, speed)
            assert shown[f"speed of {pulley.name}"] == pytest.approx(expected)
        page.evaluate(MAKE)
        assert f"speed of {pulleys[0].name}" in page.evaluate("drawing.element.innerText")
        assert page.evaluate("document.images.length") == 0


BESIDE = """() => {
  const panel = document.querySelector("#drawings .drawing-panel");
  const numbers = Array.from(panel.querySelectorAll("dt"), (name) =>
    [name.textContent, name.nextElementSibling.textContent]);
  const state = panel.querySelector(".drawing-state").textContent;
  return { state, ...Object.fromEntries(numbers) };
}"""


def beside(page: Any, time: float) -> dict[str, str]:
    """Return the readouts of the drawing at a time."""
    set_time(page, time)
    return dict(page.evaluate(BESIDE))


@pytest.mark.slow
def test_without_samples_at_events_a_page_agrees_with_its_events(
    browser: Any, tmp_path: Path
) -> None:
    data = shipped("pulley_return", solver__rtol=1e-6, solver__duration=6.0)
    record = fs.solve(data | {"output": {"interval": 0.2, "at_events": False}},
                      output=tmp_path / "a.h5").record  # fmt: skip
    away, rest = record.transitions
    with opened(browser, fs.report(tmp_path / "a.h5", tmp_path / "a.html")) as page:
        shaded = page.evaluate("frictionsim.data.results[0].sticking")
        assert page.locator("text=Grey areas: sticking.").count() == 1
        assert shaded[0][1] == away.time
        assert shaded[1][0] == rest.time
        for event, before, after in ((away, "sticks", "slips forward"),
                                     (rest, "slips forward", "sticks")):  # fmt: skip
            assert beside(page, event.time - 1e-6)["state"] == before
            assert beside(page, event.time + 1e-6)["state"] == after
            page.click(f"#events button[data-time='{event.time!r}']")
            values = beside(page, page.evaluate("frictionsim.clock.time"))
            assert values["state"] == after
            assert float(values["angle"].split()[0]) == pytest.approx(event.position, abs=0.01)
            assert float(values["angular velocity"].split()[0]) == 0.0


@pytest.mark.slow
def test_a_marble_is_delivered_at_its_transfer_without_a_sample(
    browser: Any, tmp_path: Path
) -> None:
    data = shipped("marble_machine", solver__rtol=1e-6, solver__duration=1.5)
    record = fs.solve(data | {"output": {"interval": 0.3, "at_events": False}},
                      output=tmp_path / "a.h5").record  # fmt: skip
    transfers = [event.time for event in record.transitions if event.contact == "transfer"]
    assert len(transfers) == 3
    with opened(browser, fs.report(tmp_path / "a.h5", tmp_path / "a.html")) as page:
        for number, time in enumerate(transfers):
            for at, delivered in ((time - 1e-6, number), (time, number + 1)):
                assert beside(page, at)["marbles delivered"] == str(delivered)


@of_some_kinds
def test_the_clock_moves_the_pixels(drawn: tuple[str, Any, Any]) -> None:
    _, page, file = drawn
    seen = []
    for at in (*times_of(file), times_of(file)[1]):
        set_time(page, at)
        seen.append(page.evaluate(PIXELS))
        set_time(page, at)
        assert page.evaluate(PIXELS) == seen[-1], "the same time gives the same pixels"
    assert len(set(seen[:3])) == 3
    assert seen[3] == seen[1]


@of_some_kinds
def test_a_drawing_has_its_content_as_text(drawn: tuple[str, Any, Any]) -> None:
    kind, page, file = drawn
    set_time(page, times_of(file)[-1])
    role, label, text, ends = page.evaluate(
        """() => [
          drawing.canvas.getAttribute("role"),
          drawing.canvas.getAttribute("aria-label"),
          drawing.element.innerText,
          Array.from(document.querySelectorAll(".drawing-scale-ends span")).slice(0, 2)
            .map((end) => parseFloat(end.textContent)),
        ]"""
    )
    assert role == "img"
    assert label.startswith("Moving drawing of ")
    if kind == "belt_drive":
        for words in ("speed of driver", "tension, N", "sticks on the pulley"):
            assert words in text
        low, high = (of(file["tension"][()]) for of in (np.min, np.max))
        assert ends == pytest.approx([low, high], abs=0.01 * (high - low))
        return
    assert ("sticks" if kind == "shaft" else "slips forward") in text
    digits = ".4f" if kind == "shaft" else ".4g"
    shown = f"{file['angle'][-1]:{digits}}".replace("-", "\N{MINUS SIGN}")
    assert shown in text
    parts = {"pulley": "shaft", "marble_machine": "pinion", "epicyclic": "crank", "shaft": "effort"}
    assert parts[kind] in text


@pytest.mark.parametrize("drawn", ["epicyclic"], indirect=True)
def test_dark_and_light_are_read_when_they_change(drawn: tuple[str, Any, Any]) -> None:
    _, page, _ = drawn
    seen = {False: page.evaluate(PIXELS)}
    for change, dark in (("", True), ("light", False), ("dark", True)):
        if change:
            page.evaluate("(theme) => { document.documentElement.dataset.theme = theme; }", change)
        else:
            page.emulate_media(color_scheme="dark")
        wait_until(page, f"drawing.colours.paper === '{'#16181b' if dark else '#ffffff'}'")
        pixels = page.evaluate(PIXELS)
        assert pixels == seen.setdefault(dark, pixels)
    assert seen[False] != seen[True]


@pytest.mark.parametrize("drawn", ["epicyclic"], indirect=True)
def test_a_canvas_is_sharp_and_as_wide_as_its_place(drawn: tuple[str, Any, Any]) -> None:
    _, page, _ = drawn
    page.set_viewport_size({"width": 900, "height": 700})
    wait_until(page, "drawing.canvas.width === 2 * drawing.view.clientWidth")
    wide = page.evaluate("drawing.canvas.width")
    page.set_viewport_size({"width": 450, "height": 700})
    wait_until(page, f"drawing.canvas.width < {wide}")
    wait_until(page, "drawing.canvas.width === 2 * drawing.view.clientWidth")
    assert page.evaluate("drawing.element.getBoundingClientRect().right") <= 450


@pytest.mark.parametrize("drawn", ["belt_drive"], indirect=True)
def test_a_drawing_takes_few_enough_operations_for_play(drawn: tuple[str, Any, Any]) -> None:
    _, page, _ = drawn
    assert 50 < page.evaluate(CALLS) < 5_000
