"""A short share of each attack; `python -m tests.attacks` tries the long one."""

import json
import random
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from frictionsim.cli.messages import ending_of
from tests.attacks import campaign, checkpoints, extremes, journals, promise
from tests.attacks.campaign import SHARES, Case, Tally, cases, run_campaign
from tests.attacks.promise import BrokenPromise, outcome
from tests.support.cases import slow
from tests.support.scenarios import SCENARIOS

# Those that start processes take seconds each.
COUNTS = {
    "toml": 50,
    "csv_signals": 30,
    "extremes": 15,
    "hdf5_bytes": 2,
    "hdf5_structure": 1,
    "sweeps": 2,
    "reports": 1,
    "checkpoints": 4,
    "targets": 3,
    "fits": 2,
    "kills": 1,
    "sweep_kills": 1,
    "streams": 1,
    "environments": 1,
    "interruptions": 1,
    "writers": 1,
    "segments": 1,
    "plugins": 1,
}
# A case of these takes two seconds and more; other tests of reports, kills, signals, plug-ins, of
# two runs into one file and of a full disk are about the same.
DEAR = (
    *("reports", "kills", "sweep_kills", "interruptions", "plugins", "writers", "segments"),
    *("streams", "environments"),
)


@pytest.fixture(autouse=True)
def copies(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(campaign, "START", "fork")


def test_each_attack_has_a_share_of_both() -> None:
    assert COUNTS.keys() == SHARES.keys()
    assert sum(SHARES.values()) == 1_000_000


def assert_no_promise_is_broken(attack: str) -> None:
    tried = list(cases(attack, 0, 0, COUNTS[attack]))
    assert [case for case in tried if case.broken] == []
    assert [case.number for case in tried] == list(range(COUNTS[attack]))


@pytest.mark.parametrize(
    "attack", [pytest.param(a, marks=pytest.mark.slow if a in DEAR else ()) for a in COUNTS]
)
def test_no_promise_is_broken(attack: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extremes, "TINY", 0.0)
    originals = {name: of for name, of in checkpoints.ORIGINALS.items() if name[0] not in "bs"}
    monkeypatch.setattr(checkpoints, "ORIGINALS", originals)
    assert_no_promise_is_broken(attack)


@pytest.mark.slow
@pytest.mark.parametrize("attack", ["extremes", "checkpoints"])
def test_no_promise_is_broken_by_belts_either(attack: str) -> None:
    """Kernels are compiled for many belts and guided strings."""
    assert_no_promise_is_broken(attack)


def resumed_with(craft: Any, folder: Path) -> "subprocess.CompletedProcess[str]":
    """Resume a sweep with a crafted journal."""
    part = folder / journals.PART
    part.write_bytes(journals.original().file)
    journals.journal_name(part).write_bytes(journals.original().journal)
    Path(f"{journals.journal_name(part)}{journals.LOG}").write_bytes(journals.original().log)
    craft(part)
    arguments = [sys.executable, "-m", "frictionsim", "resume", part.name, "-q", "-j", "1"]
    # Without an end, the read takes years.
    return subprocess.run(
        arguments, cwd=folder, check=False, capture_output=True, text=True, timeout=100
    )


@pytest.mark.parametrize("craft", [journals.repeat_pages, slow(journals.invent_quantities)])
def test_a_crafted_journal_neither_hangs_a_command_nor_adds_quantities(
    tmp_path: Path, craft: Any
) -> None:
    done = resumed_with(craft, tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / journals.TARGET).read_bytes() == journals.original().whole


@pytest.mark.slow  # the time that a child process has
def test_a_journal_with_an_endless_schema_is_refused(tmp_path: Path) -> None:
    done = resumed_with(journals.repeat_pages_of_schema, tmp_path)
    assert done.returncode == 4
    assert "the file is not one of a sweep (SQLite did not finish within 7 s" in done.stderr
    assert not (tmp_path / journals.TARGET).exists()


# A case knows its number by the first draw of its generator.
ODD = """
import os, subprocess, time
from pathlib import Path

def attack(rng, folder):
    number = {draws!r}.index(rng.random())
    print("a stray line", number, flush=True)
    if number == 1:
        os.abort()
    if number == 3 and not Path({once!r}).exists():
        started = subprocess.Popen(["sleep", "60"], stderr=subprocess.DEVNULL)
        Path({once!r}).write_text(str(started.pid))
        time.sleep(60)
    if number == 5:
        raise ValueError("a traceback")
    if number == 6:
        os._exit(0)
    if number == 7:
        raise SystemExit
    return "fine"
"""


def test_a_crash_and_an_error_cost_their_cases_and_a_hang_is_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of an attack whose cases crash, hang once, raise an error, end with 0, and print."""
    name = f"odd_{tmp_path.name}"
    draws = [random.Random(f"{name} 0 {number}").random() for number in range(9)]
    text = ODD.format(draws=draws, once=str(tmp_path / "once"))
    (tmp_path / f"{name}.py").write_text(text)
    monkeypatch.setattr("tests.attacks.__path__", [str(tmp_path)])
    monkeypatch.setattr(campaign, "SECONDS_PER_CASE", 1.0)
    tried = list(cases(name, 0, 0, 9))
    assert [case.number for case in tried] == list(range(9))
    assert [case.outcome for case in tried] == [
        *("fine", "crash", "fine", "fine", "fine", "broken", "crash", "crash", "fine")
    ]
    assert "process ended early, exit -6" in tried[1].broken
    assert tried[5].broken == "ValueError: a traceback"
    for case in tried[6:8]:
        assert case.broken == "process ended early, exit 0: "
    assert not _runs(int((tmp_path / "once").read_text()))  # what the hanging case had started


def _runs(pid: int) -> bool:
    """Return whether a process is there, and not only waits for its parent to take notice."""
    answer = subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True)
    return answer.stdout.strip()[:1] not in ("", "Z")


def test_what_no_command_may_do_breaks_a_promise(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: Any) -> None:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("frictionsim.mechanisms.pulley.statics", fail)
    with pytest.raises(BrokenPromise, match="exit 70"):
        outcome(["static", str(SCENARIOS / "pulley.toml")], "a bug")

    def out_of_memory(arguments: list[str]) -> int:
        message, code = ending_of(MemoryError(), arguments)
        print(f"frictionsim: {message}", file=sys.stderr)
        return code

    monkeypatch.setattr(promise, "run_command_line", out_of_memory)
    for command in ("solve", "resume", "compare"):
        with pytest.raises(BrokenPromise, match=r"exit 1, .frictionsim: out of memory"):
            outcome([command, "a.h5"], "much memory")


@pytest.mark.parametrize(
    ("code", "said"),
    [(1, "a.h5: cannot write the result: full"), (4, "a.h5: cannot read this result: x")],
)
def test_a_code_that_does_not_go_with_its_message_breaks_a_promise(
    code: int, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def wrong(arguments: list[str]) -> int:
        print(f"frictionsim: {said}", file=sys.stderr)
        return code

    monkeypatch.setattr(promise, "run_command_line", wrong)
    with pytest.raises(BrokenPromise, match=f"exit {code}"):
        outcome(["resume", "a.h5"], "a wrong code")


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
    counts = {name: of["cases"] for name, of in written["attacks"].items()}
    assert (counts, written["kills"]) == ({"toml": 75, "kills": 25}, 50)  # 50 of another test

    def fail(*_: Any) -> Iterator[Case]:
        raise OSError("no process can be started")

    monkeypatch.setattr(campaign, "cases", fail)
    with pytest.raises(RuntimeError, match="ended early: no process can be started"):
        run_campaign(Tally(tmp_path / "other.json", 1), 40, 1, workers=2, batch=7)
