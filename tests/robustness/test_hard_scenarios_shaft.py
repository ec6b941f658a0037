"""The scenarios of `scenarios/hard` of a body on a shaft, against the independent program."""

import tomllib

import pytest

from frictionsim.scenario.loading import load
from frictionsim.simulation.simulate import RunResult, run
from tests.support.scenarios import SCENARIOS, simulate
from tests.support.shaft_reference import solution

HARD = SCENARIOS / "hard"
BACKENDS = ("events", "rkf45")


def outcome(name: str, backend: str, *overrides: str) -> RunResult:
    """Run a hard scenario, which must pass its audit."""
    done = run(load(HARD / f"{name}.toml", list(overrides), backend), lambda t: None)
    assert (done.status, done.reason) == ("done", "")
    assert {key: check for key, check in done.checks.items() if not check.ok} == {}
    return done


def test_every_hard_scenario_of_a_shaft_has_a_test() -> None:
    names = {path.stem for path in HARD.glob("shaft_*.toml")}
    assert names == {"shaft_short_peak", "shaft_vanishing_load", "shaft_tie"}


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(("factor", "moves"), [(1.0 - 1e-9, False), (1.0 + 1e-9, True)])
def test_a_peak_of_nanoseconds_above_the_limit_breaks_away(
    factor: float, moves: bool, backend: str
) -> None:
    top = 1.2 * factor - 0.2
    value = f"couples.push.size.value=[0.0, {top!r}, 0.0]"
    done = outcome("shaft_short_peak", backend, value)
    if not moves:
        assert done.transitions == []
        return
    first, last = done.transitions
    assert (first.mode_from, first.mode_to) == (0, 1)
    # 1.2e-9 N m below the peak, where the torque rises by 1.65 N m/s.
    assert first.time == pytest.approx(0.605 - 1.2e-9 / (top / 0.605), abs=1e-12)
    assert last.mode_to == 0


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_load_that_vanishes_as_the_body_slides(backend: str) -> None:
    expected = solution(tomllib.loads((HARD / "shaft_vanishing_load.toml").read_text()))
    done = outcome("shaft_vanishing_load", backend)
    assert done.transitions == [] == expected["events"]
    final = [done.channels[name][-1] for name in ("angle", "angular_velocity")]
    # It is 1e-8 rad if a step goes across the corners.
    assert final == pytest.approx(expected["final"], abs=1e-9)
    assert done.channels["shaft_reaction"].min() < 0.05 * done.channels["shaft_reaction"].max()


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(("factor", "begin"), [(1.0, None), (1.0 - 1e-9, None), (1.0 + 1e-9, 0.3)])
def test_a_tie_holds_and_a_billionth_more_does_not(
    factor: float, begin: float | None, backend: str
) -> None:
    torque = 1.2 * factor
    value = f"couples.push.size.value=[0.0, {torque!r}, {torque!r}, 0.3, {torque!r}]"
    done = outcome("shaft_tie", backend, value)
    if begin is None:
        assert done.transitions == []
        assert not done.channels["angle"].any()
    else:
        assert done.transitions[0].time == pytest.approx(begin, abs=1e-8)


@pytest.mark.parametrize("direction", [[1.0, 3.0], [3.0, -1.0], [-7.0, 2.0]])
def test_a_tie_holds_as_well_if_large_forces_nearly_balance(direction: list[float]) -> None:
    """Their difference, 100 N, is known to 1e-8 N, and the limit no better."""
    through = {"point": [0.0, 0.0]}
    data = tomllib.loads((HARD / "shaft_tie.toml").read_text())
    data["forces"] = [
        {"name": "one", "size": 1e8, "direction": direction, **through},
        {"name": "other", "size": 1e8 - 100.0, "direction": [-x for x in direction], **through},
    ]
    assert simulate(data).transitions == []
