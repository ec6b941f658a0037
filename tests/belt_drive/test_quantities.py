"""Every quantity of a belt's summary against an independent reader."""

import tomllib

import pytest

import frictionsim as fs
from tests.support.belt_scenarios import mirrored, pair, trio
from tests.support.scenarios import Scenario
from tests.support.second_way import Recorded
from tests.support.second_way_belt import belt_drive

FORWARD = {"torque": {"time": [0.0, 0.01], "value": [0.0, 4.0]}}
CASES: dict[str, Scenario] = {
    "a pair": pair(),
    "overloaded": pair(solver__backend="moreau", drive__driver__torque=-30.0),
    "the other way": pair(solver__backend="moreau", drive__driver__torque=5.0),
    "three, a patch": trio(solver__backend="moreau", drive__driver=FORWARD),
    "in a mirror": mirrored(trio(solver__backend="moreau", drive__driver=FORWARD)),
    "adaptive, a free roller": trio(drive__roller=None, drive__driver={"torque": 6.0}),
}


@pytest.mark.parametrize("name", CASES)
def test_quantities_are_those_of_a_second_way(name: str) -> None:
    scenario = fs.load(CASES[name], {"output.interval": 2e-4})
    done = fs.solve(scenario).record
    assert done.status == "done", done.reason
    record = Recorded(tomllib.loads(scenario.to_toml()), done.time, dict(done.channels), [])
    seen = belt_drive(record)
    assert done.quantities.keys() == seen.keys()
    values = {name: quantity.value for name, quantity in done.quantities.items()}
    assert {n: (v, seen[n]) for n, v in values.items() if not seen[n].agrees(v)} == {}


def test_what_may_be_off_by_more_than_half_of_the_force_is_not_judged() -> None:
    """Of the chattering start of the published belt six samples tell nothing about a balance."""
    audit = fs.solve("belt_drive_published", {"solver.duration": 0.005}).audit
    assert "energy_balance" in audit
    assert "torque_balance" not in audit
