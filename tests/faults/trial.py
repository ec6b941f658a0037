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
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic
from typing import Any

from tests.faults.table import ROOT, Fault

RESULTS = ROOT / "results" / "faults.json"
STAGES = ("nearest", "default", "slow")
WITH_SLOW = "(long or slow or nightly) and not packaging"
LIMITS = {"nearest": 600.0, "default": 3600.0, "slow": 7200.0}  # s
NO_TESTS = 5  # exit code of pytest
FAILED = re.compile(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", re.MULTILINE)
TIME_LIMIT = "time limit"
DECIDING = ("frictionsim/", "scenarios/", "tests/")

Row = dict[str, Any]


@dataclass
class Outcome:
    """What a call of pytest came to: the first test that failed, "" if none."""

    failed: str
    seconds: float
    output: str


@dataclass
class Copy:
    """A copy of the sources that tests run in, with a cache of its own for compiled kernels.

    Attributes
    ----------
    folder : Path
        The same in each run, because kernels are kept by the path of their source.
    passing : set of str
        The tests that were seen to pass without a fault.
    """

    folder: Path
    passing: set[str] = field(default_factory=set)

    @property
    def tree(self) -> Path:
        """The sources."""
        return self.folder / "tree"

    def files(self) -> list[str]:
        """Return the files that git knows or would add, from the root."""
        listed = ("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard")
        found = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=True)
        return sorted(f for f in found.stdout.split("\0") if f and (ROOT / f).is_file())

    def make(self) -> str:
        """Copy the sources and return a digest of what the outcome of tests depends on."""
        shutil.rmtree(self.tree, ignore_errors=True)
        digest = hashlib.sha256()
        for name in self.files():
            (self.tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, self.tree / name)
            if name.startswith(DECIDING) and not name.startswith("tests/faults/"):
                digest.update(name.encode() + (ROOT / name).read_bytes())
        return digest.hexdigest()[:16]

    @contextmanager
    def having(self, fault: Fault) -> Iterator[None]:
        """Set a fault. What is compiled meanwhile goes with it."""
        path, cache = self.tree / fault.file, self.folder / "cache"
        before, kept = path.stat(), self.folder / "cache-without-fault"
        original = path.read_bytes()
        shutil.rmtree(kept, ignore_errors=True)
        if cache.exists():
            shutil.copytree(cache, kept, copy_function=os.link)
        try:
            fault.set_in(self.tree)
            yield
        finally:
            path.write_bytes(original)
            os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
            shutil.rmtree(cache, ignore_errors=True)
            with suppress(FileNotFoundError):
                kept.rename(cache)

    def pytest(self, arguments: Iterable[str], limit: float) -> Outcome:
        """Run pytest up to the first failure; a hanging one is ended at the limit."""
        environment = {
            **os.environ,
            "PYTHONPATH": str(self.tree),
            "XDG_CACHE_HOME": str(self.folder / "cache"),
        }
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-rfE", "--tb=short", *arguments]
        started = monotonic()
        with tempfile.TemporaryFile("w+") as output:
            process = subprocess.Popen(
                command,
                cwd=self.tree,
                env=environment,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                # Ctrl-C is ignored in what a shell starts in the background, also by its tests.
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

    def passes(self, tests: tuple[str, ...], limit: float) -> bool:
        """Return whether tests pass without a fault; they are tried once."""
        left = [test for test in tests if test not in self.passing]
        if left and self.pytest(["-m", "", *left], limit).failed:
            return False
        self.passing.update(left)
        return True


@contextmanager
def copy_of_sources() -> Iterator[Copy]:
    """Give the copy of these sources; one process has it at a time.

    Raises
    ------
    SystemExit
    """
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


def arguments_of(stage: str, fault: Fault) -> list[str]:
    """Return what pytest is called with."""
    if stage == "nearest":
        return list(fault.nearest)
    files = {path for path in fault.nearest if "::" not in path}
    rest = [f"--ignore={path}" for path in sorted(files)]
    own = ["--ignore=tests/faults"]  # it would tell that the fault is set already
    if stage == "default":
        return ["-n", "2", "--dist", "loadfile", *own, *rest]
    return ["-m", WITH_SLOW, *own]


def trial(fault: Fault, copy: Copy, stages: tuple[str, ...], before: Row) -> Row:
    """Return the row of a fault: which stage caught it, by which test, and after how long.

    Raises
    ------
    SystemExit
        If the test that failed does so without the fault, too.
    """
    row: Row = {"meaning": fault.meaning, "caught": "none", "test": "", "seconds": {}}
    row["seconds"] = dict(before.get("seconds", {}))
    for stage in stages:
        with copy.having(fault):
            found = copy.pytest(arguments_of(stage, fault), LIMITS[stage])
        row["seconds"][stage] = round(found.seconds, 1)
        if found.failed:
            hung = found.failed == TIME_LIMIT or "::" not in found.failed
            again = fault.nearest if hung else (found.failed,)
            if not copy.passes(again, LIMITS["nearest"]):
                sys.exit(f"{again} fail without the fault {fault.name}, too:\n{found.output}")
            row |= {"caught": stage, "test": found.failed}
            break
    row["about"] = before.get("about") if before.get("test") == row["test"] else None
    return row


def read_results() -> dict[str, Row]:
    """Return the rows by the names of their faults."""
    return json.loads(RESULTS.read_text()) if RESULTS.exists() else {}


def write_results(rows: dict[str, Row]) -> None:
    """Write the rows, in the place of those before."""
    part = RESULTS.with_suffix(".part")
    part.write_text(json.dumps(rows, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    part.replace(RESULTS)
