"""The statics of a body on a dry shaft: balance, impending motion, extreme roots over a turn."""

from math import inf, isfinite, radians
from sys import float_info

from frictionsim.mechanisms.effects import ROUNDING
from frictionsim.mechanisms.shaft.balance import Balance, Roots, Sum, terms_of
from frictionsim.mechanisms.shaft.schema import ShaftScenario
from frictionsim.mechanisms.shaft.turn import DIRECTIONS, Extreme, over_turn
from frictionsim.mechanisms.shaft.unknowns import UNKNOWN_KEY, place_of, unknown_of
from frictionsim.results import Quantities, Quantity, StaticQuantities
from frictionsim.scenario.schema import inconsistent
from frictionsim.scenario.signal_tables import AngleTable

WORDS = {1: "counter-clockwise", -1: "clockwise"}
STOPS = {1: "upper", -1: "lower"}  # that which keeps the body from turning in a direction


def check_unknown(scenario: ShaftScenario) -> None:
    """Raise an error if eq 24 cannot be solved for the unknown of a scenario."""
    if scenario.statics is None or scenario.statics.unknown is None:
        return
    unknown = unknown_of(scenario, scenario.statics.unknown)
    time, angle = place_of(scenario)
    if not Balance(scenario, unknown, time).enters(radians(angle)):
        raise inconsistent(
            UNKNOWN_KEY,
            f"'{unknown.key}' does not enter eq 24 at {angle:.6g} deg and {time:.6g} s: it"
            " changes neither the moment nor the friction there",
        )


def breakaway_values(scenario: ShaftScenario) -> Quantities:
    """Return the roots of eq 24 for the unknown of a scenario; none without an unknown."""
    if scenario.statics is None or scenario.statics.unknown is None:
        return {}
    return _Breakaway(scenario).roots()


def statics(scenario: ShaftScenario) -> StaticQuantities:
    """Return the balance of a scenario and, for an unknown, the roots of eq 24."""
    quantities = at_rest(scenario)
    if scenario.statics is None or scenario.statics.unknown is None:
        return quantities
    breakaway = _Breakaway(scenario)
    quantities |= breakaway.roots()
    quantities |= breakaway.steady_roots()
    quantities |= breakaway.worst()
    quantities.notes = (*quantities.notes, *breakaway.notes)
    return quantities


def at_rest(scenario: ShaftScenario) -> StaticQuantities:
    """Return moment, reaction, lever arm and limit of friction, and whether the body rests.

    All is of the body without the drive of a prescribed speed.
    """
    journal, (time, angle) = scenario.effects.shaft_friction, place_of(scenario)
    radius, q = journal.static_radius if journal else 0.0, radians(angle)
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
        friction_radius_kinetic=Quantity(journal.kinetic_radius if journal else 0.0, "m"),
    )
    if scenario.effects.end_stops is not None:
        quantities["stop_torque"] = Quantity(0.0 - torque if pressed else 0.0, "N m")
    at, speed = f"at {angle:.6g} deg and {time:.6g} s", scenario.given_speed
    rests = f"{at}, the body rests"
    if pressed:
        rests += f" on its {STOPS[on_stop]} end stop, which takes {abs(torque):.6g} N m"
    quantities.notes = (f"{at}, it breaks away {WORDS[direction]}" if direction else rests,)
    if arm is None:
        quantities.notes += (f"{at}, the shaft has no load: there is no lever arm",)
    if speed is not None:
        does = f"turns the body at {speed(time):.6g} rad/s" if speed(time) else "holds the body"
        without = f"at {time:.6g} s, the drive {does}; all values and notes are of it without drive"
        quantities.notes = (without, *quantities.notes)
    return quantities


def stop_at(scenario: ShaftScenario, degrees: float) -> int:
    """Return in which direction a stop keeps the body from turning at an angle; 0 for none."""
    stops = scenario.effects.end_stops
    if stops is None:
        return 0
    if degrees == stops.highest_angle_deg:
        return 1
    return -1 if degrees == stops.lowest_angle_deg else 0


class _Breakaway:
    """Eq 24 of a scenario with an unknown, and what is to be said about its roots."""

    def __init__(self, scenario: ShaftScenario) -> None:
        assert scenario.statics is not None  # asked by the caller
        assert scenario.statics.unknown is not None
        self.unknown = unknown_of(scenario, scenario.statics.unknown)
        self._scenario, (self._time, self._angle) = scenario, place_of(scenario)
        self._balance = Balance(scenario, self.unknown, self._time)
        self._on_stop = stop_at(scenario, self._angle)
        self._begin, self._end, self._where = self._angle - 180, self._angle + 180, "over a turn"
        if stops := scenario.effects.end_stops:
            lowest, highest = stops.lowest_angle_deg, stops.highest_angle_deg
            begin = self._begin if lowest is None else max(self._begin, lowest)
            end = self._end if highest is None else min(self._end, highest)
            if (begin, end) != (self._begin, self._end):
                self._begin, self._end, self._where = begin, end, "between the end stops"
        sizes = scenario.signals.values()
        tables = [size for size in sizes if isinstance(size, AngleTable)]
        self._knots = {angle for table in tables for angle in table.angle_deg}
        self.notes: list[str] = []

    def roots(self) -> Quantities:
        """Return the roots at the angle of the statics, by their directions."""
        roots = self._balance.roots(radians(self._angle))
        quantities = self._named(roots, self.unknown.label)
        self.notes += self._notes_of(roots)
        if self._on_stop:
            self.notes.append(
                f"at {self._angle:.6g} deg, the {STOPS[self._on_stop]} end stop keeps the"
                f" body from turning {WORDS[self._on_stop]} with any {self.unknown.key}"
            )
        return quantities

    def steady_roots(self) -> Quantities:
        """Return the roots with r_k, which keep the body turning at a constant speed.

        There are none of a key of the friction itself.
        """
        if self._balance.is_of_friction:
            return {}
        roots = Balance(self._scenario, self.unknown, self._time, steady=True).roots(
            radians(self._angle)
        )
        return self._named(roots, f"{self.unknown.label}_keep")

    def _named(self, roots: Roots, label: str) -> Quantities:
        """Return roots by a label and their directions."""
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
        if self._balance.is_of_friction:
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
        least = -inf if self.unknown.signed else 0.0
        turns = over_turn(self._balance, self._begin, self._end, self._knots, least)
        if self._where != "over a turn":
            self.notes.append(
                f"the smallest and the largest {self.unknown.key} are those {self._where}, from"
                f" {_degrees(self._begin)} to {_degrees(self._end)} deg"
            )
        quantities: Quantities = {}
        for s, direction in DIRECTIONS.items():
            turn = turns[s]
            for side, extreme in (("smallest", turn.smallest), ("largest", turn.largest)):
                name = f"{self.unknown.label}_{direction}_{side}"
                angle = None if extreme.angle is None else radians(extreme.angle)
                quantities[name] = self._quantity(extreme.value)
                quantities[f"{name}_angle"] = Quantity(angle, "rad")
                self.notes += self._notes_of_extreme(side, s, extreme)
            self.notes += [
                f"{self._where}, no {self.unknown.key} makes the body about to move {WORDS[s]} from"
                f" {_degrees(begin)} to {_degrees(end)} deg"
                for begin, end in turn.missing
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
        if self._balance.is_of_friction and not value:
            return [f"{approaches}, where the moment vanishes"]
        return [] if reached else [f"{approaches}, but it is no root there"]


def _degrees(angle: float) -> str:
    return f"{angle + 0.0:.6g}"
