"""The scenario of a belt drive: its tables and their consistency; the channels of its results."""

from collections.abc import Collection, Sequence
from itertools import pairwise
from math import ceil, pi
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Discriminator, Field, Tag, field_validator, model_validator

from frictionsim.errors import unknown
from frictionsim.mechanisms.belt_drive.belt import CLEAN
from frictionsim.mechanisms.belt_drive.geometry import (
    MIN_BODIES,
    Path,
    PathError,
    PulleyCircle,
    belt_path,
)
from frictionsim.mechanisms.effects import Gravity
from frictionsim.results import Channel
from frictionsim.scenario.methods import BELT, Pairs
from frictionsim.scenario.schema import CoefficientsOfFriction, Params, inconsistent, unit_field
from frictionsim.scenario.settings import Scenario, SolverSettings
from frictionsim.scenario.signal_tables import ONE, SUM, SpeedOrTimeSignals, TimeSignals

# A body longer than this part of a radius cannot follow the curve: two to half a turn.
MAX_BODY_OVER_RADIUS = pi / 2
MAX_STRAIN = 0.5  # of a law of springs that is linear
ENOUGH = 4  # times as many bodies as are needed: to begin with
ROUNDING = 1e-12  # of the belt's length: shorter pieces vanish in sums of lengths


CHANNELS = {
    "pulley_angle": Channel("rad", "angle of the pulley", "pulley"),
    "pulley_speed": Channel("rad/s", "angular velocity of the pulley", "pulley"),
    "pulley_torque": Channel("N m", "torque on the pulley from outside", "pulley"),
    "x": Channel("m", "x of the body's centre", "body"),
    "y": Channel("m", "y of the body's centre", "body"),
    "angle": Channel("rad", "angle of the body", "body"),
    "normal_force": Channel("N", "normal force of the pulley on the body", "body"),
    "friction_force": Channel("N", "friction of the rim on the belt, along z x n", "body"),
    "slip_velocity": Channel("m/s", "velocity of the rim less that of the belt on it", "body"),
    "sticking": Channel(
        "1",
        "1 where the body sticks to a pulley, else 0",
        "body",
        integer=True,
        flags=((0, "not_sticking"), (1, "sticking")),
    ),
    "pulley_index": Channel(
        "1",
        "pulley that the body touches, -1 none",
        "body",
        integer=True,
        flags=((-1, "none"),),  # a scenario's own pulleys: `channel_info`
    ),
    "tension": Channel("N", "tension, of the joint before the body", "joint"),
    "friction_work": Channel("J", "friction work of the body on all pulleys", "body"),
    "pulley_friction_work": Channel("J", "friction work of all bodies on the pulley", "pulley"),
    "energy_input": Channel("J", "work of the torques on the pulleys"),
    "energy_kinetic": Channel("J", "kinetic energy of belt and pulleys"),
    "energy_potential": Channel("J", "energy of springs and contacts, and of the weight"),
    "energy_friction": Channel("J", "heat of the dry friction"),
    "energy_damping": Channel("J", "heat of the dampers in belt and contacts"),
}
PANELS = ("pulley_torque", "pulley_speed", "pulley_angle")


def channels_of(pulleys: Sequence[str]) -> dict[str, Channel]:
    """Return the channels of a belt on named pulleys: the meanings of `pulley_index`."""
    index = CHANNELS["pulley_index"]
    flags = (*index.flags, *enumerate(pulleys))
    return CHANNELS | {"pulley_index": index._replace(flags=flags)}


def _check_one_of(table: Params, first: str, second: str, words: str) -> None:
    """Refuse a table that gives neither or both of two keys."""
    given = [getattr(table, key) is not None for key in (first, second)]
    if sum(given) != 1:
        raise inconsistent(
            (), f"expected either {words}; found {'both' if any(given) else 'neither'}"
        )


class BeltTable(Params):
    """`[mechanism.belt]`: give either the pretension or the unstretched length."""

    bodies: int = unit_field("1", "Number of bodies of the belt.", ge=MIN_BODIES, le=100_000)
    mass_per_length: float = unit_field("kg/m", "Mass of the belt per unstretched length.", gt=0)
    axial_rigidity: float = unit_field(
        "N", "Axial rigidity EA of the section: force over strain.", gt=0
    )
    pretension: float | None = unit_field(
        "N", "Mean tension at the start; give this or length.", None, gt=0
    )
    length: float | None = unit_field(
        "m", "Unstretched length of the belt; give this or pretension.", None, gt=0
    )

    wrap: Literal["corrected", "polygon"] = Field(
        "corrected",
        description="Velocity of the belt on a rim: corrected for the corners between the bodies,"
        " or that of their centres, as published.",
    )

    @model_validator(mode="after")
    def _check_tension_or_length(self) -> Self:
        words = "pretension, N, or length (unstretched), m"
        _check_one_of(self, "pretension", "length", words)
        return self


class PulleyTable(Params):
    """One of `[[mechanism.pulleys]]`, in the order in which the belt passes them."""

    name: str = Field(
        min_length=1,
        pattern=r"^[\w-]+$",
        description="Name, for the drive, friction and quantities of this pulley.",
    )
    center: tuple[float, float] = unit_field("m", "Position of the axis, x and y.", strict=False)
    radius: float = unit_field("m", "Radius of the rim.", gt=0)
    inertia: float = unit_field("kg m^2", "Moment of inertia.", gt=0)
    side: Literal["inside", "outside"] = Field(
        "inside", description="Whether it is inside the loop or on the back of the belt."
    )


class Geometry(Params):
    """`[mechanism]`."""

    belt: BeltTable
    pulleys: tuple[PulleyTable, ...] = Field(min_length=2, max_length=100, strict=False)

    @model_validator(mode="after")
    def _check_names(self) -> Self:
        names = [pulley.name for pulley in self.pulleys]
        for i, name in enumerate(names):
            if name in names[:i]:
                raise inconsistent(("pulleys", i, "name"), f"there is a pulley '{name}' already")
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the pulleys."""
        return tuple(pulley.name for pulley in self.pulleys)

    @property
    def circles(self) -> list[PulleyCircle]:
        """The pulleys as the path sees them."""
        return [PulleyCircle(p.name, p.center, p.radius, p.side) for p in self.pulleys]

    def path(self) -> Path:
        """Return the ideal line of the belt."""
        return belt_path(self.circles)

    @model_validator(mode="after")
    def _check_path(self) -> Self:
        try:
            path = self.path()
        except PathError as error:
            raise inconsistent(("pulleys", error.pulley), str(error)) from None
        self._check_length(path)
        return self

    def _check_length(self, path: Path) -> None:
        """Refuse a belt that its path would stretch beyond what the linear law is good for."""
        belt, good = self.belt, f"the law of its springs is good up to {100 * MAX_STRAIN:.0f} %"
        where = f"its path of {path.length:.6g} m"
        if belt.length is not None:
            strain = path.length / belt.length - 1.0
            if strain <= 0.0:
                raise inconsistent(
                    ("belt", "length"),
                    f"a belt of {belt.length} m hangs loose on {where}; make it shorter, or move"
                    " the pulleys apart",
                )
            if strain > MAX_STRAIN:
                raise inconsistent(
                    ("belt", "length"),
                    f"a belt of {belt.length} m is too short for {where}: it would stretch by"
                    f" {100 * strain:.3g} %, {good}",
                )
        elif belt.pretension is not None and belt.pretension > MAX_STRAIN * belt.axial_rigidity:
            strain = belt.pretension / belt.axial_rigidity
            raise inconsistent(
                ("belt", "pretension"),
                f"{belt.pretension} N stretch a belt of {belt.axial_rigidity} N by"
                f" {100 * strain:.3g} %: it would be too short for {where}; {good}",
            )


class DriveTable(Params):
    """`[drive.NAME]`: torque, of time or of the pulley's speed, or speed over time."""

    torque: SpeedOrTimeSignals | None = unit_field(
        "N m", "Torque, positive counter-clockwise, over time or own speed; or give speed.", None
    )
    speed: TimeSignals | None = unit_field(
        "rad/s", "Given angular velocity, positive counter-clockwise; or give torque.", None
    )

    @model_validator(mode="after")
    def _check_inputs(self) -> Self:
        _check_one_of(self, "torque", "speed", "torque or speed")
        return self

    @property
    def terms(self) -> tuple[Any, ...]:
        """The signals that add up to the torque or the speed."""
        given = self.torque if self.speed is None else self.speed
        return given if isinstance(given, tuple) else (given,)


class PulleyContactTable(Params):
    """Contact with one pulley; what is left out is as on the others."""

    c1: float | None = unit_field("N/m^2", "Quadratic stiffness there.", None, ge=0)
    c2: float | None = unit_field("N/m", "Linear stiffness there.", None, gt=0)
    damping: float | None = unit_field("N s/m", "Damping there.", None, ge=0)
    p_max: float | None = unit_field(
        "m", "Penetration from which on the damping acts in full there.", None, gt=0
    )


class ContactTable(Params):
    """`[effects.contact]`: eqs 9-11 of Kubas 2014, for one body; `pulleys.NAME` where they differ.

    With `reference_bodies` the numbers are for a body of a belt of so many; each body of another
    mesh has its part by length, so that the mesh can be refined.
    """

    c1: float = unit_field("N/m^2", "Quadratic stiffness of the contact of a body.", 0.0, ge=0)
    c2: float = unit_field("N/m", "Linear stiffness of the contact of a body.", gt=0)
    damping: float = unit_field("N s/m", "Damping of the contact of a body.", 0.0, ge=0)
    p_max: float = unit_field(
        "m", "Penetration from which on the damping acts in full.", 1e-3, gt=0
    )
    reference_bodies: int | None = unit_field(
        "1", "Bodies of the belt that these numbers are for; without it any mesh.", None, gt=0
    )
    pulleys: dict[str, PulleyContactTable] = Field(
        default_factory=dict,
        description="Contact with a pulley that differs; what is left out is as on the others.",
    )

    def at(self, pulley: str, key: str) -> float:
        """Return a number of the contact with a pulley: its own, or the common one."""
        own = getattr(self.pulleys.get(pulley), key, None)
        parameter: float = getattr(self, key) if own is None else own
        return parameter


# The parameters of the friction laws that are functions of the slip.
UNITS = {"transition_speed": "m/s", "maximum_creep": "m", "elementary_time": "s"}


class BeltFrictionTable(CoefficientsOfFriction):
    """`[effects.belt_friction]`, with `pulleys.NAME` for those that differ."""

    LAW_KEYS: ClassVar[tuple[str, ...]] = ("law", *UNITS)

    law: Literal["set-valued", "regularised", "creep"] = Field(
        "set-valued", description="Friction law."
    )
    transition_speed: float | None = unit_field(
        "m/s",
        "Speed over which `regularised` and `creep` friction rises to its full size; needed by"
        " both.",
        None,
        gt=0,
    )
    maximum_creep: float | None = unit_field(
        "m",
        "Creep at which a contact without slip has its full friction, eq 13; `creep` needs it.",
        None,
        gt=0,
    )
    elementary_time: float | None = unit_field(
        "s",
        "Time in which the slip velocity gives the creep of eq 13, for `creep`; without it the"
        " step of the solver, on which the friction depends then.",
        None,
        gt=0,
    )
    pulleys: dict[str, CoefficientsOfFriction] = Field(
        default_factory=dict,
        description="Coefficients of a pulley that differs from the others, by its name.",
    )

    @model_validator(mode="after")
    def _law_has_its_parameters(self) -> Self:
        of_law = {"regularised": ("transition_speed",), "creep": tuple(UNITS)}.get(self.law, ())
        for key, unit in UNITS.items():
            given = getattr(self, key) is not None
            if key in of_law and not given and key != "elementary_time":
                raise inconsistent(
                    (key,),
                    f"missing; law = '{self.law}' needs it, in {unit}"
                    f" (--set effects.belt_friction.{key}=VALUE)",
                )
            if given and key not in of_law:
                raise inconsistent(
                    (key,), f"law = '{self.law}' has no such parameter; leave it out"
                )
        return self


class AxialDampingTable(Params):
    """`[effects.axial_damping]`: of each joint, N s/m, or of the section, N s (b/l a joint)."""

    coefficient: float = unit_field(
        "N s/m or N s", "Damping along the belt: of a joint, N s/m, or of the section, N s.", gt=0
    )
    basis: Literal["joint", "section"] = Field(
        "joint",
        description="What the coefficient belongs to; of the section a joint has coefficient/l.",
    )


class BendingTable(Params):
    """`[effects.bending]`: of the section; a joint has rigidity/l and damping/l."""

    rigidity: float = unit_field(
        "N m^2", "Bending rigidity EI of the section; a joint has EI/l.", gt=0
    )
    damping: float = unit_field(
        "N m^2 s", "Bending damping of the section; a joint has it over l.", 0.0, ge=0
    )


class PatchTable(CoefficientsOfFriction):
    """`[effects.patch]`: a part of the belt, by unstretched length, with other friction.

    Measured from where the belt leaves the first pulley at the start, in its direction. Several are
    `[[effects.patch]]`.
    """

    name: str = Field(
        "patch",
        pattern=r"^[\w-]+$",
        description="Name, for its friction work; patches of one name count together.",
    )
    start: float = unit_field(
        "m",
        "Start of the patch, from where the belt leaves the first pulley at the start.",
        alias="from",
        ge=0,
    )
    end: float = unit_field(
        "m", "End of the patch, in the direction of the belt.", alias="to", gt=0
    )

    @model_validator(mode="after")
    def _check_ends(self) -> Self:
        if not self.end > self.start:
            raise inconsistent(("to",), f"{self.end} m is not after from = {self.start} m")
        return self


Patches = Annotated[
    Annotated[PatchTable, Tag(ONE)]
    | Annotated[tuple[PatchTable, ...], Field(min_length=1, strict=False), Tag(SUM)],
    Discriminator(lambda given: SUM if isinstance(given, list | tuple) else ONE),
]


class WearTable(Params):
    """`[effects.wear]`: friction work along the belt and on each rim, summed at every step."""


class Effects(Params):
    """`[effects]`: one table for each effect that is simulated."""

    contact: ContactTable | None = None
    belt_friction: BeltFrictionTable | None = None
    axial_damping: AxialDampingTable | None = None
    bending: BendingTable | None = None
    gravity: Gravity | None = None
    patch: Patches | None = Field(
        None,
        description="A part of the belt, by unstretched length, with other friction; or several,"
        " [[effects.patch]].",
    )
    wear: WearTable | None = None

    @property
    def patches(self) -> tuple[PatchTable, ...]:
        """The patches, one or several, in the order of the scenario."""
        if self.patch is None:
            return ()
        return self.patch if isinstance(self.patch, tuple) else (self.patch,)


# What there is without friction on the pulleys neither.
OF_FRICTION = {
    "patch": "a patch is a place of other friction",
    "wear": "there is no friction whose work it could sum",
}
# They move a belt across itself, which one that is guided on its line cannot do.
ACROSS = ("bending", "gravity")


class BeltSolverSettings(SolverSettings):
    """`[solver]` of a belt: a step is accepted when no state errs by more than rtol of its scale.

    The scales are those that the pretension gives: the stretch of a joint or the depth of a
    contact, m, whichever is less, and ten times that over the length of a body, rad; the velocity
    with which either would swing, m/s, ten times that over the length of a body, and over the
    smallest radius, rad/s.
    """

    backend: str = Field("rkf45", description="Integration method.")
    duration: float = unit_field("s", "Simulated time.", 1.0, gt=0)
    # The loosest at which the energy of a belt without dampers closes to 1e-6; with dampers most
    # steps still have the longest stable length.
    rtol: float = unit_field(
        "1",
        "Tolerance, relative to the size that the pretension gives each state.",
        2e-6,
        ge=1e-12,
        lt=1,
    )
    atol: None = Field(  # type: ignore[assignment]
        None, description="Not of belts: their states have scales of their own."
    )
    max_steps: int = unit_field(
        "1", "Budget of steps; a resumed run has as many again.", 1_000_000_000, gt=0
    )

    @field_validator("atol", mode="before")
    @classmethod
    def _no_absolute_tolerance(cls, atol: Any) -> None:
        if atol is not None:
            raise inconsistent(
                (), "the states of a belt have scales of their own; give solver.rtol alone"
            )


class BeltDriveScenario(Scenario):
    """A scenario of kind `belt_drive`."""

    PAIRS: ClassVar[Pairs] = BELT
    CHANNELS: ClassVar = CHANNELS

    kind: Literal["belt_drive"]
    mechanism: Geometry
    drive: dict[str, DriveTable] = Field(default_factory=dict)
    effects: Effects
    solver: BeltSolverSettings = BeltSolverSettings()

    @model_validator(mode="after")
    def _check_pulley_names(self) -> Self:
        names = list(self.mechanism.names)
        named: list[tuple[tuple[str, ...], str]] = [(("drive", name), name) for name in self.drive]
        for key in ("contact", "belt_friction"):
            own = getattr(getattr(self.effects, key), "pulleys", {})
            named += [(("effects", key, "pulleys", name), name) for name in own]
        for where, name in named:
            if name not in names:
                raise inconsistent(where, unknown("pulley", name, names))
        return self

    @property
    def guided(self) -> bool:
        """Whether the belt is guided on its pitch line: no effect asks for motion across it."""
        return self.effects.contact is None

    @model_validator(mode="after")
    def _check_effects(self) -> Self:
        for name in ACROSS:
            if self.guided and getattr(self.effects, name) is not None:
                raise inconsistent(
                    ("effects", name),
                    "it moves the belt across itself, and a belt without effects.contact is guided"
                    " on its pitch line; add [effects.contact], or leave this effect out",
                )
        for name, what in OF_FRICTION.items():
            if getattr(self.effects, name) is not None and self.effects.belt_friction is None:
                raise inconsistent(("effects", name), f"{what}; add belt_friction")
        path, bodies = self.mechanism.path(), self.mechanism.belt.bodies
        belt = self.mechanism.belt
        # How long bodies in the plane are at their pretension, their equilibrium tells: about that.
        stretch = 1.0 + (belt.pretension or 0.0) / belt.axial_rigidity if self.guided else 1.0
        self._check_patches(belt.length or path.length / stretch)
        if self.guided:
            problem = _missing_points(path, self.mechanism.names, self.drive, bodies)
        else:
            problem = _missing_bodies(path, self.mechanism.pulleys, bodies)
        if problem is not None:
            raise inconsistent(("mechanism", "belt", "bodies"), problem)
        return self

    def _check_patches(self, length: float) -> None:
        """Refuse patches beyond the belt's length, m, over each other, or named as what is none."""
        patches, several = self.effects.patches, isinstance(self.effects.patch, tuple)
        keys = [("effects", "patch", *((i,) if several else ())) for i in range(len(patches))]
        for key, patch in zip(keys, patches, strict=True):
            if patch.end > length:
                raise inconsistent((*key, "to"), f"{patch.end} m is beyond the belt's {length} m")
            if patch.name == CLEAN:
                raise inconsistent(
                    (*key, "name"), f"'{CLEAN}' is the belt outside of patches; take another name"
                )
        for i, k in pairwise(sorted(range(len(patches)), key=lambda i: patches[i].start)):
            if patches[k].start < patches[i].end:
                raise inconsistent(
                    (*keys[k], "from"),
                    f"{patches[k].start} m is inside the patch from {patches[i].start} m to"
                    f" {patches[i].end} m; patches may adjoin, but not overlap",
                )

    @property
    def signals(self) -> dict[str, Any]:
        """What drives it, by the keys of the scenario."""
        drives = self.drive.items()
        return {f"drive.{name}.{key}": signal for name, drive in drives for key, signal in drive}

    def warnings(self) -> list[str]:
        """Return warnings about the scenario, also of overload and of a creep by the step."""
        from frictionsim.mechanisms.belt_drive.equilibrium import empty_patches, overloads

        warnings = [*super().warnings(), *overloads(self), *empty_patches(self)]
        friction = self.effects.belt_friction
        if friction is not None and friction.law == "creep" and friction.elementary_time is None:
            warnings.append(
                "law = 'creep' takes the step of the solver as its elementary time: give"
                " effects.belt_friction.elementary_time, in s, for friction that does not depend on"
                " the steps"
            )
        return warnings


def _missing_bodies(path: Path, pulleys: Sequence[PulleyTable], bodies: int) -> str | None:
    """Return why a number of bodies cannot follow the curve of a pulley; None if they can."""
    smallest = min(pulleys, key=lambda pulley: pulley.radius)
    needed = ceil(path.length / (MAX_BODY_OVER_RADIUS * smallest.radius))
    if bodies >= needed:
        return None
    return (
        f"{bodies} bodies of {path.length / bodies:.3g} m cannot follow the curve of"
        f" '{smallest.name}', radius {smallest.radius} m; it takes at least {needed:.10g};"
        f" begin with about {ENOUGH * needed:.10g}, 'frictionsim cost' compares them with more"
    )


def _missing_points(
    path: Path, names: Sequence[str], driven: Collection[str], points: int
) -> str | None:
    """Return why a number of points cannot follow the pitch line; None if they can.

    A point stands for the belt half way to its neighbours. None is to be on two pulleys at once:
    no span is shorter than their distance. The arcs of pulleys in `driven`, which carry a load,
    have a point at least.
    """
    lengths, pieces = np.diff(path.breakpoints), []
    for j, (name, after) in enumerate(zip(names, (*names[1:], names[0]), strict=True)):
        pieces.append((float(lengths[2 * j]), f"the span from '{name}' to '{after}'"))
        if after in driven:
            pieces.append((float(lengths[2 * j + 1]), f"the arc on '{after}'"))
    length, what = min(pieces)
    if length <= path.length * ROUNDING:
        return (
            f"no number of bodies is enough for {what}, which is too short ({length:.3g} m)"
            f" compared with the belt, {path.length:.3g} m; change the centers and radii of the"
            " pulleys"
        )
    needed = ceil(path.length / length)
    if points >= needed:
        return None
    return (
        f"{points} bodies, {path.length / points:.3g} m apart, are too few for {what},"
        f" {length:.3g} m: a belt without effects.contact needs at least {needed} here;"
        f" begin with about {ENOUGH * needed}, 'frictionsim cost' compares them with more"
    )
