"""Warnings about the run of a belt drive, from its samples."""

from collections.abc import Iterator
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.mechanisms.belt_drive.belt import patch_of_bodies
from frictionsim.mechanisms.belt_drive.quantities import (
    MIN_FORCE,
    STANDARD_ERRORS,
    averaging_of,
    energy_residual,
    min_rim_speed,
)
from frictionsim.mechanisms.belt_drive.transitions import is_full_slip, is_slack
from frictionsim.simulation.averages import (
    ROUNDING,
    fitting_periods,
    standard_error,
    time_mean,
)
from frictionsim.simulation.run_warnings import hidden_turns

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.quantities import BeltSamples
    from frictionsim.results import Quantities

    Array = npt.NDArray[np.float64]

MIN_SAMPLES = 10  # for a mean
UNSTEADY = 0.01  # of the largest: what the means of the two halves of a steady part differ by
FULL_SLIP_SAMPLES = 0.01  # of the run
MOSTLY = 0.9  # of the samples in full slip: what is there in so many makes it
GAIN_OF_WARNING = 0.01  # of the energy that the springs store at the start
# What wrap factors leave of the slip that corners make is (l/R)^2 over 80 to 170; on the safe side.
CORRECTED_DIVISOR = 72


def warnings_of(run: "BeltSamples", quantities: "Quantities") -> tuple[str, ...]:
    """Return warnings about a run with this summary."""
    if not run.time.size:
        return ()
    scenario = run.scenario
    warnings = [*_slack_spans(run), *_pushed_off(run), *_full_slip(run), *_created_energy(run)]
    if run.time[-1] >= scenario.solver.duration * (1.0 - ROUNDING):  # not of one that was stopped
        warnings += [*_untouched_patch(run), *_unsteady_means(run)]
        speed, interval = run.seen["_speed"], scenario.interval
        turned = np.cumsum(speed, axis=0) * interval  # roughly
        warnings += hidden_turns(turned, speed, interval, scenario.solver.duration)
        warnings += _slip_of_corners(run, quantities)
    return tuple(warnings)


def _slack_spans(run: "BeltSamples") -> Iterator[str]:
    """Say which spans went slack, and when first."""
    slack = is_slack(run)
    for i, (start, end) in enumerate(run.spans):
        if slack[:, i].any():
            consequence = (
                "without effects.contact a slack span goes into compression instead of sagging; add"
                " [effects.contact], or give more mechanism.belt.pretension"
                if run.scenario.guided
                else "a slack belt is chaotic, so that its motion depends on rounding; trust means"
                " only"
            )
            yield (
                f"the span from '{start}' to '{end}' goes slack at"
                f" t = {run.time[np.argmax(slack[:, i])]:.6g} s (it is an event where it lasts):"
                f" {consequence}"
            )


def _pushed_off(run: "BeltSamples") -> Iterator[str]:
    """Say where a guided belt would leave its pulleys, on which it is kept without a force."""
    for j, name in enumerate(run.names if run.scenario.guided else ()):
        unpressed = run.seen["_unpressed"][:, j]
        if np.any(unpressed > 0.0):
            yield (
                f"the belt is hardly pressed on '{name}', first at"
                f" t = {run.time[np.argmax(unpressed > 0.0)]:.6g} s, over up to"
                f" {float(np.max(unpressed)):.3g} rad: its tension is about"
                " mass_per_length times speed squared there, so that it would lift off, which a"
                " belt without effects.contact does not; add [effects.contact]"
            )


def _full_slip(run: "BeltSamples") -> Iterator[str]:
    """Say on which pulleys all bodies slide one way, with all the friction that there is."""
    full = is_full_slip(run)
    for j, name in enumerate(run.names):
        share = float(np.mean(full[:, j]))
        if share > FULL_SLIP_SAMPLES:
            # A patch is there to slip: nothing is to be mended where it does.
            patched = float(np.mean(run.seen["_patches"][full[:, j], j].any(axis=1)))
            yield (
                f"the belt slips on '{name}' as a whole in {100.0 * share:.3g} % of the samples,"
                f" first at t = {run.time[np.argmax(full[:, j])]:.6g} s (it is an event where it"
                " lasts): "
            ) + (
                f"in {100.0 * patched:.3g} % of these effects.patch is on it, and carries less"
                " than the load"
                if patched > MOSTLY
                else "the load is above what its friction can carry; give more pretension,"
                " friction or arc, or less torque"
            )


def _created_energy(run: "BeltSamples") -> Iterator[str]:
    """Say that the steps have put energy into the belt.

    Where the pulleys turn fast, the energy of the belt is so small a part that the audit does not
    see it.
    """
    stored = float(abs(run.seen["energy_potential"][0]))
    gained = float(energy_residual(run.seen)[-1])
    if gained > GAIN_OF_WARNING * stored:
        way_out = "solver.step" if run.scenario.solver.backend == "moreau" else "solver.rtol"
        yield (
            f"the steps have put {gained:.3g} J into the belt, "
            f"{100.0 * gained / stored:.2g} % of what it stores: give a smaller {way_out}"
        )


def _untouched_patch(run: "BeltSamples") -> Iterator[str]:
    """Say that a patch with bodies was never on a pulley; `empty_patches` tells of others."""
    touched, several = run.seen["_patches"].any(axis=(0, 1)), len(run.scenario.effects.patches) > 1
    places = patch_of_bodies(run.scenario, run.body_length)
    for i in np.intersect1d(np.flatnonzero(~touched), places):
        yield (
            f"no body of effects.patch{f'.{i}' if several else ''} is on a pulley in any sample:"
            " the patch changes nothing; lay it elsewhere, or let the belt run further"
        )


def _unsteady_means(run: "BeltSamples") -> Iterator[str]:
    """Say that the means of the summary are of too few samples, or of a motion that changes.

    Of a motion that repeats, the last two periods are compared; of one period nothing is known.
    """
    time, seen, averaging = run.time, run.seen, averaging_of(run)
    last, to_go = averaging.samples, averaging.to_go
    count = int(np.sum(last))
    if count < MIN_SAMPLES:
        yield (
            f"the means of the summary, over {averaging.words}, have only {count}"
            f" sample{'s' if count > 1 else ''}; give a smaller output.interval"
        )
        return
    compared, middle, between = last, count // 2, "its first to its second half"
    if averaging.periods and to_go is not None:
        if fitting_periods(time, to_go) < 2:
            return
        start, turn = (int(np.argmin(np.abs(to_go - left))) for left in (2, 1))
        compared, middle, between = np.arange(len(time)) >= start, turn - start, "one to the next"
    rim, spans = seen["_speed"][compared] * run.radii, seen["_span_tension"]
    halves, at_rest = (rim[: middle + 1], rim[middle:]), min_rim_speed(run)
    fastest = max(at_rest, float(np.max(np.abs(np.mean(rim, axis=0)))))
    if max(float(np.max(np.abs(np.mean(half, axis=0)))) for half in halves) <= at_rest:
        fastest = inf  # pulleys at rest may vibrate
    names = [f"speed of '{name}'" for name in run.names]
    tensions = [f"tension from '{start}' to '{end}'" for start, end in run.spans]
    # A guided belt may be in compression, and its mean tension near zero.
    tension = max(float(np.mean(np.abs(spans))), MIN_FORCE * run.pretension)
    changing = [
        *_changes(time[compared], middle, rim, fastest, names),
        *_changes(time[compared], middle, spans[compared], tension, tensions),
    ]
    if changing:
        change, what = max(changing)
        which = "the last whole periods" if averaging.periods else averaging.words
        yield (
            f"the means of the summary, over {which}, are of a motion that is not steady: the"
            f" {what} changes by {100.0 * change:.3g} % from {between}; give a longer"
            " solver.duration, or read the channels"
        )


def _changes(
    time: "Array", middle: int, values: "Array", size: float, names: list[str]
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


def _slip_of_corners(run: "BeltSamples", quantities: "Quantities") -> Iterator[str]:
    """Say that the slip is what the polygon of the bodies makes of it.

    Links at the angle l/R slow down by (l/R)^2/12 as they wrap, and friction takes hold of them
    before that: a drive of unlike radii may even seem to slip backwards. Wrap factors leave some
    tenth of it.

    Of any belt a rim that sticks has the speed c (1 + T/EA) of the span that runs onto it; a driver
    that slides is faster, a driven pulley slower. A driven rim is thus faster than the driver's by
    no more than the stretch T/EA of the spans differs.
    """
    slip, belt = quantities["slip_percent"].value, run.scenario.mechanism.belt
    if slip is None or run.scenario.guided:
        return
    tight, slack = (quantities[f"tension_{which}"].value or 0.0 for which in ("tight", "slack"))
    stretch = 100.0 * (tight - slack) / belt.axial_rigidity
    divisor = CORRECTED_DIVISOR if belt.wrap == "corrected" else 12
    corner = 100.0 * float(np.max(run.body_length / run.radii)) ** 2 / divisor
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
