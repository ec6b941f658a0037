"""The seeded faults can be set, so that who rewrites the package carries them on."""

import pytest

from tests.faults.drawing import draw
from tests.faults.table import faults, mistakes


def test_every_seeded_fault_can_be_set() -> None:
    assert mistakes() == []


def test_half_of_sixty_faults_are_drawn() -> None:
    assert len(faults()) >= 60
    assert 2 * sum(fault.origin.startswith("drawn") for fault in faults()) >= len(faults())


@pytest.mark.slow
def test_a_drawn_fault_can_be_set_and_is_the_same_again() -> None:
    fault = draw(7)
    assert fault == draw(7)
    assert fault.old != fault.new
