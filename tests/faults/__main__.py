"""Set small faults into a copy of the package, one at a time, and see which tests notice them.

    python -m tests.faults check                 every fault can still be set
    python -m tests.faults run [-j N] [NAME...]  the first default tests that notice each fault

`run` begins with the tests of the room that a fault is in, and ends at the first that fails. After
each fault it writes results/who_notices.json. Killed, it goes on where it was; faults that are in
that file are run again where they are named.
"""

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.faults.table import ROOT, Fault, faults, mistakes

RESULTS = ROOT / "results" / "who_notices.json"
LIMIT = 2 * 3600.0  # s, of the tests of one fault: a run that hangs is noticed
FOLDERS = {"belts": "tests/belt_drive", "solvers": "tests/solvers tests/mechanisms"}


def main() -> int:
    """Read the arguments and do what they say."""
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser("python -m tests.faults", None, __doc__, formatter_class=form)
    parser.add_argument("command", choices=("check", "run"))
    parser.add_argument("names", nargs="*", metavar="NAME", help="these faults, also if done")
    parser.add_argument("-j", type=int, default=1, help="processes beside each other")
    given = parser.parse_args()
    if wrong := mistakes():
        print("\n".join(wrong), file=sys.stderr)
        return 1
    if unknown := set(given.names) - {fault.name for fault in faults()}:
        parser.error(f"no such fault: {', '.join(sorted(unknown))}")
    return run(given.names, given.j) if given.command == "run" else 0


def run(names: list[str], workers: int) -> int:
    """Run the tests against faults; return 1 if one is not noticed."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that tests at work end, too
    known = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
    missed = 0
    with tempfile.TemporaryDirectory(prefix="frictionsim-faults-") as folder:
        tree = Path(folder) / "tree"
        listed = ("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard")
        files = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=True).stdout
        for name in filter(lambda name: (ROOT / name).is_file(), files.split("\0")):
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, tree / name)
        for fault in faults():
            if fault.name not in names and (names or fault.name in known):
                continue
            known[fault.name] = noticed(tree, fault, workers)
            missed += not known[fault.name]
            print(f"{fault.name}: {', '.join(known[fault.name]) or 'not noticed'}", flush=True)
            ordered = {f.name: known[f.name] for f in faults() if f.name in known}
            part = RESULTS.with_suffix(".part")
            part.write_text(json.dumps(ordered, indent=1) + "\n", encoding="utf-8")
            part.replace(RESULTS)
    return 1 if missed else 0


def noticed(tree: Path, fault: Fault, workers: int) -> list[str]:
    """Return what fails first in a copy of the sources that has a fault."""
    path = tree / fault.file
    sound = path.read_bytes()
    near = FOLDERS.get(fault.room, f"tests/{fault.room}").split()
    path.write_text(fault.faulty(tree), encoding="utf-8")
    try:
        failed = _failing(tree, [name for name in near if (tree / name).is_dir()], workers)
        return failed or _failing(tree, ["tests", "--ignore=tests/faults"], workers)
    finally:
        path.write_bytes(sound)


def _failing(tree: Path, chosen: list[str], workers: int) -> list[str]:
    if not chosen:
        return []
    command = [sys.executable, "-m", "pytest", "-x", "-q", "--tb=no", "-p", "no:cacheprovider"]
    places = {"PYTHONPATH": str(tree), "XDG_CACHE_HOME": str(tree.parent / "cache")}
    process = subprocess.Popen(
        [*command, "-n", str(workers), *chosen],
        cwd=tree,
        env=os.environ | places,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        lines = process.communicate(timeout=LIMIT)[0].splitlines()
    except subprocess.TimeoutExpired:
        return [f"no end within {LIMIT:.0f} s"]
    finally:
        if process.poll() is None:  # with the processes that tests have started
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    failed = [line.split()[1] for line in lines if line.startswith(("FAILED ", "ERROR "))]
    return failed or ([f"pytest ends with {process.returncode}"] if process.returncode else [])


if __name__ == "__main__":
    sys.exit(main())
