"""A drawing agrees with the events and sticking phases of its run, whatever its samples are."""

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import pytest
from matplotlib.patches import Rectangle

import frictionsim as fs
from frictionsim.results import Record
from tests.support.motions import (
    Body,
    Motion,
    body,
    is_visible,
    moment_of,
    motion,
    place_of,
    record_of,
    shown_value,
)
from tests.support.records import draw
from tests.support.scenarios import shipped

RUNS: Mapping[str, tuple[str, dict[str, Any]]] = {
    "sticks, slips, sticks": ("pulley_return", {}),
    "starts at once": ("marble_machine", {}),
    "falls back": (
        "marble_machine",
        {
            "mechanism__initial_angle_deg": 20.0,
            "mechanism__initial_angular_velocity": 6.0,
            "drive": {"torque": -0.004},
            "effects__motor_inertia": None,
            "solver__duration": 0.55,
        },
    ),
    "starts with stick": ("epicyclic", {}),
    "creeps to rest": (
        "pulley_return",
        {"solver__backend": "rkf45", "effects__shaft_friction__law": "regularised"},
    ),
}
MAIN = {"pulley": "pulley", "marble_machine": "gear", "epicyclic": "crank"}


@cache
def solved(name: str, interval: float, at_events: int) -> Record:
    kind, changes = RUNS[name]
    data = shipped(kind, solver__rtol=1e-6, **{k: v for k, v in changes.items() if "__" in k})
    data |= {k: v for k, v in changes.items() if "__" not in k}
    data["output"] = {"interval": interval, "at_events": bool(at_events)}
    return fs.solve(data).record


def shaded_in(record: Record) -> list[tuple[float, float]]:
    """Return start and end of the areas that a picture shades for sticking."""
    areas = [patch for patch in draw(record).axes[0].patches if isinstance(patch, Rectangle)]
    return [(area.get_x(), area.get_x() + area.get_width()) for area in areas]


# Samples at events or not, each with an interval that hits nothing.
DRAWN = [
    (name, float(np.round(interval, 3)), at_events)
    for number, name in enumerate(RUNS)
    for at_events, interval in enumerate(np.random.default_rng(number).uniform(0.02, 0.4, 2))
]


def state_of(animation: Motion, time: float) -> int:
    return int(animation.state[moment_of(animation.time, time).frame])


def number_at(animation: Motion, name: str, time: float) -> float:
    readout = next(r for r in animation.readouts if r.name == name)
    return shown_value(readout, moment_of(animation.time, time))


@pytest.mark.parametrize(("name", "interval", "at_events"), DRAWN)
def test_both_sides_of_each_event_are_drawn_and_a_contact_sticks_where_charts_are_shaded(
    name: str, interval: float, at_events: int
) -> None:
    record = solved(name, interval, at_events)
    animation, events = motion(record), record.events
    assert np.all(np.diff(animation.time) > 0.0)
    angle = body(animation, MAIN[record.attributes["kind"]]).angle
    for i, event in enumerate(record.transitions):
        before = float(np.nextafter(event.time, -1.0))
        assert angle[moment_of(animation.time, event.time).frame] == event.position
        for side, time, mode in (
            ("before", before, event.mode_from),
            ("after", event.time, event.mode_to),
        ):
            if time < 0.0:
                continue
            assert state_of(animation, time) == mode
            for readout in animation.readouts:
                if readout.channel and readout.channel != "angle":
                    recorded = events[f"{readout.channel}_{side}"][i]
                    assert number_at(animation, readout.name, time) == pytest.approx(recorded)
    phases = shaded_in(record)
    times = np.random.default_rng(1).uniform(0.0, animation.time[-1], 100)
    near = [e.time + sign * 1e-9 for e in record.transitions for sign in (-1.0, 1.0)]
    for time in (*times.tolist(), *(t for t in near if 0.0 < t < animation.time[-1])):
        if any(abs(time - edge) < 1e-12 for phase in phases for edge in phase):
            continue  # the width of an area is a difference of rounded times
        shaded = any(start <= time < stop for start, stop in phases)
        assert (state_of(animation, time) == 0) == shaded, time


@pytest.mark.parametrize("name", ["starts at once", "falls back"])
@pytest.mark.parametrize(("interval", "at_events"), [(0.013, 1), (0.07, 0), (0.3, 1), (0.3, 0)])
def test_a_marble_changes_hands_at_its_transfer(name: str, interval: float, at_events: int) -> None:
    record = solved(name, interval, at_events)
    animation = motion(record)
    carried = [p for p in animation.parts if isinstance(p, Body) and p.carrier is not None]
    transfers = [e for e in record.transitions if e.contact == "transfer"]
    assert len(transfers) > 6
    delivered = 0
    for event in transfers:
        for time in (float(np.nextafter(event.time, -1.0)), event.time):
            delivered += event.mode_to * (time == event.time)
            assert number_at(animation, "marbles delivered", time) == delivered
            moment = moment_of(animation.time, time)
            seen = [place_of(p, moment)[:2] for p in carried if is_visible(p, moment)]
            assert len(seen) == 5
            # All are on the rising half, between the bottom and the top.
            assert min(x for x, _ in seen) > -1e-9
        # The one at the bottom has come or gone.
        lowest = min(y for _, y in seen)
        assert (lowest == pytest.approx(-0.0573425)) == (event.mode_to > 0)


def synthetic(times: Any, modes: Any, changes: Any, contacts: Any = (), **more: Any) -> Record:
    """Return a record with a uniform motion; changes are (time, mode before, mode after)."""
    time = np.asarray(times, dtype=float)
    channels = {"time": time, "angle": 3.0 * time, "mode": np.asarray(modes, dtype=np.int8)}
    table = np.asarray(changes, dtype=float).reshape(-1, 3)
    record = record_of("marble_machine", channels, events=table[:, 0])
    numbers = np.asarray(contacts or [0] * len(table), dtype=int)
    record.events.update(
        contact=numbers, mode_from=table[:, 1].astype(int), mode_to=table[:, 2].astype(int), **more
    )
    return record._replace(contacts=["shaft", "transfer"])


@pytest.mark.parametrize(
    ("changes", "states"),
    [
        ([], {0.0: 1, 0.9: 1, 1.0: 1, 2.0: 1}),
        ([(0.0, 0, 1)], {0.0: 1, 0.5: 1}),
        ([(1.6, 1, 0), (2.0, 0, 1)], {1.5: 1, 1.6: 0, 1.99: 0, 2.0: 1}),
        ([(1.5, 1, 0), (1.5, 0, -1)], {1.49: 1, 1.5: -1, 1.9: -1}),
        ([(1.2, 1, 0), (1.4, 0, 1)], {1.1: 1, 1.2: 0, 1.39: 0, 1.4: 1, 1.9: 1}),
        ([(2.5, 1, 0)], {1.99: 1, 2.0: 1}),  # after the last sample of a run that was stopped
    ],
)
def test_the_state_is_that_after_the_last_event(changes: Any, states: dict[float, int]) -> None:
    animation = motion(synthetic([0.0, 1.0, 2.0], [1, 1, 1], changes))
    assert animation.time[[0, -1]].tolist() == [0.0, 2.0]
    assert {time: state_of(animation, time) for time in states} == states


def test_neither_a_transfer_in_creep_nor_rest_after_the_last_sample_changes_the_shading() -> None:
    record = synthetic(
        [0.0, 1.0, 2.0], [0, 0, 0], [(0.7, 1, 1)], [1], angle=np.array([0.2 * np.pi])
    )
    assert set(np.asarray(motion(record).state).tolist()) == {0}
    assert shaded_in(record) == [(0.0, 2.0)]
    record = synthetic([0.0, 1.0, 2.0], [1, 1, 1], [(2.5, 1, 0)])
    assert shaded_in(record) == []


def test_of_many_events_changes_of_mode_are_frames_and_all_frames_are_right() -> None:
    """At most 300 events have frames of their own: here the last 300 of 336."""
    rng = np.random.default_rng(3)
    times = np.sort(rng.uniform(0.0, 10.0, 336))
    changes = [(t, 1, 1) for t in times[:36]] + [
        (t, i % 2, 1 - i % 2) for i, t in enumerate(times[36:], start=1)
    ]
    record = synthetic(
        np.linspace(0.0, 10.0, 11),
        np.ones(11),
        changes,
        [1] * 36 + [0] * 300,
        angle=0.2 * np.pi * np.arange(1.0, 337.0),
    )
    record.channels["angle"] = np.pi * 0.2 * np.searchsorted(times[:36], record.channels["time"])
    animation = motion(record)
    assert len(animation.time) == 11 + 2 * 300
    for time, _, mode in changes[36:]:
        assert state_of(animation, time) == mode
    for time in animation.time:
        transfers = int(np.searchsorted(times[:36], time, side="right"))
        assert number_at(animation, "marbles delivered", time) == transfers
