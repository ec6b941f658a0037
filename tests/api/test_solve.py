"""`solve` and `resume`: what they return, write, raise and tell while they run."""

import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim import errors
from frictionsim.errors import Interrupted
from frictionsim.results import Check
from tests.simulation.test_failures import FAILURES
from tests.support.scenarios import SCENARIOS, pulley

PULLEY = SCENARIOS / "pulley.toml"
MU_S = "effects.shaft_friction.mu_s"


def stopping_at(time: float) -> Callable[[float], None]:
    """Return a callback that stops a run as a signal does."""

    def on_step(t: float) -> None:
        if t >= time:
            raise Interrupted(15, t)

    return on_step


def bytes_of(result: fs.Result, folder: Path) -> bytes:
    return result.save(folder / "bytes.h5").read_bytes()


def test_a_result_has_what_the_run_has() -> None:
    scenario = fs.load(PULLEY)
    result = fs.solve(scenario)
    done = result.record
    assert (result.status, result.reason, result.failure) == ("done", "", "")
    assert (result.kind, result.title, result.effects) == (
        "pulley",
        "Pulley on a dry shaft",
        ("shaft_friction", "viscous_damping"),
    )
    assert result.scenario is scenario
    assert result.origin == scenario.origin
    assert result.quantities == done.quantities
    assert result.quantities["breakaway_time"].unit == "s"
    assert result.audit == done.checks
    assert result.warnings == done.warnings
    assert (result.errors, result.error_estimate, result.path) == ({}, "", None)
    statistics, expected = result.statistics, done.statistics
    assert statistics is not None
    assert statistics[:4] == expected[:4]
    assert statistics.wall_seconds is not None
    assert result.exit_code == 0
    assert result.check() is result
    assert np.array_equal(result.dataset["time"], done.time)
    for name, values in done.channels.items():
        assert np.array_equal(result.dataset[name], values), name
    assert result.events["time"].values.tolist() == [e.time for e in done.transitions]


def test_a_path_a_dict_and_a_scenario_give_the_same_data(tmp_path: Path) -> None:
    # The origin is in the file, so that only runs of one origin have the same bytes.
    expected = bytes_of(fs.solve(fs.load(PULLEY, {MU_S: 0.3})), tmp_path)
    assert bytes_of(fs.solve(PULLEY, {MU_S: 0.3}), tmp_path) == expected
    assert bytes_of(fs.solve(str(PULLEY), [f"{MU_S}=0.3"]), tmp_path) == expected
    assert bytes_of(fs.solve(fs.load(PULLEY), {MU_S: 0.3}), tmp_path) == expected
    of_dict = fs.solve(pulley(), {MU_S: 0.3})
    assert of_dict.dataset.equals(fs.solve(PULLEY, {MU_S: 0.3}).dataset)
    assert of_dict.record.attributes["source"] == ""


def test_output_is_the_file_of_the_command_line(tmp_path: Path, cli: Callable[..., Any]) -> None:
    result = fs.solve(PULLEY, {MU_S: 0.3}, output=tmp_path / "a.h5")
    assert result.path == tmp_path / "a.h5"
    done = cli("solve", PULLEY, "-q", "-o", "b.h5", "--set", f"{MU_S}=0.3")
    assert (done.returncode, done.stderr) == (0, "")
    written = (tmp_path / "b.h5").read_bytes()
    assert (tmp_path / "a.h5").read_bytes() == written
    assert result.save(tmp_path / "c.h5").read_bytes() == written
    assert fs.open(tmp_path / "a.h5").save(tmp_path / "d.h5").read_bytes() == written


# --- runs that fail -------------------------------------------------------------------------


@pytest.mark.parametrize("name", FAILURES)
def test_a_failed_run_raises_only_if_asked(name: str) -> None:
    data, where, advice = FAILURES[name]
    result = fs.solve(data)
    assert (result.status, result.failure) == ("failed", name)
    assert where in result.reason
    kind = errors.failure_class(name)
    code = 5 if name == "budget_exceeded" else 1
    assert (result.exit_code, kind.failure) == (code, name)
    for call in (lambda: fs.solve(data, check=True), result.check):
        with pytest.raises(fs.SolverError) as caught:
            call()
        assert type(caught.value) is kind
        assert caught.value.exit_code == code
        assert str(caught.value).startswith("run failed: ")
        assert advice in str(caught.value)


def test_check_says_where_the_samples_are(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with pytest.raises(errors.BudgetExceeded) as caught:
        fs.solve(PULLEY, {"solver.max_steps": 10}, output=path, check=True)
    part = tmp_path / "a.partial.h5"
    assert str(caught.value).endswith(f" (samples up to this time are in {part})")
    assert fs.open(path).failure == "budget_exceeded"
    with pytest.raises(errors.BudgetExceeded) as again:
        fs.open(path).check()
    assert str(again.value) == str(caught.value)


def test_an_interrupted_run_has_the_exit_code_of_its_signal(tmp_path: Path) -> None:
    result = fs.solve(PULLEY, progress=stopping_at(1.0))
    assert (result.status, result.exit_code) == ("interrupted", 143)
    for each in (result, fs.open(result.save(tmp_path / "a.h5"))):
        assert each.exit_code == 143
        with pytest.raises(fs.SolverError) as caught:
            each.check()
        assert str(caught.value).startswith("run interrupted: by SIGTERM at t = ")
        assert caught.value.exit_code == 143


def test_a_failed_audit_is_an_error_only_if_asked(tmp_path: Path) -> None:
    done = fs.solve(PULLEY).record
    checks = done.checks | {"energy_balance": Check(0.5, 0.01)}
    reason = "self-audit failed: energy_balance 0.5 above 0.01"
    failed = done._replace(checks=checks, attributes=done.attributes | {"reason": reason})
    result = fs.open(fs.Result(failed).save(tmp_path / "a.h5"))
    assert (result.status, result.exit_code) == ("done", 3)
    assert not result.audit["energy_balance"].ok
    with pytest.raises(fs.AuditError) as caught:
        result.check()
    assert str(caught.value) == "self-audit failed: energy_balance 0.5 above 0.01"
    assert caught.value.exit_code == 3


# --- resuming -------------------------------------------------------------------------------


def test_a_run_is_resumed_in_memory_to_the_same_bytes(tmp_path: Path) -> None:
    whole = bytes_of(fs.solve(PULLEY), tmp_path)
    part = fs.solve(PULLEY, progress=stopping_at(0.3))
    assert part.record.checkpoint is not None
    further = fs.resume(part, progress=stopping_at(1.2))
    assert (further.status, further.path) == ("interrupted", None)
    result = fs.resume(further, check=True)
    assert (result.status, result.record.checkpoint, result.path) == ("done", None, None)
    assert bytes_of(result, tmp_path) == whole
    # The parts are as they were.
    assert bytes_of(fs.resume(part), tmp_path) == whole


def test_a_run_is_resumed_from_its_file_to_the_same_bytes(tmp_path: Path) -> None:
    whole = bytes_of(fs.solve(PULLEY), tmp_path)
    path = tmp_path / "a.h5"
    part = fs.solve(PULLEY, output=path, progress=stopping_at(0.6))
    assert part.path == tmp_path / "a.partial.h5"
    copied = fs.open(path).save(tmp_path / "copy.h5")
    assert copied == tmp_path / "copy.partial.h5"
    assert copied.read_bytes() == part.path.read_bytes()
    result = fs.resume(path)  # where only the unfinished one stands
    assert (result.status, result.path) == ("done", path)
    assert path.read_bytes() == whole
    elsewhere = fs.resume(copied, output=tmp_path / "other.h5")
    assert elsewhere.path == tmp_path / "other.h5"
    assert (tmp_path / "other.h5").read_bytes() == whole


def test_max_wall_stops_a_run_that_can_be_resumed(tmp_path: Path) -> None:
    cycles = SCENARIOS / "hard" / "many_cycles.toml"
    part = fs.solve(cycles, max_wall=0.05)
    assert (part.status, part.failure, part.exit_code) == ("failed", "budget_exceeded", 5)
    assert part.reason.startswith("wall-time limit of 0.05 s reached at t = ")
    again = fs.resume(part, max_wall=0.05)
    assert again.failure == "budget_exceeded"
    assert again.dataset["time"][-1] > part.dataset["time"][-1]


def test_a_copy_without_its_state_is_saved_with_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = fs.solve(PULLEY, progress=stopping_at(0.6)).save(tmp_path / "a.h5")
    part = fs.open(path)
    path.unlink()
    with caplog.at_level(logging.WARNING, "frictionsim"):
        part.save(tmp_path / "b.h5")
    assert [record.getMessage() for record in caplog.records] == [
        f"saved without the state to resume from: {path}: cannot read this result: there is no such"
        " file"
    ]
    with pytest.raises(fs.InputError, match="it has no checkpoint"):
        fs.resume(tmp_path / "b.h5")


# --- progress, error estimate, arguments ----------------------------------------------------


def test_progress_calls_with_the_time_of_each_step() -> None:
    times: list[float] = []
    result = fs.solve(PULLEY, progress=times.append)
    assert result.statistics is not None
    assert times == sorted(times)
    assert len(times) >= result.statistics.steps
    assert times[-1] > 2.9


def test_progress_shows_a_bar_on_a_terminal_only(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("FORCE_COLOR", "TTY_COMPATIBLE"):
        monkeypatch.delenv(name, raising=False)
    for wanted in (False, True):
        fs.solve(PULLEY, progress=wanted)
        captured = capsys.readouterr()
        assert (captured.out, captured.err) == ("", "")
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setattr("frictionsim.api.progress.SECONDS_WITHOUT_BAR", 0.0)
    monkeypatch.setenv("FORCE_COLOR", "1")  # rich takes any stream for a terminal then
    fs.solve(PULLEY, {"solver.max_step": 1e-3}, progress=True)
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "t = " in captured.err
    assert "of 3 s" in captured.err


@pytest.mark.parametrize("error", [KeyError("mine"), ZeroDivisionError("mine")])
def test_an_exception_of_progress_ends_the_run(error: Exception) -> None:
    def broken(t: float) -> None:
        raise error

    with pytest.raises(type(error)) as raised:
        fs.solve(PULLEY, progress=broken)
    assert raised.value is error
