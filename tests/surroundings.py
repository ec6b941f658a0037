"""Run the default tests where others run them: `python3 tests/surroundings.py [NAME ...]`.

Each is a fresh clone of what is committed, with the README's two commands, in another place, as
another user, with another interpreter, processor or environment. It needs the network, some ten
minutes each, and of Python what is in its standard library; `pytest -m nightly` runs all of them.
With `--together` those named are one: its folder, interpreter, processor and environment at once.
With `--record` the counts of each run go to `results/surroundings.json`, with the commit.
"""

import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from tempfile import mkdtemp
from types import MappingProxyType
from typing import NamedTuple
from xml.etree import ElementTree

ROOT = Path(__file__).parents[1]
RECORD = ROOT / "results" / "surroundings.json"
NOBODY = 65534  # the user and group of no files
PRIVATE = 0o077
OUTCOMES = "tests", "failures", "errors", "skipped"
TESTS = [".venv/bin/pytest", "-n", "2", "--dist", "loadfile", "-p", "no:cacheprovider"]
# numpy, OpenBLAS and numba each choose instructions of their own; "generic" is x86-64 of 2003.
# To numba a processor of the level x86-64-v2 has all features of this machine; `generic` has none.
WITHOUT_AVX2 = {
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL",
    "OPENBLAS_CORETYPE": "Nehalem",
    "NUMBA_CPU_NAME": "generic",
}
WITHOUT_AVX512 = {
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL",
    "OPENBLAS_CORETYPE": "Haswell",
    "NUMBA_CPU_NAME": "haswell",
    "NUMBA_CPU_FEATURES": "+sse4.2,+popcnt,+avx,+avx2,+bmi,+bmi2,+fma",
}


class Surroundings(NamedTuple):
    """Where and how the tests are run."""

    folder: str = "frictionsim"  # as `git clone` calls it
    python: str = "python3"
    environment: Mapping[str, str] = MappingProxyType({})
    ordinary_user: bool = False  # where it is root that runs this
    before: str = ""  # commands of the shell that starts them


ALL = {
    "clone": Surroundings(),
    "ordinary user": Surroundings(ordinary_user=True),
    "path with a space": Surroundings(folder="my clones/friction sim"),
    "no AVX2": Surroundings(environment=WITHOUT_AVX2),
    "no AVX-512": Surroundings(environment=WITHOUT_AVX512),
    "SIGINT ignored": Surroundings(before="trap '' INT; "),
    "colours forced": Surroundings(environment={"FORCE_COLOR": "1"}),
    "no UTF-8": Surroundings(environment={"LC_ALL": "C", "PYTHONUTF8": "0"}),
    "Python 3.11": Surroundings(python="python3.11"),
    "Python 3.13": Surroundings(python="python3.13"),
}


def combined(names: Iterable[str]) -> Surroundings:
    """Return surroundings that combine the features of those named."""
    usual, values = Surroundings(), Surroundings()._asdict()
    for place in (ALL[name] for name in names):
        particular = {k: v for k, v in place._asdict().items() if v != getattr(usual, k)}
        if "environment" in particular:
            particular["environment"] = {**values["environment"], **place.environment}
        values |= particular
    return Surroundings(**values)


def run(place: Surroundings, tests: list[str]) -> tuple[int, dict[str, int | str]]:
    """Run the tests in surroundings.

    Returns the exit code of the first command that fails, and what is recorded of it: the commit,
    the counts of tests by outcome, and the seconds of the processor that all commands took.
    """
    above = Path(mkdtemp(prefix="surroundings-"))
    clone, home = above / place.folder, above / "home"
    user = NOBODY if place.ordinary_user and os.geteuid() == 0 else None
    home.mkdir(mode=0o700)
    subprocess.run(["git", "clone", "--quiet", "--no-hardlinks", ROOT, clone], check=True)
    asked = ["git", "-C", str(clone), "rev-parse", "--short", "HEAD"]  # the origin may go on
    commit = subprocess.run(asked, capture_output=True, text=True, check=True).stdout.strip()
    if user is not None:
        above.chmod(0o755)
        for path in (home, clone, *clone.rglob("*")):
            os.chown(path, user, user, follow_symlinks=False)
    seconds_before = seconds_of_children()
    temporary, report = home / "tmp", home / "tests.xml"
    environment = {**os.environ, "HOME": str(home), "TMPDIR": str(temporary), **place.environment}
    for variable in ("XDG_CACHE_HOME", "VIRTUAL_ENV", "PYTHONPATH", "PYTHONDONTWRITEBYTECODE"):
        environment.pop(variable, None)

    def call(*words: str) -> int:
        return subprocess.run(
            ["sh", "-c", f'{place.before}exec "$@"', "sh", *words],
            cwd=clone, env=environment, user=user, group=user, check=False,
            extra_groups=None if user is None else [], umask=PRIVATE if user else -1,
        ).returncode  # fmt: skip

    try:
        code = (
            call("mkdir", str(temporary))
            or call(interpreter(place.python, call), "-m", "venv", ".venv")
            or call(".venv/bin/pip", "install", "--quiet", "-e", ".[dev]")
            or call(*TESTS, f"--junitxml={report}", *tests)
        )
        seconds = round(seconds_of_children() - seconds_before)
        return code, {"commit": commit, **counts(report), "cpu_seconds": seconds}
    finally:
        shutil.rmtree(above, ignore_errors=True)


def counts(report: Path) -> dict[str, int]:
    """Return the counts in a report of pytest, if it came to one."""
    suite = ElementTree.parse(report).find("testsuite") if report.exists() else None
    return {} if suite is None else {name: int(suite.get(name, "0")) for name in OUTCOMES}


def seconds_of_children() -> float:
    """Return the processor seconds of ended children."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def record(name: str, code: int, totals: dict[str, int | str]) -> None:
    """Write what came of a run to the record, in the place of an earlier one."""
    runs = json.loads(RECORD.read_text()) if RECORD.exists() else {}
    runs[name] = {"exit": code, **totals}
    RECORD.write_text(json.dumps(dict(sorted(runs.items())), indent=2) + "\n")


def interpreter(python: str, call: Callable[..., int]) -> str:
    """Return the path of an interpreter that the user of a call may run, and that makes a venv."""
    places = (os.environ.get("PATH", ""), "/usr/bin")
    for program in filter(None, (shutil.which(python, path=path) for path in places)):
        # What is found may be the shim of a version manager, which asks where HOME is.
        asked = subprocess.run(
            [program, "-c", "import sys; print(sys.executable)"],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        path = asked.stdout.strip()
        has_venv = ["sh", "-c", '"$0" -c "import ensurepip" 2> /dev/null', path]
        if asked.returncode == 0 and call(*has_venv) == 0:
            return path
    sys.exit(f"{python}: no such interpreter with ensurepip that this user may run")


def main() -> int:
    """Run those named, or all; say which fail."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(ALL)}")
    parser.add_argument("--together", action="store_true", help="all that are named in one run")
    parser.add_argument("--record", action="store_true", help=f"write {RECORD.name}")
    parser.add_argument("--tests", nargs=argparse.REMAINDER, default=[], help="for pytest")
    given = parser.parse_args()
    if unknown := set(given.names) - ALL.keys():
        parser.error(f"unknown: {', '.join(sorted(unknown))}; there are {', '.join(ALL)}")
    names = given.names or list(ALL)
    groups = [names] if given.together else [[name] for name in names]
    codes = {}
    for group in groups:
        name = ", ".join(group)
        codes[name], totals = run(combined(group), given.tests)
        if given.record:
            record(name, codes[name], totals)
    for name, code in codes.items():
        print(f"{name}: {'passed' if code == 0 else f'failed with {code}'}")
    return int(any(codes.values()))


if __name__ == "__main__":
    sys.exit(main())
