"""Runs whose samples were changed behind their back, for what an audit must find."""

from collections.abc import Callable
from typing import Any

import frictionsim as fs
from tests.support.stopped_runs import interrupted_at


def falsified(data: Any, time: float, **changes: Callable[[Any], Any]) -> fs.Result:
    """Return the run of a scenario whose samples up to a time, s, are not those it was solved for.

    It is interrupted, what it would go on from is changed, and it is resumed: its audit judges all
    samples. `changes` are functions of the samples of a name, (n, ...), at the times up to then.
    """
    part = fs.solve(data, progress=interrupted_at(time))
    assert part.status == "interrupted"
    state = dict(part.record.checkpoint or {})
    for name, change in changes.items():
        (key,) = (key for key in state if key.rpartition(".")[2] == name)
        state[key] = change(state[key].copy())
    return fs.resume(fs.Result(part.record._replace(checkpoint=state)))
