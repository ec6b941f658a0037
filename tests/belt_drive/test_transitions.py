"""Transitions of belts against an independent reader of the channels, and against the capstan."""

from itertools import groupby
from math import asin, exp, pi, tanh
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.results import BACKWARD, FORWARD, OPEN, SLACK, STICK, TAUT, Record
from tests.support.belt_scenarios import NO_MOTION_ACROSS, mirrored, pair, swinging, trio
from tests.support.cases import slow
from tests.support.scenarios import Scenario, simulate
from tests.support.second_way_belt import walked
from tests.support.second_way_transitions import Events, ahead, events, read, read_pulley
from tests.support.stopped_runs import interrupted_at

INTERVAL = 5e-4
RUN = {
    "solver__backend": "moreau",
    "solver__duration": 0.1,
    "output__interval": INTERVAL,
    "mechanism__belt__bodies": 36,
}
OF_THREE = RUN | {"mechanism__belt__bodies": 48}


def told(data: Scenario) -> tuple[Record, Events]:
    """Return a run with its transitions, which must be those of the reader."""
    done = simulate(data)
    assert done.status == "done"
    assert events(done) == read(done)
    return done, events(done)


# --- full slip ------------------------------------------------------------------------------------


def limit(radius: float, mu: float, wrap: float, pretension: float = 200.0) -> float:
    """Return the torque at which a string slips, N m: T1 = T2 exp(mu a), T1 + T2 = 2 T0."""
    return 2.0 * pretension * radius * tanh(0.5 * mu * wrap)


def overloaded(seed: int) -> tuple[Scenario, float, int]:
    """Draw a driven pulley under a torque that rises beyond the limit of its friction.

    Return the scenario, the limit of the driven pulley, N m, and the direction of the slip.
    """
    rng = np.random.default_rng(seed)
    mu, radius, sense = rng.uniform(0.15, 0.3), rng.uniform(0.05, 0.09), rng.choice([-1, 1])
    most = limit(radius, mu, pi - 2.0 * asin((0.08 - radius) / 0.25))
    load = {"time": [0.0, 0.02, 0.09], "value": [0.0, 0.0, -1.5 * sense * most]}
    own = {"mu_s": mu * rng.choice([1.0, 1.1]), "mu_k": mu}
    data = pair(
        **RUN,
        drive__driver={"speed": {"time": [0.0, 0.02], "value": [0.0, 10.0 * sense]}},
        drive__driven={"torque": load},
        effects__belt_friction={"mu_s": 0.8, "mu_k": 0.8, "pulleys": {"driven": own}},
    )
    data["mechanism"]["pulleys"][1]["radius"] = radius
    if seed % 3 == 0:
        data["effects"]["belt_friction"] |= {"law": "regularised", "transition_speed": 0.05}
        data["solver"] |= {"backend": "rkf45"}
    return data, most, int(sense)


@pytest.mark.parametrize(  # 0 and 3 are regularised, and have kernels of their own
    ("seed", "mirror"), [(1, True), (4, False), slow(0, False), slow(3, True), slow(5, True)]
)
def test_a_driven_pulley_slips_at_the_limit_of_the_capstan(seed: int, mirror: bool) -> None:
    """The driven pulley falls behind the belt: in the direction of the drive the belt is ahead."""
    data, most, sense = overloaded(seed)
    done, transitions = told(mirrored(data) if mirror else data)
    slips = [event for event in transitions if event[1] == "driven"]
    assert slips[0][2:] == (STICK, -sense if mirror else sense)
    torque = 1.5 * most * (slips[0][0] - 0.02) / 0.07
    begins = int(np.searchsorted(done.time, slips[0][0] - 0.1 * INTERVAL))
    assert set(np.sign(ahead(done, 1)[begins + 1 : begins + 10])) == {float(slips[0][3])}
    # The polygon of 36 bodies, inertia, and mu_s up to a tenth above mu_k.
    assert 0.85 * most < torque < 1.25 * most
    assert not [event for event in transitions if event[1] == "driver"]


@pytest.mark.parametrize(("sense", "direction"), [(-1, FORWARD), (1, BACKWARD)])
def test_transitions_of_three_pulleys_are_those_of_the_channels(sense: int, direction: int) -> None:
    """The driver runs ahead of the belt; the reader knows no patch."""
    torque = {"time": [0.0, 0.06], "value": [0.0, sense * 80.0]}
    roller = {"torque": {"speed": [-50.0, 50.0], "value": [2.0, -2.0]}}
    data = trio(**OF_THREE, drive__driver={"torque": torque}, drive__roller=roller)
    data["effects"].pop("patch")
    _, transitions = told(data)
    assert (STICK, direction) in [event[2:] for event in transitions if event[1] == "driver"]


def pulse(most: float) -> Scenario:
    """Return a drive whose driven pulley is loaded from 0.02 to 0.07 s."""
    load = {"time": [0.0, 0.02, 0.03, 0.06, 0.07], "value": [0.0, 0.0, -most, -most, 0.0]}
    own = {"driven": {"mu_s": 0.2, "mu_k": 0.2}}
    return pair(
        **RUN | {"solver__duration": 0.16},
        drive__driver={"speed": {"time": [0.0, 0.02], "value": [0.0, 10.0]}},
        drive__driven={"torque": load},
        effects__belt_friction={"mu_s": 0.6, "mu_k": 0.6, "pulleys": own},
    )


@pytest.mark.parametrize("over", [1.25, 3.0])
def test_a_pulley_grips_again_when_its_load_is_gone(over: float) -> None:
    done, transitions = told(pulse(over * limit(0.08, 0.2, pi)))
    assert [event[1:] for event in transitions] == [
        ("driven", STICK, FORWARD),
        ("driven", FORWARD, STICK),
    ]
    slips, grips = (event[0] for event in transitions)
    # The pulley swings on the belt with a period of 12 ms.
    assert 0.0 <= slips - (0.02 + 0.01 / over) < 3e-3
    # While it slips, T1/T2 is that of the capstan: the load below it brings the rim up again.
    assert grips > 0.06
    lasts = (done.time > slips + 0.01) & (done.time < 0.06)
    c = done.channels
    rows = zip(c["tension"][lasts], c["pulley_index"][lasts], strict=True)
    slack, tight = np.mean([walked(*each, 2) for each in rows], axis=0)[[1, 0]]
    assert max(slack, tight) / min(slack, tight) == pytest.approx(exp(0.2 * pi), rel=0.1)
    over_rim = ahead(done, 1)
    begins = int(np.searchsorted(done.time, grips - 0.1 * INTERVAL))
    assert np.all(np.abs(over_rim[begins + 1 : begins + 20]) < 0.02 * np.max(over_rim))


def test_friction_that_vanishes_in_slip_still_has_a_direction() -> None:
    data, _, sense = overloaded(1)
    data["effects"]["belt_friction"]["pulleys"]["driven"]["mu_k"] = 0.0
    changes = [event for event in events(simulate(data)) if event[1] == "driven"]
    assert changes[0][2:] == (STICK, sense)


# --- what is no full slip -------------------------------------------------------------------------

NO_SLIP = {
    "without a load": pair(**RUN, drive__driver__torque=0.0),
    "that grips": pair(**RUN, drive__driver__torque={"time": [0.0, 0.02], "value": [0.0, -5.0]}),
    "without friction": trio(
        **OF_THREE, effects__belt_friction={"mu_s": 0.0, "mu_k": 0.0}, effects__patch=None
    ),
}


@pytest.mark.parametrize("name", NO_SLIP)
def test_a_belt_that_does_not_slip_has_no_transitions(name: str) -> None:
    assert events(simulate(NO_SLIP[name])) == []


def test_a_roller_that_carries_nothing_has_no_slip() -> None:
    """It slides as a whole with next to no friction, while the belt runs over it."""
    data = trio(**OF_THREE, drive__roller=None)
    data["effects"]["belt_friction"]["pulleys"] = {"roller": {"mu_s": 0.01, "mu_k": 0.01}}
    done = simulate(data)
    assert "roller" not in {event[1] for event in events(done)}
    assert not any("slips on 'roller'" in warning for warning in done.warnings)
    # The same with a drive, even one without torque: now it may be told of.
    data["drive"]["roller"] = {"torque": 0.0}
    assert "roller" in {event[1] for event in events(simulate(data))}


# --- lift-off and slack spans ---------------------------------------------------------------------

# Forces are those of the middle of a step: half a step, 5 us, at 0.2 m/s, the most that a gap of
# this roller changes with.
SINCE_FORCES = 1e-6  # m


def test_a_roller_lifts_off_and_is_touched_again() -> None:
    done, transitions = told(swinging())
    changes = [event for event in transitions if event[1] == "roller"]
    assert len(changes) >= 2
    c = done.channels
    gap = np.min(np.hypot(c["x"] - 0.2, c["y"] + 0.128), axis=1) - 0.06
    for number, (time, _, *modes) in enumerate(changes):
        assert modes == ([OPEN, STICK] if number % 2 else [STICK, OPEN])
        at = int(np.searchsorted(done.time, time - 0.1 * INTERVAL))
        is_off = gap[at - 1 : at + 3] >= -SINCE_FORCES
        if modes[1] == OPEN:
            assert is_off[1:].all()
            assert gap[at - 1] < SINCE_FORCES
        else:
            assert is_off[0]
            assert not is_off[1:].all()


@pytest.mark.parametrize(("torque", "slack"), [(4.0, False), (30.0, True)])
def test_a_span_goes_slack(torque: float, slack: bool) -> None:
    """Two spans of 40 N each hold a difference of 80 N: 6.4 N m on 80 mm, at 4.3 ms."""
    data = pair(
        **RUN | {"solver__duration": 0.03, "output__interval": 2e-4},
        mechanism__belt__pretension=40.0,
        drive__driver={"speed": 0.0},
        drive__driven={"torque": {"time": [0.0, 0.02], "value": [0.0, -torque]}},
        effects__belt_friction={"mu_s": 5.0, "mu_k": 5.0},
    )
    done, transitions = told(data)
    spans = [event for event in transitions if event[1].startswith("span.")]
    warnings = [text for text in done.warnings if "goes slack" in text]
    assert ["from 'driver' to 'driven'" in text for text in warnings] == [True] * slack
    assert bool(spans) is slack
    if slack:
        time, *first = spans[0]
        assert first == ["span.driver.driven", TAUT, SLACK]
        assert 0.02 * 6.4 / torque < time < 0.012


# --- which changes are transitions ----------------------------------------------------------------


# Half a period has so many samples; a slip ends when ten agree.
@pytest.mark.parametrize(("samples", "mean", "most"), [(4.7, 0.0, 1), (12.3, 3.0, 40)])
def test_a_change_that_lasts_is_a_transition(samples: float, mean: float, most: int) -> None:
    """Of a belt that slides to and fro on a pulley that is held, about once an interval."""
    own: Any = {"driven": {"mu_s": 0.05, "mu_k": 0.05}}
    sine = {"mean": mean, "amplitude": 6.0, "frequency_hz": 200.0}
    data = pair(
        **NO_MOTION_ACROSS,
        drive={"driver": {"speed": {"sine": sine}}, "driven": {"speed": 0.0}},
        effects__belt_friction={"mu_s": 0.8, "mu_k": 0.8, "pulleys": own},
        solver={"backend": "moreau", "duration": 0.08},
        output={"interval": 2.5e-3 / samples},
    )
    done = simulate(data)
    changes = [event for event in events(done) if event[1] == "driven"]
    assert changes == [event for event in read(done) if event[1] == "driven"]
    assert 1 <= len(changes) <= most
    assert len(list(groupby(read_pulley(done, 1)))) > 30


# --- what they do not depend on -------------------------------------------------------------------


def test_transitions_do_not_depend_on_the_recorded_channels() -> None:
    data = pulse(16.0)
    whole = events(simulate(data))
    data["output"]["channels"] = ["pulley_speed"]
    assert events(simulate(data)) == whole != []


def test_an_interrupted_run_has_its_own_transitions_and_resumed_those_of_all() -> None:
    """Of two samples after a change it is not known yet whether it lasts."""
    data = pulse(16.0)
    whole = events(simulate(data))
    part = fs.solve(data, progress=interrupted_at(0.029))
    assert events(part.record) == read(part.record)
    assert all(event in whole for event in events(part.record))
    assert events(fs.resume(part).record) == whole
    assert len(whole) == 2
