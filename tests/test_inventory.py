"""What the program offers is what its inventory says."""

import json

import pytest

from tests import inventory


@pytest.fixture(scope="module")
def present() -> inventory.Inventory:
    return inventory.inventory()


def test_the_inventory_is_that_of_the_program(present: inventory.Inventory) -> None:
    stored = inventory.STORED.read_text(encoding="utf-8")
    differing = inventory.differences(json.loads(stored), present)
    assert not differing, "\n".join([inventory.ANEW, *differing])
    assert stored == inventory.as_text(present)


def test_each_section_names_something_for_each_kind(present: inventory.Inventory) -> None:
    for section in ("audits", "channels", "keys", "quantities", "views"):
        assert all(present[section].values()), section
    assert all(present["commands"].values())


def test_what_is_gone_and_new_is_said_by_name(present: inventory.Inventory) -> None:
    old = json.loads(inventory.as_text(present))
    old["views"]["shaft"].append("shadow")
    old["commands"]["solve"].remove("--estimate-error")
    assert inventory.differences(old, present) == [
        "- views: shaft: shadow",
        "+ commands: solve: --estimate-error",
    ]
