"""Sweeps on a cluster of Dask, with a real scheduler and workers."""

import logging
import os
import shutil
import signal
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from tests.support.scenarios import ROOT
from tests.support.sweep_files import LOAD, LOOSE, PULLEY

RUNS = 600  # in many blocks of which some are done and some are not when one is seen
VARY = {LOAD: f"lin(2000, 2400, {RUNS})"}


@pytest.fixture
def distributed() -> Any:
    return pytest.importorskip("distributed", reason="the extra dask is not installed")


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="kills a worker")
def test_a_killed_worker_costs_nothing_and_a_lost_scheduler_ends_the_sweep(
    distributed: Any, tmp_path: Path, capfd: Any
) -> None:
    killed: list[int] = []

    def kill_one(sweep: Any) -> None:
        if not killed and 10 < sweep.done < sweep.total:
            killed.append(next(iter(cluster.workers.values())).pid)
            os.kill(killed[0], signal.SIGKILL)

    def lose(sweep: Any) -> None:
        if 0 < sweep.done < sweep.total:
            cluster.close()

    whole, spread, lost = (tmp_path / f"{name}.h5" for name in ("whole", "spread", "lost"))
    fs.sweep(PULLEY, VARY, LOOSE, output=whole, workers=1)
    quiet: dict[str, Any] = {"dashboard_address": None, "silence_logs": logging.CRITICAL}
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, **quiet) as cluster:
        dask = cluster.scheduler_address
        capfd.readouterr()
        sweep = fs.sweep(PULLEY, VARY, LOOSE, output=spread, dask=dask, progress=kill_one)
        assert killed
        assert spread.read_bytes() == whole.read_bytes()
        assert sweep["status"].values.tolist() == [1] * RUNS
        assert capfd.readouterr() == ("", "")
        with pytest.raises(fs.SolverError, match="dask: lost the connection to the") as ended:
            fs.sweep(PULLEY, VARY, LOOSE, output=lost, dask=dask, progress=lose)
    assert ended.value.exit_code == 5
    fs.resume_sweep(tmp_path / "lost.partial.runs", workers=2)
    assert lost.read_bytes() == whole.read_bytes()


@pytest.mark.slow
@pytest.mark.dev
def test_a_worker_of_another_version_is_refused(distributed: Any, tmp_path: Path) -> None:
    other, output = tmp_path / "other", tmp_path / "s.h5"
    shutil.copytree(ROOT / "frictionsim", other / "frictionsim")
    (other / "frictionsim" / "version.py").write_text('__version__ = "9.9"\n')
    with distributed.LocalCluster(n_workers=0, dashboard_address=":0") as empty:
        address = empty.scheduler_address
        worker = subprocess.Popen(
            [sys.executable, "-m", "distributed.cli.dask_worker", address, "--no-nanny"],
            cwd=other,
            env={**os.environ, "PYTHONPATH": str(other)},
            stderr=subprocess.DEVNULL,
        )
        try:
            with pytest.raises(fs.InputError) as refused:
                fs.sweep(PULLEY, VARY, LOOSE, output=output, dask=address)
        finally:
            worker.kill()
            worker.wait()
    told = f"has frictionsim 9.9; this is frictionsim {fs.__version__}: install the same there"
    assert told in str(refused.value)
    assert os.listdir(tmp_path) == ["other"]


@pytest.mark.dev
def test_a_scheduler_that_is_not_there_is_reported(distributed: Any, tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as closed:
        address = f"tcp://127.0.0.1:{closed.getsockname()[1]}"
    with pytest.raises(fs.InputError, match=f"dask {address}: no scheduler with workers answers"):
        fs.sweep(PULLEY, VARY, LOOSE, output=tmp_path / "s.h5", dask=address)
    assert os.listdir(tmp_path) == []


def test_a_missing_extra_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    missing = "is not installed; 'pip install distributed' brings it"
    with pytest.raises(fs.InputError, match=missing):
        fs.sweep(PULLEY, VARY, LOOSE, dask="local:2")
