"""Set small faults into a copy of the package, one at a time, and see which tests notice them.

    python -m tests.faults check                           every fault can still be set
    python -m tests.faults run                             all tests that notice each fault
    python -m tests.faults first                           one test that notices each fault
    python -m tests.faults prove                           for some faults: that none is left out
    python -m tests.faults again                           which faults are no longer noticed
    python -m tests.faults draw --seed 1 --group belts     another fault, to be described

`run` runs each default test once without a fault, to see what it uses, and against each fault those
that can notice it. After each fault it writes results/who_notices.json: by fault,
the test functions that fail with it and pass without it, and how many of their cases if several.
Killed, it goes on where it was; rows of other sources are made anew, after those that lack. `first`
is the quick form: it ends at the first test that fails, sought near the fault, in the folder of its
room and the files of no folder, and leaves a row that `run` makes whole. `prove` runs all default
tests for some faults, and says what `run` would have left out. `again` runs the tests that noticed
each fault, up to the first that fails; `run --only` finds what notices it now.
"""

import argparse
import os
import signal
import sys

from tests.faults.drawing import as_toml, draw
from tests.faults.table import GROUPS, Fault, faults, in_turns, mistakes
from tests.faults.trial import Copy, Row, copy_of_sources, read_results, write_results

PROVEN, PROVEN_KERNELS = 12, 4
KERNELS = tuple(f"/belt_drive/{name}.py" for name in ("kernels", "moreau", "rkf45"))


def main() -> int:
    """Read the arguments and do what they say."""
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser("python -m tests.faults", None, __doc__, formatter_class=form)
    parser.add_argument("command", choices=("check", "run", "first", "prove", "again", "draw"))
    parser.add_argument("--only", nargs="+", metavar="NAME", help="these faults, also if done")
    parser.add_argument("-j", type=int, default=1, help="processes beside each other")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--group", choices=GROUPS, default="elsewhere", help="where to draw from")
    given = parser.parse_args()
    if given.command == "draw":
        print(as_toml(draw(given.seed, given.group)))
        return 0
    if wrong := mistakes():
        print("\n".join(wrong), file=sys.stderr)
        return 1
    if unknown := set(given.only or ()) - {fault.name for fault in faults()}:
        parser.error(f"no such fault: {', '.join(sorted(unknown))}")
    if given.command == "check":
        return 0
    chosen = [fault for fault in in_turns() if not given.only or fault.name in given.only]
    commands = {"run": run, "first": first, "prove": prove, "again": again}
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that tests at work end, too
    with copy_of_sources(given.j) as copy:
        return commands[given.command](copy, chosen, bool(given.only))


def run(copy: Copy, chosen: list[Fault], anew: bool) -> int:
    """Make the rows of faults; first those that are not in the table."""
    used, known = copy.used(), read_results()
    for fault in sorted(chosen, key=lambda fault: fault.name in known):
        of_fault = known.get(fault.name, {})
        if anew or "first" in of_fault or of_fault.get("state") != copy.state_with(fault):
            row = copy.trial(fault, copy.can_notice(fault, used), used)
            _keep(fault, row)
            functions = sum(map(len, row["tests"].values())) or row.get("ended", "none")
            print(
                f"{fault.name}: {functions} in {row['files']} files, {row['seconds']} s", flush=True
            )
    return 0


def first(copy: Copy, chosen: list[Fault], anew: bool) -> int:
    """Make rows of faults with the first test that notices each."""
    known, missed = read_results(), 0
    for fault in sorted(chosen, key=lambda fault: fault.name in known):
        row = known.get(fault.name, {})
        if anew or row.get("state") != copy.state_with(fault):
            folder = f"tests/{fault.file.split('/')[2 if fault.room == 'belts' else 1]}"
            near = [file for file in copy.files if os.path.dirname(file) in (folder, "tests")]
            row = copy.trial(fault, near, {}, first=True)
            if row["tests"]:
                row.pop("ended", None)  # pytest was told to
            row["first"] = True
            _keep(fault, row)
            noticed = dict(row["tests"]) or row.get("ended", "none")
            print(f"{fault.name}: {noticed}, {row['seconds']} s", flush=True)
        missed += not row["tests"]
    return 1 if missed else 0


def _keep(fault: Fault, row: Row) -> None:
    rows = read_results() | {fault.name: row}
    write_results({fault.name: rows[fault.name] for fault in faults() if fault.name in rows})


def prove(copy: Copy, chosen: list[Fault], anew: bool) -> int:
    """Make the rows of some faults by all default tests: none fails that would be left out."""
    used, known, wrong = copy.used(), read_results(), 0
    kernels = [fault for fault in chosen if any(fault.file.endswith(name) for name in KERNELS)]
    others = [fault for fault in chosen if fault not in kernels]
    some = kernels[:PROVEN_KERNELS] + others[: PROVEN - PROVEN_KERNELS]
    for fault in chosen if anew else some:
        row = known.get(fault.name, {})
        if anew or "left_out" not in row or row["state"] != copy.state_with(fault):
            row = copy.trial(fault, copy.files, used, chosen=copy.can_notice(fault, used))
            _keep(fault, row)
        wrong += bool(row["left_out"])
        print(f"{fault.name}: {', '.join(row['left_out']) or 'nothing'} left out", flush=True)
    return 1 if wrong else 0


def again(copy: Copy, chosen: list[Fault], anew: bool) -> int:
    """Say which faults the tests of their rows notice no more."""
    rows, missed = read_results(), 0
    for fault in chosen:
        noticing = rows[fault.name]["tests"] if fault.name in rows else {}
        left = [
            f"{file}::{function}"
            for file in noticing
            if file in copy.files
            for function in (text.partition(" ")[0] for text in noticing[file])
            if f"def {function}(" in (copy.tree / file).read_text(encoding="utf-8")
        ]
        if noticing and not (left and copy.trial(fault, left, {}, first=True)["tests"]):
            missed += 1
            print(f"{fault.name}: no longer noticed in {', '.join(noticing)}", flush=True)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
