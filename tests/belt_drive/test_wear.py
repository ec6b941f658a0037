"""Several patches of other friction, and the work of friction along the belt and on each rim."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.results import Record
from tests.support.belt_scenarios import CONTINUED, path_of, scenario_of, shipped
from tests.support.cases import slow
from tests.support.drawn_belts import drawn
from tests.support.scenarios import Scenario, changed, simulate, sound

EA, R = 1.52e5, 0.027  # N, m, of the shipped drive
OIL = {"mu_s": 0.3, "mu_k": 0.25}
# Works are sums of the same products as the heat of all friction, in another order.
ROUNDING = 1e-9


def worn(**changes: Any) -> Scenario:
    """Return the shipped string with its work of friction, for a hundredth of a second."""
    short = {"solver__duration": 0.01, "output__interval": 1e-3, "effects__wear": {}}
    return shipped("belt_string", **{**short, **changes})


def patch(start: float, end: float, **more: Any) -> dict[str, Any]:
    return {"from": start, "to": end, **OIL, **more}


# --- patches --------------------------------------------------------------------------------------


def test_patches_that_adjoin_are_one_to_the_bit() -> None:
    """In any order, however often one is cut: with the same friction the belt is the same."""
    ends = [0.05, 0.3, 0.41, 1.15]
    pieces = [patch(a, b) for a, b in pairwise(ends)]
    order = [pieces[2], pieces[0], pieces[1]]
    one, several = (simulate(worn(effects__patch=p)) for p in (patch(ends[0], ends[-1]), order))
    assert one.channels.keys() == several.channels.keys()
    for name, values in one.channels.items():
        assert np.array_equal(values, several.channels[name]), name
    # All are named alike, so that their work counts together.
    assert one.quantities == several.quantities


def test_each_body_has_the_friction_of_its_patch() -> None:
    """In full slip the friction of a body is its own coefficient times its normal force."""
    other = {"mu_s": 0.6, "mu_k": 0.5}
    data = worn(
        effects__patch=[patch(0.0, 0.3), {**patch(0.5, 0.9), **other}],
        drive__driver={"speed": -50.0},
        drive__driven={"speed": 0.0},
    )
    done = simulate(data)
    sliding = (done.channels["normal_force"] > 0.0) & (done.channels["sticking"] == 0.0)
    sliding[0] = False  # there is no friction before the first step
    length = path_of(scenario_of(data)).length / 60 / (1.0 + 555.0 / EA)
    places = np.broadcast_to((np.arange(60) + 0.5) * length, sliding.shape)
    expected = np.select([places < 0.3, (places >= 0.5) & (places < 0.9)], [0.25, 0.5], 1.0)
    friction, normal = (done.channels[f"{name}_force"][sliding] for name in ("friction", "normal"))
    assert {*np.unique(expected[sliding])} == {0.25, 0.5, 1.0}
    assert np.abs(friction) == pytest.approx(normal * expected[sliding], rel=1e-9)


def test_a_patch_among_others_that_reaches_no_pulley_is_named() -> None:
    done = simulate(worn(effects__patch=[patch(0.5, 0.7), patch(0.2, 0.3)]))
    assert "no body of effects.patch.1 is on a pulley in any sample" in " ".join(done.warnings)
    assert "effects.patch.0" not in " ".join(done.warnings)


@pytest.mark.parametrize("given", [{"pretension": 555.0}, {"length": 1.1953}])
def test_a_patch_ends_where_the_unstretched_belt_ends(given: dict[str, Any]) -> None:
    """The path is 0.4 % longer: a patch there would have no body in it."""
    data = worn()
    del data["mechanism"]["belt"]["pretension"]
    data["mechanism"]["belt"] |= given
    end = given.get("length") or path_of(scenario_of(data)).length / (1.0 + 555.0 / EA)
    fs.load(changed(data, effects__patch=patch(1.1, end)))
    with pytest.raises(fs.ScenarioError, match=f"beyond the belt's {end} m$"):
        fs.load(changed(data, effects__patch=patch(1.1, end * (1.0 + 1e-12))))


@pytest.mark.parametrize("name", ["belt_string", "belt_patch"])
def test_a_patch_between_the_middles_of_two_bodies_is_told_before_the_run(name: str) -> None:
    """Half of a body's length between the middles has none in it, beside a middle it has one."""
    data = shipped(name, solver__duration=1e-3, solver__backend="moreau")
    length = fs.static(fs.load(data))["body_length"].value
    for start, told in ((49.6, True), (49.3, False)):
        given = [patch(0.1, 0.2), patch(start * length, (start + 0.4) * length)]
        scenario = fs.load(changed(data, effects__patch=given))
        warnings = [*scenario.warnings(), *simulate(scenario.to_dict()).warnings]
        found = [w for w in warnings if w.startswith("no body of the belt lies in effects.patch.1")]
        assert len(found) == 2 * told
        assert not told or not [w for w in warnings if "effects.patch.1 is on" in w]


def test_a_value_of_one_patch_is_set_and_varied_by_its_name_or_number() -> None:
    patches = [patch(0.1, 0.2, name="oil"), patch(0.3, 0.4)]
    scenario = fs.load(worn(effects__patch=patches, solver__duration=1e-3))
    for key in ("effects.patch.oil", "effects.patch.0"):
        changed_patches = scenario.replace({f"{key}.mu_k": 0.1}).to_dict()["effects"]["patch"]
        assert [one["mu_k"] for one in changed_patches] == [0.1, 0.25]
        swept = fs.sweep(scenario, {f"{key}.to": [0.2]}, workers=1)
        assert swept[f"{key}.to"].attrs["units"] == "m"


# --- the work of friction -------------------------------------------------------------------------


def assert_adds_up(done: Record) -> None:
    channels, largest = done.channels, done.channels["energy_friction"][-1]
    assert largest > 0.0
    for name in ("friction_work", "pulley_friction_work"):
        off = channels[name].sum(axis=1) - channels["energy_friction"]
        assert np.max(np.abs(off)) <= ROUNDING * largest, name


@pytest.mark.parametrize("backend", ["moreau", slow("rkf45")])
@pytest.mark.parametrize(("seed", "more"), [(0, 0.0), (3, 0.2)])
def test_works_of_drawn_strings_add_up_to_the_heat(seed: int, more: float, backend: str) -> None:
    data = drawn(seed, solver__backend=backend, effects__wear={}, solver__duration=0.03)
    data["effects"]["belt_friction"]["mu_s"] += more
    data["effects"]["patch"] = [patch(0.2, 0.5), patch(0.6, 0.9, name="water")]
    assert_adds_up(sound(data))


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["moreau", "rkf45"])
@pytest.mark.parametrize("name", ["belt_patch", "belt_tensioner"])
def test_works_of_belts_in_the_plane_add_up(name: str, backend: str) -> None:
    more = {"solver__backend": backend, "solver__duration": 0.02, "output__interval": 1e-3}
    assert_adds_up(simulate(shipped(name, effects__wear={}, **more)))


def test_the_work_of_a_body_is_the_integral_of_its_friction_over_its_slip() -> None:
    """From samples that are 20 steps apart, of a belt that slips as a whole."""
    data = worn(
        drive__driver={"speed": {"time": [0.0, 0.005], "value": [0.0, -40.0]}},
        drive__driven={"speed": 0.0},
        solver__duration=0.02,
        output__interval=1e-4,
        effects__patch=[patch(0.5, 0.7)],
    )
    done = simulate(data)
    time, channels = done.time, done.channels
    power = channels["friction_force"] * channels["slip_velocity"]
    work = np.sum(0.5 * (power[1:] + power[:-1]) * np.diff(time)[:, None], axis=0)
    # Friction rings with the waves in the belt, some samples long: the trapezoids miss a part.
    assert channels["friction_work"][-1] == pytest.approx(work, abs=5e-3 * np.max(work))
    for j in range(2):
        own = np.sum(power * (channels["pulley_index"] == j), axis=1)
        expected = np.sum(0.5 * (own[1:] + own[:-1]) * np.diff(time))
        assert channels["pulley_friction_work"][-1, j] == pytest.approx(
            expected, abs=5e-3 * np.sum(work)
        )


@pytest.mark.parametrize("bodies", [60, slow(150)])
def test_creep_works_as_much_on_each_metre_as_the_closed_form_has_it(bodies: int) -> None:
    """A metre of belt that passes both pulleys does (T1 - T2)^2/EA of work.

    On a rim of the speed v the belt slips by v (T - T_in)/EA, so that one pass of a metre takes
    the integral of (T - T_in)/EA over dT, (T1 - T2)^2/(2 EA).
    """
    data = worn(
        mechanism__belt__bodies=bodies,
        drive__driven__torque=CONTINUED,
        solver__duration=2.0,
        output__interval=2e-3,
        output__channels=["energy_friction", "pulley_speed", "friction_work"],
    )
    done = sound(data)
    time, channels = done.time, done.channels
    late = time >= 1.0
    duration = float(np.ptp(time[late]))
    length = path_of(scenario_of(data)).length
    unstretched = length / (1.0 + 555.0 / EA)
    # On the driver's arc the belt sticks at the tension of the tight span.
    tight, slack = (done.quantities[f"tension_{side}"].value for side in ("tight", "slack"))
    speed = R * np.abs(np.mean(channels["pulley_speed"][late, 0])) / (1.0 + tight / EA)
    turns = speed * duration / unstretched
    work = np.ptp(channels["friction_work"][late].sum(axis=1)) / turns
    expected = (15.0 / R) ** 2 / EA
    assert expected == pytest.approx(2.03, abs=5e-3)  # J/m
    # Of 60 points the creep is 1e-3 off the closed form (`test_guided_string`), and its product
    # with a torque that ripples by as much.
    assert work / unstretched == pytest.approx(expected, rel=5e-3)
    assert 1e3 * work / 150 == pytest.approx(16.2, rel=5e-3)  # mJ, of a body of 150
    assert tight - slack == pytest.approx(15.0 / R, rel=1e-3)


def test_the_work_per_metre_is_that_of_the_bodies_of_each_name() -> None:
    data = worn(
        effects__patch=[patch(0.5, 0.7, name="oil"), patch(0.2, 0.3), patch(0.8, 0.9, name="oil")],
        drive__driver={"speed": {"time": [0.0, 0.005], "value": [0.0, -40.0]}},
        drive__driven={"speed": 0.0},
    )
    done = simulate(data)
    length = path_of(scenario_of(data)).length / 60 / (1.0 + 555.0 / EA)
    places, work = (np.arange(60) + 0.5) * length, done.channels["friction_work"][-1]
    oil = ((places > 0.5) & (places < 0.7)) | ((places > 0.8) & (places < 0.9))
    other = (places > 0.2) & (places < 0.3)
    for name, bodies in (("oil", oil), ("patch", other), ("clean", ~oil & ~other)):
        quantity = done.quantities[f"friction_work_{name}"]
        expected = np.sum(work[bodies]) / (np.sum(bodies) * length)
        assert (quantity.value, quantity.unit) == (pytest.approx(expected, rel=1e-12), "J/m")


@pytest.mark.parametrize("backend", ["moreau", slow("rkf45")])
def test_a_run_is_the_same_with_the_works_of_its_friction(backend: str) -> None:
    data = worn(solver__backend=backend, effects__patch=[patch(0.5, 0.7)])
    with_work, without = simulate(data), simulate(changed(data, effects__wear=None))
    works = {"friction_work", "pulley_friction_work"}
    assert with_work.channels.keys() - without.channels.keys() == works
    for name, values in without.channels.items():
        # Adaptive steps sum their error over more numbers, in another order.
        close = 0.0 if backend == "moreau" else 1e-9 * float(np.max(np.abs(values)))
        assert np.max(np.abs(with_work.channels[name] - values)) <= close, name
    assert with_work.statistics.steps == without.statistics.steps
