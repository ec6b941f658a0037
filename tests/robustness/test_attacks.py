"""A short share of each attack; `python -m tests.attacks` tries the long one."""

import json
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.attacks import campaign
from tests.attacks.campaign import SHARES, Case, Tally, cases, run_campaign
from tests.attacks.promise import BrokenPromise, outcome
from tests.support.scenarios import SCENARIOS

# Those that start processes take seconds each.
COUNTS = {
    "toml": 80,
    "csv_signals": 50,
    "extremes": 50,
    "hdf5_bytes": 60,
    "hdf5_structure": 50,
    "checkpoints": 40,
    "targets": 40,
    "kills": 2,
    "streams": 2,
    "environments": 2,
    "interruptions": 2,
}


def test_each_attack_has_a_share_of_both() -> None:
    assert COUNTS.keys() == SHARES.keys()
    assert sum(SHARES.values()) == 1_000_000


@pytest.mark.parametrize("attack", COUNTS)
def test_no_promise_is_broken(attack: str) -> None:
    found = list(cases(attack, 0, 0, COUNTS[attack]))
    assert [case for case in found if case.broken] == []
    assert [case.number for case in found] == list(range(COUNTS[attack]))


# A case knows its number by the first draw of its generator.
ODD = """
import os, time
from pathlib import Path

def attack(rng, folder):
    number = {draws!r}.index(rng.random())
    if number == 1:
        os.abort()
    if number == 3 and not Path({once!r}).exists():
        Path({once!r}).touch()
        time.sleep(60)
    if number == 5:
        raise ValueError("a traceback")
    return "fine"
"""


@pytest.fixture
def odd(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """An attack whose cases crash, hang once, and raise an error."""
    name = f"odd_{tmp_path.name}"
    path = Path(campaign.__file__).with_name(f"{name}.py")
    draws = [random.Random(f"{name} 0 {number}").random() for number in range(7)]
    path.write_text(ODD.format(draws=draws, once=str(tmp_path / "once")))
    monkeypatch.setattr(campaign, "SECONDS_PER_CASE", 1.0)
    yield name
    path.unlink()


def test_a_crash_and_an_error_cost_their_cases_and_a_hang_is_tried_again(odd: str) -> None:
    found = list(cases(odd, 0, 0, 7))
    assert [case.number for case in found] == list(range(7))
    assert [case.outcome for case in found] == [
        *("fine", "crash", "fine", "fine", "fine", "broken", "fine"),
    ]
    assert "exit -6" in found[1].broken
    assert found[5].broken == "ValueError: a traceback"


def test_an_undocumented_exit_code_breaks_a_promise(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: Any) -> None:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("frictionsim.mechanisms.pulley.statics", fail)
    with pytest.raises(BrokenPromise, match="exit 70"):
        outcome(["static", str(SCENARIOS / "pulley.toml")], "a bug")


def test_a_campaign_goes_on_where_it_was_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried: list[tuple[str, int]] = []

    def recorded(attack: str, seed: int, first: int, count: int) -> Iterator[Case]:
        for number in range(first, first + count):
            tried.append((attack, number))
            yield Case(attack, number, "fine", "")

    monkeypatch.setattr(campaign, "SHARES", {"toml": 3, "kills": 1})
    monkeypatch.setattr(campaign, "cases", recorded)
    path = tmp_path / "hard.json"
    path.write_text('{"kills": 50}')
    for total in (40, 100):
        run_campaign(Tally(path, 1), total, 1, workers=2, batch=7)
    assert len(set(tried)) == len(tried) == 100
    written = json.loads(path.read_text())
    assert {name: of["cases"] for name, of in written["attacks"].items()} == {
        "toml": 75,
        "kills": 25,
    }
    assert written["kills"] == 50  # of another test
