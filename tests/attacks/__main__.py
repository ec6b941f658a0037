"""Try a long campaign of attacks, on all cores; a stopped one is continued.

    python -m tests.attacks --cases 1000000

writes the counts to results/hard.json after each batch, and ends with 1 if a promise was broken.

    python -m tests.attacks --cases 400 --only environments interruptions

tries 200 cases of each of these.
"""

import argparse
import os
import sys
from pathlib import Path

from tests.attacks.campaign import ROOT, SHARES, Tally, cases, run_campaign


def main() -> int:
    """Read the arguments and run the campaign, or repeat one case."""
    parser = argparse.ArgumentParser(prog="python -m tests.attacks", description=__doc__)
    parser.add_argument("--cases", type=int, default=1_000_000, help="of all attacks together")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--batch", type=int, default=500, help="cases of one process")
    parser.add_argument("--output", type=Path, default=ROOT / "results" / "hard.json")
    parser.add_argument("--repeat", nargs=2, metavar=("ATTACK", "NUMBER"), help="one case only")
    parser.add_argument("--only", nargs="+", choices=SHARES, default=(), help="attacks")
    given = parser.parse_args()
    if given.repeat:
        attack, number = given.repeat
        case = next(cases(attack, given.seed, int(number), 1))
        print(f"{case.outcome}\n{case.broken}".rstrip())
        return 1 if case.broken else 0
    tally = Tally(given.output, given.seed)
    run_campaign(tally, given.cases, given.seed, given.workers, given.batch, given.only)
    broken = 0
    for name, of in tally.attacks.items():
        print(f"{name}: {of['cases']} cases, {of['outcomes']}, {len(of['broken'])} broken")
        broken += len(of["broken"])
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
