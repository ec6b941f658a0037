"""The quantities of a belt drive's summary, and the checks of its run."""

from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.mechanisms.belt_drive.kernels.layout import PULLEY_RADIUS
from frictionsim.mechanisms.belt_drive.slip import (
    ends_of,
    mean_power,
    senses_of,
    slip_percent,
    speed_at_rest,
)
from frictionsim.mechanisms.belt_drive.torque_balance import torque_balance
from frictionsim.results import Check, Quantities, Quantity
from frictionsim.scenario.methods import SET_VALUED
from frictionsim.simulation.averages import last_part, smooth_mean, time_mean

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.composition import BeltModel
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

    Array = npt.NDArray[np.float64]

UNUSED = 1e-6  # of what the springs store: less work than that is none

# A fixed step closes the energies to second order, the adaptive one to its tolerance; both see
# the jumps of contacts that open, which neither locates.
ENERGY_LIMIT = 5e-3
# A run in which less than this share of the stored energy moved has nothing to be relative to.
STORED_SHARE = 1e-3
ROUNDING = 1e-9
# While residual slip relaxes, friction may do a little positive work.
POWER_LIMIT = 1e-3


def quantities_of(
    scenario: "BeltDriveScenario", model: "BeltModel", time: "Array", seen: dict[str, "Array"]
) -> Quantities:
    """Return the summary's quantities; means are over the last fifth of the run.

    Parameters
    ----------
    time : (n,), s
    seen : dict of (n, ...)
        What the observer keeps of each sample.
    """
    found: Quantities = {}
    if not time.size:
        return found
    last = last_part(time)

    def mean(name: str) -> Any:
        return time_mean(time[last], seen[name][last])

    names = scenario.mechanism.names
    found["pretension"] = Quantity(float(seen["_mean_tension"][0]), "N")
    spans = mean("_span_tension")
    found["tension_tight"] = Quantity(float(np.max(spans)), "N")
    found["tension_slack"] = Quantity(float(np.min(spans)), "N")
    for i, name in enumerate(names):
        after = names[(i + 1) % len(names)]
        found[f"tension_{name}_to_{after}"] = Quantity(float(spans[i]), "N")
    power = mean_power(time[last], seen["_torque"][last], seen["_speed"][last])
    # A ripple of 0.1 % of two speeds would be 1 % of their difference, the slip.
    speed = smooth_mean(time[last], seen["_speed"][last])
    ends = ends_of(power)
    found["drive_speed"] = Quantity(float(speed[ends.drive]), "rad/s")
    found["driven_speed"] = Quantity(float(speed[ends.driven]), "rad/s")
    radii = model.system.pulleys.table[PULLEY_RADIUS]
    rims = speed * radii * senses_of(scenario.mechanism.path())
    slip = float(slip_percent(rims, ends, min_rim_speed(scenario, time, seen)))
    found["slip_percent"] = Quantity(slip if isfinite(slip) else None, "%")
    found["efficiency"] = Quantity(
        efficiency(time[last], power, losses(seen, last), _unused_energy(seen)), "1"
    )
    touching, sticking = mean("_touching"), mean("_sticking")
    if model.system.friction is not None:
        share = float(np.sum(sticking) / np.sum(touching)) if np.sum(touching) else None
        found["stick_fraction"] = Quantity(share, "1")
    for j, name in enumerate(names):
        per_body = model.system.chain.length / model.system.pulleys.table[PULLEY_RADIUS, j]
        found[f"contact_arc_{name}"] = Quantity(float(touching[j] * per_body), "rad")
        if model.system.friction is not None:
            found[f"adhesion_arc_{name}"] = Quantity(float(sticking[j] * per_body), "rad")
    found["final_time"] = Quantity(float(time[-1]), "s")
    for name, energy in seen.items():
        if name.startswith("energy"):
            found[name] = Quantity(float(energy[-1]), "J")
    return found


def min_rim_speed(scenario: "BeltDriveScenario", time: "Array", seen: dict[str, "Array"]) -> float:
    """Return the speed below which a rim is at rest, m/s: it may vibrate."""
    last = last_part(time)
    tension = float(np.mean(seen["_span_tension"][last]))
    return speed_at_rest(tension, scenario.mechanism.belt.mass_per_length)


def _unused_energy(seen: dict[str, "Array"]) -> float:
    """Return an energy, J, that is nothing beside what the belt stores."""
    return UNUSED * float(abs(seen["energy_potential"][0]))


def losses(seen: dict[str, "Array"], last: Any) -> float:
    """Return the heat of friction and dampers in a part of a run, J."""
    heats = (seen[name][last] for name in ("energy_friction", "energy_damping") if name in seen)
    return float(sum(heat[-1] - heat[0] for heat in heats))


def efficiency(time: "Array", power: "Array", lost: float, least: float) -> float | None:
    """Return the work that pulleys take out, over that and what is lost on the way.

    That is the work put in less what the drive stores meanwhile, in motion and springs. None where
    nothing is taken out or lost.

    Parameters
    ----------
    time : (n,), s
    power : (np,), W
        The mean of each pulley's, positive into the drive.
    lost : float, J
        In that time.
    least : float, J
        No more than this is nothing.
    """
    require_array = float(np.sum((-power).clip(min=0.0)) * np.ptp(time))
    return require_array / (require_array + lost) if require_array + lost > least else None


def checks_of(
    scenario: "BeltDriveScenario", model: "BeltModel", time: "Array", seen: dict[str, "Array"]
) -> dict[str, Check]:
    """Return the audit: energies over the largest of them, forces over their limits."""
    if not time.size:
        return {}
    changes = {n: v - v[0] for n, v in seen.items() if n.startswith("energy")}
    residual = -changes["energy_input"]
    for name, change in changes.items():
        if name != "energy_input":
            residual = residual + change
    largest = max(float(np.max(np.abs(change))) for change in changes.values())
    largest = max(largest, STORED_SHARE * float(abs(seen["energy_potential"][0])))
    checks = {"energy_balance": _relative(float(np.max(np.abs(residual))), largest, ENERGY_LIMIT)}
    if model.system.friction is not None:
        over, limit = np.max(seen["_excess"], axis=0)
        checks["friction_law"] = _relative(over, limit, ROUNDING)
        driving, power = np.sum(seen["_power"], axis=0)
        checks["dissipation_sign"] = _relative(driving, power, POWER_LIMIT)
        if scenario.law == SET_VALUED:
            checks["release"] = Check(float(model.system.contacts.release[0]), ROUNDING)
    checks["torque_balance"] = torque_balance(scenario, model, time, seen)
    return checks


def _relative(value: float, size: float, limit: float) -> Check:
    return Check(float(value / size if size > 0.0 else value) + 0.0, limit)  # no minus zero
