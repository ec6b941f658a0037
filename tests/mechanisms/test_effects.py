"""Effects and channels of one coordinate: absent ones, and integers."""

import numpy as np
import pytest

import frictionsim as fs
from tests.support.problems import CORD_RADIUS, INERTIA, LOAD
from tests.support.scenarios import (
    changed,
    pulley,
    shipped,
    simulate,
    with_method,
)

BARE = {
    "angle",
    "angular_velocity",
    "angular_acceleration",
    "drive_force",
    "shaft_reaction",
    "energy_input",
    "energy_kinetic",
    "energy_potential",
}
OF_EFFECT = {
    "shaft_friction": {"friction_torque", "mode", "energy_friction", "lever_arm", "case"},
    "viscous_damping": {"energy_damping"},
}
AUDITS = {
    "shaft_friction": {"friction_law", "dissipation_sign", "stick_drift"},
    "viscous_damping": set(),
}


@pytest.mark.parametrize(
    ("named", "law", "backend"),
    [
        ((), "set-valued", "events"),
        (("viscous_damping",), "set-valued", "rkf45"),
        (("shaft_friction",), "published", "rkf45"),
        (tuple(OF_EFFECT), "set-valued", "events"),
    ],
)
def test_only_named_effects_leave_a_trace(named: tuple[str, ...], law: str, backend: str) -> None:
    left_out = {f"effects__{name}": None for name in OF_EFFECT if name not in named}
    run = simulate(with_method(pulley(**left_out), law, backend))
    assert run.status == "done"
    assert set(run.attributes["effects"].split()) == set(named)
    # Angle, velocity, the work of the force, and one dissipated energy for each effect.
    assert run.statistics.states == 3 + len(named)
    of_law = {"switch"} if law == "published" and "shaft_friction" in named else set()
    assert set(run.channels) - {"time"} == BARE.union(of_law, *(OF_EFFECT[n] for n in named))
    located = {"release"} if backend == "events" and "shaft_friction" in named else set()
    assert set(run.checks) == {"energy_balance"}.union(located, *(AUDITS[name] for name in named))


@pytest.mark.parametrize("force", [3000.0, 1000.0])
def test_absent_effects_have_no_terms(force: float) -> None:
    """Nothing but the force and the load turns the pulley, at any angle and speed."""
    run = simulate(pulley(effects=None, drive__force=force))
    assert run.transitions == []
    moment = (force - LOAD) * CORD_RADIUS
    acceleration = run.channels["angular_acceleration"]
    assert acceleration == pytest.approx(moment / INERTIA, rel=1e-14)  # a few roundings
    assert run.channels["angle"] == pytest.approx(
        0.5 * moment / INERTIA * run.time**2, rel=1e-11
    )  # some hundred steps


def test_absent_effects_are_bit_identical_to_effects_of_zero_strength() -> None:
    absent = simulate(pulley(effects__viscous_damping=None))
    zero = simulate(pulley(effects__viscous_damping={"coefficient": 0.0}))
    assert np.array_equal(absent.time, zero.time)
    assert zero.channels.keys() - absent.channels.keys() == {"energy_damping"}
    for name, channel in absent.channels.items():
        assert np.array_equal(channel, zero.channels[name]), name


def test_samples_are_at_multiples_of_the_interval_and_at_the_end() -> None:
    for duration, interval, expected in (
        (1.0, 0.25, [0.0, 0.25, 0.5, 0.75, 1.0]),
        (1.0, 0.4, [0.0, 0.4, 0.8, 1.0]),
        (0.3, 0.1, [0.0, 0.1, 0.2, 0.3]),  # 3 * 0.1 is more than 0.3
        (1.0, 5.0, [0.0, 1.0]),
    ):
        run = simulate(
            pulley(solver__duration=duration, output__interval=interval, output__at_events=False)
        )
        assert run.time.tolist() == expected


@pytest.mark.parametrize("name", ["marble_machine", "lift"])
def test_integers_are_the_whole_numbers_and_have_a_meaning(name: str) -> None:
    data = shipped(name)
    channels = fs.Result(simulate(data)).dataset
    whole = {n for n in channels if np.array_equal(channels[n], np.round(channels[n]))}
    integers = {n for n in channels if channels[n].dtype.kind in "iu"}
    assert {n for n in whole if np.ptp(channels[n].values) > 0.0} <= integers <= whole
    for channel in integers - {"carried_marbles"}:
        attributes, values = channels[channel].attrs, set(channels[channel].values.tolist())
        assert values <= set(np.asarray(attributes["flag_values"]).tolist()), channel
        meanings = attributes["flag_meanings"].split()
        assert len(meanings) == len(attributes["flag_values"]), channel


def test_a_couple_that_turns_a_shaft_beyond_all_numbers_ends_the_run_by_name() -> None:
    couple = {"name": "motor", "size": {"time": [0.0, 4.5, 5.0], "value": [0.0, 0.0, 1e49]}}
    data = changed(shipped("hoist_drum"), couples=[couple], solver__rtol=1e-10)
    run = simulate(with_method(data, "set-valued", "rkf45"))
    assert (run.status, run.failure) == ("failed", "non_finite")
