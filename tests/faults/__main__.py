"""Set small faults into a copy of the package, one at a time, and see which tests find them.

    python -m tests.faults check                     every fault can still be set
    python -m tests.faults run --until nearest       the nearest tests against each
    python -m tests.faults draw --seed 1             another fault, to be described

`run` writes results/faults.json after each fault and goes on where it was stopped. A fault counts
as caught if a test fails with it that passes without it. Whether that test is about the fault, or
failed by chance, is for a person to judge, who writes true or false as `about` into that file; it
is kept while the same test catches it.
"""

import argparse
import sys

from tests.faults.drawing import as_toml, draw
from tests.faults.table import faults, mistakes
from tests.faults.trial import LIMITS, copy_of_sources, read_results, write_results

STAGES = list(LIMITS)
JUDGED = {True: "about it", False: "by chance", None: "not judged"}


def main() -> int:
    """Read the arguments and do what they say."""
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser("python -m tests.faults", None, __doc__, formatter_class=form)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("check", help="that every fault can be set")
    commands.add_parser("draw", help="a fault").add_argument("--seed", type=int, required=True)
    run = commands.add_parser("run", help="the tests against each fault")
    run.add_argument("--only", nargs="+", metavar="NAME", help="these, also if they are done")
    run.add_argument("--until", choices=STAGES, default="slow", help="the last tests to run")
    given = parser.parse_args()
    if given.command == "draw":
        print(as_toml(draw(given.seed)))
        return 0
    wrong = mistakes()
    print("\n".join(wrong), file=sys.stderr, end="\n" if wrong else "")
    if given.command == "run" and not wrong:
        known = [fault.name for fault in faults()]
        if unknown := set(given.only or ()) - set(known):
            sys.exit(f"no such fault: {', '.join(sorted(unknown))}")
        run_faults(given.only or known, bool(given.only), STAGES[: STAGES.index(given.until) + 1])
    return 1 if wrong else 0


def run_faults(names: list[str], anew: bool, stages: list[str]) -> None:
    """Run the tests of some stages against faults, but for what is done; print the table."""
    with copy_of_sources() as copy:
        for fault in faults():
            rows = read_results()
            row = rows.get(fault.name, {})
            is_known = not anew and row.get("state") == f"{copy.state} {fault.digest}"
            before = row if is_known else {**row, "seconds": {}}
            left = [stage for stage in stages if stage not in before["seconds"]]
            if fault.name not in names:
                continue
            if is_known and (row["caught"] != "none" or not left):
                print(f"{fault.name}: known of these sources, not run again")
                continue
            rows[fault.name] = row = copy.trial(fault, left, before)
            write_results(
                {fault.name: rows[fault.name] for fault in faults() if fault.name in rows}
            )
            print(f"{fault.name}: {row['test'] or 'NOT CAUGHT'}", flush=True)
    rows = read_results()
    for name, row in sorted(
        rows.items(), key=lambda item: STAGES.index(item[1]["caught"]) if item[1]["test"] else 9
    ):
        print(f"{name:40} {row['caught']:8} {JUDGED[row['about']]:11} {row['test']}")
    print({of: sum(row["caught"] == of for row in rows.values()) for of in (*STAGES, "none")})


if __name__ == "__main__":
    sys.exit(main())
