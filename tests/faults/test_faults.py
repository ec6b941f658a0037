"""The seeded faults can be set, so that who rewrites the package carries them on."""

from pathlib import Path

import pytest

from tests.faults.drawing import draw
from tests.faults.selection import can_notice
from tests.faults.table import GROUPS, Fault, faults, in_turns, mistakes


def test_every_seeded_fault_can_be_set() -> None:
    assert mistakes() == []


def test_most_faults_are_drawn_and_all_groups_have_their_part_of_any_third() -> None:
    assert len(faults()) >= 120
    assert 3 * sum(fault.origin.startswith("drawn") for fault in faults()) >= 2 * len(faults())
    third = in_turns()[: len(faults()) // 3]
    for group in GROUPS:
        of_all = sum(fault.group == group for fault in faults())
        assert of_all >= 30
        assert abs(3 * sum(fault.group == group for fault in third) - of_all) <= 3


TEXT = """import os

def outer(a=1):
    def inner():
        return 2
    return inner

def other():
    return 3
"""


MANY = ["outer", "inner", "forks", "reads", "unseen"]
FILES = ["file_reads", "file_unknown", "file_broken"]


@pytest.mark.parametrize(
    ("file", "old", "noticing"),
    [
        ("frictionsim/io/a.py", "return 2", [*MANY, "file_runs"]),
        ("frictionsim/io/a.py", "return 3", ["forks", "reads", "unseen"]),
        ("frictionsim/io/a.py", "a=1", ["imports", *MANY, "file_runs", "file_imports"]),
        ("frictionsim/mechanisms/belt_drive/a.py", "return 3", ["forks", "reads", "unseen"]),
        (
            "frictionsim/mechanisms/belt_drive/moreau.py",
            "return 3",
            ["imports", *MANY, "file_runs"],
        ),
        ("frictionsim/io/page.js", "return 3", ["imports", *MANY, "file_runs", "file_imports"]),
    ],
)
def test_what_can_notice_a_fault_is_never_too_little(
    file: str, old: str, noticing: list[str], tmp_path: Path
) -> None:
    (tmp_path / file).parent.mkdir(parents=True)
    (tmp_path / file).write_text(TEXT)

    def use(lines: list[int], read: bool = False, *started: str) -> dict[str, object]:
        ran = {file: lines} if lines else {}
        return {"ran": ran, "read": [file] if read else [], "started": [*started]}

    tests = {
        "": use([]),
        "nothing": use([]),
        "imports": use([1]),
        "outer": use([1, 3]),
        "inner": use([1, 4]),
        "forks": use([1], False, "fork"),
        "reads": use([], True),
        "unseen": use([], False, "unseen"),
    }
    used = {
        "file": {"failed": [], "tests": tests},
        "file_imports": {"failed": [], "tests": {"": use([1]), "test": use([])}},
        "file_runs": {"failed": [], "tests": {"": use([1, 4]), "test": use([])}},
        "file_reads": {"failed": [], "tests": {"": use([], True), "test": use([])}},
        "file_unknown": {"failed": [], "tests": {}},
        "file_broken": {"failed": None, "tests": {"": use([]), "test": use([])}},
    }
    fault = Fault("", "", "", "", file, old, old.replace("return ", "return -") + "0")
    assert set(can_notice(fault, used, tmp_path)) == {*noticing, *FILES}


@pytest.mark.slow
def test_a_drawn_fault_can_be_set_and_is_the_same_again() -> None:
    fault = draw(7, "belts")
    assert fault == draw(7, "belts")
    assert fault.old != fault.new
