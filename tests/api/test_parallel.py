"""Threads and processes: results are bit-identical to those of one thread."""

import multiprocessing
from collections.abc import Mapping
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from frictionsim.api.result import checkpoint_of
from tests.support.belt_scenarios import pair
from tests.support.scenarios import SCENARIOS, python

# Different kinds, laws, methods; events, failures and CSV files.
JOBS: Mapping[str, tuple[Any, dict[str, Any]]] = {
    "pulley": (SCENARIOS / "pulley.toml", {}),
    "return": (SCENARIOS / "pulley_return.toml", {}),
    "stopped": (SCENARIOS / "pulley.toml", {"solver.max_steps": 50}),
    "marble_machine": (SCENARIOS / "marble_machine.toml", {"solver.duration": 2.0}),
    "epicyclic": (SCENARIOS / "epicyclic.toml", {"output.interval": 0.01}),
    "csv": (SCENARIOS / "hard" / "jump_from_csv.toml", {}),
    "horizontal": (SCENARIOS / "pulley_horizontal.toml", {"solver.backend": "rkf45"}),
    "belt": (pair(solver__backend="moreau", solver__rtol=None), {}),
}


def solved(name: str) -> fs.Result:
    source, overrides = JOBS[name]
    return fs.solve(fs.load(source, overrides))


@pytest.fixture(scope="module")
def serial(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("serial")
    return {name: image(solved(name), folder) for name in JOBS}


def image(result: fs.Result, folder: Path) -> bytes:
    return result.save(folder / "a.h5").read_bytes()


def assert_same(results: Mapping[str, fs.Result], serial: dict[str, bytes], folder: Path) -> None:
    for name, result in results.items():
        if result.record.checkpoint is None:
            assert image(result, folder) == serial[name], name
            continue
        # A checkpoint has the run time, the only part that differs between two runs.
        (folder / "serial.h5").write_bytes(serial[name])
        expected = fs.open(folder / "serial.h5")
        assert result.dataset.identical(expected.dataset)
        # A file has channels, too, that follow from those of the state.
        assert state_of(result).items() <= state_of(expected).items()


def state_of(result: fs.Result) -> dict[str, bytes]:
    state = checkpoint_of(result)
    return {k: values.tobytes() for k, values in state.items() if not k.startswith("clock.")}


def in_pool(pool: Executor) -> dict[str, fs.Result]:
    return dict(zip(JOBS, pool.map(solved, JOBS), strict=True))


def test_threads_give_the_results_of_one(serial: dict[str, bytes], tmp_path: Path) -> None:
    with ThreadPoolExecutor(8) as pool:
        assert_same(in_pool(pool), serial, tmp_path)


@pytest.mark.slow
def test_processes_give_the_results_of_one(serial: dict[str, bytes], tmp_path: Path) -> None:
    """A process that solves a belt imports numba, and loads its kernels, for seconds."""
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        assert_same(in_pool(pool), serial, tmp_path)
        # A scenario goes there as it is, and an exception comes back as it is.
        scenario = fs.load(SCENARIOS / "pulley_return.toml")
        result = pool.submit(fs.solve, scenario).result()
        assert result.scenario.to_toml() == scenario.to_toml()
        assert image(result, tmp_path) == serial["return"]
        with pytest.raises(fs.ScenarioError) as caught:
            pool.submit(fs.load, SCENARIOS / "pulley.toml", {"solver.rtoll": 1}).result()
        assert caught.value.faults == [
            "overrides: solver.rtoll: unknown key 'rtoll' (did you mean 'rtol'?)"
        ]


FIRST_USE = """
import sys
from concurrent.futures import ThreadPoolExecutor
from hashlib import sha256
from threading import Barrier

import frictionsim as fs
from tests.support.scenarios import SCENARIOS

sys.setswitchinterval(1e-6)
barrier = Barrier(8)
names = ["pulley", "epicyclic", "marble_machine", "pulley_horizontal"] * 2


def solve(name):
    barrier.wait()
    result = fs.solve(SCENARIOS / f"{name}.toml", {"output.interval": 0.02})
    result.dataset, result.events, result.scenario, result._repr_html_()
    fs.compare(result, result), fs.static(result.scenario)
    channels = result.record.channels.items()
    return sha256(repr(sorted((name, data.tobytes()) for name, data in channels)).encode())


with ThreadPoolExecutor(8) as pool:
    digests = [digest.hexdigest() for digest in pool.map(solve, names)]
assert digests[:4] == digests[4:], digests
print("equal", len(set(digests)))
"""


@pytest.mark.slow
def test_threads_may_use_the_package_first() -> None:
    """Nothing but the bare package is imported when eight threads start."""
    for _ in range(3):
        done = python("-c", FIRST_USE)
        assert done.stdout == "equal 4\n", done.stderr


FIRST_BELT = """
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import frictionsim as fs
from tests.support.scenarios import SCENARIOS

data = {short}
barrier = Barrier(3)


def solve(number):
    barrier.wait()
    return fs.solve(data).record.channels["pulley_speed"].tobytes()


with ThreadPoolExecutor(3) as pool:
    print("equal", len(set(pool.map(solve, range(3)))))
"""


def test_threads_may_solve_the_first_belt_of_a_process() -> None:
    """Kernels are loaded, or compiled, by several threads at once."""
    data = pair(solver__backend="moreau", solver__rtol=None)
    solved("belt")  # compiles them if need be
    done = python("-c", FIRST_BELT.format(short=repr(data)))
    assert done.stdout == "equal 1\n", done.stderr


def drawn(result: fs.Result) -> bytes:
    picture = BytesIO()
    fs.plot(result, channels=["angle", "mode"]).savefig(picture, format="png", dpi=50)
    return picture.getvalue()


@pytest.mark.slow
def test_threads_write_results_at_once(tmp_path: Path) -> None:
    whole, source = tmp_path / "whole.h5", SCENARIOS / "pulley.toml"
    fs.solve(source, output=whole)
    files = [tmp_path / f"{number}.h5" for number in range(24)]
    with ThreadPoolExecutor(4) as pool:
        results = list(pool.map(lambda file: fs.solve(source, output=file), files))
    assert {result.status for result in results} == {"done"}
    assert {file.read_bytes() for file in files} == {whole.read_bytes()}
