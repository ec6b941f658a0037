"""The radius c of a journal, its five cases, and the switch of eq 30, of the samples of a run.

    c = |M|/R                                               eqs 28, 29
    case                                                    eqs 31 to 35

         c           at rest    in motion
         c <= r_s    1, 5       4
         c > r_s     2          3

M is the moment of all but dry friction, I dw/dt - T, and R the reaction of the shaft [1]_. Case 1
is before the first motion, case 5 after it. What the friction law holds is at rest: of the
regularised one what is slower than its transition speed. With a constant normal load N the cases
are those of |M|/N.

References
----------
.. [1] "Analysis of friction systems on shafts", Int. J. Applied Engineering Research 13(11),
   2018, 8871-8881.
"""

from typing import TYPE_CHECKING, Any

from frictionsim.mechanisms.effects import CONTACT_NAME, ShaftFriction
from frictionsim.results import STICK, Channel, Flags
from frictionsim.scenario.methods import PUBLISHED

if TYPE_CHECKING:
    from collections.abc import Mapping

    from frictionsim.simulation.mechanism import Derived, Samples

REST, BEGIN, BEYOND, WITHIN, STOPPED = range(1, 6)
CASES: Flags = (
    (REST, "1_rest"),
    (BEGIN, "2_breakaway"),
    (BEYOND, "3_beyond_limit"),
    (WITHIN, "4_within_limit"),
    (STOPPED, "5_rest_again"),
)
CHANNELS = {
    "lever_arm": Channel("m", "radius c: moment of all but dry friction over reaction"),
    "case": Channel(
        "1", "case of the motion, eqs 31 to 35 of the paper", integer=True, flags=CASES
    ),
    "switch": Channel(
        "1", "factor S of eq 30, of the published law", integer=True, flags=((0, "off"), (1, "on"))
    ),
}


def moment_of(inertia: float, of: Any) -> Any:
    """Return |M|, N m, of all but dry friction, which accelerates an inertia, kg m^2, with it."""
    return abs(inertia * of["angular_acceleration"] - of["friction_torque"])


def journal_channels(effect: ShaftFriction | None, inertia: float) -> "Mapping[str, Derived]":
    """Return how the channels of a journal follow from the columns of a run; see `Derived`.

    Parameters
    ----------
    effect : ShaftFriction or None
        Without the effect there are none; `switch` is of the published law.
    inertia : float, kg m^2
        I, which the torques of `angular_acceleration` accelerate.
    """
    if effect is None:
        return {}
    r_s = effect.static_radius

    def moment(of: Any) -> Any:
        return moment_of(inertia, of)

    def limit(of: Any) -> Any:
        return r_s * effect.load_of(of["shaft_reaction"])

    def lever_arm(time: Any, of: Any, run: "Samples") -> Any:
        import numpy as np  # imported here because `check` does not need it

        load = of["shaft_reaction"]
        return np.divide(moment(of), load, out=np.full(len(load), np.nan), where=load != 0.0)

    def case(time: Any, of: Any, run: "Samples") -> Any:
        import numpy as np

        modes, a = of["mode"], of["angular_acceleration"]
        moves = [e.time for e in run.transitions if e.contact == CONTACT_NAME and e.mode_to]
        first = np.min([*run.time[run["mode"] != STICK][:1], *moves[:1]], initial=np.inf)
        beyond = moment(of) > limit(of) + of["margin_roundoff"]
        begins = np.where(modes == STICK, beyond, (of["angular_velocity"] == 0.0) & (modes * a > 0))
        rest = np.where(time > first, STOPPED, REST)
        return np.select([begins, modes == STICK, beyond], [BEGIN, rest, BEYOND], WITHIN)

    def switch(time: Any, of: Any, run: "Samples") -> Any:
        return (of["mode"] != STICK) | (moment(of) > limit(of))

    channels = {"lever_arm": lever_arm, "case": case}
    return channels | {"switch": switch} if effect.law == PUBLISHED else channels
