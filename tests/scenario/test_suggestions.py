"""The key that is meant is suggested, also for a start of it."""

import pytest

import frictionsim as fs
from tests.support.scenarios import pulley

FREQUENCY = {"mean": 0.0, "amplitude": 1.0, "frequency_hz": 2.0}


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("freq", "frequency_hz"),
        ("ampl", "amplitude"),
        ("phase", "phase_deg"),
        ("frequency", "frequency_hz"),
    ],
)
def test_a_start_of_a_key_is_enough(given: str, meant: str) -> None:
    sine = {name: value for name, value in FREQUENCY.items() if name != meant}
    with pytest.raises(
        fs.ScenarioError, match=rf"unknown key '{given}' \(did you mean '{meant}'\?\)"
    ):
        fs.load(pulley(drive={"force": {"sine": {**sine, given: 1.0}}}))


def test_a_start_of_several_keys_suggests_none() -> None:
    with pytest.raises(fs.ScenarioError) as refused:
        fs.load(pulley(output={"at_": 1.0, "int": 0.1}))
    texts = " ".join(refused.value.faults)
    assert "did you mean 'interval'" in texts
