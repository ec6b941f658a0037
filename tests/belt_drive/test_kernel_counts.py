"""Kernels compiled for a run: few functions, and none twice."""

import json
import logging
import os
import subprocess
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

import frictionsim as fs
from frictionsim.cli.commands import run_command_line
from frictionsim.mechanisms.belt_drive import numba_kinds
from tests.support.scenarios import ROOT, SCENARIOS

# A large function more is 0.15 s more on one core; seven make a second. Loops over vectors are
# functions of a few lines, of which many take less time than a few with versions for overlaps.
MAX_FUNCTIONS = {"moreau": 34, "rkf45": 39}

COUNT = """
import json, sys
from numba.core import event
import frictionsim as fs
from frictionsim.mechanisms.belt_drive import simulation
from frictionsim.simulation.monitor import RunMonitor

drive = simulation(fs.load(sys.argv[1], {"solver.duration": 1e-3}, backend=sys.argv[2]))
with event.install_recorder("numba:compile") as recorder:
    drive.prepare(RunMonitor())
    drive.solve(lambda t: None)
starts = (one for _, one in recorder.buffer if one.is_start)
print(json.dumps([one.data["dispatcher"].py_func.__name__ for one in starts]))
"""


@pytest.mark.slow
@pytest.mark.parametrize("backend", MAX_FUNCTIONS)
def test_a_cold_run_compiles_few_functions(backend: str, tmp_path: Path) -> None:
    command = [sys.executable, "-c", COUNT, str(SCENARIOS / "belt_drive.toml"), backend]
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path), "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    functions = json.loads(done.stdout)
    assert len(functions) <= MAX_FUNCTIONS[backend], functions
    assert "solve_dampers" not in functions, "of dampers that no step solves for"


def test_warm_up_names_combinations_and_compiles_nothing_twice(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    name, only = "belt_drive", SCENARIOS / "belt_drive.toml"
    monkeypatch.setattr("frictionsim.api.scenarios.shipped_scenarios", lambda: {name: only})
    first = fs.warm_up()
    assert [(entry.scenario, entry.backend) for entry in first] == [
        (name, "rkf45"),
        (name, "moreau"),
    ]
    assert [entry.seconds for entry in fs.warm_up("belt_drive")] == [0.0, 0.0]
    assert run_command_line(["warm-up"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "belt_drive, rkf45: compiled already",
        "belt_drive, moreau: compiled already",
        "0.0 s of compilation",
    ]


def doubled(x: float) -> float:
    return 2.0 * x


@pytest.mark.parametrize("inside", ["options.DefaultOptions._nrt", "compiler.Flags.noalias"])
def test_without_the_insides_of_numba_kernels_are_slower_and_no_more(
    inside: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.delattr(f"numba.core.{inside}")
    spec = spec_from_file_location("numba_kinds_of_another_numba", numba_kinds.__file__)
    assert spec is not None
    assert spec.loader is not None
    kinds = module_from_spec(spec)
    with caplog.at_level(logging.INFO):
        spec.loader.exec_module(kinds)
    assert "_nrt" in numba_kinds.OPTIONS
    assert "_nrt" not in kinds.OPTIONS
    assert not kinds.DISJOINT
    assert not kinds.ANNOUNCED
    assert "kernels of belts will be slower" in caplog.text
    monkeypatch.undo()
    twice = kinds.loop(doubled)
    assert kinds.kernel(lambda x: twice(x))(2.0) == 4.0
