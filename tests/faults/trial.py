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
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from itertools import groupby
from pathlib import Path
from time import monotonic
from typing import Any

from tests.faults.selection import Used, can_notice
from tests.faults.table import ROOT, Fault

RESULTS = ROOT / "results" / "who_notices.json"
LIMIT = 4 * 3600.0  # s, of one run of pytest
HANGING = 10  # tests that may hang with a fault before its trial ends, after half an hour
# Those of the faults would tell that one is set already.
TESTS = re.compile(r"tests/(?!faults/)(.*/)?test_[^/]*\.py")
DECIDING = ("frictionsim/", "scenarios/", "tests/")  # what the outcome of tests depends on
OPTIONS = ("-p", "tests.faults.plugin", "-p", "no:cacheprovider", "--tb=no")
OPTIONS += ("--continue-on-collection-errors",)
FEW = 12  # failing tests, up to which they are run once more
FINE = (0, 1, 5)  # exit codes of pytest: passed, failed, no tests

Row = dict[str, Any]


def is_among(test: str, names: Collection[str]) -> bool:
    """Return whether a test or its file is named."""
    return test in names or test.partition("::")[0] in names


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


class Copy:
    """A copy of the sources that tests run in, with its own cache of compiled kernels.

    Its place is always the same, because kernels are kept by the path of their source.
    """

    def __init__(self, folder: Path, workers: int) -> None:
        self.tree, self.cache, self.workers = folder / "tree", folder / "cache", workers
        self._used = folder / "used.jsonl"
        self._cache_without_fault = folder / "cache-without-fault"
        if self._cache_without_fault.exists():  # a run was killed
            shutil.rmtree(self.cache, ignore_errors=True)
            self._cache_without_fault.rename(self.cache)
        shutil.rmtree(self.tree, ignore_errors=True)
        listed = ("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard")
        names = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=True).stdout
        self._digests: dict[str, str] = {}
        for name in sorted(set(names.split("\0"))):
            if (ROOT / name).is_file():
                (self.tree / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, self.tree / name)
                if name.startswith(DECIDING) and not name.startswith("tests/faults/"):
                    self._digests[name] = _digest((ROOT / name).read_bytes())
        shutil.copy2(Path(__file__).with_name("started_python.py"), self.tree / "sitecustomize.py")
        self.files = [name for name in self._digests if TESTS.fullmatch(name)]
        self.state = self._state(self._digests)

    def _state(self, names: Iterable[str]) -> str:
        """Return the digest of some files, with their names."""
        return _digest("".join(name + self._digests[name] for name in names).encode())

    def used(self, only: Iterable[str] = ()) -> dict[str, Used]:
        """Return what each file of tests uses without a fault; run those not known of this state.

        `failed` are its tests that fail then, and None if pytest broke off; `seconds` its time;
        `tests` what its imports used, under "", and each test beside.
        """
        text = self._used.read_text() if self._used.exists() else ""
        rows = [json.loads(line) for line in text.splitlines() if line.endswith("}")]
        shared = self._state(name for name in self._digests if not TESTS.fullmatch(name))
        folders = groupby(
            sorted(self.files, key=os.path.dirname), os.path.dirname
        )  # files of one import one another
        ofs = {folder: shared + self._state(files) for folder, files in folders}
        states = {name: ofs[os.path.dirname(name)] for name in self.files}
        known = {row["file"]: row for row in rows if row["state"] == states.get(row["file"])}
        wanted = sorted(only) or self.files
        left = [name for name in wanted if name not in known]
        with self._used.open("a") as kept, ThreadPoolExecutor(self.workers) as pool:
            kept.write("" if text.endswith("\n") or not text else "\n")
            for number, row in enumerate(pool.map(self._used_by, left), 1):
                row["state"] = states[row["file"]]
                kept.write(json.dumps(row) + "\n")
                kept.flush()
                known[row["file"]] = row
                said = f"{row['seconds']:.0f} s, {row['failed'] or 'all pass'}"
                print(f"{number} of {len(left)}: {row['file']}: {said}", flush=True)
        return {name: known[name] for name in wanted}

    def _used_by(self, name: str) -> Row:
        with tempfile.TemporaryDirectory() as folder:
            place, began = Path(folder) / "used", monotonic()
            code, failed = self.pytest(["-n", "0", name], used=place)
            lines = place.read_text(encoding="utf-8").splitlines() if place.exists() else []
        used = [json.loads(line) for line in lines]
        return {
            "file": name,
            "seconds": round(monotonic() - began, 1),
            "failed": sorted(failed) if code in FINE else None,
            "tests": {one.pop("test"): one for one in used},
        }

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

    def pytest(
        self, arguments: list[str], among: Iterable[str] = (), used: Path | None = None
    ) -> tuple[int | None, set[str]]:
        """Run pytest; return its exit code, None after the limit, and what failed.

        Of the files only what is named in `among` is run, all if nothing is. `used` is the file for
        what tests use.
        """
        with tempfile.TemporaryDirectory() as folder:
            failed, names = Path(folder) / "failed", Path(folder) / "among"
            names.write_text("\n".join(among), encoding="utf-8")
            places = {"PYTHONPATH": str(self.tree), "XDG_CACHE_HOME": str(self.cache)}
            places |= {"FAULTS_FAILED": str(failed), "FAULTS_AMONG": str(names)}
            places |= {"FAULTS_USED": str(used)} if used else {}
            process = subprocess.Popen(
                [sys.executable, "-m", "pytest", *OPTIONS, *arguments],
                cwd=self.tree,
                env=os.environ | places,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
                # What a shell starts in the background ignores Ctrl-C; tests send it.
                preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
            )
            try:
                code = process.wait(LIMIT)
            except subprocess.TimeoutExpired:
                code = None
            finally:
                with suppress(ProcessLookupError):  # also of the processes that tests have started
                    os.killpg(process.pid, signal.SIGKILL)
                process.wait()
            return code, set(failed.read_text().splitlines()) if failed.exists() else set()

    def state_with(self, fault: Fault) -> str:
        """Return the digest of what decides the row of a fault."""
        return f"{self.state} {fault.digest}"

    def can_notice(self, fault: Fault, used: dict[str, Used]) -> list[str]:
        """Return the tests that can notice a fault, and files of which all tests can."""
        return can_notice(fault, used, self.tree)

    def trial(
        self,
        fault: Fault,
        among: list[str],
        used: dict[str, Used],
        *,
        first: bool = False,
        chosen: Collection[str] | None = None,
    ) -> Row:
        """Return the row of a fault: how many cases of which functions fail with it alone.

        They are sought among these tests and files of tests; with `first` only up to the first test
        that fails. The row says which of them are not among those `chosen`.
        """
        began, files = monotonic(), sorted({name.partition("::")[0] for name in among})
        # By files, pytest-xdist would run a test again and again that ended its worker.
        workers = ["-n", str(self.workers), "--dist", "load"]
        with self.having(fault):
            ends = [f"--max-worker-restart={HANGING}", *(["-x"] if first else [])]
            code, failed = self.pytest([*workers, *ends, *files], among) if files else (0, set())
            failed -= {test for use in used.values() for test in use["failed"] or ()}
            if len(failed) <= FEW and code in FINE and not first:  # one may fail by chance
                again = sorted({name.partition("::")[0] for name in failed})
                failed &= self.pytest(["-n", "1", *again], failed)[1] if failed else set()
        counts = Counter(test.partition("[")[0] for test in failed)
        tests: dict[str, list[str]] = defaultdict(list)
        for test, count in sorted(counts.items()):
            name, _, function = test.partition("::")
            tests[name].append(function + (f" {count}" if count > 1 else ""))
        row: Row = {"state": self.state_with(fault), "files": len(files)}
        row |= {"seconds": round(monotonic() - began), "tests": tests}
        if chosen is not None:
            row["left_out"] = sorted(test for test in failed if not is_among(test, chosen))
        return row if code in FINE else row | {"ended": f"pytest ends with {code}"}


@contextmanager
def copy_of_sources(workers: int) -> Iterator[Copy]:
    """Give the copy of these sources; one process has it at a time."""
    place = _digest(str(ROOT).encode())
    folder = Path(tempfile.gettempdir()) / f"frictionsim-faults-{os.getuid()}-{place}"
    folder.mkdir(mode=0o700, exist_ok=True)
    with (folder / "lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            sys.exit(f"another run of faults is in {folder}: wait for it, or end it")
        try:
            yield Copy(folder, workers)
        finally:
            shutil.rmtree(folder / "tree", ignore_errors=True)


def read_results() -> dict[str, Row]:
    """Return the rows by the names of their faults."""
    return json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}


def write_results(rows: dict[str, Row]) -> None:
    """Write the rows, a line for each file of tests, in the place of those before."""
    lines = []
    for name, row in sorted(rows.items()):
        files = [f"  {json.dumps(file)}: {json.dumps(of)}" for file, of in row["tests"].items()]
        others = json.dumps({key: row[key] for key in row if key != "tests"})[:-1]
        inner = "\n" + ",\n".join(files) if files else ""
        lines.append(f' {json.dumps(name)}: {others}, "tests": {{{inner}}}}}')
    part = RESULTS.with_suffix(".part")
    part.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
    part.replace(RESULTS)
