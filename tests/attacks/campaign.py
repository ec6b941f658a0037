"""Campaigns: many cases of attacks, in processes that are watched for crashes and hangs."""

import json
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Generator, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).parents[2]
SECONDS_PER_CASE = 10.0
# Of cases that start processes: the command, the undisturbed one and the next one after it.
SECONDS_WITH_PROCESSES = 90.0
WITH_PROCESSES = ("kills", "streams", "environments", "interruptions")
SECONDS_TO_START = 120.0  # of a process: imports, kernels, and the files that its cases change
STDERR_LENGTH = 3000

# How many of a million cases; those that start processes take a hundred times as long.
SHARES = {
    "toml": 315_000,
    "csv_signals": 150_000,
    "extremes": 130_000,
    "hdf5_bytes": 200_000,
    "hdf5_structure": 130_000,
    "sweeps": 20_000,
    "reports": 20_000,
    "checkpoints": 22_500,  # more than a thousand of each original
    "targets": 10_000,
    "kills": 1000,
    "streams": 500,
    "environments": 500,
    "interruptions": 500,
}


class Case(NamedTuple):
    """What came of a case: an outcome, or how a promise was broken."""

    attack: str
    number: int
    outcome: str
    broken: str


def cases(attack: str, seed: int, first: int, count: int) -> Iterator[Case]:
    """Try cases of an attack; a crash or a hang ends its case, and the others go on.

    A case that takes longer than `SECONDS_PER_CASE` is tried a second time: other programs may have
    kept the machine busy.

    Parameters
    ----------
    attack : str
        Its module.
    seed, first, count : int
        Of the cases.

    Yields
    ------
    Case
    """
    number, end, slow = first, first + count, -1
    while number < end:
        with closing(_of_one_process(attack, seed, number, end - number)) as of_one_process:
            for found in of_one_process:
                if found.outcome == "slow" and found.number != slow:
                    slow = number = found.number
                    break
                yield found
                number = found.number + 1


def _of_one_process(attack: str, seed: int, first: int, count: int) -> Generator[Case]:
    """Yield what came of the cases of one process, up to the one that ended it."""
    with _process(attack, seed, first, count) as process:
        lines: queue.Queue[str] = queue.Queue()
        errors: list[str] = []
        threads = [
            threading.Thread(target=_read_lines, args=(process.stdout, lines.put), daemon=True),
            threading.Thread(target=_read_lines, args=(process.stderr, errors.append), daemon=True),
        ]
        for thread in threads:
            thread.start()
        number, seconds = first, SECONDS_TO_START
        end_of_case = time.monotonic() + seconds
        while True:
            try:
                line = lines.get(timeout=max(0.0, end_of_case - time.monotonic()))
            except queue.Empty:
                yield Case(attack, number, "slow", f"no end after {seconds:g} s")
                return
            if not line:
                break
            found = _reported(line, number)
            if found is None:
                continue
            seconds = SECONDS_WITH_PROCESSES if attack in WITH_PROCESSES else SECONDS_PER_CASE
            end_of_case = time.monotonic() + seconds
            if len(found) > 1:
                yield Case(attack, number, found.get("outcome", "broken"), found.get("broken", ""))
                number += 1
        last = first + count - 1
        try:
            code = process.wait(SECONDS_PER_CASE)
        except subprocess.TimeoutExpired:
            yield Case(attack, min(number, last), "slow", "its process does not end")
            return
        threads[1].join(SECONDS_PER_CASE)
        if number <= last or code != 0:  # a case may end the process with 0, by os._exit(0)
            early = "process ended early, " if number <= last else ""
            captured = "".join(errors)[-STDERR_LENGTH:]
            yield Case(attack, min(number, last), "crash", f"{early}exit {code}: {captured}")


def _reported(line: str, number: int) -> dict[str, Any] | None:
    """Return what a line of `batch` says of a case; None if the line is not of it."""
    try:
        found = json.loads(line)
    except ValueError:
        return None
    return found if isinstance(found, dict) and found.get("number") == number else None


@contextmanager
def _process(attack: str, seed: int, first: int, count: int) -> Iterator["subprocess.Popen[str]"]:
    """Start a process for cases; at the end of the block end it and all that it started."""
    command = [sys.executable, "-m", "tests.attacks.batch", attack, *map(str, (seed, first, count))]
    with subprocess.Popen(
        command,
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        start_new_session=True,
    ) as process:
        try:
            yield process
        finally:
            if hasattr(os, "killpg"):
                with suppress(ProcessLookupError, PermissionError):  # all have ended
                    os.killpg(process.pid, signal.SIGKILL)
            else:  # Windows
                process.kill()


def _read_lines(stream: Any, put: Any) -> None:
    """Hand on the lines of a stream, and an empty one at its end."""
    for line in stream:
        put(line)
    put("")


class Tally:
    """The counts of a campaign, in a file from which it goes on.

    Parameters
    ----------
    path : Path
        JSON; other entries in it are kept.
    seed : int
    """

    def __init__(self, path: Path, seed: int) -> None:
        self._path = path
        self._file: dict[str, Any] = json.loads(path.read_text()) if path.exists() else {}
        self.attacks: dict[str, Any] = self._file.setdefault("attacks", {})
        if self._file.setdefault("seed", seed) != seed:
            raise SystemExit(f"{path}: it is of the seed {self._file['seed']}, not {seed}")
        self._lock = threading.Lock()

    def done(self, attack: str) -> int:
        """Return how many cases of an attack were tried."""
        return int(self.attacks.get(attack, {}).get("cases", 0))

    def end(self, attack: str) -> int:
        """Return the number above those of all cases that were tried."""
        return int(self.attacks.get(attack, {}).get("end", 0))

    def add(self, found: list[Case], seconds: float) -> None:
        """Add cases of one attack, and write the file."""
        with self._lock:
            of = self.attacks.setdefault(
                found[0].attack, {"cases": 0, "seconds": 0.0, "outcomes": {}, "broken": []}
            )
            of["end"] = max(of.get("end", 0), found[-1].number + 1)
            of["cases"] += len(found)
            of["seconds"] = round(of["seconds"] + seconds, 1)
            counts = Counter(of["outcomes"]) + Counter(case.outcome for case in found)
            of["outcomes"] = dict(sorted(counts.items()))
            of["broken"] += [
                {"number": case.number, "what": case.broken} for case in found if case.broken
            ]
            part = self._path.with_suffix(".part")
            part.write_text(json.dumps(dict(sorted(self._file.items())), indent=2) + "\n")
            part.replace(self._path)


def run_campaign(tally: Tally, total: int, seed: int, workers: int, batch: int) -> None:
    """Try cases of all attacks, in their shares, until there are so many in all.

    Parameters
    ----------
    tally : Tally
        Of the cases so far.
    total : int
        Cases of all attacks.
    seed : int
    workers : int
        Processes at a time.
    batch : int
        Cases of one process.

    Raises
    ------
    RuntimeError
        If cases could not be tried, or not be counted.
    """
    wanted = {name: -(-total * share // sum(SHARES.values())) for name, share in SHARES.items()}
    given = {name: tally.done(name) for name in wanted}
    numbers = {name: tally.end(name) for name in wanted}
    lock = threading.Lock()
    errors: list[Exception] = []

    def work() -> None:
        while not errors:
            with lock:  # the attack that is furthest behind
                name = min(wanted, key=lambda each: given[each] / wanted[each])
                first = numbers[name]
                count = min(batch, max(1, wanted[name] // 50), wanted[name] - given[name])
                if count <= 0:
                    return
                given[name] += count
                numbers[name] += count
            started = time.monotonic()
            try:
                tally.add(list(cases(name, seed, first, count)), time.monotonic() - started)
            except Exception as error:
                errors.append(error)

    threads = [threading.Thread(target=work, daemon=True) for _ in range(workers)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if errors:
        raise RuntimeError(f"the campaign ended early: {errors[0]}") from errors[0]
