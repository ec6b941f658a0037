"""The time of a belt's steps in two versions of the program, taken in turn on one machine.

Run it as `python -m tests.benchmarks.belt_steps OLD NEW [CASE...]`, with the folders of two
versions and the numbers of cases, all by default. It prints microseconds a step, medians, and the
median of the ratios of neighbours in time. Both processes live throughout, and step in turn for
some hundredths of a second, so that what else the machine does hits both alike.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from statistics import median

CASES: list[tuple[str, dict[str, object]]] = [
    ("belt_drive", {"solver.backend": "moreau"}),
    ("belt_drive", {"solver.backend": "moreau", "mechanism.belt.wrap": "polygon"}),
    ("belt_drive", {"solver.backend": "rkf45"}),
    ("belt_drive", {"solver.backend": "rkf45", "mechanism.belt.wrap": "polygon"}),
    ("belt_drive", {"solver.backend": "moreau", "mechanism.belt.bodies": 600}),
    ("belt_drive", {"solver.backend": "rkf45", "mechanism.belt.bodies": 600}),
]
WARM_UP, TURNS, SECONDS = 0.02, 21, 0.03  # s of model time; turns of each; s of wall time a turn

WORKER = """
import json, sys, time
from pathlib import Path
from frictionsim.mechanisms.belt_drive.belt_simulation import BeltDrive
from frictionsim.scenario.loading import load

root, warm_up = Path(sys.argv[1]), float(sys.argv[2])
sys.path.insert(0, str(root))
steppers = {}
for line in sys.stdin:
    case, steps = json.loads(line)
    key = json.dumps(case)
    if key not in steppers:
        name, overrides = case
        scenario = load(root / "scenarios" / (name + ".toml"), overrides)
        drive = BeltDrive(scenario)
        drive.prepare(lambda t: None)
        steppers[key] = drive._stepper
        drive._stepper.advance(warm_up, warm_up, 10**9)
    stepper = steppers[key]
    before, started = stepper.statistics, time.process_time()
    stepper.advance(1e9, 1e9, steps)
    took, after = time.process_time() - started, stepper.statistics
    print(json.dumps([took, after[0] + after[1] - before[0] - before[1]]), flush=True)
"""


class Worker:
    """A process that steps belts in one version of the program."""

    def __init__(self, root: Path) -> None:
        command = [sys.executable, "-c", WORKER, str(root), str(WARM_UP)]
        environment = {**os.environ, "PYTHONPATH": str(root)}
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(
            command, env=environment, cwd=root, stdin=pipe, stdout=pipe, text=True
        )

    def step(self, case: tuple[str, dict[str, object]], steps: int) -> float:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps([case, steps]) + "\n")
        self._process.stdin.flush()
        took, taken = json.loads(self._process.stdout.readline())
        return float(1e6 * took / taken)


def main() -> None:
    old, new = (Worker(Path(root).resolve()) for root in sys.argv[1:3])
    for case in [CASES[int(number)] for number in sys.argv[3:]] or CASES:
        steps = int(1e6 * SECONDS / max(old.step(case, 1000), new.step(case, 1000)))
        pairs = [(old.step(case, steps), new.step(case, steps)) for _ in range(TURNS)]
        before, after = (median(column) for column in zip(*pairs, strict=True))
        ratio = median(b / a for a, b in pairs)
        print(f"{case[0]} {case[1]}: {before:.3f} {after:.3f} us, ratio {ratio:.3f}", flush=True)


if __name__ == "__main__":
    main()
