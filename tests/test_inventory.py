"""What the program offers is what its inventory says."""

import pytest

from tests import inventory


@pytest.fixture(scope="module")
def present() -> inventory.Inventory:
    return inventory.inventory()


def test_the_inventory_is_that_of_the_program(present: inventory.Inventory) -> None:
    stored = inventory.STORED.read_text(encoding="utf-8")
    assert stored == inventory.as_text(present), inventory.ANEW


def test_each_section_names_something_for_each_kind(present: inventory.Inventory) -> None:
    for section in ("audits", "channels", "keys", "quantities", "views"):
        assert all(present[section].values()), section
    assert all(present["commands"].values())
