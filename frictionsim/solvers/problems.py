"""What the event-driven solver integrates: one contact on one coordinate, or several on several.

A problem has the loop, its arguments, and the names of what is in its state.
"""

from array import array
from collections.abc import Callable, Mapping, Sequence
from math import copysign, inf
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.results import TAUT
from frictionsim.scenario.methods import SET_VALUED
from frictionsim.solvers import multi_contact, one_contact
from frictionsim.solvers import multi_contact_state as multi
from frictionsim.solvers import one_contact_state as layout
from frictionsim.solvers.common import SampleBuffer
from frictionsim.solvers.contacts import Friction, MultiContactMechanism
from frictionsim.solvers.end_stops import ENERGY, EVENT
from frictionsim.solvers.one_contact_state import MAX_STATES, NEVER, ROW_COLUMNS, Run
from frictionsim.solvers.system import system_of

if TYPE_CHECKING:
    from frictionsim.scenario.settings import SolverSettings
    from frictionsim.solvers.mechanism import Mechanism

# Contacts: with 3^10 combinations of modes a search takes a second compiled, a minute as Python.
MAX_SEARCHED = 10


class Field(NamedTuple):
    """A field of a checkpoint.

    Attributes
    ----------
    place : int
        In the state.
    kind : type
        A list is that of `length` numbers.
    """

    place: int
    kind: type = float
    length: int = 1


def stepper_fields(states: int) -> dict[str, Field]:
    """Return the fields of the integrator."""
    return {
        "t_old": Field(layout.T_OLD),
        "t": Field(layout.T_NEW),
        "y_old": Field(layout.Y_OLD, list, states),
        "y": Field(layout.Y_NEW, list, states),
        "f_old": Field(layout.F_OLD, list, states),
        "f": Field(layout.F_NEW, list, states),
        "_h": Field(layout.STEP),  # 0 before the first segment
        "_error_before": Field(layout.ERROR_BEFORE),
        "steps": Field(layout.STEPS, int),
        "rejected": Field(layout.REJECTED, int),
        "nfev": Field(layout.EVALUATIONS, int),
    }


class Problem:
    """One contact on one coordinate.

    Parameters
    ----------
    mechanism : Mechanism
    settings : SolverSettings
    buffer : SampleBuffer

    Attributes
    ----------
    integrate : callable
        The loop, of `system`, `run` and `state`.
    contacts : int
        The number of events that may be at one time.
    cost : int
        How long an evaluation takes as Python, relative to one contact.
    event_names : tuple of str
        By the number of the event.
    change, advice : str
        Of the message on contacts that chatter.
    budget_advice : str
        Of the message on too many steps.
    """

    integrate: Callable[..., int] = staticmethod(one_contact.integrate)
    contacts = cost = 1

    def __init__(
        self, mechanism: "Mechanism", settings: "SolverSettings", buffer: SampleBuffer
    ) -> None:
        if len(mechanism.initial_state) > MAX_STATES:
            raise ValueError(
                f"at most {MAX_STATES} states have room; found {len(mechanism.initial_state)}"
            )
        self.subject = _subject([] if mechanism.contact is None else [mechanism.contact.name])
        self.system = system_of(mechanism)
        self.run = run_of(mechanism, settings, buffer)
        self.state = initial_state(mechanism)
        self.event_names = event_names(mechanism)
        law = "" if mechanism.contact is None else mechanism.contact.law
        self.budget_advice = settings.budget_advice(law)
        self.change = f"the contact '{self.event_names[0]}' changed its mode"
        self.advice = "check whether the drive changes too fast" + (
            ", or give a larger effects.end_stops.capture_speed" if mechanism.stops else ""
        )

    @property
    def fields(self) -> Mapping[str, Field]:
        """The fields of the phase in a checkpoint."""
        return {
            "t": Field(layout.TIME),
            "started": Field(layout.STARTED, bool),
            "y": Field(layout.Y, list, self.run.states),
            "mode": Field(layout.MODE, int),
            "sampled_until": Field(layout.SAMPLED_UNTIL),
            "phase_ends": Field(layout.PHASE_ENDS, bool),
            "direction": Field(layout.DIRECTION, int),
            "held": Field(layout.HELD),
            "segment_end": Field(layout.SEGMENT_END),
        }

    def restored(self) -> None:
        """Set what follows from the fields."""

    @property
    def moves(self) -> bool:
        """Whether the integrator takes steps in the present phase."""
        return self.state[layout.MODE] != 0.0


class MultiContactProblem(Problem):
    """Several contacts on several coordinates."""

    integrate = staticmethod(multi_contact.integrate)
    cost = 4

    def __init__(
        self,
        mechanism: MultiContactMechanism,
        settings: "SolverSettings",
        buffer: SampleBuffer,
    ) -> None:
        self._mechanism, self.contacts = mechanism, len(mechanism.contacts)
        states, terms = len(mechanism.initial_state), mechanism.system.contacts.terms
        if max(states, terms) > MAX_STATES or self.contacts > MAX_SEARCHED:
            raise ValueError(
                f"at most {MAX_STATES} states and forces have room, and of {MAX_SEARCHED} contacts"
                " the modes are searched, for all of their combinations are; found"
                f" {states} states, {terms - 2} forces, {self.contacts} contacts"
            )
        self.event_names, self.system = event_names(mechanism), mechanism.system
        self.subject = _subject(self.event_names)
        self.run = _run_of_several(mechanism, settings, buffer)
        self.state = _state_of_several(mechanism)
        self.budget_advice = settings.budget_advice(SET_VALUED)
        self.change = "the contacts changed their modes"
        self.advice = "check whether the drive changes too fast"

    @property
    def fields(self) -> Mapping[str, Field]:
        return {
            "t": Field(layout.TIME),
            "started": Field(layout.STARTED, bool),
            "y": Field(layout.Y, list, self.run.states),
            "modes": Field(multi.MODES, list, self.contacts),
            "ends": Field(multi.ENDS, list, self.contacts),
            "sampled_until": Field(layout.SAMPLED_UNTIL),
            "held": Field(layout.HELD),
            "segment_end": Field(layout.SEGMENT_END),
        }

    def restored(self) -> None:
        multi.write_phase(self.system, self.state)

    @property
    def moves(self) -> bool:
        return self.state[multi.RESTING] == 0.0


def problem_of(
    mechanism: "Mechanism | MultiContactMechanism",
    settings: "SolverSettings",
    buffer: SampleBuffer,
) -> Problem:
    """Return the problem of a mechanism with dry friction."""
    if isinstance(mechanism, MultiContactMechanism):
        return MultiContactProblem(mechanism, settings, buffer)
    return Problem(mechanism, settings, buffer)


def _subject(contacts: Sequence[str]) -> str:
    """Return the subject of messages about the motion."""
    if not contacts:
        return "the motion"
    names = " and ".join(f"'{name}'" for name in contacts)
    return f"the motion on the contact{'s' if len(contacts) > 1 else ''} {names}"


def run_of(mechanism: "Mechanism", settings: "SolverSettings", buffer: SampleBuffer) -> Run:
    """Return the numbers of a run of one contact that do not change."""
    start = mechanism.position, mechanism.velocity
    stored = [energy(*start) for energy in mechanism.stored_energies.values()]
    names = mechanism.energy_integrals
    states = len(mechanism.initial_state)
    atol = settings.atol * mechanism.tolerance_share
    return Run(
        states=states,
        columns=ROW_COLUMNS + states - 2,
        stored=tuple(1.0 * energy for energy in stored),
        energy_floor=stored[0] + atol / settings.rtol,
        input=2 + names.index("energy_input"),
        heats=2 + names.index(ENERGY) if ENERGY in names else 0,
        **(_settings_of(settings, buffer) | {"atol": atol}),
    )


def _run_of_several(
    mechanism: MultiContactMechanism, settings: "SolverSettings", buffer: SampleBuffer
) -> Run:
    n, states = len(mechanism.position), len(mechanism.initial_state)
    return Run(
        states=states,
        columns=n + mechanism.system.contacts.terms + len(mechanism.contacts) + states,
        stored=(0.0, 0.0),
        energy_floor=0.0,
        input=2 * n,
        heats=2 * n + len(mechanism.power_flows),
        **_settings_of(settings, buffer),
    )


def _settings_of(settings: "SolverSettings", buffer: SampleBuffer) -> dict[str, Any]:
    return {
        "end": settings.duration,
        "rtol": settings.rtol,
        "atol": settings.atol,
        "max_step": settings.max_step or inf,
        "fixed_step": settings.step or 0.0,
        "max_steps": settings.max_steps,
        "interval": buffer.times.interval,
        "last": 1.0 * buffer.times.last,
        "given": buffer.times.given,
    }


def initial_state(mechanism: "Mechanism") -> "array[float]":
    """Return the state of a run of one contact that has not begun."""
    s = _state_with(mechanism.initial_state, layout.LENGTH)
    if mechanism.velocity != 0.0:
        s[layout.MODE] = copysign(1.0, mechanism.velocity)
    return s


def _state_of_several(mechanism: MultiContactMechanism) -> "array[float]":
    """Return the state before forces are compared with their limits."""
    s = _state_with(mechanism.initial_state, multi.LENGTH)
    s[multi.RESTING] = 1.0  # the state is that of the phase
    for i, contact in enumerate(mechanism.contacts):
        rate = mechanism.velocity[contact.coordinate]
        if not isinstance(contact.law, Friction):
            s[multi.MODES + i] = TAUT
        elif rate != 0.0:
            s[multi.MODES + i] = copysign(1.0, rate)
    return s


def _state_with(y: list[float], length: int) -> "array[float]":
    s = array("d", bytes(8 * length))
    s[layout.Y : layout.Y + len(y)] = array("d", y)
    s[layout.HELD], s[layout.ERROR_BEFORE] = NEVER, 1.0
    return s


def event_names(mechanism: "Mechanism | MultiContactMechanism") -> tuple[str, ...]:
    """Return the names of events by their numbers: of contacts, stops and surfaces."""
    if isinstance(mechanism, MultiContactMechanism):
        return tuple(contact.name for contact in mechanism.contacts)
    surfaces = [surface.event for surface in mechanism.switching_surfaces]
    contact = "drive" if mechanism.contact is None else mechanism.contact.name
    return (contact, EVENT, *surfaces)
