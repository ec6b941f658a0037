"""The tests against one fault at a time, in a copy of the sources."""

import fcntl
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple

from tests.faults.table import ROOT, Fault

RESULTS = ROOT / "results" / "faults.json"
LIMITS = {"nearest": 600.0, "default": 3600.0, "slow": 7200.0}  # s, by stage
WITH_SLOW = "slow or nightly"
LEFT_OUT = ("--ignore=tests/faults",)  # they would tell that a fault is set already
TIME_LIMIT = "time limit"
DECIDING = ("frictionsim/", "scenarios/", "tests/")  # what the outcome of tests depends on
FAILED = re.compile(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", re.MULTILINE)
NO_TESTS = 5  # exit code of pytest

Row = dict[str, Any]


class Outcome(NamedTuple):
    """The first test that failed, "" if none, after how many seconds, and what pytest said."""

    failed: str
    seconds: float
    output: str


class Copy:
    """A copy of the sources that tests run in, with its own cache of compiled kernels.

    Its place is always the same, because kernels are kept by the path of their source.
    """

    def __init__(self, folder: Path) -> None:
        self.tree, self.cache = folder / "tree", folder / "cache"
        self._cache_without_fault = folder / "cache-without-fault"
        self.failing: list[str] = []  # tests that fail without a fault
        if self._cache_without_fault.exists():  # a run was killed
            shutil.rmtree(self.cache, ignore_errors=True)
            self._cache_without_fault.rename(self.cache)
        shutil.rmtree(self.tree, ignore_errors=True)
        listed = ("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard")
        names = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=True).stdout
        digest = hashlib.sha256()
        for name in sorted(set(names.split("\0"))):
            if (ROOT / name).is_file():
                (self.tree / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, self.tree / name)
                if name.startswith(DECIDING) and not name.startswith("tests/faults/"):
                    digest.update(name.encode() + (ROOT / name).read_bytes())
        self.state = digest.hexdigest()[:16]

    @contextmanager
    def having(self, fault: Fault) -> Iterator[None]:
        """Set a fault; code compiled meanwhile is removed with it."""
        path, kept = self.tree / fault.file, self._cache_without_fault
        original, before = path.read_bytes(), path.stat()
        shutil.rmtree(kept, ignore_errors=True)
        self.cache.mkdir(exist_ok=True)
        shutil.copytree(self.cache, kept, copy_function=os.link)
        try:
            path.write_text(fault.faulty(self.tree), encoding="utf-8")
            yield
        finally:
            path.write_bytes(original)
            os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
            shutil.rmtree(self.cache, ignore_errors=True)
            kept.rename(self.cache)

    def pytest(self, arguments: list[str], limit: float) -> Outcome:
        """Run pytest up to the first failure; what hangs is ended at the limit, s."""
        places = {"PYTHONPATH": str(self.tree), "XDG_CACHE_HOME": str(self.cache)}
        started = monotonic()
        with tempfile.TemporaryFile("w+") as output:
            process = subprocess.Popen(
                [sys.executable, "-m", "pytest", "-x", "-rfE", "--tb=short", *arguments],
                cwd=self.tree,
                env=os.environ | places,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                # What a shell starts in the background ignores Ctrl-C; tests send it.
                preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
            )
            try:
                code = process.wait(limit)
            except subprocess.TimeoutExpired:
                return Outcome(TIME_LIMIT, monotonic() - started, "")
            finally:
                with suppress(ProcessLookupError):  # also of the processes that tests have started
                    os.killpg(process.pid, signal.SIGKILL)
                process.wait()
            output.seek(0)
            text = output.read()
        failed = FAILED.search(text)
        name = failed[1] if failed else "" if code in (0, NO_TESTS) else f"pytest ends with {code}"
        return Outcome(name, monotonic() - started, text)

    def _first_failure(self, fault: Fault, arguments: list[str], limit: float) -> Outcome:
        """Return the outcome of tests with a fault, without those that also fail without it.

        Raises
        ------
        SystemExit
            If it cannot be told which these are.
        """
        while True:
            left_out = [f"--deselect={test}" for test in self.failing]
            with self.having(fault):
                outcome = self.pytest([*arguments, *left_out], limit)
            if not outcome.failed:
                return outcome
            suspects = [outcome.failed] if "::" in outcome.failed else list(fault.nearest)
            again = self.pytest(["-m", "", *suspects, *left_out], LIMITS["nearest"])
            if not again.failed:
                return outcome
            if "::" not in again.failed:
                sys.exit(f"without the fault {fault.name}, too, this fails:\n{again.output}")
            print(f"left out, because it fails without a fault: {again.failed}", flush=True)
            self.failing.append(again.failed)

    def trial(self, fault: Fault, stages: list[str], before: Row) -> Row:
        """Return the row of a fault: which stage caught it, by which test, after how long."""
        nearest = list(fault.nearest)
        done = [f"--ignore={test}" for test in nearest if "::" not in test]
        arguments = {
            "nearest": nearest,
            "default": ["-n", "2", *LEFT_OUT, *done],
            "slow": ["-m", WITH_SLOW, *LEFT_OUT],
        }
        row: Row = {"meaning": fault.meaning, "caught": "none", "test": "", "about": None}
        row |= {"seconds": before.get("seconds", {}), "state": f"{self.state} {fault.digest}"}
        for stage in stages:
            outcome = self._first_failure(fault, arguments[stage], LIMITS[stage])
            row["seconds"] = {**row["seconds"], stage: round(outcome.seconds, 1)}
            if outcome.failed:
                row |= {"caught": stage, "test": outcome.failed}
                break
        if before.get("test") == row["test"]:
            row["about"] = before.get("about")
        return row


@contextmanager
def copy_of_sources() -> Iterator[Copy]:
    """Give the copy of these sources; one process has it at a time."""
    place = hashlib.sha256(str(ROOT).encode()).hexdigest()[:8]
    folder = Path(tempfile.gettempdir()) / f"frictionsim-faults-{os.getuid()}-{place}"
    folder.mkdir(mode=0o700, exist_ok=True)
    with (folder / "lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            sys.exit(f"another run of faults is in {folder}: wait for it, or end it")
        try:
            yield Copy(folder)
        finally:
            shutil.rmtree(folder / "tree", ignore_errors=True)


def read_results() -> dict[str, Row]:
    """Return the rows by the names of their faults."""
    return json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}


def write_results(rows: dict[str, Row]) -> None:
    """Write the rows, in the place of those before."""
    part = RESULTS.with_suffix(".part")
    part.write_text(json.dumps(rows, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    part.replace(RESULTS)
