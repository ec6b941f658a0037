"""Warnings of runs whose results may mislead, and, before a run, that nothing will move.

Without numpy, which `check` does not need.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import inf, pi, ulp
from typing import TYPE_CHECKING, Any

from frictionsim.results import STICK, TAUT
from frictionsim.scenario.methods import REGULARISED
from frictionsim.scenario.plausibility import SAMPLES_PER_PERIOD, unresolved
from frictionsim.scenario.signals import Signal
from frictionsim.solvers.prescribed import DRIVE
from frictionsim.solvers.system import MARGINS, STOP, OneCoordinate

if TYPE_CHECKING:
    from frictionsim.results import Array, Transition
    from frictionsim.simulation.mechanism import Mechanism, Samples

# Transitions closer than this are one: event location is exact to two units in the last place.
SAME_EVENT_ULPS = 4.0
# The absolute tolerance may be the first share of a motion, and fits it with the second.
SMALL_SHARE, FITTING_SHARE = 1e-6, 1e-9
# Torque and limit that differ by less, relatively, are equal but for rounding.
TIE = 1e-9
# Of more times at which a body may break away, to look at which takes seconds, nothing is said.
MAX_TIMES = 2000
LOOKS = 100  # times of a run besides those of extrema


def hidden_stick_slip(
    transitions: "Sequence[Transition]", interval: float, duration: float
) -> list[str]:
    """Warn if the interval, s, does not resolve the changes of a contact: stick and slip, slack.

    The flights of a body that bounces on an end stop, ever shorter ones, do not count, nor do the
    turns of a given speed, which is no contact.
    """
    changes = [e for e in transitions if e.mode_from != e.mode_to and e.contact != DRIVE]
    apart = SAME_EVENT_ULPS * ulp(duration)
    between = (b.time - a.time for a, b in pairwise(changes) if STOP not in (a.contact, b.contact))
    shortest = min((time for time in between if time > apart), default=None)
    if shortest is None:
        return []
    of = f"the shortest time between two changes of a contact, {shortest:.6g} s"
    return unresolved(interval, shortest, duration, of, "the motion between them")


def tiny_motion(position: "Array", velocity: "Array", atol: float) -> list[str]:
    """Warn of a motion of which the absolute tolerance `atol`, in rad and rad/s, is no small part.

    The stops of a motion of 1e-7 rad are 1e-6 of their time off with an atol of 1e-12.
    """
    moved = max(float(position.max() - position.min()), float(abs(velocity).max()))
    if moved == 0.0 or atol <= SMALL_SHARE * moved:
        return []
    return [
        f"the motion is at most {moved:.3g} rad and rad/s, of which solver.atol = {atol:.3g} is no"
        f" small part: its events may be off; give solver.atol = {FITTING_SHARE * moved:.0e}"
    ]


def hidden_turns(
    position: "Array", velocity: "Array", interval: float, duration: float
) -> list[str]:
    """Warn if the interval, s, does not resolve the turns of what depends on an angle.

    Motion within a tenth of a turn does not count, however fast. Positions, rad, and velocities,
    rad/s, are (n,) or (n, pulleys).
    """
    ways = position.max(axis=0) - position.min(axis=0)
    fastest = float((abs(velocity) * (ways * SAMPLES_PER_PERIOD > 2.0 * pi)).max(initial=0.0))
    if interval * fastest == 0.0:
        return []
    turn = 2.0 * pi / fastest
    of = f"a turn, which takes {turn:.3g} s at the largest speed"
    return unresolved(interval, turn, duration, of, "what depends on the angle")


def against_drive(time: "Array", torque: "Array", position: "Array") -> str:
    """Return the text of a warning if a motion went against the mean torque, N m; else empty."""
    from frictionsim.simulation.averages import time_mean  # imports numpy

    mean = float(time_mean(time, torque))
    displacement = float(position[-1] - position[0])
    if mean * displacement >= 0.0:
        return ""
    return f"ran back by {abs(displacement):.6g} rad, against a mean torque of {mean:.4g} N m"


def undetermined(samples: "Samples") -> list[str]:
    """Warn of a rest that the drive gives to a body with dry friction."""
    if "mode" not in samples.columns:
        return []
    limit = (samples["mode"] == STICK) * samples[MARGINS[0]]
    return [
        f"drive.speed is 0 at {time:.6g} s: the friction of a body that is held is undetermined,"
        " and counts as 0; drive_torque may differ from what is shown there by up to the static"
        f" limit, {limit.max():.4g} N m"
        for time in samples.time[limit > 0.0][:1]
    ]


def foreseen(mechanism: "Mechanism", duration: float) -> Iterator[str]:
    """Yield a warning if nothing moves in a run of `duration` s, and one if no friction acts."""
    system = mechanism.system
    if isinstance(system, OneCoordinate) and _has_no_friction(system, duration):
        names = [f"effects.{name}" for name in mechanism.effects if name.endswith("friction")]
        yield (
            f"{' and '.join(names) or 'dry friction'} {'have' if names[1:] else 'has'}"
            " no effect, zero throughout: give a coefficient above 0, and a load that presses the"
            " contact"
        )
    n, start = system.coordinates, system.start
    if mechanism.prescribed or any(start[n : 2 * n]):
        return
    times: list[float] = []
    for t in _times(system, duration):
        if len(times) > MAX_TIMES or _moves(mechanism, t):
            return
        times.append(t)
    if isinstance(system, OneCoordinate):
        yield f"nothing moves: {_reason(mechanism, times)}"
    else:
        yield "nothing moves: all contacts hold"


def _times(system: Any, end: float) -> Iterator[float]:
    """Yield the times, s, at which a mechanism at rest may break away, and some between them."""
    signals = getattr(system.drive, "signals", (system.drive,))
    t, last = 0.0, min(end, _end_of_first_period(signals))
    while t < last:
        yield t
        extrema = [signal.next_extremum(t) for signal in signals]
        t = system.rests_until(t, system.start, min([end, *extrema]))
    yield end
    yield from (end * i / LOOKS for i in range(LOOKS))


def _end_of_first_period(signals: Sequence[Any]) -> float:
    """Return a time, s, after which signals only repeat themselves; inf if there is none."""
    terms = [term for signal in signals for term in getattr(signal, "terms", (signal,))]
    if not all(isinstance(term, Signal) for term in terms):
        return inf  # the drive of a kind of others
    periods = {2.0 * pi / term.harmonic.angular_frequency for term in terms if term.harmonic}
    last_knot = max([0.0, *[piece.knot for term in terms for piece in term.pieces[-1:]]])
    return inf if len(periods) > 1 else last_knot + sum(periods)


def _moves(mechanism: "Mechanism", t: float) -> bool:
    """Return whether what rests from the start breaks away at a time, s."""
    system = mechanism.system
    n, y = system.coordinates, system.start
    if mechanism.law == REGULARISED:  # which holds nothing
        return bool(system.torque(system.acting(t, y[0], 0.0), y[0], 0.0))
    modes = [TAUT if contact.is_rope else STICK for contact in system.contacts]
    if any(system.rates(t, y, modes)[n : 2 * n]):
        return True
    margins = system.margins(t, y, modes) if modes else []
    return any(
        forward < -roundoff or (mode == STICK and backward < -roundoff)
        for mode, (forward, backward, roundoff) in zip(modes, margins, strict=True)
    )


def _reason(mechanism: "Mechanism", times: list[float]) -> str:
    """Return why a body of one coordinate does not move, with the largest torque over its limit."""
    system: OneCoordinate = mechanism.system
    q = system.start[0]
    acting = [system.acting(t, q, 0.0) for t in times]
    torques, friction = [system.torque(u, q, 0.0) for u in acting], system.friction
    if not any(torques):
        if system.stops is not None and system.stops.side(q) != STICK:
            return "the body rests on its end stop"
        size = max(sum(map(abs, mechanism.torques(t))) for t in times)
        if not size:
            return "no torque is applied"
        half = f"{0.5 * size:.4g} N m"
        return f"the applied torques are in balance, {half} against {half}: their sum is zero"
    if friction is None:
        return ""
    limits = [friction.static(u, q) for u in acting]
    roundoff = [friction.roundoff(u, q) for u in acting]
    hidden = [
        (abs(torque), tie)
        for torque, limit, tie in zip(torques, limits, roundoff, strict=True)
        if (1.0 + TIE) * limit < abs(torque) <= limit + tie
    ]
    if hidden:
        return (
            f"a torque of {max(hidden)[0]:.4g} N m is above the static limit, but not by more than"
            f" the rounding of the forces, {max(roundoff):.2g} N m; give smaller forces"
        )
    percent = 100.0 * _largest_ratio(system, sorted(times))
    shown = f"{percent:.6g}"
    if shown == "100":  # how near it is, if it is not there
        shown = f"{percent:.10g}"
    return f"the largest torque is {shown} % of the static limit"


def _largest_ratio(system: OneCoordinate, times: list[float]) -> float:
    """Return the largest torque at rest over the static limit, at times and near the largest."""
    q, friction = system.start[0], system.friction
    assert friction is not None  # the caller's

    def ratio(t: float) -> float:
        u = system.acting(t, q, 0.0)
        limit = friction.static(u, q)
        return abs(system.torque(u, q, 0.0)) / limit if limit else 0.0

    if len(getattr(system.drive, "signals", ())) < 2:
        return max(map(ratio, times))
    # The sum of several is largest between their extrema.
    times = [a + (b - a) * i / 4 for a, b in pairwise(times) for i in range(4)] + times[-1:]
    ratios = [ratio(t) for t in times]
    i = ratios.index(max(ratios))
    a, b = times[max(i - 1, 0)], times[min(i + 1, len(times) - 1)]
    for _ in range(60):  # to roundoff
        left, right = a + (b - a) / 3.0, b - (b - a) / 3.0
        a, b = (left, b) if ratio(left) < ratio(right) else (a, right)
    return max(*ratios, ratio(a))


def _has_no_friction(system: OneCoordinate, duration: float) -> bool:
    """Return whether the friction is zero at some times of a run, angles and speeds."""
    friction, angle = system.friction, system.start[0]
    if friction is None:
        return False
    for t in (duration * i / LOOKS for i in range(LOOKS)):
        for q in (angle, angle + 1.0, angle - 2.0):
            for s in (1, -1):
                u = system.acting(t, q, float(s))
                applied = system.torque(u, q, float(s))
                if friction.static(u, q) or friction.kinetic(u, q, float(s), s, applied):
                    return False
    return True
