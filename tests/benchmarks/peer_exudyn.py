"""The belt of `belt_verification.toml` in Exudyn, an independent multibody program.

Run it as `python tests/benchmarks/peer_exudyn.py` in an environment with the extra `peer`; it takes
half an hour and writes `results/belt_peer.json`, the speed of the driven pulley in each case. Cases
that the file has are left as they are; names of cases as arguments run those alone. Nothing else of
this project is needed.

The belt there is a ring of ANCF cable elements, curved and without corners; friction is that of
bristles, which stretch until they slip, so that the belt creeps by what they stretch. Contact is by
straight segments of the elements, as many as are asked for.
"""

import json
import platform
import sys
from collections.abc import Sequence
from importlib.metadata import version
from math import cos, pi, sin, sqrt
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

RESULT = Path(__file__).parents[2] / "results" / "belt_peer.json"
RADIUS, DISTANCE, INERTIA = 0.08125, 0.253, 0.02  # m, m, kg m^2
MASS, AXIAL, BENDING = 1.036, 1e4, 0.0208  # kg/m, N, N m^2
PRETENSION, FRICTION = 256.0, 0.8  # N, 1
SPEED, RAMP = -12.0, 0.2  # rad/s, s
LOAD, LOADED, LOAD_RAMP = 10.0, 0.3, 1e-4  # N m, s, s
DURATION, INTERVAL = 0.6, 1e-3  # s
SETTLING = 0.01  # s, before all, in which damped contacts let the belt come to rest
# N/m^2, per length: c2 of a body of 60
CONTACT = 5e6 * 60 / (2.0 * DISTANCE + 2.0 * pi * RADIUS)
BRISTLE = 2.5e9  # N/m^2
DAMPING = 0.5  # N s


class Case(NamedTuple):
    """Options in which runs of the peer differ."""

    elements: int = 120
    segments: int = 2
    contact: float = CONTACT
    bristle: float = BRISTLE
    damping: float = DAMPING
    step: float = 5e-5
    reference: str = "pretension"  # or "unstretched", or "as given": see `add_belt`

    @property
    def name(self) -> str:
        """Its differences from the first case."""
        first = Case()
        parts = [
            f"{field}={value if isinstance(value, str) else format(value, 'g')}"
            for field, value in self._asdict().items()
            if value != getattr(first, field)
        ]
        return " ".join(parts) or "standard"


CASES = (
    Case(),
    Case(bristle=2.5e8),
    Case(segments=4),
    Case(elements=60),
    Case(damping=0.0),
    Case(reference="unstretched"),
    Case(reference="as given"),
    Case(contact=4.0 * CONTACT),
    Case(bristle=2.5e7),
    Case(segments=1),
    Case(bristle=2.5e10, step=2.5e-5),
    Case(step=2.5e-5),
    Case(contact=16.0 * CONTACT),
    Case(elements=240),
)


class PitchLine:
    """Where the belt lies at the start: counter-clockwise round both pulleys.

    The middles of the segments, which touch, are as deep in the rims as the pretension asks for.
    """

    def __init__(self, case: Case) -> None:
        segment = (2.0 * DISTANCE + 2.0 * pi * RADIUS) / case.elements / case.segments
        depth = PRETENSION / (RADIUS * case.contact)
        self.radius = RADIUS + segment**2 / (8.0 * RADIUS) - depth
        self.length = 2.0 * DISTANCE + 2.0 * pi * self.radius

    def at(self, place: float) -> tuple[float, float, float, float]:
        """Return point and direction at a place along the line, m."""
        arc = pi * self.radius
        if place < DISTANCE:  # below both pulleys, to the right
            return place, -self.radius, 1.0, 0.0
        if DISTANCE + arc <= place < 2.0 * DISTANCE + arc:
            return 2.0 * DISTANCE + arc - place, self.radius, -1.0, 0.0
        on_driven = place < DISTANCE + arc
        centre = DISTANCE if on_driven else 0.0
        entry = DISTANCE if on_driven else 2.0 * DISTANCE + arc
        angle = (place - entry) / self.radius + (-0.5 if on_driven else 0.5) * pi
        x, y = centre + self.radius * cos(angle), self.radius * sin(angle)
        return x, y, -sin(angle), cos(angle)


def given_speed(_system: Any, time: float, _item: int, _offset: float) -> float:
    return SPEED * min(max(time - SETTLING, 0.0) / RAMP, 1.0)


def given_torque(_system: Any, time: float, load: Sequence[float]) -> list[float]:
    share = min(max((time - SETTLING - LOADED) / LOAD_RAMP, 0.0), 1.0)
    return [0.0, 0.0, share * load[2]]


def add_belt(items: Any, system: Any, case: Case) -> list[int]:
    """Add nodes and elements; return the numbers of the elements."""
    # The peer remembers where a segment sticks by its undeformed length. Elements that are as long
    # as they are with the pretension have next to no error of that; mass and stiffness are turned
    # into those per stretched length, unless they are taken "as given".
    strain = PRETENSION / AXIAL
    stretch = 1.0 if case.reference == "as given" else 1.0 + strain
    relaxed = case.reference == "unstretched"
    slope, ratio = (stretch, 1.0) if relaxed else (1.0, stretch)
    line = PitchLine(case)
    nodes = []
    for i in range(case.elements):
        x, y, along, across = line.at(i * line.length / case.elements)
        at = [x, y, slope * along, slope * across]
        nodes.append(system.AddNode(items.NodePoint2DSlope1(referenceCoordinates=at)))
    cables = []
    for first, second in zip(nodes, [*nodes[1:], nodes[0]], strict=True):
        cable = items.ObjectANCFCable2D(
            length=line.length / case.elements / slope,
            massPerLength=MASS / ratio,
            bendingStiffness=BENDING,
            axialStiffness=AXIAL * ratio,
            axialDamping=case.damping * ratio,
            referenceAxialStrain=0.0 if relaxed else -strain / stretch,
            nodeNumbers=[first, second],
            useReducedOrderIntegration=2,
        )
        cables.append(system.AddObject(cable))
    return cables


def add_pulley(items: Any, system: Any, ground: int, x: float) -> tuple[int, int]:
    """Add a pulley that turns about a fixed point; return its node and the marker of its angle."""
    node = system.AddNode(items.NodeRigidBody2D(referenceCoordinates=[x, 0.0, 0.0]))
    body = items.ObjectRigidBody2D(mass=1.0, inertia=INERTIA, nodeNumber=node)
    system.AddObject(body)
    for coordinate in (0, 1):
        marker = system.AddMarker(
            items.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate)
        )
        system.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[ground, marker]))
    return node, system.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=2))


def add_contacts(items: Any, system: Any, pulley: int, belt: list[int], case: Case) -> list[int]:
    """Let all elements touch a pulley, by straight segments; return the numbers of contacts."""
    rim = system.AddMarker(items.MarkerNodeRigid(nodeNumber=pulley))
    count = case.segments
    length = PitchLine(case).length / case.elements / count
    start = [0.1] * count + [-2.0] * count + [0.0] * count
    normal, along, mass = case.contact * length, case.bristle * length, MASS * length
    contacts = []
    for element in belt:
        shape = items.MarkerBodyCable2DShape(bodyNumber=element, numberOfSegments=count)
        state = items.NodeGenericData(numberOfDataCoordinates=3 * count, initialCoordinates=start)
        contact = items.ObjectContactFrictionCircleCable2D(
            markerNumbers=[rim, system.AddMarker(shape)],
            nodeNumber=system.AddNode(state),
            numberOfContactSegments=count,
            contactStiffness=normal,
            contactDamping=2.0 * sqrt(normal * mass),
            frictionStiffness=along,
            frictionVelocityPenalty=0.2 * sqrt(along * mass),
            frictionCoefficient=FRICTION,
            circleRadius=RADIUS,
            useSegmentNormals=False,
        )
        contacts.append(system.AddObject(contact))
    return contacts


def advance(exu: Any, system: Any, case: Case, start: float, end: float) -> None:
    """Solve it by trapezoidal steps, with constraints on velocities."""
    settings = exu.SimulationSettings()
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = INTERVAL
    integration = settings.timeIntegration
    integration.startTime, integration.endTime = start, end
    integration.numberOfSteps = round((end - start) / case.step)
    integration.newton.useModifiedNewton = True
    integration.discontinuous.iterationTolerance = 1e-3
    integration.discontinuous.maxIterations = 5
    integration.discontinuous.ignoreMaxIterations = True
    method = exu.DynamicSolverType.TrapezoidalIndex2
    if not system.SolveDynamic(settings, solverType=method):
        raise RuntimeError(f"{case.name}: the peer did not solve it")


def simulate(case: Case) -> tuple[list[float], list[float]]:
    """Return time and speed of the driven pulley, s and rad/s."""
    import exudyn as exu
    from exudyn import itemInterface as items  # noqa: N813

    system = exu.SystemContainer().AddSystem()
    point = system.AddNode(items.NodePointGround())
    ground = system.AddMarker(items.MarkerNodeCoordinate(nodeNumber=point, coordinate=0))
    belt = add_belt(items, system, case)
    driver, angle = add_pulley(items, system, ground, 0.0)
    driven, _ = add_pulley(items, system, ground, DISTANCE)
    system.AddObject(
        items.ObjectConnectorCoordinate(
            markerNumbers=[ground, angle], velocityLevel=True, offsetUserFunction_t=given_speed
        )
    )
    rim = system.AddMarker(items.MarkerNodeRigid(nodeNumber=driven))
    system.AddLoad(
        items.LoadTorqueVector(
            markerNumber=rim, loadVector=[0.0, 0.0, LOAD], loadVectorUserFunction=given_torque
        )
    )
    contacts = [
        contact
        for pulley in (driver, driven)
        for contact in add_contacts(items, system, pulley, belt, case)
    ]
    speed = system.AddSensor(
        items.SensorNode(
            nodeNumber=driven,
            outputVariableType=exu.OutputVariableType.AngularVelocity,
            storeInternal=True,
        )
    )
    system.Assemble()
    advance(exu, system, case, 0.0, SETTLING)
    for contact in contacts:
        system.SetObjectParameter(contact, "contactDamping", 0.0)
    rest = system.systemData.GetSystemState()
    system.systemData.SetSystemState(rest, configuration=exu.ConfigurationType.Initial)
    advance(exu, system, case, SETTLING, SETTLING + DURATION)
    stored = [row for row in system.GetSensorStoredData(speed) if row[0] > SETTLING - 1e-9]
    return [float(row[0]) - SETTLING for row in stored], [float(row[3]) for row in stored]


def load() -> dict[str, Any]:
    if not RESULT.exists():
        return {"cases": {}}
    numbers: dict[str, Any] = json.loads(RESULT.read_text(encoding="utf-8"))
    return numbers


def main(names: list[str]) -> None:
    """Run the cases that are named, or all, and write them down one by one."""
    for case in CASES:
        done = load()
        if case.name in done["cases"] or (names and case.name not in names):
            continue
        start = perf_counter()
        time, speed = simulate(case)
        wall = perf_counter() - start
        done["versions"] = f"Python {platform.python_version()}, exudyn {version('exudyn')}"
        done["time"] = [round(value, 9) for value in time]
        done["cases"][case.name] = {
            "settings": case._asdict(),
            "wall_seconds": round(wall, 1),
            "driven_speed": [round(value, 6) for value in speed],
        }
        RESULT.write_text(json.dumps(done) + "\n", encoding="utf-8")
        print(f"{case.name}: {wall:.0f} s", flush=True)


if __name__ == "__main__":
    sys.exudynFast = True  # type: ignore[attr-defined]  # no checks of ranges
    main(sys.argv[1:])
