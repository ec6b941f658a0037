"""Sweeps on a cluster of Dask, with a real scheduler and workers."""

import logging
import os
import signal
import socket
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import frictionsim as fs
from frictionsim.parameter_study import dask_cluster, dispatch
from frictionsim.parameter_study.dask_cluster import DaskCluster
from frictionsim.parameter_study.design import design_of
from frictionsim.parameter_study.sweep import SweepPlan
from frictionsim.parameter_study.values import values_by_key
from frictionsim.simulation.monitor import SweepProgress
from tests.support.sweep_files import LOAD, LOOSE, PULLEY

RUNS = 300
VARY = {LOAD: f"lin(2000, 2400, {RUNS})"}


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """A scheduler and two worker processes."""
    distributed = pytest.importorskip("distributed", reason="the extra dask is not installed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=logging.CRITICAL
    ) as address:
        yield address


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="kills a worker")
def test_a_worker_that_is_killed_costs_nothing(
    cluster: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: Any
) -> None:
    # Many blocks, so that some are done and some are not, however fast the machine is.
    monkeypatch.setattr(DaskCluster, "seconds_of_a_block", 0.01)
    monkeypatch.setattr(dispatch, "MAX_TOGETHER", 10)
    monkeypatch.setattr(dispatch, "SECONDS_BETWEEN_TICKS", 0.0)
    killed: list[int] = []

    def kill_one(sweep: SweepProgress) -> None:
        if not killed and 10 < sweep.done < sweep.total:
            killed.append(next(iter(cluster.workers.values())).pid)
            os.kill(killed[0], signal.SIGKILL)

    serial, spread = tmp_path / "serial.h5", tmp_path / "spread.h5"
    fs.sweep(PULLEY, VARY, LOOSE, output=serial, workers=1)
    address = cluster.scheduler_address
    capfd.readouterr()
    sweep = fs.sweep(PULLEY, VARY, LOOSE, output=spread, dask=address, progress=kill_one)
    assert killed
    assert spread.read_bytes() == serial.read_bytes()
    assert sweep["status"].values.tolist() == [1] * RUNS
    assert capfd.readouterr() == ("", "")
    assert sorted(os.listdir(tmp_path)) == ["serial.h5", "spread.h5"]


def test_what_does_not_fit_is_one_sentence(
    cluster: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    address, output = cluster.scheduler_address, tmp_path / "s.h5"
    with pytest.raises(fs.InputError, match=r"vary: mechanism.load=-1.0 is not valid"):
        fs.sweep(PULLEY, {LOAD: [2000.0, -1.0]}, LOOSE, output=output, dask=address)
    monkeypatch.setattr(dask_cluster, "__version__", "9.9")
    with pytest.raises(fs.InputError) as refused:
        fs.sweep(PULLEY, VARY, LOOSE, output=output, dask=address)
    assert f"has frictionsim {fs.__version__}; this is frictionsim 9.9: install" in str(
        refused.value
    )
    assert os.listdir(tmp_path) == []


def test_a_scheduler_that_does_not_answer_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("distributed", reason="the extra dask is not installed")
    monkeypatch.setattr(dask_cluster, "SECONDS_TO_ANSWER", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as silent:  # takes connections, and says nothing
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        with pytest.raises(fs.InputError, match=f"dask {address}: no scheduler answers there"):
            fs.sweep(PULLEY, VARY, LOOSE, output=tmp_path / "s.h5", dask=address)
    assert os.listdir(tmp_path) == []


def test_a_missing_extra_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(fs.InputError) as refused:
        fs.sweep(PULLEY, VARY, LOOSE, dask="local:2")
    assert str(refused.value) == (
        "dask: the package distributed is not installed; install it with"
        " pip install 'frictionsim[dask]'"
    )


def test_workers_know_how_many_runs_there_are() -> None:
    """Few go alone, however long the blocks are."""
    cluster: Any = DaskCluster.__new__(DaskCluster)
    cluster._plan = None
    cluster._client = SimpleNamespace(submit=lambda made, *arguments, pure: made(*arguments))
    design = design_of(values_by_key([("mechanism.load", "lin(2000.0, 2400.0, 5000)")]))
    plan = SweepPlan(fs.load("pulley"), design)
    cluster.start(plan, lambda: None)
    assert cluster._combinations.__reduce__() == plan.combinations.__reduce__()
