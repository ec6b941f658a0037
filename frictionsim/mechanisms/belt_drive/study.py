"""What a study of a belt's accuracy compares: tolerances, steps, friction laws and meshes.

Over time there is, beside tolerances and steps, the friction law: set-valued as the scenario has
it, or smoothed over a speed, as the literature has it.

A mesh is a model in space and a number of bodies. The model is `string`, a belt guided on its pitch
line, or one whose bodies move in the plane and press on their pulleys: with `corrected` wrap
factors, or as a `polygon`. These two have the same limit of fine meshes. A string has less than
they have: what it leaves out does not vanish with the mesh.
"""

from collections.abc import Iterable
from math import isclose
from typing import TYPE_CHECKING, Any

from frictionsim.mechanisms.belt_drive.belt import belt_of
from frictionsim.mechanisms.belt_drive.equilibrium import at_rest
from frictionsim.mechanisms.belt_drive.geometry import MIN_BODIES
from frictionsim.results import ENERGY_BALANCE, Metric
from frictionsim.scenario.methods import REGULARISED, SET_VALUED
from frictionsim.scenario.toml_data import keys_and_values
from frictionsim.scenario.variants import TOLERANCES as USUAL_TOLERANCES
from frictionsim.scenario.variants import Limit, Mesh, Setting, short

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

HEAT = Metric("friction_heat", "quantity", "energy_friction", "J")
# Places of single bodies depend on rounding before long; these do not.
METRICS = (
    Metric("driven_speed", "quantity", "driven_speed", "rad/s"),
    Metric("slip", "quantity", "slip_percent", "%"),
    Metric("tension_tight", "quantity", "tension_tight", "N"),
    Metric("tension_slack", "quantity", "tension_slack", "N"),
    Metric("speed_L1", "channel", "pulley_speed", "rad/s"),
    HEAT,
    ENERGY_BALANCE,
)
# Of meshes without the heat: that of the start-up on coarse ones would decide the largest error.
MESH_METRICS = tuple(metric for metric in METRICS if metric is not HEAT)

TOLERANCES = (1e-4, 2e-6, 1e-7)  # looser ones have the same steps, the longest stable ones
REFERENCE_TOLERANCE, SMOOTHED_TOLERANCE = 1e-9, 1e-4
PARTS, REFERENCE_PART = (1, 2, 4), 16  # of the longest stable step
SPEEDS = (1.0, 0.1, 0.01)  # m/s; smaller ones take minutes for tenths of a second

STRING, CORRECTED, POLYGON = "string", "corrected", "polygon"
MODELS = (STRING, CORRECTED, POLYGON)
# Without a contact there is nothing to press on a pulley: such a scenario is a string only.
NOT_OF_STRINGS = ("contact", "bending", "gravity")
RATIOS = (0.4, 1.0, 2.0, 4.0)  # of the bodies by default to those of the scenario
MAX_BODIES = 600  # by default, if the scenario has no more
LIMIT_RATIO = 2  # of the bodies of a limit to the most that are compared

# Of the ideal line of the belt, of time, or a length that is that of this mesh by its meaning.
WITHOUT_MESH = (
    *("final_time", "path_length", "belt_length", "body_length"),
    *("wrap_angle_", "capstan_ratio_"),
)
OF_PRETENSION = ("pretension", "strain", "torque_limit_")
OF_SPEED = ("drive_speed", "driven_speed")
# The search for the belt at rest meets the pretension to about 1e-10.
SAME = 1e-8


# --- over time ------------------------------------------------------------------------------------


def ladders(scenario: "BeltDriveScenario", tolerances: Iterable[float]) -> list[Setting]:
    """Return tolerances, steps and smoothed laws; those of a belt instead of usual tolerances."""
    asked, longest = tuple(tolerances), _default_step(scenario)
    settings = [_adaptive(rtol) for rtol in (TOLERANCES if asked == USUAL_TOLERANCES else asked)]
    settings += [_fixed(longest / part) for part in PARTS]
    settings = [setting.with_law(SET_VALUED, scenario) for setting in settings]
    for speed in SPEEDS if scenario.effects.belt_friction is not None else ():
        setting = _adaptive(SMOOTHED_TOLERANCE, f"effects.belt_friction.transition_speed={speed:g}")
        setting = setting._replace(label=f"speed {short(speed)}")
        settings.append(setting.with_law(REGULARISED, scenario))
    return settings


def references(scenario: "BeltDriveScenario", rtol: float) -> tuple[Setting, Setting]:
    """Return the adaptive method and short fixed steps."""
    adaptive = _adaptive(max(rtol, REFERENCE_TOLERANCE))
    fixed = _fixed(_default_step(scenario) / REFERENCE_PART)
    return adaptive.with_law(SET_VALUED, scenario), fixed.with_law(SET_VALUED, scenario)


def tighter(scenario: "BeltDriveScenario") -> Setting | None:
    """Return half the step, also where `moreau` takes its own; None where tolerances decide."""
    if scenario.solver.backend != "moreau":
        return None
    return _fixed(0.5 * (scenario.solver.step or _default_step(scenario)))


def _adaptive(rtol: float, *overrides: str) -> Setting:
    return Setting("rkf45", f"rtol {short(rtol)}", (*overrides, f"solver.rtol={rtol:.6g}"))


def _fixed(length: float) -> Setting:
    step = float(f"{length:.3g}")
    return Setting("moreau", f"step {short(step)}", (f"solver.step={step:.3g}",))


def _default_step(scenario: "BeltDriveScenario") -> float:
    """Return the step that `moreau` takes by itself: just short of unstable, s."""
    from frictionsim.mechanisms.belt_drive.moreau import step_plan  # slow: numba

    settings, rest = scenario.solver.model_copy(update={"step": None}), at_rest(scenario)
    return step_plan(belt_of(scenario, rest.body_length), settings, rest).h


# --- meshes ---------------------------------------------------------------------------------------


def depends_on_mesh(name: str, value: float, scenario: dict[str, Any]) -> bool:
    """Return whether a quantity of summary or statics depends on the number of bodies.

    Only what the tables of the `scenario` give, and what follows from that without bodies, does
    not.
    """
    if name.startswith(WITHOUT_MESH):
        return False
    if name.startswith(OF_PRETENSION):
        return "pretension" not in scenario["mechanism"]["belt"]
    drives = scenario.get("drive", {}).values()
    given = [drive["speed"] for drive in drives if "speed" in drive]
    speeds = [speed for _, speed in keys_and_values(given, lists="all")]
    return name not in OF_SPEED or not any(
        isclose(value, speed, rel_tol=SAME) for speed in speeds if isinstance(speed, int | float)
    )


def models_of(scenario: "BeltDriveScenario") -> tuple[str, ...]:
    """Return the models that a scenario has the parameters of."""
    return (STRING,) if scenario.guided else MODELS


def own_mesh(scenario: "BeltDriveScenario") -> Mesh:
    """Return the mesh of the scenario itself."""
    belt = scenario.mechanism.belt
    return Mesh(STRING if scenario.guided else belt.wrap, belt.bodies)


def default_bodies(scenario: "BeltDriveScenario") -> tuple[int, ...]:
    """Return the numbers of bodies that are compared by default."""
    own = scenario.mechanism.belt.bodies
    counts = (round(ratio * own) for ratio in RATIOS)
    return tuple(count for count in counts if MIN_BODIES <= count <= max(own, MAX_BODIES))


def mesh_of(scenario: "BeltDriveScenario", model: str, bodies: int) -> Mesh:
    """Return a mesh with the overrides that make it of a scenario.

    A contact that is given for a body of this scenario has its part by length on other meshes.
    Dampers of the joints are left as they are: by length they would be stiffer than the springs
    of a fine mesh, cost three times the time and change slip by 0.1 %.
    """
    own, effects = own_mesh(scenario), scenario.effects
    if (model, bodies) == (own.model, own.bodies):
        return own
    overrides = [f"mechanism.belt.bodies={bodies}"]
    if model != own.model:
        overrides.append(f"mechanism.belt.wrap={'none' if model == STRING else model}")
        given = (name for name in NOT_OF_STRINGS if getattr(effects, name) is not None)
        overrides += [f"effects.{name}=none" for name in given if model == STRING]
    if model != STRING and effects.contact is not None and effects.contact.reference_bodies is None:
        overrides.append(f"effects.contact.reference_bodies={own.bodies}")
    return Mesh(model, bodies, tuple(overrides))


def mesh_settings(
    scenario: "BeltDriveScenario", mesh: Mesh, backends: Iterable[str], laws: Iterable[str]
) -> list[Setting]:
    """Return the setting of a mesh, by the fastest of the methods and laws asked for, if any."""
    adaptive = _adaptive(scenario.solver.rtol)._replace(mesh=mesh)
    settings = [_longest_step(scenario, mesh), adaptive.with_law(SET_VALUED, scenario)]
    if scenario.effects.belt_friction is not None:
        smoothed = adaptive._replace(label=f"{adaptive.label}, smoothed")
        settings.append(smoothed.with_law(REGULARISED, scenario))
    methods, wanted = tuple(backends), tuple(laws)
    return [s for s in settings if s.backend in methods and (not s.law or s.law in wanted)][:1]


def limits(scenario: "BeltDriveScenario", most: int) -> tuple[Limit, ...]:
    """Return the limit of fine meshes of the scenario's own model, and one to compare it with.

    `most` is the number of bodies of the finest mesh that is compared.
    """
    own = own_mesh(scenario).model
    if own == STRING:
        return _limit(scenario, STRING, LIMIT_RATIO * most), _limit(scenario, STRING, most)
    other = POLYGON if own == CORRECTED else CORRECTED
    return tuple(_limit(scenario, model, LIMIT_RATIO * most) for model in (own, other))


def _limit(scenario: "BeltDriveScenario", model: str, bodies: int) -> Limit:
    fine, coarse = (
        _longest_step(scenario, mesh_of(scenario, model, count)) for count in (bodies, bodies // 2)
    )
    return Limit(fine, coarse)


def _longest_step(scenario: "BeltDriveScenario", mesh: Mesh) -> Setting:
    """Return the method of fixed steps with its own step: just short of unstable."""
    return Setting("moreau", "longest step", (), mesh=mesh).with_law(SET_VALUED, scenario)
