"""Many runs of one coordinate in lockstep: quantities, audit, events and warnings of each.

Each result has the bits of that of its scenario alone with samples at the start, at the events and
at the end only. What does not go in lockstep is given back to be run alone.
"""

import gc
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.results import Check, Quantities, SimulationResult, Transition
from frictionsim.scenario.kinds import KINDS, mechanism_module
from frictionsim.scenario.methods import SET_VALUED
from frictionsim.simulation.audit import (
    RELEASE_DISTANCE,
    ROUNDING,
    allowed_residual,
    driving_power,
    energy_residual,
    friction_violation,
    release_distance,
    stick_drift,
)
from frictionsim.simulation.lockstep_samples import Breakaways, SamplesOfRuns, samples_of_runs
from frictionsim.simulation.run_warnings import hidden_stick_slip, nothing_moves
from frictionsim.simulation.single_dof import (
    energy_scale,
    final_quantities,
    quantities_of_transitions,
    trajectory_of,
)
from frictionsim.solvers.lockstep import LockstepSolver
from frictionsim.solvers.lockstep_functions import (
    functions_agree,
    joined_mechanism,
    selected,
    with_exact_powers,
)
from frictionsim.solvers.lockstep_signals import FORMS, Unlike
from frictionsim.solvers.lockstep_stepper import Tolerances, tolerances_of
from frictionsim.solvers.mechanism import Mechanism, Trajectory

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario

BACKEND = "events"
# More runs at once do not fit into the cache of the processor; fewer do not pay.
BATCH = 2000


def applies(scenario: "Scenario", keys: Sequence[str]) -> bool:
    """Return whether runs that differ in these keys only can go in lockstep.

    Parameters
    ----------
    scenario : Scenario
    keys : sequence of str
        With dots, as of `Scenario.replace`.
    """
    tables = scenario.model_dump(by_alias=True)
    if not all(isinstance(_value_at(tables, key), float) for key in keys):
        return False
    return functions_agree() and _is_joined(scenario)


def _value_at(tables: Any, key: str) -> Any:
    """Return the value of a key with dots; None if there is none."""
    for part in key.split("."):
        try:
            tables = tables[part] if isinstance(tables, dict) else tables[int(part)]
        except (KeyError, IndexError, ValueError, TypeError):
            return None
    return tables


def _is_joined(scenario: "Scenario") -> bool:
    """Return whether the functions of two such scenarios join to those of arrays."""
    # Whether the functions of an installed kind are arithmetic only is not known.
    if scenario.kind not in KINDS or scenario.solver.backend != BACKEND:
        return False
    module = mechanism_module(scenario.kind)
    if not hasattr(module, "build"):
        return False
    mechanism = module.build(scenario)
    if not isinstance(mechanism, Mechanism):  # of several coordinates
        return False
    contact = mechanism.contact
    if (
        contact is None
        or contact.law != SET_VALUED
        or mechanism.prescribed
        or mechanism.switching_surfaces
        or mechanism.stops is not None
        or type(mechanism.drive) not in FORMS
        or scenario.solver.step is not None
    ):
        return False
    try:
        return _agrees(mechanism)
    except (Unlike, TypeError, ValueError, ArithmeticError):
        return False


def _agrees(mechanism: Mechanism) -> bool:
    """Return whether the functions of a mechanism take arrays, and return the bits of numbers."""
    joined = with_exact_powers(joined_mechanism([mechanism, mechanism]))
    contact, both = mechanism.contact, joined.contact
    assert contact is not None  # of `joined_mechanism`
    assert both is not None
    u, q, v, s = 0.7 * (mechanism.drive(0.0) or 1.0), 0.3, -1.7, -1.0
    pairs: list[tuple[Any, Any, tuple[float, ...]]] = [
        (mechanism.applied_torque, joined.applied_torque, (u, q, v)),
        (contact.static_limit, both.static_limit, (u, q)),
        (contact.kinetic_limit, both.kinetic_limit, (u, q, v, s)),
        (contact.roundoff, both.roundoff, (u, q)),
    ]
    for name, arguments in (("power_flows", (u, q, v)), ("stored_energies", (q, v))):
        alone, together = getattr(mechanism, name), getattr(joined, name)
        pairs += [(alone[key], together[key], arguments) for key in alone]
    return all(
        np.array_equal(
            np.broadcast_to(of_arrays(*(np.array([x, x]) for x in at)), 2), [of(*at)] * 2
        )
        for of, of_arrays, at in pairs
    )


def run_lockstep(
    scenarios: "Sequence[Scenario]", on_pass: Callable[[], object] = lambda: None
) -> list[SimulationResult | None]:
    """Simulate many scenarios of one kind that differ in numbers only.

    Parameters
    ----------
    scenarios : sequence of Scenario
        To all of them lockstep `applies`. It pays for more than about twenty.
    on_pass : callable, optional
        Called between passes over all runs; it may raise Interrupted.

    Returns
    -------
    list of SimulationResult or None
        Quantities, checks, transitions and warnings of each run, without channels; None where the
        run has to be done alone, because it fails or is unlike the others.
    """
    found: list[SimulationResult | None] = []
    with no_search_for_cycles():
        for first in range(0, len(scenarios), BATCH):
            found += _run_batch(scenarios[first : first + BATCH], on_pass)
    return found


@contextmanager
def no_search_for_cycles() -> Iterator[None]:
    """Make thousands of small objects, none of them in a cycle, without a search for cycles."""
    searched = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if searched:
            gc.enable()


def _run_batch(
    scenarios: "Sequence[Scenario]", on_pass: Callable[[], object]
) -> list[SimulationResult | None]:
    found: list[SimulationResult | None] = [None] * len(scenarios)
    try:
        build = mechanism_module(scenarios[0].kind).build
        mechanisms = [build(scenario) for scenario in scenarios]
        alike = _alike(scenarios, mechanisms)
        batch = _Batch([scenarios[i] for i in alike], [mechanisms[i] for i in alike])
        # A division by zero stops a run alone.
        with np.errstate(divide="raise", over="ignore", invalid="ignore", under="ignore"):
            for run, result in batch.results(on_pass):
                found[alike[run]] = result
    except (Unlike, ArithmeticError):
        return [None] * len(scenarios)
    return found


def _alike(scenarios: "Sequence[Scenario]", mechanisms: list[Mechanism]) -> list[int]:
    """Return the indices of the runs whose drive and limit of steps are like those of the first."""
    form, max_steps = type(mechanisms[0].drive), scenarios[0].solver.max_steps
    return [
        i
        for i, (scenario, mechanism) in enumerate(zip(scenarios, mechanisms, strict=True))
        if type(mechanism.drive) is form and scenario.solver.max_steps == max_steps
    ]


class _Batch:
    """Runs that are integrated together.

    Parameters
    ----------
    scenarios : list of Scenario
    mechanisms : list of Mechanism
        Built from them.
    """

    def __init__(self, scenarios: "list[Scenario]", mechanisms: list[Mechanism]) -> None:
        self._scenarios, self._mechanisms = scenarios, mechanisms
        self._joined = joined_mechanism(mechanisms)
        self._tolerances = tolerances_of([scenario.solver for scenario in scenarios])

    def results(self, on_pass: Callable[[], object]) -> Iterator[tuple[int, SimulationResult]]:
        """Yield the index and result of each run that need not be done alone."""
        exact = with_exact_powers(self._joined)
        max_steps = self._scenarios[0].solver.max_steps
        solver = LockstepSolver(exact, self._tolerances, max_steps, on_pass)
        solver.run()
        at_events = np.array([scenario.output.at_events for scenario in self._scenarios])
        samples = samples_of_runs(solver, exact, self._tolerances.end, at_events)
        release = self._release(samples.breakaways)
        for runs in samples.runs_by_length():
            yield from self._observe(runs, samples, release)

    def _release(self, breakaways: Breakaways) -> Any:
        """Return the largest distance of a breakaway from its static limit, (runs,)."""
        run, *sides = breakaways
        mechanism = selected(self._joined, run)
        before, after = (trajectory_of(mechanism, columns, []) for columns in sides)
        largest = np.zeros(len(self._scenarios))
        np.maximum.at(largest, run, release_distance(mechanism, before, after))
        return largest

    def _observe(
        self, runs: Any, samples: SamplesOfRuns, release: Any
    ) -> Iterator[tuple[int, SimulationResult]]:
        """Yield the results of runs with as many samples each, as `SingleDofSimulation.observe`.

        One whose energy does not close, or that leaves stick off its static limit, is left out.
        """
        mechanism, tolerances = selected(self._joined, runs), self._tolerances.select(runs)
        trajectory = trajectory_of(mechanism, samples.columns(runs), [])
        checks = _checks(mechanism, trajectory, tolerances)
        sticks = (trajectory.mode[1:] == 0) & (trajectory.mode[:-1] == 0)
        may_drift = np.any(sticks & (np.diff(trajectory.position, axis=0) != 0.0), axis=0)
        rests = ~np.any(trajectory.velocity, axis=0) & ~(np.ptp(trajectory.position, axis=0) > 0.0)
        of_one = _split(trajectory)
        for i, run in enumerate(runs.tolist()):
            found, released = checks(i), Check(release.item(run), RELEASE_DISTANCE)
            if not (found["energy_balance"].ok and released.ok):
                continue  # alone, its limit is one of all its steps, and the load may jump
            alone = of_one(i, samples.transitions(run))
            drift = stick_drift(alone) if may_drift[i] else 0.0
            yield (
                run,
                SimulationResult(
                    time=alone.time,
                    channels={},
                    transitions=alone.transitions,
                    quantities=_quantities(self._mechanisms[run], alone),
                    checks=found | {"stick_drift": Check(drift, 0.0), "release": released},
                    non_finite_tail=False,
                    warnings=self._warnings(run, alone, bool(rests[i])),
                ),
            )

    def _warnings(self, run: int, trajectory: Trajectory, rests: bool) -> tuple[str, ...]:
        mechanism, scenario = self._mechanisms[run], self._scenarios[run]
        return (
            *(nothing_moves(mechanism, trajectory) if rests else ()),
            *mechanism.run_warnings(trajectory),
            *hidden_stick_slip(trajectory.transitions, scenario.interval, scenario.solver.duration),
        )


def _split(trajectory: Trajectory) -> Any:
    """Return a function of index and transitions that returns the trajectory of one run."""
    integrals, stored = list(trajectory.energy_integrals), list(trajectory.stored_energies)
    columns: list[Any] = [
        *trajectory[: Trajectory._fields.index("energy_integrals")],
        *trajectory.energy_integrals.values(),
        *trajectory.stored_energies.values(),
    ]
    by_run = np.stack(columns).transpose(2, 0, 1).copy()  # (runs, columns, n)

    def of_one(run: int, transitions: list[Transition]) -> Trajectory:
        time, drive, position, velocity, acceleration, friction, mode, *energies = by_run[run]
        return Trajectory(
            time,
            drive,
            position,
            velocity,
            acceleration,
            friction,
            mode,
            dict(zip(integrals, energies[: len(integrals)], strict=True)),
            dict(zip(stored, energies[len(integrals) :], strict=True)),
            transitions,
        )

    return of_one


def _checks(mechanism: Mechanism, trajectory: Trajectory, tolerances: Tolerances) -> Any:
    """Return a function of the index of a run that returns its checks, without the drift."""
    assert mechanism.contact is not None  # of `joined_mechanism`
    limits = [allowed_residual(rtol) for rtol in tolerances.rtol.tolist()]
    size = energy_scale(mechanism, trajectory)
    energy = energy_residual(trajectory, np.array(limits), tolerances.atol, size).tolist()
    friction = friction_violation(trajectory, mechanism.contact).tolist()
    power = driving_power(trajectory).tolist()
    return lambda i: {
        "energy_balance": Check(energy[i], limits[i]),
        "friction_law": Check(friction[i], ROUNDING),
        "dissipation_sign": Check(power[i], 0.0),
    }


def _quantities(mechanism: Mechanism, trajectory: Trajectory) -> Quantities:
    energies = trajectory.energy_integrals | trajectory.stored_energies
    return (
        mechanism.quantities(trajectory)
        | quantities_of_transitions(trajectory.transitions)
        | final_quantities(
            trajectory.time.item(-1),
            trajectory.position.item(-1),
            trajectory.velocity.item(-1),
            {name: energy.item(-1) for name, energy in energies.items()},
        )
    )
