"""Results as plain data for JSON: the objects that the command line prints with --json."""

from typing import TYPE_CHECKING, Any

from frictionsim.results import finite, quantities_json

if TYPE_CHECKING:
    from frictionsim.api.result import Result
    from frictionsim.io.comparison import Comparison
    from frictionsim.results import Transition


def result_json(result: "Result") -> dict[str, Any]:
    """Return the JSON object of a result.

    Parameters
    ----------
    result : Result
        With estimated errors, each quantity gets an `error`, and the object `error_estimate`.
    """
    attributes = result.record.attributes
    statistics = result.statistics
    data: dict[str, Any] = {
        "scenario": result.origin.source or None,
        "overrides": result.origin.values,
        "kind": result.kind,
        "law": attributes.get("law") or None,
        "backend": attributes["backend"],
        "status": result.status,
        "reason": result.reason,
        "failure": result.failure,
        "quantities": quantities_json(result.quantities),
        "events": [_event_json(e) for e in result.record.transitions],
        "solver": {} if statistics is None else statistics._asdict(),
        "effects": list(result.effects),
        "audit": {
            name: {"value": finite(check.value), "limit": finite(check.limit), "ok": check.ok}
            for name, check in result.audit.items()
        },
        "warnings": list(result.warnings),
        "output": None if result.path is None else str(result.path),
    }
    if result.error_estimate:
        for name, quantity in data["quantities"].items():
            quantity["error"] = finite(result.errors.get(name))
        data["error_estimate"] = result.error_estimate
    return data


def comparison_json(comparison: "Comparison") -> dict[str, Any]:
    """Return the JSON object of a comparison."""
    return {
        "same": comparison.same,
        "rows": [
            {
                "channel": row.name,
                "difference": finite(row.difference),
                "allowed": finite(row.allowed),
                "time": finite(row.time),
                "ok": row.ok,
                "note": row.note,
            }
            for row in comparison.rows
        ],
        "notes": list(comparison.notes),
    }


def _event_json(e: "Transition") -> dict[str, Any]:
    event = {
        "time": e.time,
        "contact": e.contact,
        "mode_from": e.mode_from,
        "mode_to": e.mode_to,
    }
    return event if e.position is None else {**event, "angle": e.position}
