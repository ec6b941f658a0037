"""What the author of a kind of mechanism needs, in one place: the public interface of kinds.

A kind is a module, named by an entry point of the group `frictionsim.kinds` in the metadata of an
installed package. The module has

    SCENARIO              the model of its scenario files, a class derived from Scenario, with
                          the supported PAIRS of friction law and method, and its CHANNELS
    simulation(scenario)  the `Simulation` of a scenario; `simulation_of(build)` makes it
    statics(scenario)     the quantities of impending motion
    PANELS                the channels of its default plot, from top to bottom
    METRICS               the error metrics of a work-precision study
    build(scenario)       the `Mechanism` of a scenario, for a mechanism of one coordinate, by
                          `one_coordinate`

and may have

    VIEWS                 further pictures by name, each a function view(result, figure) that
                          draws a `Record` into an empty Figure or SubFigure of matplotlib;
                          `response`, the PANELS over time, is there without it, and is the default
    EXAMPLE               the text of a scenario in TOML, to start from
    ladders(scenario, tolerances), references(scenario, rtol), tighter(scenario)
                          the settings of a study, its references, and the more accurate setting of
                          `solve --estimate-error`; without `build`, the first two are needed

The names of `__all__` and the names above are stable: a release that changes or removes one says so
in the changelog, under "Changed" or "Removed", and has another minor version (another major version
from 1.0 on). All other names of frictionsim are its own and may change in any release; so may what
two further names of a module are made of, motion(result, sample), see `frictionsim.motion`, and
mesh_study, see `frictionsim.mechanisms`.

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
    OneCoordinate, Term, Friction: a sum of terms, with dry friction or without
    EndStops, MultiplesOf: stops, and angles at which the equation is not smooth
    INPUT: the energy of the term of the drive, which each equation has
    journal_friction, viscous_damping: the friction of a shaft, the term of damping
    one_coordinate, simulation_of, start_of: from the equation to the simulation
    Mechanism, Samples: what they make, and what quantities and warnings are made from

Results
    Channel, base_channels, Quantity, Quantities, Transition, STICK
    Record: the content of a result file, for a view
    Metric, METRICS, ENERGY_BALANCE
    SINGLE_DOF_METRICS: METRICS without the heat of friction

A mechanism that does not fit into one coordinate
    Simulation: the protocol of what `simulation(scenario)` returns
    SimulationResult, Check: what it observes
"""

from frictionsim.mechanisms.effects import (
    Gravity,
    ShaftFriction,
    ViscousDamping,
    friction_radius,
    journal_friction,
    viscous_damping,
)
from frictionsim.mechanisms.single_dof import (
    METRICS,
    MultiplesOf,
    SingleDofScenario,
    base_channels,
    one_coordinate,
    simulation_of,
    start_of,
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
from frictionsim.simulation.mechanism import Mechanism, Samples, Simulation
from frictionsim.solvers.system import INPUT, EndStops, Friction, OneCoordinate, Term

__all__ = [
    "ENERGY_BALANCE",
    "INPUT",
    "METRICS",
    "SINGLE_DOF",
    "SINGLE_DOF_METRICS",
    "STICK",
    "Channel",
    "Check",
    "EndStops",
    "Friction",
    "FrictionLaw",
    "Gravity",
    "Mechanism",
    "Metric",
    "MultiplesOf",
    "OneCoordinate",
    "Pair",
    "Params",
    "Quantities",
    "Quantity",
    "Record",
    "Samples",
    "Scenario",
    "ShaftFriction",
    "Simulation",
    "SimulationResult",
    "SingleDofScenario",
    "Term",
    "TimeSignal",
    "Transition",
    "ViscousDamping",
    "base_channels",
    "check_kinetic",
    "extremes",
    "friction_radius",
    "inconsistent",
    "journal_friction",
    "one_coordinate",
    "signal_from",
    "simulation_of",
    "start_of",
    "unit_field",
    "viscous_damping",
]
