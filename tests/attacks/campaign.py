"""Campaigns: many cases of attacks, in processes that are watched for crashes and hangs."""

import contextlib
import faulthandler
import importlib
import json
import multiprocessing
import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from tests.attacks.promise import BrokenPromise

ROOT = Path(__file__).parents[2]
# Of address space, bytes, besides the program and its libraries: together two gigabytes.
MEMORY = 3 << 29
SECONDS_PER_CASE = 10.0
# Of extremes, whose runs of thousands of steps compile a kernel for their kind and effects. In a
# process that goes on, as here, no limit of the wall time ends a compilation.
SECONDS_WITH_COMPILATION = 60.0
# Of cases that start processes: the command, the undisturbed one and the next one after it.
SECONDS_WITH_PROCESSES = 90.0
WITH_PROCESSES = (
    *("kills", "sweep_kills", "streams", "environments", "interruptions", "writers", "plugins"),
)
SECONDS_TO_START = 120.0  # of a process: imports, kernels, and the files that its cases change
STDERR_LENGTH = 3000
START = "spawn"  # of processes; a test copies itself instead, which has all imports already

# How many of a million cases; those that start processes take a hundred times as long.
SHARES = {
    "toml": 302_500,
    "csv_signals": 150_000,
    "extremes": 130_000,
    "hdf5_bytes": 200_000,
    "hdf5_structure": 130_000,
    "sweeps": 20_000,
    "reports": 20_000,
    "checkpoints": 28_000,  # more than a thousand of each original
    "targets": 10_000,
    "fits": 5000,
    "kills": 1000,
    "sweep_kills": 500,
    "streams": 500,
    "environments": 500,
    "interruptions": 500,
    "writers": 500,
    "segments": 500,
    "plugins": 500,
}


class Case(NamedTuple):
    """What came of a case: an outcome, or how a promise was broken."""

    attack: str
    number: int
    outcome: str
    broken: str


def cases(attack: str, seed: int, first: int, count: int) -> Iterator[Case]:
    """Try cases of an attack, and yield what came of each.

    A crash or a hang ends its process, and the next case has another one. A case that takes too
    long is tried a second time: other programs may have kept the machine busy.
    """
    number, end, slow = first, first + count, -1
    while number < end:
        with _process(attack, seed) as process:
            while number < end:
                case = process.tried(number)
                if case.outcome == "slow" and slow != number:
                    slow = number
                    break
                yield case
                number += 1
                if case.outcome in ("slow", "crash"):
                    break


class _Process:
    """A process for cases of one attack."""

    def __init__(self, attack: str, seed: int, errors: Path) -> None:
        context = multiprocessing.get_context(START)
        self._attack, self._errors = attack, errors
        self._pipe, end = context.Pipe()
        arguments = (attack, seed, end, self._pipe, str(errors))
        self._process = context.Process(target=_serve, args=arguments)  # type: ignore[attr-defined]
        self._process.start()
        end.close()
        self._seconds = SECONDS_TO_START

    def tried(self, number: int) -> Case:
        """Return the outcome of a case."""
        try:
            if self._seconds == SECONDS_TO_START:  # it says when it is ready
                if not self._pipe.poll(self._seconds):
                    return Case(self._attack, number, "slow", "its process does not start")
                self._pipe.recv()
                self._seconds = _seconds(self._attack)
            self._pipe.send(number)
            if self._pipe.poll(self._seconds):
                return Case(self._attack, number, *self._pipe.recv())
        except (EOFError, OSError):
            self._process.join()
            errors = self._errors.read_text(errors="replace")[-STDERR_LENGTH:]
            early = f"process ended early, exit {self._process.exitcode}: {errors}"
            return Case(self._attack, number, "crash", early)
        return Case(self._attack, number, "slow", f"no end after {self._seconds:g} s")

    def end(self) -> None:
        """End it and all that it started."""
        with contextlib.suppress(ProcessLookupError, PermissionError, AttributeError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.kill()
        self._process.join()
        self._pipe.close()


def _seconds(attack: str) -> float:
    if attack == "extremes":
        return SECONDS_WITH_COMPILATION
    return SECONDS_WITH_PROCESSES if attack in WITH_PROCESSES else SECONDS_PER_CASE


@contextlib.contextmanager
def _process(attack: str, seed: int) -> Iterator[_Process]:
    with tempfile.NamedTemporaryFile() as errors:
        process = _Process(attack, seed, Path(errors.name))
        try:
            yield process
        finally:
            process.end()


def _serve(attack: str, seed: int, pipe: Any, other_end: Any, errors: str) -> None:
    """Try the cases whose numbers come through a pipe, each in an empty folder."""
    other_end.close()  # or the pipe would not end with the process that started this one
    if hasattr(os, "setsid"):
        os.setsid()
    for number, name in ((1, os.devnull), (2, errors)):
        os.dup2(os.open(name, os.O_WRONLY | os.O_APPEND), number)
    sys.stderr = os.fdopen(2, "w", closefd=False)  # a test may have put something else there
    faulthandler.enable(2)
    _limit_memory()
    module = importlib.import_module(f"tests.attacks.{attack}")
    if hasattr(module, "warm_up"):
        module.warm_up()
    pipe.send("ready")
    with contextlib.suppress(EOFError):
        while True:
            number = pipe.recv()
            rng = random.Random(f"{attack} {seed} {number}")
            with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
                pipe.send(_outcome(module, rng, Path(name)))


def _limit_memory() -> None:
    with contextlib.suppress(ImportError, FileNotFoundError):  # only on Linux
        import resource

        pages = int(Path("/proc/self/statm").read_text().split()[0])
        limit = pages * resource.getpagesize() + MEMORY
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def _outcome(module: Any, rng: random.Random, folder: Path) -> tuple[str, str]:
    try:
        return str(module.attack(rng, folder)), ""
    except BrokenPromise as broken:
        return "broken", str(broken)
    except Exception as error:  # of the program, where the command line did not catch it
        return "broken", f"{type(error).__name__}: {error}"


class Tally:
    """The counts of a campaign in a JSON file, which continues it; other entries are kept."""

    def __init__(self, path: Path, seed: int) -> None:
        self._path = path
        self._file: dict[str, Any] = json.loads(path.read_text()) if path.exists() else {}
        self.attacks: dict[str, Any] = self._file.setdefault("attacks", {})
        if self._file.setdefault("seed", seed) != seed:
            raise SystemExit(f"{path}: it is of the seed {self._file['seed']}, not {seed}")
        self._commit = subprocess.check_output(
            ["git", "-C", ROOT, "rev-parse", "--short", "HEAD"], text=True
        ).strip()
        self._lock = threading.Lock()

    def count(self, attack: str, of: str) -> int:
        """Return how many `cases` of an attack were tried, or the `end` of their numbers."""
        return int(self.attacks.get(attack, {}).get(of, 0))

    def add(self, batch: list[Case], seconds: float) -> None:
        """Add cases of one attack, and write the file."""
        with self._lock:
            of = self.attacks.setdefault(
                batch[0].attack, {"cases": 0, "seconds": 0.0, "outcomes": {}, "broken": []}
            )
            of["end"] = max(of.get("end", 0), batch[-1].number + 1)
            of["cases"] += len(batch)
            commits = of.setdefault("commits", {})  # how many cases were tried against each
            commits[self._commit] = commits.get(self._commit, 0) + len(batch)
            of["seconds"] = round(of["seconds"] + seconds, 1)
            counts = Counter(of["outcomes"]) + Counter(case.outcome for case in batch)
            of["outcomes"] = dict(sorted(counts.items()))
            of["broken"] += [
                {"number": case.number, "what": case.broken} for case in batch if case.broken
            ]
            part = self._path.with_suffix(".part")
            part.write_text(json.dumps(dict(sorted(self._file.items())), indent=2) + "\n")
            part.replace(self._path)


def run_campaign(
    tally: Tally, total: int, seed: int, workers: int, batch: int, only: Sequence[str] = ()
) -> None:
    """Try cases of all attacks, or of some, in their shares, until there are so many in all.

    Each of the workers, which are threads, tries a batch of cases in a process at a time.

    Raises
    ------
    RuntimeError
        If cases could not be tried, or not be counted.
    """
    shares = {name: share for name, share in SHARES.items() if not only or name in only}
    wanted = {name: -(-total * share // sum(shares.values())) for name, share in shares.items()}
    given = {name: tally.count(name, "cases") for name in wanted}
    numbers = {name: tally.count(name, "end") for name in wanted}
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
