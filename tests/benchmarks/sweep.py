"""Measure sweeps: runs per second, workers, the coordinator, memory, and a cluster of Dask.

    python tests/benchmarks/sweep.py [pulley] [coordinator] [memory] [dask]

Other work on the machine changes the times, but not much the ratios within one call: what is
compared is measured by turns.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

import frictionsim as fs
from frictionsim.parameter_study import worker_process
from frictionsim.parameter_study.block import DONE, Block, Outcome, block_of
from frictionsim.parameter_study.dask_cluster import DaskCluster
from frictionsim.parameter_study.in_process import InProcess
from frictionsim.parameter_study.process_pool import ProcessPool
from frictionsim.parameter_study.sweep import Execution, SweepPlan, plan_of
from frictionsim.parameter_study.values import values_of
from frictionsim.results import Quantity
from tests.support.scenarios import SCENARIOS

PULLEY = SCENARIOS / "pulley.toml"
LOAD = "mechanism.load"
SECONDS_OF_SLEEP = 1e-3
TURNS = 3


def plan(runs: int, rtol: float, alone: bool = False) -> SweepPlan:
    """Return a sweep of a pulley, whose runs go alone if channels are chosen, else in lockstep."""
    chosen = {"output.channels": ["angle"]} if alone else {}
    scenario = fs.load(PULLEY, {"solver.rtol": rtol, **chosen})
    return plan_of(scenario, {LOAD: values_of(LOAD, f"lin(2000.0, 2400.0, {runs})")})


def seconds_of(execution: Execution, what: SweepPlan) -> float:
    """Return the time of checking and running a sweep, without that of starting workers."""
    execution.check(what, [range(what.design.runs)], _nothing, _nothing)
    started = time.perf_counter()
    done = 0
    for image in execution.blocks(what, [range(what.design.runs)], _nothing):
        done += Block.from_bytes(image).runs
    assert done == what.design.runs
    return time.perf_counter() - started


def _nothing(*_: Any) -> None:
    pass


def pulley() -> None:
    """Runs per second of a pulley, with one worker and two, and of a loop of `solve` processes."""
    for rtol, runs, alone in (
        (1e-6, 40_000, False),
        (1e-9, 20_000, False),
        (1e-6, 2000, True),
        (1e-9, 1000, True),
    ):
        what = plan(runs, rtol, alone)
        one, two = InProcess(), ProcessPool(2)
        times = [(seconds_of(one, what), seconds_of(two, what)) for _ in range(TURNS)]
        two.close()
        serial, pooled = np.median(times, axis=0)
        ratio = np.median([a / b for a, b in times])
        print(
            f"rtol {rtol:g}, {'alone' if alone else 'in lockstep'}: one process"
            f" {runs / serial:.0f} runs/s, two {runs / pooled:.0f} runs/s, {ratio:.2f} times one",
            flush=True,
        )
        if rtol == 1e-6 and not alone:
            loop = _shell_loop(20)
            print(
                f"a loop of solve: {1 / loop:.2f} runs/s; two workers:"
                f" {loop * runs / pooled:.0f} times that"
            )


def _shell_loop(runs: int) -> float:
    """Return the seconds of each of some `solve` processes, one after the other."""
    with tempfile.TemporaryDirectory() as folder:
        started = time.perf_counter()
        for number in range(runs):
            subprocess.run(
                [
                    *(sys.executable, "-m", "frictionsim", "solve", str(PULLEY), "-q"),
                    *("--set", "solver.rtol=1e-6", "--set", f"{LOAD}={2000.0 + number}"),
                    *("-o", f"{folder}/{number}.h5"),
                ],
                check=True,
            )
        return (time.perf_counter() - started) / runs


def coordinator() -> None:
    """How much of their time up to 8 workers sleep, if each run sleeps a millisecond."""

    def asleep(combinations: Any, task: Any, *_: Any) -> Block:
        outcome = Outcome(DONE, {f"quantity_{n}": Quantity(0.5, "1") for n in range(15)})
        # Slept at once, as the system wakes a sleeper late: what is measured is not its clock.
        time.sleep(SECONDS_OF_SLEEP * len(task.values))
        return block_of(task.first, [outcome] * len(task.values))

    worker_process.run_task, before = asleep, worker_process.run_task
    try:
        for workers in (1, 2, 4, 8):
            what = plan(3000 * workers, 1e-6)
            pool = ProcessPool(workers)
            pool._start(what)
            cpu, started = time.process_time(), time.perf_counter()
            for image in pool.blocks(what, [range(what.design.runs)], _nothing):
                Block.from_bytes(image)
            seconds = time.perf_counter() - started
            cpu = time.process_time() - cpu
            pool.close()
            print(
                f"{workers} workers: {100 * 3000 * SECONDS_OF_SLEEP / seconds:.1f} % efficient, the"
                f" coordinator takes {cpu / what.design.runs * 1e6:.1f} us of the processor a run"
            )
    finally:
        worker_process.run_task = before


MEMORY = """\
import json, resource, sys, time
import numpy as np
import frictionsim as fs
from pathlib import Path
from frictionsim.io.sweep_file import write_sweep
from frictionsim.parameter_study.block import Block
from frictionsim.parameter_study.sweep import Assembly, plan_of
from frictionsim.parameter_study.values import values_of
runs, path = int(sys.argv[1]), Path(sys.argv[2])
scenario = fs.load(sys.argv[3])
keys = {"mechanism.load": values_of("mechanism.load", "normal(2200.0, 50.0)"),
        "mechanism.inertia": values_of("mechanism.inertia", "uniform(1.0, 2.0)")}
from frictionsim.parameter_study.design import Sampling
plan = plan_of(scenario, keys, sampling=Sampling(runs, "random", 1))
peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
before, started = peak(), time.process_time()
assembly = Assembly(runs)
units = {f"quantity_{n}": "1" for n in range(15)}
size = 1000
rng = np.random.default_rng(1)
for first in range(0, runs, size):
    texts = {"failure": {first: "diverged"}, "reason": {first: "it left" * 10},
             "warnings": {first + 1: "a warning"}}
    status = np.ones(size, np.int8)
    values = rng.random((15, size))
    assembly.add(Block.from_bytes(Block(first, status, units, values, texts).to_bytes()))
added = peak()
write_sweep(assembly.table(plan, ""), path)
print(json.dumps([before, added, peak(), time.process_time() - started]))
"""


def memory() -> None:
    """Peak memory of the coordinator, with the outcomes of many runs."""
    for runs in (10_000, 1_000_000):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "s.h5"
            done = subprocess.run(
                [sys.executable, "-c", MEMORY, str(runs), str(path), str(PULLEY)],
                check=True,
                capture_output=True,
            )
            before, added, peak, seconds = json.loads(done.stdout)
            print(
                f"{runs} runs: {before:.0f} MB at the start, {added:.0f} MB with all outcomes,"
                f" {peak:.0f} MB at most, {seconds:.1f} s, file {path.stat().st_size / 1e6:.0f} MB"
            )


def dask() -> None:
    """A study of 10 000 runs on two workers of Dask, and on two of the pool."""
    what = plan(int(os.environ.get("RUNS", "10000")), 1e-6)
    pool, cluster = ProcessPool(2), DaskCluster("local:2")
    pairs = []
    for _ in range(TURNS):
        pairs.append((seconds_of(pool, what), seconds_of(cluster, what)))
        print(f"pool {pairs[-1][0]:.2f} s, Dask {pairs[-1][1]:.2f} s", flush=True)
    pool.close()
    cluster.close()
    print(f"Dask takes {np.median([b / a for a, b in pairs]):.2f} times the time of the pool")


if __name__ == "__main__":
    os.nice(5)
    known = {"pulley": pulley, "coordinator": coordinator, "memory": memory, "dask": dask}
    for name in sys.argv[1:] or list(known):
        known[name]()
