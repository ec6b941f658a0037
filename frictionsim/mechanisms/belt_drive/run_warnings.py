"""Warnings about the run of a belt drive."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.mechanisms.belt_drive.averaging import Averaging, averaging_of
from frictionsim.mechanisms.belt_drive.effects.patch import patch_bodies
from frictionsim.mechanisms.belt_drive.kernels.system import PULLEY_RADIUS, Array
from frictionsim.mechanisms.belt_drive.quantities import min_rim_speed
from frictionsim.mechanisms.belt_drive.transitions import full_slip, slack_spans
from frictionsim.simulation.averages import (
    ROUNDING,
    fitting_periods,
    standard_error,
    time_mean,
)
from frictionsim.simulation.run_warnings import hidden_turns

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.model import BeltModel
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario
    from frictionsim.results import Quantities


MIN_SAMPLES = 10  # for a mean
UNSTEADY = 0.01  # of the largest: what the means of the two halves of a steady part differ by
STANDARD_ERRORS = 4.0  # by which two means may differ by chance
FULL_SLIP_SAMPLES = 0.01  # of the run
MOSTLY = 0.9  # of the samples in full slip: what is there in so many makes it
MAX_ENERGY_GAIN = 0.01  # of the energy that the springs store at the start
ALL_STICKS = 0.99  # of the contact arcs
SHORTER = 2.0  # steps of dampers than those of waves
# What wrap factors leave of the slip that corners make is (l/R)^2 over 80 to 170; on the safe side.
CORRECTED_DIVISOR = 72


def warnings_of(
    scenario: "BeltDriveScenario",
    model: "BeltModel",
    time: Array,
    seen: dict[str, Array],
    quantities: "Quantities",
) -> tuple[str, ...]:
    """Return warnings about a run: its times, (n,), s, samples, (n, ...), and summary."""
    if not time.size:
        return ()
    averaging = averaging_of(scenario, model, time, seen)
    warnings = [
        *_slack_spans(scenario, model, time, seen["_span_tension"]),
        *_pushed_off(scenario, time, seen),
        *_full_slip(scenario, time, seen),
        *_created_energy(scenario, seen),
        *_steps_of_dampers(scenario, model),
    ]
    if time[-1] >= scenario.solver.duration * (1.0 - ROUNDING):  # not of a run that was stopped
        warnings += _untouched_patch(scenario, model, seen)
        warnings += _unsteady_means(scenario, model, time, seen, averaging)
        speed, interval = seen["_speed"], scenario.interval
        turned = np.cumsum(speed, axis=0) * interval  # roughly
        warnings += hidden_turns(turned, speed, interval, scenario.solver.duration)
        if scenario.guided:
            warnings += _bursts(model, quantities)
        else:
            warnings += _slip_of_corners(scenario, model, quantities)
        warnings += _no_efficiency(averaging, quantities)
    return tuple(warnings)


def _spans(scenario: "BeltDriveScenario") -> list[str]:
    names = scenario.mechanism.names
    return [f"from '{a}' to '{b}'" for a, b in zip(names, [*names[1:], names[0]], strict=True)]


def _slack_spans(
    scenario: "BeltDriveScenario", model: "BeltModel", time: Array, tension: Array
) -> Iterator[str]:
    """Say which spans went slack, and when first."""
    slack = slack_spans(model, tension)
    for i, span in enumerate(_spans(scenario)):
        if slack[:, i].any():
            consequence = (
                "without effects.contact a slack span goes into compression instead of sagging; add"
                " [effects.contact], or give more mechanism.belt.pretension"
                if scenario.guided
                else "a slack belt is chaotic, so that its motion depends on rounding; trust means"
                " only"
            )
            yield (
                f"the span {span} goes slack at t = {time[np.argmax(slack[:, i])]:.6g} s (it is an"
                f" event where it lasts): {consequence}"
            )


def _pushed_off(
    scenario: "BeltDriveScenario", time: Array, seen: dict[str, Array]
) -> Iterator[str]:
    """Say where a guided belt would leave its pulleys, on which it is kept without a force."""
    for j, name in enumerate(scenario.mechanism.names if scenario.guided else ()):
        off = seen["_unpressed"][:, j] > 0.0
        if off.any():
            yield (
                f"the belt is hardly pressed on '{name}', first at"
                f" t = {time[np.argmax(off)]:.6g} s, over up to"
                f" {float(np.max(seen['_unpressed'][:, j])):.3g} rad: its tension is about"
                " mass_per_length times speed squared there, so that it would lift off, which a"
                " belt without effects.contact does not; add [effects.contact]"
            )


def _full_slip(scenario: "BeltDriveScenario", time: Array, seen: dict[str, Array]) -> Iterator[str]:
    """Say on which pulleys all bodies slide one way, with all the friction that there is."""
    full = full_slip(scenario, seen)
    for j, name in enumerate(scenario.mechanism.names):
        share = float(np.mean(full[:, j]))
        if share > FULL_SLIP_SAMPLES:
            # A patch is there to slip: nothing is to be mended where it does.
            patched = float(np.mean(seen["_patch"][full[:, j]] > 0))
            yield (
                f"the belt slips on '{name}' as a whole in {100.0 * share:.3g} % of the samples,"
                f" first at t = {time[np.argmax(full[:, j])]:.6g} s (it is an event where it"
                " lasts): "
            ) + (
                f"in {100.0 * patched:.3g} % of these effects.patch is on a pulley, and carries"
                " less than the load"
                if patched > MOSTLY
                else "the load is above what its friction can carry; give more pretension,"
                " friction or arc, or less torque"
            )


def _untouched_patch(
    scenario: "BeltDriveScenario", model: "BeltModel", seen: dict[str, Array]
) -> Iterator[str]:
    """Say that a patch of the belt was never on a pulley."""
    if scenario.effects.patch is None:
        return
    if not patch_bodies(scenario.effects.patch, model.system.chain).any():
        yield (
            "effects.patch has the middle of no body in it, and changes nothing: make it longer"
            f" than a body, {model.system.chain.length:.4g} m, or take more bodies"
        )
    elif not seen["_patch"].any():
        yield (
            "no body of effects.patch is on a pulley in any sample: the patch changes nothing;"
            " lay it elsewhere, or let the belt run further"
        )


def _unsteady_means(
    scenario: "BeltDriveScenario",
    model: "BeltModel",
    time: Array,
    seen: dict[str, Array],
    averaging: Averaging,
) -> Iterator[str]:
    """Say that the means of the summary are of too few samples, or of a motion that changes.

    Of a motion that repeats, the last two periods are compared; of one period nothing is known.
    """
    last, to_go = averaging.samples, averaging.to_go
    count = int(np.sum(last))
    if count < MIN_SAMPLES:
        yield (
            f"the means of the summary, over {averaging.words}, are of {count}"
            f" sample{'s' if count > 1 else ''}; give a smaller output.interval"
        )
        return
    compared, middle, unlike = last, count // 2, "its first to its second half"
    if averaging.periods and to_go is not None:
        if fitting_periods(time, to_go) < 2:
            return
        start, turn = (int(np.argmin(np.abs(to_go - left))) for left in (2, 1))
        compared, middle, unlike = np.arange(len(time)) >= start, turn - start, "one to the next"
    tension = float(np.mean(seen["_span_tension"]))
    at_rest = min_rim_speed(scenario, time, seen)
    rim = seen["_speed"][compared] * _radii(model)
    fastest = max(at_rest, float(np.max(np.abs(np.mean(rim, axis=0)))))
    changing = [
        *_changes(
            time[compared],
            middle,
            rim,
            fastest,
            [f"speed of '{n}'" for n in scenario.mechanism.names],
        ),
        *_changes(
            time[compared],
            middle,
            seen["_span_tension"][compared],
            tension,
            [f"tension {span}" for span in _spans(scenario)],
        ),
    ]
    if changing:
        change, what = max(changing)
        which = "the last whole periods" if averaging.periods else averaging.words
        yield (
            f"{which}, which the means of the summary are over, are not"
            f" steady: the {what} changes by {100.0 * change:.3g} % from {unlike}; give a longer"
            " solver.duration, or read the channels"
        )


def _changes(
    time: Array, middle: int, values: Array, size: float, names: list[str]
) -> list[tuple[float, str]]:
    """Return by how much means of two parts differ, of those that change, over their size."""
    halves = (slice(None, middle + 1), slice(middle, None))
    first, second = (time_mean(time[half], values[half]) for half in halves)
    errors = [standard_error(values[half]) for half in halves]
    change = np.abs(second - first)
    # Of a motion that drifts, batches differ by their drift: half of the change is no chance.
    chance = STANDARD_ERRORS * np.minimum(np.hypot(*errors), 0.1 * change)
    return [
        (float(c / size), name)
        for c, scatter, name in zip(change, chance, names, strict=True)
        if c - scatter > UNSTEADY * size
    ]


def _slip_of_corners(
    scenario: "BeltDriveScenario", model: "BeltModel", quantities: "Quantities"
) -> Iterator[str]:
    """Say that the slip is what the polygon of the bodies makes of it.

    Links at the angle l/R slow down by (l/R)^2/12 as they wrap, and friction takes hold of them
    before that: a drive of unlike radii may even seem to slip backwards. Wrap factors leave some
    tenth of it.

    Of any belt a rim that sticks has the speed c (1 + T/EA) of the span that runs onto it; a driver
    that slides is faster, a driven pulley slower. A driven rim is thus faster than the driver's by
    no more than the stretch T/EA of the spans differs.
    """
    slip = quantities["slip_percent"].value
    tight, slack = (quantities[f"tension_{which}"].value or 0.0 for which in ("tight", "slack"))
    stretch = 100.0 * (tight - slack) / scenario.mechanism.belt.axial_rigidity
    divisor = 12 if model.system.contacts.wrap is None else CORRECTED_DIVISOR
    corner = 100.0 * float(np.max(model.system.chain.length / _radii(model))) ** 2 / divisor
    if slip is None:
        return
    way_out = "take slip, and tensions on the arcs, from a belt of more bodies"
    if abs(slip) < corner:
        yield (
            f"slip_percent = {slip:.3g} is no more than what the corners between the bodies do,"
            f" (l/R)^2/{divisor} = {corner:.2g} %: {way_out}"
        )
    elif slip < -stretch:
        yield (
            f"slip_percent = {slip:.3g}: the driven rim is faster than the driver's by more than"
            f" the stretch of the spans differs, {stretch:.2g} %, which the corners between the"
            f" bodies do: {way_out}"
        )


def _bursts(model: "BeltModel", quantities: "Quantities") -> Iterator[str]:
    """Say that a guided belt whose static friction is larger slides in bursts of its points."""
    share = quantities["stick_fraction"].value if model.distinct_static_friction else None
    if share is not None and share < ALL_STICKS:
        yield (
            "mu_s is above mu_k: a guided belt then slides in bursts that belong to its mesh; they"
            " shrink as bodies are added, and stick_fraction and adhesion_arc_* with them: compare"
            " a belt of more bodies, or set mu_s = mu_k"
        )


def _steps_of_dampers(scenario: "BeltDriveScenario", model: "BeltModel") -> Iterator[str]:
    """Say that the dampers of a guided belt make the adaptive steps short, which are explicit."""
    law, damping = scenario.effects.belt_friction, model.system.effects.axial_damping.damping
    if scenario.guided and scenario.solver.backend == "rkf45" and damping is not None:
        decay = 4.0 * damping / model.system.chain.mass
        ratio = decay / model.max_frequency_and_decay[0]
        if ratio > SHORTER and (law is None or law.law == "set-valued"):
            yield (
                "the dampers of effects.axial_damping make the steps of 'rkf45' about"
                f" {ratio:.2g} times as short as the waves along the belt do; solver.backend ="
                " 'moreau' solves for these dampers, at the steps of the waves"
            )


def _no_efficiency(averaging: Averaging, quantities: "Quantities") -> Iterator[str]:
    """Say why there is no efficiency; of a single sample there is no energy, which is said."""
    if quantities["efficiency"].value is None and np.sum(averaging.samples) > 1:
        yield (
            f"efficiency has no value: over {averaging.words} nothing is taken out of the drive or"
            " lost in it"
        )


def _radii(model: "BeltModel") -> Array:
    radii: Array = model.system.pulleys.table[PULLEY_RADIUS]
    return radii


def _created_energy(scenario: "BeltDriveScenario", seen: dict[str, Array]) -> Iterator[str]:
    """Say that the steps have put energy into the belt.

    Where the pulleys turn fast, the energy of the belt is so small a part that the audit does not
    see it.
    """
    stored = float(abs(seen["energy_potential"][0]))
    energy_gain = float(-(seen["energy_input"][-1] - seen["energy_input"][0]))
    for name, energy in seen.items():
        if name.startswith("energy") and name != "energy_input":
            energy_gain += float(energy[-1] - energy[0])
    if energy_gain > MAX_ENERGY_GAIN * stored:
        way_out = "solver.step" if scenario.solver.backend == "moreau" else "solver.rtol"
        yield (
            f"the steps have put {energy_gain:.3g} J into the belt, "
            f"{100.0 * energy_gain / stored:.2g} % of what it stores: give a smaller {way_out}"
        )
