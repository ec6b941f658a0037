"""The samples of runs in lockstep, against those of each run alone."""

import random
from array import array

import numpy as np
import pytest

from frictionsim.results import Transition
from frictionsim.simulation.lockstep_samples import with_events
from frictionsim.simulation.single_dof import samples_of
from frictionsim.solvers.common import SampleBuffer, SampleTimes

pytestmark = pytest.mark.quick

WIDTH, RUNS = 8, 200


def test_events_replace_and_join_the_regular_samples_as_in_a_run_alone() -> None:
    """Runs with up to four events, several at one time or at the start or end of the run."""
    rng = random.Random(1)
    expected, starts, ends, events, who = [], [], [], [], []
    for run in range(RUNS):
        buffer = SampleBuffer(SampleTimes(1.0, 1.0))
        start, end = ([t, *(rng.random() for _ in range(WIDTH - 1))] for t in (0.0, 1.0))
        buffer.rows = array("d", start + end)
        for t in sorted(rng.choice([0.0, 0.3, 0.3, 0.7, 1.0]) for _ in range(rng.randrange(5))):
            before, after = ([t, *(rng.random() for _ in range(WIDTH - 1))] for _ in range(2))
            before[6], after[6] = rng.choice([-1.0, 0.0, 1.0]), rng.choice([-1.0, 0.0, 1.0])
            before[3] = rng.choice([before[3], after[3]])
            transition = Transition(t, "shaft", int(before[6]), int(after[6]), 0.0)
            buffer.record_event(transition, tuple(before), tuple(after))
            events.append((before, after, before[6]))
            who.append(run)
        starts.append(start)
        ends.append(end)
        expected.append(samples_of(buffer, WIDTH, at_events=True).rows.tolist())
    sides = tuple(np.array([event[side] for event in events]).T for side in (0, 1, 2))
    rows, run = with_events(np.array(starts).T, np.array(ends).T, sides, np.array(who))
    assert [rows[:, run == i].T.tolist() for i in range(RUNS)] == expected
