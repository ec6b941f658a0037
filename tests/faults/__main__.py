"""Set small faults into a copy of the package, one at a time, and see which tests find them.

    python -m tests.faults check                     every fault can still be set
    python -m tests.faults run --until nearest       the nearest tests against each
    python -m tests.faults draw --seed 1             another fault, to be described

`run` writes results/faults.json after each fault and goes on where it was stopped. A fault counts
as caught if a test fails with it that passes without it. Whether that test is about the fault, or
failed by chance, is for a person to judge (`judge NAME true`); it is kept while the same test
catches it.
"""

import argparse
import sys

from tests.faults.drawing import as_toml, draw
from tests.faults.table import faults, mistakes
from tests.faults.trial import STAGES, copy_of_sources, read_results, trial, write_results


def main() -> int:
    """Read the arguments and do what they say."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.faults",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("check", help="that every fault can be set")
    commands.add_parser("draw", help="a fault").add_argument("--seed", type=int, required=True)
    run = commands.add_parser("run", help="the tests against each fault")
    run.add_argument("--only", nargs="+", metavar="NAME", help="these, also if they are done")
    run.add_argument("--until", choices=STAGES, default="slow", help="the last tests to run")
    commands.add_parser("show", help="the table of results")
    judge = commands.add_parser("judge", help="whether the test that failed is about the fault")
    judge.add_argument("name")
    judge.add_argument("about", choices=("true", "false"))
    given = parser.parse_args()
    if given.command == "draw":
        print(as_toml(draw(given.seed)))
        return 0
    if given.command == "judge":
        rows = read_results()
        rows[given.name]["about"] = given.about == "true"
        write_results(rows)
        return 0
    if given.command == "show":
        return show()
    if wrong := mistakes():
        print("\n".join(wrong), file=sys.stderr)
    elif given.command == "run":
        run_all(given.only, given.until)
        return show()
    return 1 if wrong else 0


def run_all(only: list[str] | None, until: str) -> None:
    """Run the tests against all faults that have no result of these sources yet.

    Raises
    ------
    SystemExit
        If a fault is unknown.
    """
    if unknown := set(only or []) - {fault.name for fault in faults()}:
        sys.exit(f"no such fault: {', '.join(sorted(unknown))}")
    stages = STAGES[: STAGES.index(until) + 1]
    with copy_of_sources() as copy:
        state = copy.make()
        for fault in faults():
            rows = read_results()
            row = rows.get(fault.name, {})
            chosen = not only or fault.name in only
            is_same = row.get("state") == f"{state} {fault.digest}"
            done = tuple(row["seconds"]) if is_same and not only else ()
            left = () if done and row["caught"] != "none" else stages[len(done) :]
            if not chosen or not left:
                print(f"{fault.name}: not run again" if chosen else "", end="\n" if chosen else "")
                continue
            before = row if done else {**row, "seconds": {}}
            rows[fault.name] = trial(fault, copy, left, before)
            rows[fault.name]["state"] = f"{state} {fault.digest}"
            write_results({f.name: rows[f.name] for f in faults() if f.name in rows})
            print(one_line(fault.name, rows[fault.name]), flush=True)


def one_line(name: str, row: dict[str, object]) -> str:
    """Return a row of the table as text."""
    about = {True: "about it", False: "by chance", None: "not judged"}[row["about"]]  # type: ignore[index]
    how = f"{row['test']} ({about})" if row["test"] else row["meaning"]
    return f"{name:32} {row['caught']!s:8} {how}"


def show() -> int:
    """Print the table and the counts; the faults that no test finds come last."""
    rows = read_results()
    for name, row in sorted(rows.items(), key=lambda item: item[1]["caught"] == "none"):
        print(one_line(name, row))
    counts = {s: sum(r["caught"] == s for r in rows.values()) for s in (*STAGES, "none")}
    print(f"{len(rows)} of {len(faults())} faults: {counts}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
