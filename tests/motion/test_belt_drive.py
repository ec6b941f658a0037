"""Belts in motion: the points of a drawing are those of the file."""

import numpy as np
import pytest

from frictionsim.errors import InputError
from frictionsim.motion import belt_drive
from frictionsim.motion.parts import Band, Body, Motion
from frictionsim.reports.page import packed_data
from frictionsim.scenario.toml_data import scenario_value
from tests.support.belt_results import belt_run
from tests.support.motions import motion
from tests.support.records import BELTS, shown, with_scenario, without

# These belts are guided strings: there are points between their bodies.
BODIES = slice(belt_drive.PIECES - 1, None, belt_drive.PIECES)


def band_of(animation: Motion) -> Band:
    return next(part for part in animation.parts if isinstance(part, Band))


@pytest.mark.parametrize("name", BELTS)
def test_a_belt_is_where_its_run_says(name: str) -> None:
    animation = motion(shown(name))
    band = band_of(animation)
    left, right, bottom, top = animation.bounds
    step = max(right - left, top - bottom) / belt_drive.STEPS
    run = belt_run(BELTS[name])
    of = run.channels
    wheels = [part for part in animation.parts if isinstance(part, Body)]
    for frame in (0, len(animation.time) // 2, len(animation.time) - 1):
        sample = int(np.flatnonzero(run.time == animation.time[frame])[0])
        assert np.abs(band.x[frame, BODIES] - of["x"][sample]).max() <= step
        assert np.abs(band.y[frame, BODIES] - of["y"][sample]).max() <= step
        off = np.abs(band.value[frame, BODIES] - of["tension"][sample])
        assert off.max() <= np.ptp(of["tension"]) / 250.0
        on = of["pulley_index"][sample] >= 0
        assert np.array_equal(band.touching[frame, BODIES], on)
        assert np.array_equal(band.sticking[frame, BODIES], on & (of["sticking"][sample] > 0))
        for i, wheel in enumerate(wheels):
            assert wheel.angle[frame] == of["pulley_angle"][sample, i]
    assert left < of["x"].min() < of["x"].max() < right
    assert bottom < of["y"].min() < of["y"].max() < top


@pytest.mark.parametrize("name", BELTS)
def test_a_guided_string_follows_its_arcs_and_is_marked_on_them_only(name: str) -> None:
    band = band_of(motion(shown(name)))
    places = np.stack([band.x, band.y], axis=-1)
    on = np.zeros(band.x.shape, dtype=int)
    for table in scenario_value(shown(name), "mechanism", "pulleys"):
        away = np.hypot(*np.moveaxis(places - np.array(table["center"]), -1, 0)) - table["radius"]
        assert away.min() > -1e-4  # nothing cuts through a pulley
        on += np.abs(away) < 1e-4
    marked = band.touching.sum(axis=1)
    assert np.all(marked <= (on > 0).sum(axis=1))
    assert np.all(on[band.touching] > 0)
    # More than the bodies alone: the points between them too.
    assert marked.mean() > 3.0 * band.touching[:, BODIES].sum(axis=1).mean()


def test_a_fine_belt_and_a_long_run_are_thinned(monkeypatch: pytest.MonkeyPatch) -> None:
    record = shown("two pulleys")
    monkeypatch.setattr(belt_drive, "MAX_POINTS", 40)
    monkeypatch.setattr(belt_drive, "MAX_VALUES", 400)
    band = band_of(motion(record))
    bodies = record.channels["x"].shape[1]
    stride = -(-bodies // 40)
    assert band.x.shape[1] == -(-bodies // stride)
    assert band.x.size <= 400
    first = np.asarray(record.channels["x"][0])[::stride]
    assert band.x[0] == pytest.approx(first, abs=1e-4)


def test_what_is_not_recorded_is_left_out() -> None:
    record = shown("two pulleys")
    names = ("tension", "pulley_index", "sticking", "pulley_angle", "pulley_speed")
    animation = motion(without(record, *names))
    band = band_of(animation)
    assert (band.value, band.touching, band.sticking) == (None, None, None)
    assert animation.readouts == ()
    wheel = next(part for part in animation.parts if isinstance(part, Body))
    assert len(wheel.shapes) == 1, "a wheel whose angle is not known has no mark"
    for name in ("x", "y"):
        with pytest.raises(InputError, match=f"it has no channel {name} "):
            motion(without(record, name))


def test_small_pulleys_are_shown_larger_as_well() -> None:
    details = motion(shown("two pulleys")).details
    assert [detail.name for detail in details] == ["driver", "driven"]
    left, right, bottom, top = details[1].bounds
    assert 0.5 * (left + right) == pytest.approx(0.515)
    side = 2.0 * belt_drive.WINDOW * 0.027
    assert [right - left, top - bottom] == pytest.approx([side, side])


def test_the_data_of_a_belt_is_small() -> None:
    animation = motion(shown("two pulleys"))
    assert len(packed_data(animation)) < 8 * band_of(animation).x.size + 40_000


def test_a_patch_is_the_part_of_the_belt_that_the_scenario_names() -> None:
    record = shown("two pulleys")
    scenario = record.attributes["scenario"]
    text = f"{scenario}\n[effects.patch]\nfrom = 0.3\nto = 0.6\nmu_s = 0.3\nmu_k = 0.25\n"
    band = band_of(motion(with_scenario(record, text)))
    patch = band.patch[BODIES]
    points = np.column_stack([band.x[0], band.y[0]])[BODIES][patch]
    legs = np.hypot(*np.diff(points, axis=0).T)
    length, pitch = float(legs.sum()), float(legs.mean())
    assert length == pytest.approx(0.3 - pitch, abs=1.2 * pitch)
    assert np.flatnonzero(patch)[0] == pytest.approx(0.3 / pitch, abs=1.0)
