"""Belts in motion: the points of a drawing are those of the file."""

import numpy as np
import pytest

from frictionsim.results import Record
from tests.support.motions import Arrow, Body, Line, Motion, motion
from tests.support.records import BELTS, shown, with_scenario, without
from tests.support.scenarios import shipped


def bodies_of(band: Line, record: Record) -> slice:
    """Return the places of the bodies among the points of a guided string, which has more."""
    pieces, rest = divmod(band.points.shape[1], record.channels["x"].shape[1])
    assert (pieces > 1, rest) == (True, 0)
    return slice(pieces - 1, None, pieces)


def band_of(animation: Motion) -> Line:
    return next(part for part in animation.parts if isinstance(part, Line))


@pytest.mark.parametrize("name", BELTS)
def test_a_belt_and_its_forces_are_where_its_run_says(name: str) -> None:
    run = shown(name)
    animation = motion(run)
    band = band_of(animation)
    left, right, bottom, top = animation.bounds
    of, bodies = run.channels, bodies_of(band, run)
    wheels = [part for part in animation.parts if isinstance(part, Body)]
    bars = {part.name: part for part in animation.parts if isinstance(part, Arrow)}
    centres = np.array([pulley["center"] for pulley in shipped(name)["mechanism"]["pulleys"]])
    for frame in (0, len(animation.time) // 2, len(animation.time) - 1):
        sample = int(np.flatnonzero(run.time == animation.time[frame])[0])
        places = np.column_stack([of[axis][sample] for axis in "xy"])
        assert band.points[frame, bodies] == pytest.approx(places, abs=1e-6)
        assert np.array_equal(band.value[frame, bodies], of["tension"][sample])
        touched = of["pulley_index"][sample].astype(int)
        stuck = np.where(touched >= 0, of["sticking"][sample] > 0, -1)
        assert np.array_equal(band.stuck[frame, bodies], stuck)
        for i, wheel in enumerate(wheels):
            assert wheel.angle[frame] == of["pulley_angle"][sample, i]
        away = (places - centres[touched]) @ np.array([1.0, 1j])
        away /= np.abs(away)
        normal = bars["normal force on the belt"].vector[frame] @ np.array([1.0, 1j])
        wanted = np.where(touched >= 0, of["normal_force"][sample], 0.0)
        assert normal / away == pytest.approx(wanted)
        friction = [
            np.abs(bars[f"friction on the belt, {way}"].vector[frame] @ np.array([1.0, 1j]))
            for way in ("counter-clockwise", "clockwise")
        ]
        assert friction[0] - friction[1] == pytest.approx(
            np.where(touched >= 0, of["friction_force"][sample], 0.0)
        )
        assert not (friction[0] * friction[1]).any()
    assert left < of["x"].min() < of["x"].max() < right
    assert bottom < of["y"].min() < of["y"].max() < top


@pytest.mark.parametrize("name", BELTS)
def test_a_guided_string_follows_its_arcs_and_touches_on_them_only(name: str) -> None:
    band = band_of(motion(shown(name)))
    bodies = bodies_of(band, shown(name))
    on = np.zeros(band.points.shape[:2], dtype=int)
    for pulley in shipped(name)["mechanism"]["pulleys"]:
        away = np.linalg.norm(band.points - pulley["center"], axis=-1) - pulley["radius"]
        assert away.min() > -1e-4  # nothing cuts through a pulley
        on += np.abs(away) < 1e-4
    touching = band.stuck >= 0
    between = touching.copy()
    between[:, bodies] = False  # half of the section of a body may touch where it is itself off
    assert np.all(on[between] > 0)
    # More than the bodies alone: the points between them too.
    assert touching.sum() > 3.0 * touching[:, bodies].sum()


def test_a_patch_is_the_part_of_the_belt_that_the_scenario_names() -> None:
    tight = {"mechanism__belt__pretension": 1.52e4}  # of EA = 1.52e5 N
    record = shown("belt_string", **tight, solver__duration=0.01)
    scenario = record.attributes["scenario"]
    text = f"{scenario}\n[effects.patch]\nfrom = 0.31\nto = 0.6\nmu_s = 0.3\nmu_k = 0.25\n"
    # Of 1.1996 m, stretched by a tenth: the middle of body k is at (k + 0.5) 0.01818 m.
    for known in (record, without(record, "tension")):
        band = band_of(motion(with_scenario(known, text)))
        patch = np.flatnonzero(band.patch[bodies_of(band, record)])
        assert patch.tolist() == list(range(17, 33))
