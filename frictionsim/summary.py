"""The figures of a run, and the one JSON object that scripts read."""

from typing import TYPE_CHECKING, Any

from frictionsim.quantities import Quantities, Quantity, finite, quantities_json
from frictionsim.series import STICK

if TYPE_CHECKING:
    from frictionsim.audit import Check
    from frictionsim.run import Run


def figures(run: "Run") -> Quantities:
    """Return the summary's quantities: the mechanism's own, then those of any motion.

    breakaway_time is when a contact first goes over from stick to slip; None if it never does.
    """
    series = run.series
    found = run.mechanism.figures(series)
    if run.mechanism.contact is not None:
        slips = (e.time for e in series.transitions if e.mode_from == STICK)
        rests = [e.time for e in series.transitions if e.mode_to == STICK]
        found["breakaway_time"] = Quantity(next(slips, None), "s")
        found["last_rest_time"] = Quantity(rests[-1] if rests else None, "s")
    if series.time.size:
        found["final_time"] = Quantity(float(series.time[-1]), "s")
        found["final_angle"] = Quantity(float(series.position[-1]), "rad")
        found["final_angular_velocity"] = Quantity(float(series.velocity[-1]), "rad/s")
        for name, energy in (*series.ledger.items(), *series.stores.items()):
            found[name] = Quantity(float(energy[-1]), "J")
    return found


def run_json(run: "Run", checks: dict[str, "Check"], scenario: str, output: str) -> dict[str, Any]:
    """Return the JSON object of a run.

    Parameters
    ----------
    run : Run
    checks : dict
        Of the audit.
    scenario, output : str
        Paths of the scenario and of the result file.
    """
    return {
        "scenario": scenario,
        "kind": run.scene.kind,
        "backend": run.scene.solver.backend,
        "status": run.status,
        "reason": run.reason,
        "quantities": quantities_json(figures(run)),
        "events": [
            {
                "time": e.time,
                "contact": e.contact,
                "mode_from": e.mode_from,
                "mode_to": e.mode_to,
                "angle": e.position,
            }
            for e in run.series.transitions
        ],
        "solver": run.counts._asdict(),
        "effects": list(run.mechanism.effects),
        "audit": {
            name: {"value": finite(check.value), "limit": check.limit, "ok": check.ok}
            for name, check in checks.items()
        },
        "output": output,
    }
