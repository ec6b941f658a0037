"""Drawings in a real browser: where things are, what is seen, which text stands beside it."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import frictionsim as fs
from frictionsim.io import hdf5_writer
from frictionsim.motion import belt_drive
from tests.support.belt_results import TWO, belt_run
from tests.support.browser import opened, set_time, wait_until
from tests.support.motions import scenario

# Of bodies in the plane: a guided string has points between its bodies.
IN_PLANE = {"belt_friction": {"mu_s": 1.0}, "contact": {}}
KINDS = ("pulley", "marble_machine", "epicyclic", "shaft")
# Of the page: a drawing of its own, so that nothing here depends on how a report shows its own.
MAKE = """() => {
  const canvas = document.createElement("canvas");
  document.body.prepend(canvas);
  window.drawing = new frictionsim.Drawing(canvas, frictionsim.data.results[0].motion);
  frictionsim.clock.follow((time) => drawing.draw(time));
}"""
PIXELS = "drawing.canvas.toDataURL()"


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Path, Path]]:
    """By kind the result and its report."""
    folder, found = tmp_path_factory.mktemp("drawings"), {}
    for kind in (*KINDS, "belt_drive"):
        result = folder / f"{kind}.h5"
        if kind == "belt_drive":
            hdf5_writer.write(belt_run(TWO, effects=IN_PLANE), result)
        else:
            fs.solve(scenario(kind, solver__rtol=1e-6), output=result)
        found[kind] = result, fs.report(result, folder / f"{kind}.html")
    return found


@pytest.fixture(scope="module", params=[*KINDS, "belt_drive"])
def drawn(
    request: Any, browser: Any, files: dict[str, tuple[Path, Path]]
) -> Iterator[tuple[str, Any, Any]]:
    """The kind, the page with a drawing, the open result."""
    result, report = files[request.param]
    with opened(browser, report) as page, h5py.File(result) as file:
        page.evaluate(MAKE)
        yield request.param, page, file


def times_of(file: Any) -> list[float]:
    time = file["time"][()]
    return [float(time[0]), float(time[len(time) // 3]), float(time[-1])]


def test_the_pose_is_that_of_the_file(drawn: tuple[str, Any, Any]) -> None:
    kind, page, file = drawn
    time = file["time"][()]
    for at in times_of(file):
        i = int(np.searchsorted(time, at))
        pose = page.evaluate("(time) => drawing.pose(time)", at)
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
        main = {
            "pulley": "pulley",
            "marble_machine": "gear",
            "epicyclic": "crank",
            "shaft": "body",
        }[kind]
        assert bodies[main]["angle"] == pytest.approx(angle)
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


def test_a_pose_between_frames_is_between_them(
    browser: Any, files: dict[str, tuple[Path, Path]]
) -> None:
    result, report = files["epicyclic"]
    with opened(browser, report) as page, h5py.File(result) as file:
        page.evaluate(MAKE)
        time, angle = file["time"][()], file["angle"][()]
        i = len(time) - 5
        middle = 0.5 * (time[i] + time[i + 1])
        pose = page.evaluate("(time) => drawing.pose(time)", middle)
        planet = next(body for body in pose["bodies"] if body["name"] == "planet")
        turned = 0.5 * (angle[i] + angle[i + 1])
        assert planet["angle"] == pytest.approx(3.0 * turned)
        # On its circle, not on a chord of it.
        assert np.hypot(planet["x"], planet["y"]) == pytest.approx(0.18, rel=1e-12)


def test_numbers_beside_a_drawing_of_few_frames_are_those_of_all_samples(
    browser: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(belt_drive, "MAX_FRAMES", 3)
    monkeypatch.setattr(belt_drive, "MIN_FRAMES", 3)
    result = tmp_path / "belt.h5"
    hdf5_writer.write(belt_run(TWO), result)
    report = fs.report(result, tmp_path / "belt.html")
    with opened(browser, report) as page, h5py.File(result) as file:
        assert page.evaluate("frictionsim.drawings[0].motion.time.length") == 3
        time, speeds = file["time"][()], file["pulley_speed"][()]
        at = 0.7 * time[1] + 0.3 * time[2]
        found = page.evaluate("(time) => frictionsim.drawings[0].pose(time).readouts", at)
        shown = {readout["name"]: readout["value"] for readout in found}
        for i, name in enumerate(file["pulley"].asstr()[()]):
            assert shown[f"speed of {name}"] == pytest.approx(np.interp(at, time, speeds[:, i]))


BESIDE = """() => {
  const panel = document.querySelector("#drawings .drawing-panel");
  const numbers = Array.from(panel.querySelectorAll("dt"), (name) =>
    [name.textContent, name.nextElementSibling.textContent]);
  const state = panel.querySelector(".drawing-state").textContent;
  return { state, ...Object.fromEntries(numbers) };
}"""


def test_without_samples_at_events_a_page_agrees_with_its_events(
    browser: Any, tmp_path: Path
) -> None:
    data = scenario("pulley_return", solver__rtol=1e-6, solver__duration=6.0)
    record = fs.solve(data | {"output": {"interval": 0.2, "at_events": False}},
                      output=tmp_path / "a.h5").record  # fmt: skip
    away, rest = record.transitions
    with opened(browser, fs.report(tmp_path / "a.h5", tmp_path / "a.html")) as page:

        def at(time: float) -> dict[str, str]:
            set_time(page, time)
            return dict(page.evaluate(BESIDE))

        shaded = page.evaluate("frictionsim.data.results[0].sticking")
        assert shaded[0][1] == away.time
        assert shaded[1][0] == rest.time
        for event, before, after in ((away, "sticks", "slips forward"),
                                     (rest, "slips forward", "sticks")):  # fmt: skip
            assert at(event.time - 1e-6)["state"] == before
            assert at(event.time + 1e-6)["state"] == after
            page.click(f"#events button[data-time='{event.time!r}']")
            set_time(page, page.evaluate("frictionsim.clock.time"))
            found = page.evaluate(BESIDE)
            assert found["state"] == after
            assert float(found["angle"].split()[0]) == pytest.approx(event.position, abs=0.01)
            assert float(found["angular velocity"].split()[0]) == 0.0


def test_a_marble_is_delivered_at_its_transfer_without_a_sample(
    browser: Any, tmp_path: Path
) -> None:
    data = scenario("marble_machine", solver__rtol=1e-6, solver__duration=1.5)
    record = fs.solve(data | {"output": {"interval": 0.3, "at_events": False}},
                      output=tmp_path / "a.h5").record  # fmt: skip
    transfers = [event.time for event in record.transitions if event.contact == "transfer"]
    assert len(transfers) == 3
    with opened(browser, fs.report(tmp_path / "a.h5", tmp_path / "a.html")) as page:
        for number, time in enumerate(transfers):
            for at, delivered in ((time - 1e-6, number), (time, number + 1)):
                set_time(page, at)
                assert page.evaluate(BESIDE)["marbles delivered"] == str(delivered)


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


def test_dark_and_light_are_read_when_they_change(
    browser: Any, files: dict[str, tuple[Path, Path]]
) -> None:
    with opened(browser, files["pulley"][1], color_scheme="light") as page:
        page.evaluate(MAKE)
        light = page.evaluate(PIXELS)
        page.emulate_media(color_scheme="dark")
        wait_until(page, "drawing.colours.paper === '#16181b'")
        dark = page.evaluate(PIXELS)
        assert dark != light
        page.evaluate("() => { document.documentElement.dataset.theme = 'light'; }")
        wait_until(page, "drawing.colours.paper === '#ffffff'")
        assert page.evaluate(PIXELS) == light
        page.evaluate("() => { document.documentElement.dataset.theme = 'dark'; }")
        wait_until(page, "drawing.colours.paper === '#16181b'")
        assert page.evaluate(PIXELS) == dark


def test_a_canvas_is_sharp_and_as_wide_as_its_place(
    browser: Any, files: dict[str, tuple[Path, Path]]
) -> None:
    options = {"device_scale_factor": 2, "viewport": {"width": 900, "height": 700}}
    with opened(browser, files["epicyclic"][1], **options) as page:
        page.evaluate(MAKE)
        wait_until(page, "drawing.canvas.width === 2 * drawing.view.clientWidth")
        wide = page.evaluate("drawing.canvas.width")
        page.set_viewport_size({"width": 450, "height": 700})
        wait_until(page, f"drawing.canvas.width < {wide}")
        wait_until(page, "drawing.canvas.width === 2 * drawing.view.clientWidth")
        right = page.evaluate("drawing.element.getBoundingClientRect().right")
        assert right <= 450


def test_a_drawing_has_its_content_as_text(drawn: tuple[str, Any, Any]) -> None:
    kind, page, file = drawn
    set_time(page, times_of(file)[-1])
    assert page.evaluate("drawing.canvas.getAttribute('role')") == "img"
    label = page.evaluate("drawing.canvas.getAttribute('aria-label')")
    assert label.startswith("Moving drawing of ")
    text = page.evaluate("drawing.element.innerText")
    if kind == "belt_drive":
        for words in ("speed of driver", "tension, N", "sticks on the pulley"):
            assert words in text
        low, high = (of(file["tension"][()]) for of in (np.min, np.max))
        ends = page.evaluate("Array.from(document.querySelectorAll('.drawing-scale-ends span'))"
                             ".slice(0, 2).map((end) => parseFloat(end.textContent))")  # fmt: skip
        assert ends == pytest.approx([low, high], abs=0.01 * (high - low))
        return
    assert ("sticks" if kind == "shaft" else "slips forward") in text
    digits = ".4f" if kind == "shaft" else ".4g"
    shown = f"{file['angle'][-1]:{digits}}".replace("-", "\N{MINUS SIGN}")
    assert shown in text
    parts = {"pulley": "shaft", "marble_machine": "pinion", "epicyclic": "crank", "shaft": "effort"}
    assert parts[kind] in text


def test_a_name_with_markup_stays_text(browser: Any, tmp_path: Path) -> None:
    pulleys = (TWO[0]._replace(name="<img src=x onerror=alert(1)>"), TWO[1])
    hdf5_writer.write(belt_run(pulleys), tmp_path / "a.h5")
    report = fs.report(tmp_path / "a.h5", tmp_path / "a.html")
    with opened(browser, report) as page:
        page.evaluate(MAKE)
        assert "speed of <img src=x onerror=alert(1)>" in page.evaluate("drawing.element.innerText")
        assert page.evaluate("document.images.length") == 0


def test_a_drawing_is_fast_enough_for_play(
    browser: Any, files: dict[str, tuple[Path, Path]]
) -> None:
    with opened(browser, files["belt_drive"][1]) as page:
        page.evaluate(MAKE)
        milliseconds = page.evaluate(
            """() => {
              const { start, end } = frictionsim.clock;
              const begin = performance.now();
              for (let k = 0; k < 100; k++) drawing.draw(start + ((end - start) * k) / 100);
              drawing.context.getImageData(0, 0, 1, 1);  // when all is drawn
              return (performance.now() - begin) / 100;
            }"""
        )
        assert milliseconds < 1000.0 / 30.0
