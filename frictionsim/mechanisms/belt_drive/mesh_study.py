"""The meshes of a belt that a study of its accuracy compares: models in space, numbers of bodies.

A model is `string`, a belt guided on its pitch line, or one whose bodies move in the plane and
press on their pulleys: with `corrected` wrap factors, or as a `polygon`. These two have the same
limit of fine meshes. A string has less than they have: what it leaves out does not vanish with
the mesh.
"""

from math import isclose
from typing import TYPE_CHECKING, Any

from frictionsim.mechanisms.belt_drive.work_precision import METRICS as TIME_METRICS
from frictionsim.scenario.methods import REGULARISED, SET_VALUED
from frictionsim.scenario.toml_data import keys_and_values
from frictionsim.scenario.variants import Limit, Mesh, Setting, short

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario


STRING, CORRECTED, POLYGON = "string", "corrected", "polygon"
MODELS = (STRING, CORRECTED, POLYGON)
# Without a contact there is nothing to press on a pulley: such a scenario is a string only.
NOT_OF_STRINGS = ("contact", "bending", "gravity")

# The heat is left out: that of the start-up on coarse meshes would decide the largest error.
METRICS = tuple(metric for metric in TIME_METRICS if metric.name != "friction_heat")

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


def depends_on_mesh(name: str, value: float, scenario: dict[str, Any]) -> bool:
    """Return whether a quantity of summary or statics depends on the number of bodies.

    Only what the scenario gives, and what follows from that without bodies, does not.

    Parameters
    ----------
    name : str
    value : float
    scenario : dict
        Its tables.
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
    return MODELS if scenario.effects.contact is not None else (STRING,)


def own_mesh(scenario: "BeltDriveScenario") -> Mesh:
    """Return the mesh of the scenario itself."""
    belt = scenario.mechanism.belt
    return Mesh(STRING if scenario.effects.contact is None else belt.wrap, belt.bodies)


def default_bodies(scenario: "BeltDriveScenario") -> tuple[int, ...]:
    """Return the numbers of bodies that are compared by default."""
    own = scenario.mechanism.belt.bodies
    counts = (round(ratio * own) for ratio in RATIOS)
    return tuple(count for count in counts if count <= max(own, MAX_BODIES))


def mesh_of(scenario: "BeltDriveScenario", model: str, bodies: int) -> Mesh:
    """Return a mesh with the overrides that make it of a scenario.

    A contact that is given for a body of this scenario has its part by length on other meshes.
    Dampers of the joints are left as they are: by length they would be stiffer than the springs
    of a fine mesh, cost three times the time and change slip by 0.1 %.
    """
    own = own_mesh(scenario)
    if (model, bodies) == (own.model, own.bodies):
        return own
    effects = scenario.effects
    overrides = [f"mechanism.belt.bodies={bodies}"]
    if model != own.model and model == STRING:
        overrides += ["mechanism.belt.wrap=none"]
        overrides += [
            f"effects.{name}=none" for name in NOT_OF_STRINGS if getattr(effects, name) is not None
        ]
    elif model != own.model:
        overrides.append(f"mechanism.belt.wrap={model}")
    if model != STRING and effects.contact is not None and effects.contact.reference_bodies is None:
        overrides.append(f"effects.contact.reference_bodies={own.bodies}")
    return Mesh(model, bodies, tuple(overrides))


def mesh_settings(
    scenario: "BeltDriveScenario", mesh: Mesh, backends: "Iterable[str]", laws: "Iterable[str]"
) -> list[Setting]:
    """Return the setting of a mesh, by the fastest of the methods and laws asked for, if any."""
    rtol = scenario.solver.rtol
    adaptive = Setting("rkf45", f"rtol {short(rtol)}", (f"solver.rtol={rtol:.6g}",), mesh=mesh)
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
