"""Properties of random pulleys: energy, friction law, symmetries."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionsim.results import Record
from tests.support.examples import examples
from tests.support.scenarios import Scenario, changed, pulley, simulate, sound
from tests.support.second_way import friction_radius


def close(actual: Any, expected: Any, tolerance: float = 1e-6) -> bool:
    """Compare channels of two runs at rtol 1e-9 whose steps differ.

    A hundred steps of 1e-9 each, and a position that is off where a stop came a little late.
    """
    scale = max(1.0, float(np.max(np.abs(expected), initial=0.0)))
    return bool(np.max(np.abs(actual - expected), initial=0.0) <= tolerance * scale)


forces = st.one_of(
    st.floats(0.0, 6000.0),
    st.lists(st.floats(0.0, 6000.0), min_size=2, max_size=6).map(
        lambda values: {"time": [0.3 * i for i in range(len(values))], "value": values}
    ),
    st.builds(
        lambda mean, amplitude, hz, phase: {
            "sine": {"mean": mean, "amplitude": amplitude, "frequency_hz": hz, "phase_deg": phase}
        },
        st.floats(1000.0, 4000.0),
        st.floats(1.0, 3000.0),
        st.floats(0.2, 5.0),
        st.floats(-180.0, 180.0),
    ),
    st.builds(
        lambda a, b, start, length: {
            "smooth_step": {"from": a, "to": b, "start": start, "stop": start + length}
        },
        st.floats(0.0, 6000.0),
        st.floats(0.0, 6000.0),
        st.floats(0.0, 1.0),
        st.floats(0.001, 1.0),
    ),
)


@st.composite
def scenarios(draw: st.DrawFn, force: Any = forces) -> Scenario:
    # No smaller one: friction below the rounding of the moments is neither there nor absent.
    mu_s = round(draw(st.floats(0.0, 1.0)), 9)
    effects: dict[str, Any] = {
        "shaft_friction": {
            "shaft_radius": draw(st.floats(0.005, 0.05)),
            "mu_s": mu_s,
            "mu_k": mu_s * draw(st.sampled_from([0.0, 0.5, 0.9, 1.0])),
        }
    }
    if draw(st.booleans()):
        effects["viscous_damping"] = {"coefficient": draw(st.floats(0.0, 5.0))}
    return {
        "kind": "pulley",
        "mechanism": {
            "cord_radius": 0.0508,
            "inertia": draw(st.floats(0.1, 10.0)),
            "load": draw(st.floats(100.0, 4000.0)),
        },
        "drive": {
            "force": draw(force),
            "direction": draw(st.sampled_from(["vertical", "horizontal"])),
        },
        "effects": effects,
        "solver": {"duration": 2.0},
        # Runs are compared sample by sample, and each has its own times of events.
        "output": {"interval": 0.02, "at_events": False},
    }


@given(scenarios(), st.sampled_from(["events", "rkf45"]))
def test_every_run_passes_its_audit(data: Scenario, backend: str) -> None:
    data["solver"]["backend"] = backend
    data["output"]["at_events"] = True
    run = sound(data)
    for channel in run.channels.values():
        assert np.all(np.isfinite(channel))
    for heat in ("energy_friction", "energy_damping"):
        # The weights of the method are not all positive: less than its tolerance may come back.
        lost = np.diff(run.channels.get(heat, np.zeros(2)))
        assert np.all(lost >= -1e-12 - 1e-9 * run.channels["energy_friction"][-1])
    stick = run.channels["mode"] == 0
    assert np.all(run.channels["angular_velocity"][stick] == 0.0)
    assert np.all(run.channels["angular_acceleration"][stick] == 0.0)
    # rkf45 may be past zero by its tolerance where it has not yet noticed.
    assert np.all(run.channels["angular_velocity"][~stick] * run.channels["mode"][~stick] >= -1e-8)


@given(scenarios())
def test_backends_agree(data: Scenario) -> None:
    events = simulate(data)
    data["solver"]["backend"] = "rkf45"
    assert close(simulate(data).channels["angle"], events.channels["angle"])


def test_backends_agree_on_a_rest_between_the_stages_of_a_step() -> None:
    """On straight lines of force the motion is a cubic, which rkf45 steps at once, rest or not."""
    times = [0.0, 0.3, 0.6, 0.9, 1.2, 1.5]
    data = pulley(
        mechanism={"cord_radius": 0.0508, "inertia": 3.97, "load": 3618.3},
        drive__force={"time": times, "value": [429.0, 881.5, 2336.0, 0.3, 5253.0, 0.0]},
        effects={"shaft_friction": {"shaft_radius": 0.0257, "mu_s": 1.0, "mu_k": 0.9}},
        solver={"duration": 2.0},
    )
    events, rkf45 = simulate(data), simulate(changed(data, solver__backend="rkf45"))
    assert [(e.mode_from, e.mode_to) for e in events.transitions] == [(0, -1), (-1, 0), (0, -1)]
    for one, other in zip(events.transitions, rkf45.transitions, strict=True):
        assert (one.mode_from, one.mode_to) == (other.mode_from, other.mode_to)
        assert one.time == pytest.approx(
            other.time, abs=1e-6
        )  # a stop is late by rkf45's tolerance
    assert close(rkf45.quantities["final_angle"].value, events.quantities["final_angle"].value)


points = st.lists(st.floats(0.0, 6000.0), min_size=2, max_size=6)


def with_points(data: Scenario, times: list[float], values: list[float], **solver: Any) -> Scenario:
    return changed(
        data,
        drive__force={"time": times, "value": values},
        **{f"solver__{key}": value for key, value in solver.items()},
    )


def end_of(run: Record) -> dict[str, float]:
    """Return the initial state of a run that continues from the end of another."""
    return {
        "initial_angle_deg": float(np.rad2deg(run.channels["angle"][-1])),
        "initial_angular_velocity": float(run.channels["angular_velocity"][-1]),
    }


@given(scenarios(), points, st.floats(0.1, 1.9))
def test_a_restarted_run_ends_the_same(data: Scenario, values: list[float], split: float) -> None:
    times = [0.3 * i for i in range(len(values))]
    whole = simulate(with_points(data, times, values))
    first = simulate(with_points(data, times, values, duration=split))
    rest = with_points(data, [t - split for t in times], values, duration=2.0 - split)
    state = {f"mechanism__{key}": value for key, value in end_of(first).items()}
    assert close(
        simulate(changed(rest, **state)).channels["angle"][-1], whole.channels["angle"][-1]
    )


@given(scenarios(), st.floats(100.0, 3000.0), st.floats(0.0, 1.0), st.floats(0.1, 10.0))
def test_breakaway_depends_on_static_friction_alone(
    data: Scenario, rate: float, share: float, inertia: float
) -> None:
    load = data["mechanism"]["load"]
    data = with_points(data, [0.0, 2.0], [load, load + 2.0 * rate])
    mu_k = data["effects"]["shaft_friction"]["mu_s"] * share
    other = changed(
        data,
        mechanism__inertia=inertia,
        effects__shaft_friction__mu_k=mu_k,
        effects__viscous_damping=None,
    )
    rkf45 = changed(data, solver__backend="rkf45")
    first = [
        next((e.time for e in simulate(scenario).transitions), None)
        for scenario in (data, other, rkf45)
    ]
    assert first[1] == first[0]
    assert first[2] == pytest.approx(first[0], abs=1e-12)  # another piece to look for it in


@given(scenarios(), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_more_kinetic_friction_never_lifts_higher(
    data: Scenario, share_a: float, share_b: float
) -> None:
    load = data["mechanism"]["load"]
    # From balance upwards and to rest again: lifting only.
    data = with_points(data, [0.0, 0.5, 1.0, 1.5], [load, 3.0 * load, 3.0 * load, load])
    mu_s = data["effects"]["shaft_friction"]["mu_s"]
    angles = [
        simulate(changed(data, effects__shaft_friction__mu_k=mu_s * share)).channels["angle"][-1]
        for share in sorted((share_a, share_b))
    ]
    assert angles[1] <= angles[0] + 1e-6 * abs(angles[0])  # as close() allows


@given(scenarios(st.floats(0.0, 6000.0)))
def test_without_losses_energy_is_kept_and_motion_reverses(data: Scenario) -> None:
    bare = data | {"effects": {}}
    run = simulate(bare)
    energy = run.channels["energy_kinetic"] + run.channels["energy_potential"]
    # A constant force has the potential -P r_e theta: what it puts in is what is stored.
    assert close(energy, run.channels["energy_input"], 1e-8)  # rtol 1e-9 of some ten steps
    end = end_of(run)
    end["initial_angular_velocity"] *= -1.0
    back = bare | {"mechanism": data["mechanism"] | end}
    turned = simulate(back).channels["angle"][-1]
    assert close(turned, 0.0, 1e-6 * (1 + abs(run.channels["angle"][-1])))


@examples(10)
@given(scenarios())
def test_terminal_velocity_balances_the_drag(data: Scenario) -> None:
    geometry, friction = data["mechanism"], data["effects"]["shaft_friction"]
    force, drag = 3.0 * geometry["load"], geometry["inertia"]  # a time constant of one second
    data = changed(
        data,
        drive={"force": force, "direction": "vertical"},
        effects={"shaft_friction": friction, "viscous_damping": {"coefficient": drag}},
        solver={"duration": 30.0},
    )
    run = simulate(data)
    if not run.transitions:
        return  # this shaft holds thrice the load
    torque = (force - geometry["load"]) * geometry["cord_radius"]
    radius = friction_radius(friction["shaft_radius"], friction["mu_k"])
    torque -= radius * (force + geometry["load"])
    # exp(-30) of it is missing, and rtol 1e-9
    assert drag * run.channels["angular_velocity"][-1] == pytest.approx(torque, rel=1e-8)
