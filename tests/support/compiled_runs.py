"""Runs as Python and compiled, to the last bit."""

from typing import Any

import frictionsim as fs
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.simulation.single_dof import RecordedSimulation


def simulation_of(scenario: fs.Scenario) -> RecordedSimulation:
    simulation = mechanism_module(scenario.kind).simulation(scenario)
    assert isinstance(simulation, RecordedSimulation)
    return simulation


def recorded(simulation: RecordedSimulation) -> Any:
    """Return all that a run leaves; the state as text, in which a NaN is equal to itself."""
    recording = simulation._recording
    transitions = list(recording.transitions)
    state = simulation.state()
    assert state is not None
    text = repr({name: values.tolist() for name, values in state.items()})
    return recording.rows.tobytes(), recording.sides.tobytes(), transitions, text


def as_python(scenario: fs.Scenario) -> Any:
    simulation = simulation_of(scenario)
    simulation._solver._patience = -1  # type: ignore[attr-defined]  # it stays Python
    assert simulation.solve(lambda t: None) is False
    return recorded(simulation)


def as_compiled(scenario: fs.Scenario) -> Any:
    simulation = simulation_of(scenario)
    solver: Any = simulation._solver
    solver.compile()
    assert simulation.solve(lambda t: None) is False
    assert solver._compiled is not None  # Python took no step in its place
    return recorded(simulation)
