"""Channels of the mechanisms of one coordinate: which of them are integers, and what these mean."""

from typing import Any

import numpy as np
import pytest

from frictionsim.mechanisms import epicyclic, marble_machine, pulley
from frictionsim.scenario.loading import load
from frictionsim.simulation.simulate import run
from tests.support.scenarios import SCENARIOS

pytestmark = pytest.mark.quick


COUNTS = {"carried_marbles"}


@pytest.mark.parametrize(
    ("kind", "integers"),
    [
        (pulley, {"mode", "cord_mode", "slack"}),
        (marble_machine, {"mode", "carried_marbles"}),
        (epicyclic, {"mode"}),
    ],
    ids=lambda value: getattr(value, "__name__", "").rpartition(".")[2],
)
def test_modes_and_counts_are_integers(kind: Any, integers: set[str]) -> None:
    info = kind.CHANNELS
    assert {name for name, channel in info.items() if channel.integer} == integers
    assert info["mode"].flags == ((-1, "sliding_backward"), (0, "stick"), (1, "sliding_forward"))
    assert {name for name, channel in info.items() if channel.flags} == integers - COUNTS


def test_recorded_integers_are_whole_numbers_with_a_meaning() -> None:
    done = run(load(SCENARIOS / "marble_machine.toml", []), lambda t: None)
    for name, values in done.channels.items():
        channel = done.channel_info[name]
        if channel.integer:
            assert np.array_equal(values, np.round(values)), name
        if channel.flags:
            assert set(values) <= {float(value) for value, _ in channel.flags}, name
