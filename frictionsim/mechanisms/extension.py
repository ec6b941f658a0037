"""What the author of a kind of mechanism needs, in one place: the public interface of kinds.

A kind is a module, named by an entry point of the group `frictionsim.kinds` in the metadata of an
installed package. The module has

    SCENARIO              the model of its scenario files, a class derived from Scenario, with
                          the supported PAIRS of friction law and method, and its CHANNELS
    simulation(scenario)  the `Simulation` of a scenario; `simulation_of(build)` makes it
    statics(scenario)     the quantities of impending motion
    PANELS                the channels of its default plot, from top to bottom
    METRICS               the error metrics of a work-precision study
    build(scenario)       the `Mechanism` of a scenario, for a mechanism of one coordinate

and may have

    VIEWS                 further pictures by name, each a function
                          view(result, figure, **options) that draws a `Record` into an empty
                          Figure or SubFigure of matplotlib; `response`, the PANELS over time, is
                          there without it, and is the default
    EXAMPLE               the text of a scenario in TOML, to start from
    ladders(scenario, tolerances), references(scenario, rtol), tighter(scenario)
                          the settings of a study, its references, and the more accurate setting of
                          `solve --estimate-error`; without `build`, the first two are needed

The names of `__all__` and the names above are stable: a release that changes or removes one says so
in the changelog, under "Changed" or "Removed", and has another minor version (another major version
from 1.0 on). All other names of frictionsim are its own and may change in any release.

This module imports neither numpy nor matplotlib; a kind that imports them within its functions
keeps `frictionsim check` fast.

Tables of a scenario
    Params, unit_field, inconsistent
    SingleDofScenario, Scenario
    SINGLE_DOF, Pair: the pairs of law and method of one coordinate, and one of them
    TimeSignal, signal_from, extremes: a field that holds a signal, the signal, its extreme values

Dry friction and damping
    FrictionLaw, check_kinetic: `law` and `transition_speed`, and mu_k <= mu_s
    ShaftFriction, friction_radius: the journal of a shaft
    ViscousDamping, Gravity

Equation of motion of one coordinate
    Mechanism, DryFriction, SwitchingSurface, Trajectory, Value
    simulation_of, set_up, kinetic_energy, total
    sin, cos, sqrt: of a float in a step, of an array in post-processing

The same as a named tuple of numbers with methods, which is compiled for sweeps, fits and long runs
    equation_of, friction_of: the arguments of `Mechanism` and its contact, from such a tuple
    Curve, curve_of: the drive
    compilable: marks a function that the methods call
    MultiplesOf: a switching surface
    Damping, damping_of, with_damping, with_damping_power: viscous damping, or none

Results
    Channel, base_channels, Quantity, Quantities, Transition, STICK
    Record: the content of a result file, for a view
    Metric, METRICS, SINGLE_DOF_METRICS, ENERGY_BALANCE

A mechanism that does not fit into one coordinate
    Simulation: the protocol of what `simulation(scenario)` returns
    SimulationResult, Check: what it observes
"""

from frictionsim.mechanisms.effects import (
    Damping,
    Gravity,
    ShaftFriction,
    ViscousDamping,
    damping_of,
    friction_radius,
    with_damping,
    with_damping_power,
)
from frictionsim.mechanisms.single_dof import (
    METRICS,
    MultiplesOf,
    SingleDofScenario,
    base_channels,
    cos,
    kinetic_energy,
    set_up,
    simulation_of,
    sin,
    sqrt,
    total,
)
from frictionsim.results import (
    ENERGY_BALANCE,
    SINGLE_DOF_METRICS,
    STICK,
    Channel,
    Check,
    Metric,
    Quantities,
    Quantity,
    Record,
    SimulationResult,
    Transition,
)
from frictionsim.scenario.methods import SINGLE_DOF, Pair
from frictionsim.scenario.schema import FrictionLaw, Params, check_kinetic, inconsistent, unit_field
from frictionsim.scenario.settings import Scenario
from frictionsim.scenario.signal_tables import TimeSignal, extremes, signal_from
from frictionsim.scenario.signals import Curve, curve_of
from frictionsim.simulation.base import Simulation
from frictionsim.solvers.compilation import compilable
from frictionsim.solvers.mechanism import (
    DryFriction,
    Mechanism,
    SwitchingSurface,
    Trajectory,
    Value,
    equation_of,
    friction_of,
)

__all__ = [
    "ENERGY_BALANCE",
    "METRICS",
    "SINGLE_DOF",
    "SINGLE_DOF_METRICS",
    "STICK",
    "Channel",
    "Check",
    "Curve",
    "Damping",
    "DryFriction",
    "FrictionLaw",
    "Gravity",
    "Mechanism",
    "Metric",
    "MultiplesOf",
    "Pair",
    "Params",
    "Quantities",
    "Quantity",
    "Record",
    "Scenario",
    "ShaftFriction",
    "Simulation",
    "SimulationResult",
    "SingleDofScenario",
    "SwitchingSurface",
    "TimeSignal",
    "Trajectory",
    "Transition",
    "Value",
    "ViscousDamping",
    "base_channels",
    "check_kinetic",
    "compilable",
    "cos",
    "curve_of",
    "damping_of",
    "equation_of",
    "extremes",
    "friction_of",
    "friction_radius",
    "inconsistent",
    "kinetic_energy",
    "set_up",
    "signal_from",
    "simulation_of",
    "sin",
    "sqrt",
    "total",
    "unit_field",
    "with_damping",
    "with_damping_power",
]
