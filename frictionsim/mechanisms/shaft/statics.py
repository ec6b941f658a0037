"""The statics of a body on a dry shaft: its balance, impending motion, extreme roots over a turn.

Roots are smooth functions of the angle but at a few angles: where both join and cease to exist, or
cross; where one grows without bound; where the slope of a size jumps. These angles, the zeros of
`features_at`, cut the turn into pieces. On a piece, extrema are zeros of `growth_at` between
samples. Where a root ceases to exist at the end of a piece, its limit there counts as well, in the
direction of that root.

A plain search, 720 samples with each sampled extremum refined by values alone, loses in roundoff a
root that is 0/0 at an angle, as the stiffness of a spring that is free where the other moment
vanishes (25 of 60 drawn cases, by up to 36 %), and takes poles of `mu_s` for large roots (4 of 60).
On other drawn bodies its extremes agree to 1e-12, but its angles to 1e-8 rad only, since values are
flat at an extremum.
"""

from collections.abc import Callable, Iterator
from itertools import pairwise
from math import cos, isfinite, pi, radians
from typing import NamedTuple

from frictionsim.mechanisms.shaft.balance import (
    CLOCKWISE,
    COUNTER_CLOCKWISE,
    ROUNDOFF,
    Balance,
    Root,
    Roots,
    balance_of,
    features_at,
    growth_at,
    limits_at,
    possible_roots_at,
    reaction_of,
    roots_at,
    sum_of,
)
from frictionsim.mechanisms.shaft.schema import ShaftScenario
from frictionsim.mechanisms.shaft.unknowns import UNKNOWN_KEY, place_of, unknown_of
from frictionsim.results import Quantities, Quantity, StaticQuantities
from frictionsim.scenario.schema import inconsistent
from frictionsim.solvers.root_finding import bracket_root

DIRECTIONS = {COUNTER_CLOCKWISE: "counter_clockwise", CLOCKWISE: "clockwise"}
WORDS = {1: "counter-clockwise", -1: "clockwise"}
STOPS = {1: "upper", -1: "lower"}  # that which keeps the body from turning in a direction
SAMPLES = 720  # of features, whose period is not below a quarter of a turn
MIN_SAMPLES = 24
RESOLUTION = 1e-6  # deg: what is shorter is of rounding
END_MARGIN = 1e-6  # of a piece, from its end
FARTHER, GROWTH = 100, 5  # towards a pole, a root grows so many times from a farther angle
SUBDIVISIONS = 8
DIGITS_OF_ANGLE = 12  # deg

ScalarFunction = Callable[[float], float]


def check_unknown(scenario: ShaftScenario) -> None:
    """Raise an error if eq 24 cannot be solved for the unknown of a scenario."""
    if scenario.statics is None or scenario.statics.unknown is None:
        return
    unknown = unknown_of(scenario, scenario.statics.unknown)
    time, angle = place_of(scenario)
    if not balance_of(scenario, unknown, time).enters(angle):
        raise inconsistent(
            UNKNOWN_KEY,
            f"'{unknown.key}' does not enter eq 24 at {angle:.6g} deg and {time:.6g} s: it"
            " changes neither the moment nor the friction there",
        )


def breakaway_values(scenario: ShaftScenario) -> Quantities:
    """Return the roots of eq 24 for the unknown of a scenario; none without an unknown."""
    if scenario.statics is None or scenario.statics.unknown is None:
        return {}
    return _TurnProblem(scenario).roots()


def statics(scenario: ShaftScenario) -> StaticQuantities:
    """Return the balance of a scenario and, for an unknown, the roots of eq 24."""
    quantities = at_rest(scenario)
    if scenario.statics is None or scenario.statics.unknown is None:
        return quantities
    problem = _TurnProblem(scenario)
    quantities |= problem.roots()
    quantities |= problem.worst()
    quantities.notes = (*quantities.notes, *problem.notes)
    return quantities


def at_rest(scenario: ShaftScenario) -> StaticQuantities:
    """Return moment, reaction, lever arm and limit of friction, and whether the body rests."""
    journal, loads = scenario.effects.shaft_friction, sum_of(scenario)
    time, angle = place_of(scenario)
    at_angle = radians(angle)
    torque = loads.at(time, at_angle)[0]
    if abs(torque) <= ROUNDOFF * loads.scale(time, at_angle):
        torque = 0.0
    reaction = reaction_of(loads, time, at_angle)
    limit = (journal.static_radius if journal else 0.0) * reaction
    arm, margin = torque / reaction if reaction else None, limit - abs(torque)
    tie = 0.0
    if journal is not None:  # as in a run
        tie = loads.shaft.roundoff(time, at_angle)
    direction = 0 if margin >= -tie else 1 if torque > 0.0 else -1
    on_stop = stop_at(scenario, angle)
    pressed = on_stop != 0 and on_stop * torque >= 0.0  # a stop takes all that presses into it
    if pressed:
        direction = 0
    quantities = StaticQuantities(
        angle=Quantity(radians(angle), "rad"),
        applied_torque=Quantity(torque, "N m"),
        shaft_reaction=Quantity(reaction, "N"),
        lever_arm=Quantity(arm, "m"),
        static_limit=Quantity(limit, "N m"),
        static_margin=Quantity(margin, "N m"),
        breakaway_direction=Quantity(float(direction), "1"),
        friction_radius_static=Quantity(journal.static_radius if journal else 0.0, "m"),
        friction_radius_kinetic=Quantity(journal.kinetic_radius if journal else 0.0, "m"),
    )
    if scenario.effects.end_stops is not None:
        quantities["stop_torque"] = Quantity(0.0 - torque if pressed else 0.0, "N m")
    at = f"at {angle:.6g} deg and {time:.6g} s"
    rests = f"{at}, the body rests"
    if pressed:
        rests += f" on its {STOPS[on_stop]} end stop, which takes {abs(torque):.6g} N m"
    quantities.notes = (f"{at}, it breaks away {WORDS[direction]}" if direction else rests,)
    if arm is None:
        quantities.notes += (f"{at}, the shaft has no load: there is no lever arm",)
    return quantities


def stop_at(scenario: ShaftScenario, degrees: float) -> int:
    """Return in which direction a stop keeps the body from turning at an angle; 0 for none."""
    stops = scenario.effects.end_stops
    if stops is None:
        return 0
    if degrees == stops.highest_angle_deg:
        return 1
    return -1 if degrees == stops.lowest_angle_deg else 0


class Extreme(NamedTuple):
    """The smallest or the largest root of a direction.

    Attributes
    ----------
    value : float or None
        None without a root, and without a bound.
    angle : float or None
        deg; where it is, or where it grows without bound.
    reached : bool
        Whether it is a root there; else it is the limit of the roots beside that angle.
    """

    value: float | None
    angle: float | None
    reached: bool = True


class Turn(NamedTuple):
    """The roots over a turn; both by the direction of impending motion.

    Attributes
    ----------
    smallest, largest : dict of Extreme
    missing : dict of list of (float, float)
        From which to which angle there is none, deg.
    """

    smallest: dict[int, Extreme]
    largest: dict[int, Extreme]
    missing: dict[int, list[tuple[float, float]]]


class _Piece(NamedTuple):
    """A part of the turn between two cuts.

    A cut is a list of angles, deg: several where zeros of features are closer than RESOLUTION, as
    those of |M| - r_s F about a zero of M with little friction. Extremes may be at any of them.
    """

    first: list[float]
    last: list[float]
    counts: dict[int, int]  # of its roots by direction

    @property
    def begin(self) -> float:
        return max(self.first)

    @property
    def end(self) -> float:
        return min(self.last)


def over_turn(balance: Balance, turn: tuple[float, float]) -> Turn:
    """Return the extreme roots from an angle to another, deg."""
    return _TurnSearch(balance, turn).result()


class _TurnSearch:
    def __init__(self, balance: Balance, turn: tuple[float, float]) -> None:
        self._balance, self._turn = balance, turn
        self._middle = 0.5 * (turn[0] + turn[1])
        # By direction and sign: 1 for the largest, -1 for the smallest.
        self._extremes: dict[tuple[int, int], Extreme] = {}
        self._unbounded: dict[tuple[int, int], float] = {}

    def result(self) -> Turn:
        cuts = self._cuts()
        # A root at a cut may be one of both directions that it has beside it in one of them only.
        if min(abs(self._middle - angle) for cut in cuts for angle in cut) > RESOLUTION:
            for s, values in self._roots(self._middle).items():
                for value in values:
                    self._add(value, s, self._middle)
        pieces = []
        for first, last in pairwise(cuts):
            roots = self._roots(0.5 * (max(first) + min(last)))
            pieces.append(_Piece(first, last, {s: len(roots[s]) for s in DIRECTIONS}))
        for piece in pieces:
            inward = END_MARGIN * (piece.end - piece.begin)
            for angle in piece.first:
                self._search_end(piece, angle, piece.begin, inward)
            for angle in piece.last:
                self._search_end(piece, angle, piece.end, -inward)
            for s, count in piece.counts.items():
                for i in range(count):
                    self._search_inside(piece, s, i)
        smallest, largest = ({s: self._extreme(s, sign) for s in DIRECTIONS} for sign in (-1, 1))
        return Turn(smallest, largest, {s: self._missing(pieces, s) for s in DIRECTIONS})

    def _roots(self, angle: float) -> dict[int, list[float]]:
        """Return the possible roots at an angle by direction, each in ascending order."""
        roots = possible_roots_at(self._balance, angle)
        return {s: roots.of(s) for s in DIRECTIONS}

    def _extreme(self, direction: int, sign: int) -> Extreme:
        if (direction, sign) in self._unbounded:
            return Extreme(None, _rounded(self._unbounded[direction, sign]))
        value, angle, reached = self._extremes.get((direction, sign), Extreme(None, None))
        return Extreme(value, None if angle is None else _rounded(angle), reached)

    def _missing(self, pieces: list[_Piece], direction: int) -> list[tuple[float, float]]:
        gaps: list[tuple[float, float]] = []
        adjoins = False
        for piece in pieces:
            is_gap = not piece.counts[direction]
            if is_gap:
                begin = gaps.pop()[0] if adjoins else piece.begin
                gaps.append((begin, piece.end))
            adjoins = is_gap
        return [(_rounded(begin), _rounded(end)) for begin, end in gaps]

    def _add(self, value: float, direction: int, angle: float, reached: bool = True) -> None:
        for sign in (1, -1):
            best, at, _ = self._extremes.get((direction, sign), Extreme(None, None))
            if best is not None and at is not None:
                rise, tie = sign * (value - best), ROUNDOFF * max(abs(best), abs(value))
                nearer = abs(at - self._middle) - abs(angle - self._middle) > RESOLUTION
                if rise < -tie or (rise <= tie and not nearer):
                    continue
            self._extremes[direction, sign] = Extreme(value, angle, reached)

    def _cuts(self) -> list[list[float]]:
        """Return the cuts of the turn, with its ends."""
        begin, end = self._turn
        step = (end - begin) / SAMPLES
        grid = [begin + i * step for i in range(SAMPLES)] + [end]
        sampled = [features_at(self._balance, angle) for angle in grid]
        angles = [begin, end, *(knot for knot in self._balance.knots if begin < knot < end)]
        for i in range(len(sampled[0])):
            size = max(features[i][1] for features in sampled)
            if not size:
                continue

            def feature(angle: float, i: int = i, size: float = size) -> float:
                return features_at(self._balance, angle)[i][0] / size

            angles += _zeros(feature, grid, [features[i][0] / size for features in sampled])
        cuts: list[list[float]] = []
        for angle in sorted(angles):
            if cuts and angle - cuts[-1][-1] <= RESOLUTION:
                cuts[-1].append(angle)
            else:
                cuts.append([angle])
        exact = {begin, end, *self._balance.knots}  # these come first
        return [sorted(cut, key=lambda angle: angle not in exact) for cut in cuts]

    def _search_inside(self, piece: _Piece, direction: int, i: int) -> None:
        """Add the extrema of a root within a piece."""
        begin, end, count = piece.begin, piece.end, piece.counts[direction]

        def growth(angle: float) -> float:
            roots = self._roots(angle)[direction]
            if len(roots) != count:
                return 0.0
            return growth_at(self._balance, angle, Root(roots[i], direction))

        width = end - begin
        n = max(MIN_SAMPLES, int(SAMPLES * width / (self._turn[1] - self._turn[0])))
        shares = [0.5 - 0.5 * cos(pi * k / n) for k in range(1, n)]
        grid = [begin + width * share for share in (END_MARGIN, *shares, 1.0 - END_MARGIN)]
        for angle in _changes(growth, grid, [growth(angle) for angle in grid]):
            roots = self._roots(angle)[direction]
            if len(roots) == count:
                self._add(roots[i], direction, angle)

    def _search_end(self, piece: _Piece, angle: float, end: float, inward: float) -> None:
        """Add the limits of the roots of a piece at an angle of the cut at one of its ends."""
        here = possible_roots_at(self._balance, angle)
        limits = limits_at(self._balance, angle)
        beside, farther = self._roots(end + inward), self._roots(end + FARTHER * inward)
        if any(len(roots[s]) != piece.counts[s] for roots in (beside, farther) for s in roots):
            return
        branches = [
            (value, before, s)
            for s in DIRECTIONS
            for value, before in zip(beside[s], farther[s], strict=True)
        ]
        for rank, (value, before, s) in enumerate(sorted(branches, key=lambda each: abs(each[0]))):
            # Where A = 0, a root is left for the smaller one, and the larger one has no bound. Two
            # such angles may be one cut.
            bounded = here.leading != 0 or rank < len(here.real) or here.every
            bounded &= abs(value) <= GROWTH * abs(before) or not before
            near = (here if bounded else limits).of(s)
            if near:
                _, limit = min((abs(x - value), x) for x in near)
                self._add(limit, s, angle, bounded)
            elif not bounded:
                self._unbounded.setdefault((s, 1 if value > 0.0 else -1), angle)


def _zeros(function: ScalarFunction, grid: list[float], values: list[float]) -> Iterator[float]:
    """Yield the zeros of a function from its samples, also those where it touches zero."""
    yield from _changes(function, grid, values)
    for i in range(1, len(grid) - 1):
        sign = 1.0 if values[i - 1] > 0.0 else -1.0
        before, x, after = (sign * value for value in values[i - 1 : i + 2])
        touches = -ROUNDOFF <= x <= min(before, after) and min(before, after) > ROUNDOFF
        if not touches or 2.0 * x > max(before, after):  # not even with a corner
            continue
        angle = _lowest(function, sign, grid[i - 1], grid[i + 1])
        lowest = sign * function(angle)
        if lowest < -ROUNDOFF:
            yield _zero(function, grid[i - 1], angle)
            yield _zero(function, angle, grid[i + 1])
        elif lowest <= ROUNDOFF:
            yield angle


def _changes(function: ScalarFunction, grid: list[float], values: list[float]) -> Iterator[float]:
    """Yield the zeros between samples of other signs; those that tie with zero do not count."""
    signed = [(x, value) for x, value in zip(grid, values, strict=True) if abs(value) > ROUNDOFF]
    for (low, one), (high, other) in pairwise(signed):
        if (one > 0.0) != (other > 0.0):
            yield _zero(function, low, high)


def _zero(function: ScalarFunction, low: float, high: float) -> float:
    return sum(bracket_root(function, low, high)) / 2.0


def _lowest(function: ScalarFunction, sign: float, low: float, high: float) -> float:
    """Return the extremum of a function of a sign that is nearest to zero, by finer samples."""
    while True:
        step = (high - low) / SUBDIVISIONS
        grid = [low + i * step for i in range(SUBDIVISIONS + 1)]
        best = min(range(SUBDIVISIONS + 1), key=lambda i: sign * function(grid[i]))
        low, high = grid[max(best - 1, 0)], grid[min(best + 1, SUBDIVISIONS)]
        if step < 1e-14 * max(abs(low), abs(high), 1.0):
            return grid[best]


def _rounded(angle: float) -> float:
    return round(angle, DIGITS_OF_ANGLE) + 0.0  # without the sign of a zero


class _TurnProblem:
    """Eq 24 of a scenario with an unknown, and what is to be said about its roots."""

    def __init__(self, scenario: ShaftScenario) -> None:
        assert scenario.statics is not None  # asked by the caller
        assert scenario.statics.unknown is not None
        self.unknown = unknown_of(scenario, scenario.statics.unknown)
        time, angle = place_of(scenario)
        self._balance = balance_of(scenario, self.unknown, time)
        self._angle = angle
        self._on_stop = stop_at(scenario, angle)
        begin, end = self._angle - 180, self._angle + 180
        self._range, self._where = (begin, end), "over a turn"
        stops = scenario.effects.end_stops
        if stops is not None:
            lowest, highest = stops.lowest_angle_deg, stops.highest_angle_deg
            begin = begin if lowest is None else max(begin, lowest)
            end = end if highest is None else min(end, highest)
        if self._range != (begin, end):
            self._range, self._where = (begin, end), "between the end stops"
        self.notes: list[str] = []

    def roots(self) -> Quantities:
        """Return the roots at the angle of the statics, by their directions."""
        roots = roots_at(self._balance, self._angle)
        quantities = {}
        for s, direction in DIRECTIONS.items():
            first, second = (*roots.of(s), None, None)[:2]
            name = f"{self.unknown.label}_{direction}"
            quantities[name] = self._quantity(first)
            if second is not None:
                quantities[f"{name}_second"] = self._quantity(second)
        self.notes += self._notes_of(roots)
        if self._on_stop:
            self.notes.append(
                f"at {self._angle:.6g} deg, the {STOPS[self._on_stop]} end stop keeps the"
                f" body from turning {WORDS[self._on_stop]} with any {self.unknown.key}"
            )
        return quantities

    def _quantity(self, value: float | None) -> Quantity:
        bounded = value is not None and isfinite(value)
        return Quantity(value if bounded else None, self.unknown.unit)

    def _text(self, value: float) -> str:
        unit = "" if self.unknown.unit == "1" else f" {self.unknown.unit}"
        return f"{value + 0.0:.6g}{unit}"

    def _range_of(self, low: float, high: float) -> str:
        """Return the two ends of a range, with as many digits as tell them apart."""
        unit = "" if self.unknown.unit == "1" else f" {self.unknown.unit}"
        for digits in (6, 9, 12, 17):
            ends = [f"{x + 0.0:.{digits}g}{unit}" for x in (low, high)]
            if ends[0] != ends[1]:
                return f"from {ends[0]} to {ends[1]}"
        return f"= {self._text(low)}"

    def _notes_of(self, roots: Roots) -> list[str]:
        """Return the meaning of the roots, or why there are none."""
        key, at = self.unknown.key, f"at {self._angle:.6g} deg"
        values = [root.value for root in roots.real]
        if roots.every:
            return [f"{at}, the body is about to move with every {key}"]
        if self.unknown.label in ("mu_s", "shaft_radius"):
            return self._notes_of_friction(roots)
        if not values:
            return [f"{at}, no {key} makes the body move: the friction exceeds the moment with any"]
        range_ = self._range_of(values[0], values[-1])
        notes = []
        if roots.leading > 0 and range_.startswith("="):
            notes = [f"{at}, the body rests with {key} {range_} only, and moves with any other"]
        elif roots.leading > 0:
            notes = [f"{at}, the body rests with {key} {range_}"]
        elif roots.leading < 0:
            words = WORDS.get(roots.real[0].direction)
            moves = (
                f"the body moves {words} with {key} {range_}"
                if words
                else (f"the body is about to move with {key} = {self._text(values[0])}")
            )
            notes = [f"{at}, {moves} and rests with any other value"]
        growth = "faster than" if roots.leading < 0 else "as fast as"
        notes += [
            f"{at}, no {key} makes it move {words}: friction grows with it {growth} the moment"
            for s, words in WORDS.items()
            if not roots.of(s)
        ]
        if not self.unknown.signed and values[0] < 0:
            notes.append(f"{key} below zero is a root of the equation, but not possible")
        return notes

    def _notes_of_friction(self, roots: Roots) -> list[str]:
        key, at = self.unknown.key, f"at {self._angle:.6g} deg"
        if not roots.real:
            return [f"{at}, the body moves with every {key}: its lever arm is too large"]
        root = roots.real[0]
        if not root.value:
            return [f"{at}, the body rests with every {key}: there is no moment"]
        return [
            f"{at}, the body moves {WORDS[root.direction]} with {key} below"
            f" {self._text(root.value)}, and with no value {WORDS[-root.direction]}"
        ]

    def worst(self) -> Quantities:
        """Return the smallest and the largest root of each direction over a turn.

        With end stops, over the part of it between them.
        """
        begin, end = self._range
        turn = over_turn(self._balance, self._range)
        if self._where != "over a turn":
            self.notes.append(
                f"the smallest and the largest {self.unknown.key} are those {self._where}, from"
                f" {_degrees(begin)} to {_degrees(end)} deg"
            )
        quantities: Quantities = {}
        for s, direction in DIRECTIONS.items():
            for side, extremes in (("smallest", turn.smallest), ("largest", turn.largest)):
                name = f"{self.unknown.label}_{direction}_{side}"
                quantities |= self._extreme(name, extremes[s])
                self.notes += self._notes_of_extreme(side, s, extremes[s])
            self.notes += [
                f"{self._where}, no {self.unknown.key} makes the body about to move {WORDS[s]} from"
                f" {_degrees(begin)} to {_degrees(end)} deg"
                for begin, end in turn.missing[s]
            ]
        return quantities

    def _notes_of_extreme(self, side: str, direction: int, extreme: Extreme) -> list[str]:
        """Return why an extreme has no bound, or is not reached."""
        value, angle, reached = extreme
        if angle is None:
            return []
        what = f"{self._where}, the {side} {self.unknown.key} to move {WORDS[direction]}"
        if value is None:
            goes = "grows" if side == "largest" else "falls"
            return [f"{what} has no bound: it {goes} towards {_degrees(angle)} deg"]
        approaches = f"{what} approaches {self._text(value)} at {_degrees(angle)} deg"
        if self.unknown.label in ("mu_s", "shaft_radius") and not value:
            return [f"{approaches}, where the moment vanishes"]
        return [] if reached else [f"{approaches}, but it is no root there"]

    def _extreme(self, name: str, extreme: Extreme) -> Quantities:
        value, angle = extreme.value, extreme.angle
        degrees = None if angle is None else radians(angle)
        return {name: self._quantity(value), f"{name}_angle": Quantity(degrees, "rad")}


def _degrees(angle: float | None) -> str:
    return "" if angle is None else f"{angle + 0.0:.6g}"
