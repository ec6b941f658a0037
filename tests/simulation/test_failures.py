"""Failed runs: the name of the failure in file and JSON, the message, the samples kept."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

import frictionsim as fs
from frictionsim import errors
from tests.support.scenarios import Scenario, pulley, simulate

PUBLISHED = {"effects__shaft_friction__law": "published"}
# A time constant of I/b = 1 ms in steps of 10 ms.
UNSTABLE = pulley(
    effects__viscous_damping__coefficient=1355.0,
    **PUBLISHED,
    solver={"backend": "rkf45", "duration": 30.0, "step": 1e-2},
)
RETURNS = {"time": [0.0, 0.8, 4.0, 4.8], "value": [1832.6, 3113.75, 3113.75, 2224.1]}
FAILURES: dict[str, tuple[Scenario, str, str]] = {
    "non_finite": (
        pulley(
            mechanism__load=1e50,
            mechanism__inertia=1e-50,
            mechanism__cord_radius=1e50,
            effects__viscous_damping__coefficient=1e50,
        ),
        "after t = 0 s",
        "check the scenario for forces or coefficients that are too large",
    ),
    "diverged": (UNSTABLE, "at t = ", "give a shorter solver.step or max_step"),
    "step_underflow": (
        pulley(
            **PUBLISHED, solver={"backend": "rkf45", "rtol": 1e-14, "atol": 1e-30, "duration": 3.0}
        ),
        "at t = ",
        "give a larger solver.rtol or atol",
    ),
    "chattering": (
        pulley(
            drive__force=RETURNS,
            **PUBLISHED,
            solver={"backend": "rkf45", "duration": 12.0},
        ),
        "chattering at t = ",
        "use law 'set-valued'",
    ),
    "budget_exceeded": (
        pulley(solver__max_steps=10),
        "limit of 10 steps reached at t = ",
        "resume the run",
    ),
}


@pytest.mark.parametrize("name", FAILURES)
def test_failures_are_named_in_file_json_and_message(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario, where, advice = FAILURES[name]
    (tmp_path / "s.toml").write_text(tomli_w.dumps(scenario))
    target = tmp_path / "a.h5"
    code = 5 if name == "budget_exceeded" else 1
    command = ["solve", str(tmp_path / "s.toml"), "-o", str(target), "--json"]
    assert fs.run_command_line(command) == code
    captured = capsys.readouterr()
    summary = json.loads(captured.out)
    assert (summary["status"], summary["failure"]) == ("failed", name)
    reason = summary["reason"]
    assert where in reason
    assert advice in reason
    assert "'shaft'" in reason
    assert f"frictionsim: run failed: {reason}" in captured.err
    part = tmp_path / "a.partial.h5"
    assert f"samples up to this time are in {part}, status 'failed'" in captured.err
    kept = fs.open(part).record
    assert kept.channels["time"].size > (where != "after t = 0 s")
    attributes = {key: kept.attributes[key] for key in ("status", "failure", "reason")}
    assert attributes == {"status": "failed", "failure": name, "reason": reason}
    assert all(np.isfinite(channel).all() for channel in kept.channels.values())


@pytest.mark.parametrize("at_events", [True, False])
def test_quantities_of_a_failed_run_end_at_its_last_sample(at_events: bool) -> None:
    """It breaks away at 0.05 s, chatters at 0.5 s, and is sampled every 0.7 s."""
    run = simulate(
        pulley(
            drive__force={"time": [0.0, 0.1, 0.2, 0.3], "value": [2224.1, 3113.75, 2700.0, 2224.1]},
            **PUBLISHED,
            solver={"backend": "rkf45", "duration": 3.0},
            output={"interval": 0.7, "at_events": at_events},
        )
    )
    assert run.failure == "chattering"
    first, last = run.transitions[0].time, run.transitions[-1].time
    assert 0.0 < first < last < 0.7
    values = {name: run.quantities[name].value for name in ("breakaway_time", "final_time")}
    if at_events:
        assert values == {"breakaway_time": first, "final_time": last}
    else:
        assert values == {"breakaway_time": None, "final_time": 0.0}


def test_failure_names_are_unique() -> None:
    def kinds(of: Any) -> list[Any]:
        return [k for kind in of.__subclasses__() for k in (kind, *kinds(kind))]

    names = [
        kind.failure
        for kind in kinds(errors.SolverError)
        if not issubclass(kind, errors.Interrupted | errors.WorkerDied)  # of no single run
    ]
    assert sorted(names) == sorted({*FAILURES, "belt_off_pulleys"})
