"""Threads and processes: results are bit-identical to those of one thread."""

import multiprocessing
from collections.abc import Mapping
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from tests.support.belt_scenarios import pair
from tests.support.scenarios import SCENARIOS, python

BELT = pair(solver__backend="moreau", solver__rtol=None)
# Different kinds, laws, methods; events, failures and CSV files.
JOBS: Mapping[str, tuple[Any, dict[str, Any]]] = {
    "return": (SCENARIOS / "pulley_return.toml", {}),
    "stopped": (SCENARIOS / "pulley.toml", {"solver.max_steps": 50}),
    "marble_machine": (SCENARIOS / "marble_machine.toml", {"solver.duration": 2.0}),
    "epicyclic": (SCENARIOS / "epicyclic.toml", {"output.interval": 0.01}),
    "csv": (SCENARIOS / "hard" / "jump_from_csv.toml", {}),
    "horizontal": (SCENARIOS / "pulley_horizontal.toml", {"solver.backend": "rkf45"}),
    "belt": (BELT, {}),
}


def solved(name: str) -> fs.Result:
    source, overrides = JOBS[name]
    return fs.solve(fs.load(source, overrides))


def assert_in_pool(pool: Executor, folder: Path) -> None:
    for name, result in zip(JOBS, pool.map(solved, JOBS), strict=True):
        expected = solved(name)
        assert result.dataset.identical(expected.dataset), name
        assert result.events.identical(expected.events), name
        if expected.record.checkpoint is None:  # which has the run time
            images = [one.save(folder / "a.h5").read_bytes() for one in (result, expected)]
            assert images[0] == images[1], name


def test_threads_give_the_results_of_one(tmp_path: Path) -> None:
    with ThreadPoolExecutor(8) as pool:
        assert_in_pool(pool, tmp_path)


@pytest.mark.slow
def test_processes_give_the_results_of_one(tmp_path: Path) -> None:
    """A process that solves a belt imports numba, and loads its kernels, for seconds."""
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        assert_in_pool(pool, tmp_path)
        # A scenario goes there as it is, and an exception comes back as it is.
        scenario = fs.load(SCENARIOS / "pulley_return.toml")
        assert pool.submit(fs.solve, scenario).result().scenario.to_toml() == scenario.to_toml()
        with pytest.raises(fs.ScenarioError) as caught:
            pool.submit(fs.load, SCENARIOS / "pulley.toml", {"solver.rtoll": 1}).result()
        assert caught.value.faults == [
            "overrides: solver.rtoll: unknown key 'rtoll' (did you mean 'rtol'?)"
        ]


FIRST_USE = """
import sys
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import frictionsim as fs
from tests.api.test_parallel import BELT
from tests.support.scenarios import SCENARIOS

sys.setswitchinterval(1e-6)
names = {names}
barrier = Barrier(len(names))


def solve(name):
    barrier.wait()
    data = BELT if name == "belt" else SCENARIOS / f"{{name}}.toml"
    result = fs.solve(data)
    result.dataset, result.events, result.scenario, result._repr_html_()
    fs.compare(result, result), fs.static(result.scenario)
    channels = result.record.channels.items()
    return repr(sorted((name, data.tobytes()) for name, data in channels))


with ThreadPoolExecutor(len(names)) as pool:
    texts = list(pool.map(solve, names))
print("equal", len(set(texts)))
"""


@pytest.mark.parametrize(
    "names",
    [
        ["belt"] * 3,  # kernels are loaded, or compiled, by several threads at once
        pytest.param(["pulley", "epicyclic", "marble_machine"] * 3, marks=pytest.mark.slow),
    ],
)
def test_threads_may_use_the_package_first(names: list[str]) -> None:
    """Nothing is solved before the threads start."""
    solved("belt")  # compiles its kernels if need be
    done = python("-c", FIRST_USE.format(names=names))
    assert done.stdout == f"equal {len(set(names))}\n", done.stderr
