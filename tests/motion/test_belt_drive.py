"""Belts in motion: the points of a drawing are those of the file."""

import numpy as np
import pytest

from frictionsim.errors import InputError
from frictionsim.results import Record
from tests.support.belt_results import belt_run
from tests.support.motions import Band, Body, Motion, motion
from tests.support.records import BELTS, shown, with_scenario, without

STEPS = 40_000.0  # of the larger side of a drawing, which is all that it tells apart


def bodies_of(band: Band, record: Record) -> slice:
    """Return the places of the bodies among the points of a guided string, which has more."""
    pieces, rest = divmod(band.x.shape[1], record.channels["x"].shape[1])
    assert (pieces > 1, rest) == (True, 0)
    return slice(pieces - 1, None, pieces)


def band_of(animation: Motion) -> Band:
    return next(part for part in animation.parts if isinstance(part, Band))


@pytest.mark.parametrize("name", BELTS)
def test_a_belt_is_where_its_run_says(name: str) -> None:
    animation = motion(shown(name))
    band = band_of(animation)
    left, right, bottom, top = animation.bounds
    step = max(right - left, top - bottom) / STEPS
    run = belt_run(BELTS[name])
    of, bodies = run.channels, bodies_of(band, run)
    wheels = [part for part in animation.parts if isinstance(part, Body)]
    for frame in (0, len(animation.time) // 2, len(animation.time) - 1):
        sample = int(np.flatnonzero(run.time == animation.time[frame])[0])
        assert np.abs(band.x[frame, bodies] - of["x"][sample]).max() <= step
        assert np.abs(band.y[frame, bodies] - of["y"][sample]).max() <= step
        off = np.abs(band.value[frame, bodies] - of["tension"][sample])
        assert off.max() <= np.ptp(of["tension"]) / 250.0
        on = of["pulley_index"][sample] >= 0
        assert np.array_equal(band.touching[frame, bodies], on)
        assert np.array_equal(band.sticking[frame, bodies], on & (of["sticking"][sample] > 0))
        for i, wheel in enumerate(wheels):
            assert wheel.angle[frame] == of["pulley_angle"][sample, i]
    assert left < of["x"].min() < of["x"].max() < right
    assert bottom < of["y"].min() < of["y"].max() < top


@pytest.mark.parametrize("name", BELTS)
def test_a_guided_string_follows_its_arcs_and_is_marked_on_them_only(name: str) -> None:
    band = band_of(motion(shown(name)))
    bodies = bodies_of(band, shown(name))
    places = np.stack([band.x, band.y], axis=-1)
    on = np.zeros(band.x.shape, dtype=int)
    for pulley in BELTS[name]:
        away = np.hypot(*np.moveaxis(places - (pulley.x, pulley.y), -1, 0)) - pulley.radius
        assert away.min() > -1e-4  # nothing cuts through a pulley
        on += np.abs(away) < 1e-4
    marked = band.touching.sum(axis=1)
    assert np.all(marked <= (on > 0).sum(axis=1))
    assert np.all(on[band.touching] > 0)
    # More than the bodies alone: the points between them too.
    assert marked.mean() > 3.0 * band.touching[:, bodies].sum(axis=1).mean()


def test_a_fine_belt_and_a_long_run_are_thinned() -> None:
    """To at most 300 points, and 90 000 of all frames together, so that a page stays small."""
    bodies = 700
    record = belt_run(bodies=bodies, samples=700)
    band = band_of(motion(record))
    stride = -(-bodies // 300)
    assert band.x.shape[1] == -(-bodies // stride)
    assert 45_000 < band.x.size <= 90_000
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
    side = 3.0 * 0.027
    assert [right - left, top - bottom] == pytest.approx([side, side])


def test_a_patch_is_the_part_of_the_belt_that_the_scenario_names() -> None:
    record = shown("two pulleys")
    scenario = record.attributes["scenario"]
    text = f"{scenario}\n[effects.patch]\nfrom = 0.3\nto = 0.6\nmu_s = 0.3\nmu_k = 0.25\n"
    band = band_of(motion(with_scenario(record, text)))
    bodies = bodies_of(band, record)
    patch = band.patch[bodies]
    points = np.column_stack([band.x[0], band.y[0]])[bodies][patch]
    legs = np.hypot(*np.diff(points, axis=0).T)
    length, pitch = float(legs.sum()), float(legs.mean())
    assert length == pytest.approx(0.3 - pitch, abs=1.2 * pitch)
    assert np.flatnonzero(patch)[0] == pytest.approx(0.3 / pitch, abs=1.0)
