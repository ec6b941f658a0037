"""The statics of a body on a dry shaft: balance, impending motion, extreme roots over a turn."""

from math import inf, isfinite, radians
from sys import float_info

from frictionsim.mechanisms.effects import ROUNDING, radii_of
from frictionsim.mechanisms.shaft.balance import (
    UNKNOWN_KEY,
    Balance,
    Root,
    Roots,
    Sum,
    Unknown,
    terms_of,
    unknown_of,
)
from frictionsim.mechanisms.shaft.schema import ShaftScenario
from frictionsim.mechanisms.shaft.turn import DIRECTIONS, Extreme, over_turn
from frictionsim.results import Quantities, Quantity, StaticQuantities
from frictionsim.scenario.schema import inconsistent
from frictionsim.scenario.signal_tables import AngleTable

WORDS = {1: "counter-clockwise", -1: "clockwise"}
STOPS = {1: "upper", -1: "lower"}  # that which keeps the body from turning in a direction


def place_of(scenario: ShaftScenario) -> tuple[float, float]:
    """Return time, s, and angle, deg, of the statics."""
    statics, start = scenario.statics, scenario.mechanism.initial_angle_deg
    if statics is None:
        return 0.0, start
    return statics.time, start if statics.angle_deg is None else statics.angle_deg


def check_unknown(scenario: ShaftScenario) -> None:
    """Raise an error if eq 24 cannot be solved for the unknown of a scenario."""
    unknown, (time, angle) = unknown_of(scenario), place_of(scenario)
    if unknown is not None and not Balance(scenario, unknown, time).enters(radians(angle)):
        raise inconsistent(
            UNKNOWN_KEY,
            f"'{unknown.key}' does not enter eq 24 at {angle:.6g} deg and {time:.6g} s: it"
            " changes neither the moment nor the friction there",
        )


def breakaway_values(scenario: ShaftScenario) -> Quantities:
    """Return the roots of eq 24 for the unknown of a scenario; none without an unknown."""
    unknown = unknown_of(scenario)
    return {} if unknown is None else _Breakaway(scenario, unknown).roots()


def statics(scenario: ShaftScenario) -> StaticQuantities:
    """Return the balance of a scenario and, for an unknown, the roots of eq 24."""
    quantities, unknown = at_rest(scenario), unknown_of(scenario)
    if unknown is not None:
        breakaway = _Breakaway(scenario, unknown)
        quantities |= breakaway.roots() | breakaway.steady_roots() | breakaway.worst()
        quantities.notes = (*quantities.notes, *breakaway.notes)
    return quantities


def at_rest(scenario: ShaftScenario) -> StaticQuantities:
    """Return moment, reaction, lever arm and limit of friction, and whether the body rests.

    All is of the body without the drive of a prescribed speed.
    """
    journal, (time, angle) = scenario.effects.shaft_friction, place_of(scenario)
    (radius, r_k), q = radii_of(journal), radians(angle)
    loads = Sum(terms_of(scenario, time), radius)
    (torque, x, y, terms), reaction = loads.at(q), loads.reaction(q)
    limit = radius * journal.load_of(reaction) if journal else 0.0
    arm, margin = torque / reaction if reaction else None, limit - abs(torque)
    # As in a run: torque and limit are sums of products.
    tie = ROUNDING * terms + float_info.min if journal else 0.0
    direction = 0 if margin >= -tie else 1 if torque > 0.0 else -1
    on_stop = stop_at(scenario, angle)
    pressed = on_stop != 0 and on_stop * torque >= 0.0  # a stop takes all that presses into it
    if pressed:
        direction = 0
    quantities = StaticQuantities(
        angle=Quantity(q, "rad"),
        applied_torque=Quantity(torque, "N m"),
        shaft_reaction=Quantity(reaction, "N"),
        force_x=Quantity(x if reaction else 0.0, "N"),
        force_y=Quantity(y if reaction else 0.0, "N"),
        lever_arm=Quantity(arm, "m"),
        static_limit=Quantity(limit, "N m"),
        static_margin=Quantity(margin, "N m"),
        breakaway_direction=Quantity(float(direction), "1"),
        friction_radius_static=Quantity(radius, "m"),
        friction_radius_kinetic=Quantity(r_k, "m"),
    )
    if scenario.effects.end_stops is not None:
        quantities["stop_torque"] = Quantity(0.0 - torque if pressed else 0.0, "N m")
    at, speed = f"at {_both(angle)} and {time:.6g} s", scenario.given_speed
    rests = f"{at}, the body rests"
    if pressed:
        rests += f" on its {STOPS[on_stop]} end stop, which takes {abs(torque):.6g} N m"
    quantities.notes = (f"{at}, it breaks away {WORDS[direction]}" if direction else rests,)
    if arm is None:
        quantities.notes += (f"{at}, the loads add up to no force: there is no lever arm",)
    if speed is not None:
        does = f"turns the body at {speed(time):.6g} rad/s" if speed(time) else "holds the body"
        without = f"at {time:.6g} s, the drive {does}; all values and notes are of it without drive"
        quantities.notes = (without, *quantities.notes)
    return quantities


def stop_at(scenario: ShaftScenario, degrees: float) -> int:
    """Return in which direction a stop keeps the body from turning at an angle; 0 for none."""
    stops = scenario.effects.end_stops
    if stops is None or degrees not in (stops.highest_angle_deg, stops.lowest_angle_deg):
        return 0
    return 1 if degrees == stops.highest_angle_deg else -1


class _Breakaway:
    """Eq 24 of a scenario with an unknown, and what is to be said about its roots."""

    def __init__(self, scenario: ShaftScenario, unknown: Unknown) -> None:
        self.unknown, self.notes = unknown, list[str]()
        self._scenario, (self._time, angle) = scenario, place_of(scenario)
        self._angle, self._at = angle, f"at {angle:.6g} deg"
        self._stop = stop_at(scenario, angle)
        self._balance = Balance(scenario, unknown, self._time)

    def roots(self) -> Quantities:
        """Return the roots at the angle of the statics, by their directions."""
        roots, stop = self._possible(self._balance), self._stop
        self.notes += self._notes_on_stop(roots) if stop else self._notes_of(roots)
        if stop:
            self.notes.append(
                f"{self._at}, the {STOPS[stop]} end stop keeps the body from turning {WORDS[stop]}"
                f" with any {self.unknown.key}"
            )
        return self._named(roots, self.unknown.label)

    def steady_roots(self) -> Quantities:
        """Return the roots with r_k, which keep the body turning at a constant speed.

        There are none of a key of the friction itself.
        """
        if self.unknown.is_of_friction:
            return {}
        steady = Balance(self._scenario, self.unknown, self._time, steady=True)
        return self._named(self._possible(steady), f"{self.unknown.label}_keep")

    def _possible(self, balance: Balance) -> Roots:
        """Return the roots at the angle, on a stop without those of a turn into it."""
        roots, stop = balance.roots(radians(self._angle)), self._stop
        if not stop:
            return roots
        return roots._replace(real=tuple(Root(value, -stop) for value in roots.of(-stop)))

    def _named(self, roots: Roots, label: str) -> Quantities:
        quantities = {}
        for s, direction in DIRECTIONS.items():
            first, second = (*roots.of(s), None, None)[:2]
            quantities[f"{label}_{direction}"] = self._quantity(first)
            if second is not None:
                quantities[f"{label}_{direction}_second"] = self._quantity(second)
        return quantities

    def _quantity(self, value: float | None) -> Quantity:
        bounded = value is not None and isfinite(value)
        return Quantity(value if bounded else None, self.unknown.unit)

    def _text(self, value: float, digits: int = 6) -> str:
        unit = "" if self.unknown.unit == "1" else f" {self.unknown.unit}"
        return f"{value + 0.0:.{digits}g}{unit}"

    def _range_of(self, low: float, high: float) -> str:
        """Return the two ends of a range, with as many digits as tell them apart."""
        for digits in (6, 9, 12, 17):
            ends = self._text(low, digits), self._text(high, digits)
            if ends[0] != ends[1]:
                return f"from {ends[0]} to {ends[1]}"
        return f"= {self._text(low)}"

    def _notes_of(self, roots: Roots) -> list[str]:
        """Return the meaning of the roots, or why there are none."""
        key, at = self.unknown.key, self._at
        if roots.every:
            return [f"{at}, the body is about to move with every {key}"]
        if self.unknown.is_of_friction:
            return [self._note_of_friction(roots)]
        if not roots.real:
            return [f"{at}, no {key} makes the body move: the friction exceeds the moment with any"]
        first, last = roots.real[0], roots.real[-1]
        range_, notes = self._range_of(first.value, last.value), list[str]()
        if roots.leading > 0 and range_.startswith("="):
            notes = [f"{at}, the body rests with {key} {range_} only, and moves with any other"]
        elif roots.leading > 0:
            notes = [f"{at}, the body rests with {key} {range_}"]
        elif roots.leading < 0:
            moves = f"is about to move with {key} = {self._text(first.value)}"
            if first.direction:
                moves = f"moves {WORDS[first.direction]} with {key} {range_}"
            notes = [f"{at}, the body {moves} and rests with any other value"]
        growth = "faster than" if roots.leading < 0 else "as fast as"
        notes += [
            f"{at}, no {key} makes it move {words}: friction grows with it {growth} the moment"
            for s, words in WORDS.items()
            if not roots.of(s) and s != self._stop
        ]
        return notes + self._note_of_sign(first.value)

    def _note_of_sign(self, value: float) -> list[str]:
        if self.unknown.signed or value >= 0.0:
            return []
        return [f"{self.unknown.key} below zero is a root of the equation, but not possible"]

    def _notes_on_stop(self, roots: Roots) -> list[str]:
        """Return the meaning of the roots on a stop, which are those of the way off it."""
        key, values, q = self.unknown.key, [root.value for root in roots.real], radians(self._angle)
        moves, is_of_friction = self._balance.moves, self.unknown.is_of_friction
        if roots.every or len(values) == 2 or (is_of_friction and values):
            return self._notes_of(roots)
        if not values:
            does = f"moves {WORDS[-self._stop]}" if moves(q, 0.0, -self._stop) else "rests"
            return [f"{self._at}, the body {does} with every {key}"]
        # There is no other root of this way: on one side of it, the body rests everywhere.
        above = moves(q, values[0] + max(abs(values[0]), 1.0), -self._stop)
        side = f"up to {self._text(values[0])}" if above else f"from {self._text(values[0])} on"
        notes = [f"{self._at}, the body rests with {key} {side}"]
        return notes + self._note_of_sign(values[0])

    def _note_of_friction(self, roots: Roots) -> str:
        key, at = self.unknown.key, self._at
        if not roots.real:
            return f"{at}, the body moves with every {key}: its lever arm is too large"
        value, s = roots.real[0]
        if not value:
            return f"{at}, the body rests with every {key}: there is no moment"
        return (
            f"{at}, the body moves {WORDS[s]} with {key} below {self._text(value)}, and with no"
            f" value {WORDS[-s]}"
        )

    def worst(self) -> Quantities:
        """Return the smallest and the largest root of each direction over a turn.

        With end stops, over the part of it between them.
        """
        unknown, begin, end, where = self.unknown, self._angle - 180, self._angle + 180, ""
        if stops := self._scenario.effects.end_stops:
            lowest, highest = stops.lowest_angle_deg, stops.highest_angle_deg
            whole = begin, end
            begin = begin if lowest is None else max(begin, lowest)
            end = end if highest is None else min(end, highest)
            where = "between the end stops" if (begin, end) != whole else ""
        if where:
            self.notes.append(
                f"the smallest and the largest {unknown.key} are those {where}, from"
                f" {begin:.6g} to {end:.6g} deg"
            )
        where = where or "over a turn"
        tables = [s for s in self._scenario.signals.values() if isinstance(s, AngleTable)]
        knots = {angle for table in tables for angle in table.angle_deg}
        turns = over_turn(self._balance, begin, end, knots, -inf if unknown.signed else 0.0)
        quantities: Quantities = {}
        for s, direction in DIRECTIONS.items():
            turn = turns[s]
            for side, extreme in (("smallest", turn.smallest), ("largest", turn.largest)):
                name = f"{unknown.label}_{direction}_{side}"
                angle = None if extreme.angle is None else radians(extreme.angle)
                quantities[name] = self._quantity(extreme.value)
                quantities[f"{name}_angle"] = Quantity(angle, "rad")
                what = f"{where}, the {side} {unknown.key} to move {WORDS[s]}"
                self.notes += self._notes_of_extreme(what, side, extreme)
            self.notes += [
                f"{where}, no {unknown.key} makes the body about to move {WORDS[s]} from"
                f" {low:.6g} to {high:.6g} deg"
                for low, high in turn.missing
            ]
        return quantities

    def _notes_of_extreme(self, what: str, side: str, extreme: Extreme) -> list[str]:
        """Return why an extreme has no bound, or is not reached."""
        value, angle, reached = extreme
        if angle is None:
            return []
        if value is None:
            goes = "grows" if side == "largest" else "falls"
            return [f"{what} has no bound: it {goes} towards {_both(angle)}"]
        approaches = f"{what} approaches {self._text(value)} at {_both(angle)}"
        if self.unknown.is_of_friction and not value:
            return [f"{approaches}, where the moment vanishes"]
        return [] if reached else [f"{approaches}, but it is no root there"]


def _both(angle: float) -> str:
    """Return an angle in deg, as keys have it, and in rad, as quantities have it."""
    in_rad = f" ({radians(angle):.6g} rad)" if angle else ""
    return f"{angle + 0.0:.6g} deg{in_rad}"
