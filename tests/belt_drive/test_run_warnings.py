"""Warnings of a belt's run: exactly when their rules hold, as read from the channels."""

import re
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.errors import InputError
from frictionsim.results import Record
from tests.support.belt_scenarios import NO_MOTION_ACROSS, pair, trio
from tests.support.cases import slow
from tests.support.falsified import falsified
from tests.support.scenarios import Scenario, changed, scenario_run, simulate

LONG = {"solver__duration": 0.3, "solver__backend": "moreau"}


def full_slip(done: Record, name: str) -> float:
    """Return the share of samples in which all bodies on a pulley slide with all their friction."""
    c, law = done.channels, scenario_run(done).to_dict()["effects"]["belt_friction"]
    j = done.members["pulley"].index(name)
    mu_k = law.get("pulleys", {}).get(name, law)["mu_k"]
    on = c["pulley_index"] == j
    friction = np.abs(np.sum(c["friction_force"] * on, axis=1))
    limit = mu_k * np.sum(c["normal_force"] * on, axis=1)
    nobody = on.any(axis=1) & ~np.any((c["sticking"] > 0.0) & on, axis=1)
    return float(np.mean(nobody & (friction >= 0.99 * limit)))


FIXED = {"solver__backend": "moreau"}
ALIKE = {"mu_s": 0.6, "mu_k": 0.6}


def torque_of(value: float) -> Scenario:
    return {"drive__driver__torque": {"time": [0.0, 0.02], "value": [0.0, value]}}


OVERLOAD = torque_of(-30.0)
SMOOTHED = {**ALIKE, "law": "regularised", "transition_speed": 0.05}
ON_DRIVEN = {**ALIKE, "pulleys": {"driven": {"mu_s": 0.05, "mu_k": 0.05}}}
DRAWN: dict[str, Scenario] = {
    "moderate": pair(**FIXED),
    "overloaded": pair(**FIXED, **OVERLOAD),
    "overloaded, adaptive": pair(**OVERLOAD, solver__rtol=1e-5),
    "slippery driven pulley": pair(**FIXED, **torque_of(-10.0), effects__belt_friction=ON_DRIVEN),
    "smoothed": pair(**OVERLOAD, effects__belt_friction=SMOOTHED),
    "three pulleys": trio(**FIXED, effects__patch=None),
    "at rest": pair(**FIXED, drive__driver__torque=0.0),
}


@pytest.mark.parametrize(
    "name",
    [slow(name) if name == "smoothed" else name for name in DRAWN],  # it has kernels of its own
)
def test_a_belt_that_slips_as_a_whole_is_warned_of(name: str) -> None:
    done = simulate(DRAWN[name])
    assert done.status == "done"
    told = {p for p in done.members["pulley"] if any(f"slips on '{p}'" in w for w in done.warnings)}
    assert told == {p for p in done.members["pulley"] if full_slip(done, p) > 0.01}
    if name.startswith("overloaded"):
        assert "driver" in told
    if name in ("moderate", "at rest"):
        assert told == set()


def warned(done: Record, words: str) -> bool:
    return any(words in warning for warning in done.warnings)


@pytest.mark.parametrize(("where", "unused"), [((0.0, 0.1), True), ((0.2, 0.45), False)])
def test_a_patch_that_reaches_no_pulley_is_warned_of(
    where: tuple[float, float], unused: bool
) -> None:
    """The belt is at rest; its first span is 0.25 m long. One without bodies is in `test_wear`."""
    patch = {"from": where[0], "to": where[1], "mu_s": 0.1, "mu_k": 0.1}
    done = simulate(pair(effects__patch=patch, **FIXED, drive__driver__torque=0.0))
    assert warned(done, "the patch changes nothing") is unused


@pytest.mark.parametrize(("where", "reason"), [(0.3, "load is above"), (0.75, "effects.patch is")])
def test_a_patch_makes_the_slip_of_the_pulley_it_is_on(where: float, reason: str) -> None:
    """The driven pulley holds the belt; its arc is from 0.25 to 0.5 m, the driver's from 0.75 m."""
    patch = {"from": where, "to": where + 0.15, "mu_s": 0.6, "mu_k": 0.6}
    done = simulate(pair(effects__patch=patch, drive__driven={"speed": 0.0}, **FIXED, **OVERLOAD))
    (warning,) = (w for w in done.warnings if "slips on 'driver'" in w)
    assert reason in warning


@pytest.mark.parametrize(
    ("torque", "steady"),
    [
        (0.0, True),
        ({"time": [0.0, 0.3], "value": [0.0, -5.0]}, False),
        ({"smooth_step": {"from": 0.0, "to": -5.0, "start": 0.0, "stop": 0.02}}, True),
    ],
    ids=["at rest", "a ramp to the end", "a load that is reached early"],
)
def test_means_of_a_motion_that_changes_are_warned_of(torque: Any, steady: bool) -> None:
    # The damped driven pulley settles within 30 ms: 2e-3 kg m^2 against 0.25 N m s.
    done = simulate(pair(drive__driver__torque=torque, mechanism__belt__bodies=48, **LONG))
    assert warned(done, "not steady") is not steady, done.warnings


def compressed(stop: float) -> Scenario:
    """Return a guided belt, in compression while both its pulleys speed up until a time, s."""
    pulleys = [
        {"name": name, "center": [x, 0.0], "radius": 0.1, "inertia": 1e-3}
        for name, x in (("a", 0.0), ("b", 0.4))
    ]
    string = {"bodies": 60, "mass_per_length": 0.1, "axial_rigidity": 1e4, "pretension": 30.0}
    speed = {"speed": {"time": [0.0, stop], "value": [0.0, 800.0]}}
    return {
        "kind": "belt_drive",
        "mechanism": {"belt": string, "pulleys": pulleys},
        "drive": {"a": speed, "b": speed},
        "effects": {
            "belt_friction": {"mu_s": 0.8, "mu_k": 0.8},
            "axial_damping": {"coefficient": 2.0},
        },
        "solver": {"backend": "moreau", "duration": 0.15},
        "output": {"interval": 5e-4},
    }


@pytest.mark.parametrize(("stop", "steady"), [(0.05, True), (0.15, False)])
def test_a_change_of_tension_counts_the_same_in_compression(stop: float, steady: bool) -> None:
    """The mean tension of a run is negative."""
    run = fs.solve(compressed(stop))
    on_spans = run.dataset["pulley_index"].values < 0.0
    tension = np.ma.array(run.dataset["tension"].values, mask=~on_spans).mean(axis=1)
    assert np.mean(tension) < 0.0
    assert bool(np.ptp(tension[-60:]) < 1e-9) is steady  # the last fifth of the run
    warnings = [warning for warning in run.warnings if "not steady" in warning]
    if steady:
        assert not warnings
        return
    (changes,) = re.findall(r"the tension from '\w' to '\w' changes by (\S+) %", warnings[0])
    assert 10.0 < float(changes) < 1000.0


def test_means_of_a_few_samples_are_warned_of() -> None:
    done = simulate(pair(solver__backend="moreau", output__interval=5e-3))
    assert warned(done, "have only 3 samples")
    assert not warned(simulate(pair(solver__backend="moreau")), "samples; give")


@pytest.mark.parametrize(("share", "told"), [(0.995, False), (0.98, True)])
def test_energy_that_comes_from_nowhere_is_warned_of(share: float, told: bool) -> None:
    """Of samples whose elastic energy is less than it was: more than 1 % of it is too much."""
    solver = {"backend": "moreau", "duration": 0.01}
    data = pair(**NO_MOTION_ACROSS, drive__driver__torque=0.0, solver=solver)
    run = falsified(data, 9e-3, energy_potential=lambda energy: share * energy)
    assert any("the steps have put" in warning for warning in run.warnings) is told


@pytest.mark.parametrize(
    ("bodies", "wrap", "divisor"),
    [
        (14, "corrected", 72.0),
        (24, "corrected", 72.0),
        (96, "corrected", 72.0),
        # The polygon has kernels of its own.
        *(slow(bodies, "polygon", 12.0) for bodies in (14, 24, 96)),
    ],
)
def test_slip_that_corners_make_is_warned_of(bodies: int, wrap: str, divisor: float) -> None:
    data = pair(mechanism__belt__bodies=bodies, drive__driver__torque=-3.0, **LONG)
    data["mechanism"]["belt"]["wrap"] = wrap
    done = simulate(data)
    slip = done.quantities["slip_percent"].value
    assert slip is not None
    # The unstretched length of a body: 1.0027 m round both pulleys, less a strain of 2 %.
    length = (2.0 * 0.25 + 2.0 * np.pi * 0.08) / 1.02 / bodies
    corner = 100.0 * (length / 0.08) ** 2 / divisor
    assert abs(abs(slip) / corner - 1.0) > 0.05  # the length is known to a per cent
    assert warned(done, "what the corners between the bodies do") is (abs(slip) < corner)
    # At the least, a driven rim that sticks to the tight span and a driver to the slack one.
    tight, slack = (done.quantities[f"tension_{which}"].value for which in ("tight", "slack"))
    stretch = 100.0 * (tight - slack) / data["mechanism"]["belt"]["axial_rigidity"]
    backwards = slip < -stretch and abs(slip) >= corner
    assert warned(done, "the driven rim is faster than the driver's") is backwards


def test_a_belt_at_rest_has_no_efficiency_and_no_slip() -> None:
    done = simulate(pair(drive__driver__torque=0.0, **LONG))
    assert done.quantities["efficiency"].value is None
    assert done.quantities["slip_percent"].value is None
    assert simulate(pair(**LONG)).quantities["efficiency"].value is not None


def test_a_long_step_with_very_stiff_dampers_is_warned_of() -> None:
    """With 0.35 of the longest stable step energies of a violent overload close to 3e-4."""
    stiff = pair(**FIXED, effects__axial_damping__coefficient=2e4, solver__duration=1e-3)
    with pytest.raises(InputError, match="'moreau' is stable below") as caught:
        simulate(changed(stiff, solver__step=1e-2))
    longest = float(str(caught.value).split("stable below ")[1].split()[0])
    assert warned(simulate(changed(stiff, solver__step=0.8 * longest)), "are very stiff")
    assert not warned(simulate(changed(stiff, solver__step=0.33 * longest)), "are very stiff")
    assert not warned(simulate(stiff), "are very stiff")
    soft = changed(stiff, effects__axial_damping__coefficient=10.0, solver__step=0.8 * longest)
    assert not warned(simulate(soft), "are very stiff")
