"""The page on validation has the numbers of its file."""

import pytest

from tests.benchmarks.validation import MEASURED, PAGE, PARTS, load, rendered

NUMBERS = load()


def test_the_page_shows_each_part_that_is_measured() -> None:
    shown = [name for _, name, _ in MEASURED.findall(PAGE.read_text(encoding="utf-8"))]
    assert shown == list(PARTS)
    assert set(NUMBERS) == set(PARTS)


def test_the_page_has_the_numbers_of_the_file() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert rendered(page, NUMBERS) == page, "python -m tests.benchmarks.validation --page writes it"


@pytest.mark.parametrize("part", PARTS)
def test_the_numbers_have_the_columns_of_the_command(part: str) -> None:
    assert tuple(NUMBERS[part]["heading"]) == PARTS[part].heading
