"""The scenario of a belt drive: what its tables hold, and what does not go together in them."""

from math import ceil, pi
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from frictionsim.errors import unknown
from frictionsim.mechanisms.belt_drive.geometry import Path, PathError, Pulley, belt_path
from frictionsim.mechanisms.effects import Gravity
from frictionsim.results import Channel
from frictionsim.scenario.schema import Params, inconsistent, unit_field
from frictionsim.scenario.settings import Scenario, SolverSettings
from frictionsim.scenario.signal_tables import SpeedOrTimeSignal, TimeSignal

# A body longer than this share of a radius cannot follow the curve: two to half a turn.
MAX_BODY_OVER_RADIUS = pi / 2
MAX_STRAIN = 0.5  # of a law that is linear

CHANNELS = {
    "pulley_angle": Channel("rad", "angle of the pulley", "pulley"),
    "pulley_speed": Channel("rad/s", "angular velocity of the pulley", "pulley"),
    "pulley_torque": Channel("N m", "torque on the pulley from outside", "pulley"),
    "x": Channel("m", "x of the body's centre", "body"),
    "y": Channel("m", "y of the body's centre", "body"),
    "angle": Channel("rad", "angle of the body", "body"),
    "normal_force": Channel("N", "normal force of the pulley on the body", "body"),
    "friction_force": Channel("N", "friction of the pulley on the body, along z x n", "body"),
    "slip_velocity": Channel("m/s", "velocity of the rim less that of the body", "body"),
    "sticking": Channel("1", "1 where the body sticks to a pulley, else 0", "body"),
    "pulley_index": Channel("1", "pulley that the body touches, -1 none", "body"),
    "tension": Channel("N", "tension, of the joint before the body", "joint"),
    "energy_input": Channel("J", "work of the torques on the pulleys"),
    "energy_kinetic": Channel("J", "kinetic energy of belt and pulleys"),
    "energy_potential": Channel("J", "energy of springs and contacts, and of the weight"),
    "energy_friction": Channel("J", "heat of the dry friction"),
    "energy_damping": Channel("J", "heat of the dampers in belt and contacts"),
}


class BeltTable(Params):
    """`[mechanism.belt]`: give either the pretension or the unstretched length."""

    bodies: int = unit_field("1", ge=3, le=100_000)
    mass_per_length: float = unit_field("kg/m", gt=0)
    axial_rigidity: float = unit_field("N", gt=0)
    pretension: float | None = unit_field("N", None, gt=0)
    length: float | None = unit_field("m", None, gt=0)

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.pretension is None) == (self.length is None):
            found = "neither" if self.length is None else "both"
            raise inconsistent(
                (), f"expected either pretension, N, or length (unstretched), m; found {found}"
            )
        return self


class PulleyTable(Params):
    """One of `[[mechanism.pulleys]]`, in the order in which the belt passes them."""

    name: str = Field(min_length=1, pattern=r"^[\w-]+$")
    center: tuple[float, float] = unit_field("m", strict=False)
    radius: float = unit_field("m", gt=0)
    inertia: float = unit_field("kg m^2", gt=0)
    side: Literal["inside", "outside"] = "inside"


class Geometry(Params):
    """`[mechanism]`."""

    belt: BeltTable
    pulleys: tuple[PulleyTable, ...] = Field(min_length=2, max_length=100, strict=False)

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
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
    def circles(self) -> list[Pulley]:
        """The pulleys as the path sees them."""
        return [Pulley(p.name, p.center, p.radius, p.side) for p in self.pulleys]

    def path(self) -> Path:
        """Return the ideal line of the belt.

        Raises
        ------
        PathError
        """
        return belt_path(self.circles)

    @model_validator(mode="after")
    def _belt_fits_its_path(self) -> Self:
        try:
            path = self.path()
        except PathError as error:
            raise inconsistent(("pulleys", error.pulley), str(error)) from None
        self._check_length(path)
        smallest = min(self.pulleys, key=lambda pulley: pulley.radius)
        needed = ceil(path.length / (MAX_BODY_OVER_RADIUS * smallest.radius))
        if self.belt.bodies < needed:
            raise inconsistent(
                ("belt", "bodies"),
                f"{self.belt.bodies} bodies of {path.length / self.belt.bodies:.3g} m cannot follow"
                f" the curve of '{smallest.name}', radius {smallest.radius} m; it takes at least"
                f" {needed}, and about {needed * 4} for quantities that depend little on their"
                " number",
            )
        return self

    def _check_length(self, path: Path) -> None:
        """Refuse a belt that its path would stretch beyond what the linear law is good for."""
        belt = self.belt
        if belt.length is not None:
            strain = path.length / belt.length - 1.0
            if strain <= 0.0:
                raise inconsistent(
                    ("belt", "length"),
                    f"a belt of {belt.length} m hangs loose on its path of {path.length:.6g} m;"
                    f" make it shorter, or move the pulleys apart",
                )
            if strain > MAX_STRAIN:
                raise inconsistent(
                    ("belt", "length"),
                    f"a belt of {belt.length} m is too short for its path of {path.length:.6g} m:"
                    f" it would stretch by {100 * strain:.3g} %, the law of its springs is good up"
                    f" to {100 * MAX_STRAIN:.0f} %",
                )
        elif belt.pretension is not None and belt.pretension > MAX_STRAIN * belt.axial_rigidity:
            strain = belt.pretension / belt.axial_rigidity
            raise inconsistent(
                ("belt", "pretension"),
                f"{belt.pretension} N stretch a belt of {belt.axial_rigidity} N by"
                f" {100 * strain:.3g} %: it would be too short for its path of"
                f" {path.length:.6g} m; the law of its springs is good up to"
                f" {100 * MAX_STRAIN:.0f} %",
            )


class PulleyDrive(Params):
    """`[drive.NAME]`: torque, of time or of the pulley's speed, or speed over time."""

    torque: SpeedOrTimeSignal | None = unit_field("N m", None)
    speed: TimeSignal | None = unit_field("rad/s", None)

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.torque is None) == (self.speed is None):
            found = "neither" if self.torque is None else "both"
            raise inconsistent((), f"expected either torque or speed; found {found}")
        return self


class ContactTable(Params):
    """`[effects.contact]`: eqs 9-11 of Kubas 2014, for one body.

    With `reference_bodies` the numbers are for a body of a belt of so many; each body of another
    mesh has its share by length, so that the mesh can be refined.
    """

    c1: float = unit_field("N/m^2", 0.0, ge=0)
    c2: float = unit_field("N/m", gt=0)
    damping: float = unit_field("N s/m", 0.0, ge=0)
    p_max: float = unit_field("m", 1e-3, gt=0)
    reference_bodies: int | None = unit_field("1", None, gt=0)


class Coefficients(Params):
    """Friction of one pulley, or of a part of the belt."""

    mu_s: float = unit_field("1", ge=0)
    mu_k: float = unit_field("1", ge=0)

    @model_validator(mode="after")
    def _static_is_not_below_kinetic(self) -> Self:
        if self.mu_s < self.mu_k:
            raise inconsistent(
                ("mu_s",), f"{self.mu_s} is below mu_k = {self.mu_k}; expected mu_s >= mu_k"
            )
        return self


class BeltFriction(Coefficients):
    """`[effects.belt_friction]`, with `pulleys.NAME` for those that differ."""

    law: Literal["set-valued", "regularised", "creep"] = "set-valued"
    transition_speed: float | None = unit_field("m/s", None, gt=0)
    maximum_creep: float | None = unit_field("m", None, gt=0)
    pulleys: dict[str, Coefficients] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _law_has_its_parameters(self) -> Self:
        needs = {
            "transition_speed": self.law in ("regularised", "creep"),
            "maximum_creep": self.law == "creep",
        }
        for key, needed in needs.items():
            given = getattr(self, key) is not None
            if needed and not given:
                raise inconsistent((key,), f"missing; law = '{self.law}' needs it")
            if given and not needed:
                raise inconsistent(
                    (key,), f"law = '{self.law}' has no such parameter; leave it out"
                )
        return self


class AxialDampingTable(Params):
    """`[effects.axial_damping]`: of each joint, N s/m, or of the section, N s (b/l a joint)."""

    coefficient: float = unit_field("N s/m or N s", gt=0)
    basis: Literal["joint", "section"] = "joint"


class BendingTable(Params):
    """`[effects.bending]`: of the section; a joint has rigidity/l and damping/l."""

    rigidity: float = unit_field("N m^2", gt=0)
    damping: float = unit_field("N m^2 s", 0.0, ge=0)


class Patch(Coefficients):
    """`[effects.patch]`: a part of the belt with a friction of its own, by its unstretched length.

    Measured from where the belt leaves the first pulley at the start, in its direction.
    """

    start: float = unit_field("m", alias="from", ge=0)
    end: float = unit_field("m", alias="to", gt=0)

    @model_validator(mode="after")
    def _end_after_start(self) -> Self:
        if not self.end > self.start:
            raise inconsistent(("to",), f"{self.end} m is not after from = {self.start} m")
        return self


class Effects(Params):
    """`[effects]`: one table for each effect that is simulated."""

    contact: ContactTable
    belt_friction: BeltFriction | None = None
    axial_damping: AxialDampingTable | None = None
    bending: BendingTable | None = None
    gravity: Gravity | None = None
    patch: Patch | None = None


class BeltSolverSettings(SolverSettings):
    """`[solver]` of a belt: a step is accepted when the error is (rtol + atol) sizes of its states.

    The sizes are those that the pretension gives: the stretch of a joint or the depth of a contact,
    m, whichever is less, and over the length of a body, rad; the velocity with which either would
    swing, m/s, over the length of a body and over the smallest radius, rad/s.
    """

    backend: str = "rkf45"
    duration: float = unit_field("s", 1.0, gt=0)
    # Looser, the adaptive steps put energy into waves that no damper takes.
    rtol: float = unit_field("1", 1e-5, ge=1e-12, lt=1)
    atol: float = unit_field("1", 0.0, ge=0)
    max_steps: int = unit_field("1", 1_000_000_000, gt=0)


class BeltDriveScenario(Scenario):
    """A scenario of kind `belt_drive`."""

    BACKENDS: ClassVar[tuple[str, ...]] = (
        *("rkf45", "moreau"),
        *("rk45", "dop853", "radau", "bdf", "lsoda"),
    )
    CHANNELS: ClassVar = CHANNELS

    kind: Literal["belt_drive"]
    mechanism: Geometry
    drive: dict[str, PulleyDrive] = Field(default_factory=dict)
    effects: Effects
    solver: BeltSolverSettings = BeltSolverSettings()

    @model_validator(mode="after")
    def _names_are_of_pulleys(self) -> Self:
        names = list(self.mechanism.names)
        friction = self.effects.belt_friction
        named: list[tuple[tuple[str, ...], str]] = [(("drive", name), name) for name in self.drive]
        if friction is not None:
            path = ("effects", "belt_friction", "pulleys")
            named += [((*path, name), name) for name in friction.pulleys]
        for where, name in named:
            if name not in names:
                raise inconsistent(where, unknown("pulley", name, names))
        return self

    @model_validator(mode="after")
    def _patch_needs_friction(self) -> Self:
        patch = self.effects.patch
        if patch is None:
            return self
        if self.effects.belt_friction is None:
            raise inconsistent(
                ("effects", "patch"), "a patch is a place of other friction; add belt_friction"
            )
        length = self.mechanism.path().length
        if patch.end > length:
            raise inconsistent(
                ("effects", "patch", "to"), f"{patch.end} m is beyond the belt's {length:.6g} m"
            )
        return self

    @model_validator(mode="after")
    def _backend_can_do_the_law(self) -> Self:
        friction = self.effects.belt_friction
        if self.solver.backend == "moreau" and friction and friction.law != "set-valued":
            raise inconsistent(
                ("effects", "belt_friction", "law"),
                f"'moreau' solves for the impulses of set-valued friction; '{friction.law}' takes"
                " backend = 'rkf45'",
            )
        return self

    @property
    def signals(self) -> dict[str, Any]:
        """What drives it, by the keys of the scenario."""
        drives = self.drive.items()
        return {f"drive.{name}.{key}": signal for name, drive in drives for key, signal in drive}

    def warnings(self) -> list[str]:
        """Return what is odd about the scenario: also a creep that depends on the step."""
        found = super().warnings()
        friction = self.effects.belt_friction
        if friction is not None and friction.law == "creep":
            found.append(
                "law = 'creep' takes the creep as slip times step, as published: its friction"
                " depends on the steps of the solver"
            )
        return found
