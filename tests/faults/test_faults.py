"""The seeded faults can be set, so that who rewrites the package carries them on."""

from tests.faults.table import faults, mistakes


def test_every_seeded_fault_can_be_set() -> None:
    assert mistakes() == []
    assert len(faults()) >= 120
