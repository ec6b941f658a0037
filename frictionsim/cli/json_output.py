"""The JSON object that `solve` and `resume` print with --json."""

from typing import TYPE_CHECKING, Any

from frictionsim.results import finite, quantities_json

if TYPE_CHECKING:
    from frictionsim.results import Transition
    from frictionsim.simulation.simulate import RunResult
    from frictionsim.work_precision.error_estimate import Estimate


def run_json(
    run: "RunResult", source: str, output: str | None, estimate: "Estimate | None" = None
) -> dict[str, Any]:
    """Return the JSON object of a run.

    Parameters
    ----------
    run : RunResult
    source : str
        Path of the scenario.
    output : str or None
        Path of the result file; None if none was written.
    estimate : Estimate, optional
        Adds `error` to each quantity and `error_estimate`, the method, to the object.

    Returns
    -------
    dict
    """
    data = _run_json(run, source, output)
    if estimate is not None:
        for name, quantity in data["quantities"].items():
            quantity["error"] = finite(estimate.errors.get(name))
        data["error_estimate"] = estimate.method
    return data


def _run_json(run: "RunResult", source: str, output: str | None) -> dict[str, Any]:
    return {
        "scenario": source,
        "kind": run.scenario.kind,
        "law": run.scenario.law or None,
        "backend": run.scenario.solver.backend,
        "status": run.status,
        "reason": run.reason,
        "failure": run.failure,
        "quantities": quantities_json(run.quantities),
        "events": [_event_json(e) for e in run.transitions],
        "solver": run.statistics._asdict(),
        "effects": list(run.effects),
        "audit": {
            name: {"value": finite(check.value), "limit": check.limit, "ok": check.ok}
            for name, check in run.checks.items()
        },
        "warnings": list(run.warnings),
        "output": output,
    }


def _event_json(e: "Transition") -> dict[str, Any]:
    event = {
        "time": e.time,
        "contact": e.contact,
        "mode_from": e.mode_from,
        "mode_to": e.mode_to,
    }
    return event if e.position is None else {**event, "angle": e.position}
