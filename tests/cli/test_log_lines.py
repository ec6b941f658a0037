"""`-v` and `-vv` log what runs, on stderr."""

import logging
from pathlib import Path

import pytest

from frictionsim.errors import OutputError
from frictionsim.io.destination import Destination
from tests.cli.conftest import Run, strict_json
from tests.support.scenarios import SCENARIOS

PULLEY = str(SCENARIOS / "pulley.toml")
BELT = str(SCENARIOS / "belt_verification.toml")
SCENARIO = (
    f"frictionsim: scenario {PULLEY}: kind pulley, effects shaft_friction, viscous_damping,"
    " law set-valued, backend events"
)


def lines(err: str) -> list[str]:
    """Return the lines of a log without what differs between runs."""
    return [line.partition(", wall time")[0] for line in err.splitlines()]


def test_without_v_nothing_is_logged(told: Run) -> None:
    assert told("solve", PULLEY, "-q") == ("", "")


def test_v_tells_what_runs_and_what_is_written(told: Run) -> None:
    out, err = told("solve", PULLEY, "-q", "-v")
    assert out == ""
    assert lines(err) == [
        SCENARIO,
        "frictionsim: the run starts",
        "frictionsim: run done at t = 3 s: samples 302, events 1, steps 139, rejected 0",
        "frictionsim: result written: results/pulley.h5",
    ]


def test_vv_tells_overrides_limits_events_and_audit(told: Run) -> None:
    _, err = told("solve", PULLEY, "-q", "-vv", "--set", "solver.max_steps=500", "--max-wall", "60")
    assert lines(err)[:5] == [
        "frictionsim: limit: 60 s of wall time",
        SCENARIO,
        "frictionsim: overridden: solver.max_steps=500",
        "frictionsim: limit: 500 steps",
        "frictionsim: the run starts",
    ]
    assert "frictionsim: event at t = 0.546448475 s: shaft from stick to sliding_forward" in err
    assert "frictionsim: audit friction_law: 0, limit 1e-12" in err


def test_the_log_is_not_in_the_json(told: Run) -> None:
    out, err = told("solve", PULLEY, "--json", "-vv")
    assert strict_json(out)["status"] == "done"
    assert SCENARIO in err


def test_an_incomplete_result_and_its_resumption_are_logged(told: Run) -> None:
    _, err = told("solve", PULLEY, "-o", "a.h5", "-q", "-v", "--max-steps", "100", code=5)
    assert "frictionsim: run failed at t = " in err
    assert "frictionsim: incomplete result written: a.h5 (limit of 100 steps" in err
    _, err = told("resume", "a.h5", "-q", "-v")
    assert "frictionsim: the run is resumed" in err
    assert lines(err)[-1] == "frictionsim: result written: a.h5"


def test_the_removal_of_an_incomplete_result_is_logged(told: Run) -> None:
    told("solve", PULLEY, "-o", "a.h5", "-q")
    told("solve", PULLEY, "-o", "a.h5", "-q", "--max-steps", "100", code=5)
    _, err = told("resume", "a.partial.h5", "-q", "-v")
    assert lines(err)[-2:] == [
        "frictionsim: result written: a.h5",
        "frictionsim: incomplete result removed: a.partial.h5",
    ]


def test_checkpoints_are_logged(told: Run) -> None:
    # Each step is written to the disk: a short run.
    options = ["--set", "output.checkpoint=1e-9", "--set", "solver.duration=0.56"]
    _, err = told("solve", PULLEY, "-q", "-v", "-o", "a.h5", *options)
    assert "frictionsim: incomplete result written: a.h5 (checkpoint at t = " in err


def test_the_folder_of_kernels_and_the_transitions_of_a_belt_are_logged(told: Run) -> None:
    from frictionsim.mechanisms.belt_drive.kernels import jit

    jit._folder.cache_clear()
    _, err = told("solve", BELT, "-q", "-vv", "-o", "a.h5", "--set", "solver.duration=1e-3")
    assert "frictionsim: folder of the compiled kernels: " in err
    assert "kind belt_drive" in err


def test_a_checkpoint_that_cannot_be_written_is_a_warning_without_v(
    told: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = Destination.write

    def refuse_parts(self: Destination, run: object) -> object:
        if run.status != "done":  # type: ignore[attr-defined]
            raise OutputError("the disk is full")
        return write(self, run)  # type: ignore[arg-type]

    monkeypatch.setattr(Destination, "write", refuse_parts)
    _, err = told("solve", PULLEY, "-q", "-o", "a.h5", "--set", "output.checkpoint=1e-9")
    assert err == "frictionsim: warning: checkpoint not written: the disk is full\n"
    assert Path("a.h5").exists()


def test_python_has_the_same_log(told: Run, caplog: pytest.LogCaptureFixture) -> None:
    import frictionsim as fs

    with caplog.at_level(logging.INFO, logger="frictionsim"):
        fs.solve(PULLEY)
    names = [record.name.removeprefix("frictionsim.simulation.") for record in caplog.records]
    assert names == ["run_log", "simulate", "run_log"]
