"""Units and descriptions of keys that are varied or fitted."""

import pytest

from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario
from frictionsim.mechanisms.shaft.schema import ShaftScenario
from frictionsim.scenario.model_fields import description_of, unit_of_key
from frictionsim.scenario.settings import Scenario


@pytest.mark.parametrize(
    ("model", "key", "unit"),
    [
        (ShaftScenario, "mechanism.inertia", "kg m^2"),
        (ShaftScenario, "forces.0.size", "N"),
        (ShaftScenario, "forces.load.size", "N"),
        (ShaftScenario, "forces.size.size", "N"),  # of an entry with that name
        (ShaftScenario, "forces.load.cord_radius", "m"),
        (ShaftScenario, "forces.load.point.1", "m"),
        (ShaftScenario, "couples.motor.size", "N m"),
        (ShaftScenario, "forces.load.size.sine.frequency_hz", "Hz"),
        (ShaftScenario, "effects.shaft_friction.mu_s", "1"),
        (BeltDriveScenario, "mechanism.pulleys.1.radius", "m"),
        (BeltDriveScenario, "effects.belt_friction.pulleys.motor.mu_k", "1"),
        (BeltDriveScenario, "effects.unknown.key", ""),
    ],
)
def test_entries_of_lists_have_the_unit_of_their_key(
    model: type[Scenario], key: str, unit: str
) -> None:
    assert description_of(model, key)[0] == unit
    assert unit_of_key(model, key) == unit
