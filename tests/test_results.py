"""The files of results/ are those that its README names, and say what they were made with."""

import re
from pathlib import Path

import pytest

RESULTS = Path(__file__).parents[1] / "results"
LISTED = re.findall(r"`(\w+\.(?:png|txt|csv|md|json))`", (RESULTS / "README.md").read_text())
PICTURES = sorted(name for name in LISTED if name.endswith(".png"))
TABLES = sorted(name for name in LISTED if name.endswith((".txt", ".csv", ".md")))
MOST_BYTES = 200_000


def test_the_readme_lists_each_file_once() -> None:
    assert len(LISTED) == len(set(LISTED))
    assert PICTURES
    assert TABLES


@pytest.mark.parametrize("name", LISTED)
def test_a_listed_file_exists(name: str) -> None:
    assert (RESULTS / name).stat().st_size > 0


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_is_small(name: str) -> None:
    assert (RESULTS / name).stat().st_size < MOST_BYTES


@pytest.mark.parametrize("name", TABLES)
def test_a_table_names_machine_and_versions(name: str) -> None:
    text = (RESULTS / name).read_text(encoding="utf-8")
    assert re.search(r"^\W*machine: \S", text, re.MULTILINE)
    assert re.search(
        r"^\W*versions: Python \S+, numpy \S+, scipy \S+, numba \S", text, re.MULTILINE
    )
