"""What is seen of a belt drive: channels to record, the quantities of the summary, the audit."""

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import BeltOffPulleys
from frictionsim.mechanisms.belt_drive.effects.patch import patch_bodies
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    ANGLE,
    BACKWARD_LIMIT,
    CENTRE_X,
    CENTRE_Y,
    FORCE_X,
    FORCE_Y,
    FORWARD_LIMIT,
    FRICTION,
    KINETIC,
    NORMAL,
    RADIUS,
    SLIP,
    SPEED,
    STATIC,
    STICKING,
    TORQUE,
    VX,
    VY,
    X,
    Y,
    kinematics_of,
)
from frictionsim.mechanisms.belt_drive.quantities import checks_of, quantities_of
from frictionsim.mechanisms.belt_drive.run_warnings import warnings_of
from frictionsim.mechanisms.belt_drive.schema import CHANNELS
from frictionsim.mechanisms.belt_drive.slip import span_tensions
from frictionsim.mechanisms.belt_drive.transitions import transitions_of
from frictionsim.results import SimulationResult
from frictionsim.simulation.record import stored_type
from frictionsim.simulation.sample_store import SampleStore

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.composition import BeltModel
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]


MAX_PENETRATION = 0.5  # of a radius: a body that gets further into a pulley does not come out again


class Observer:
    """Samples of a belt drive, in a `SampleStore`.

    Only the channels that are wanted are kept whole; of the others what the quantities need.

    Parameters
    ----------
    scenario : BeltDriveScenario
    model : BeltModel
        Its system holds the forces of the state that a sample is taken of.
    """

    def __init__(self, scenario: "BeltDriveScenario", model: "BeltModel") -> None:
        self._scenario, self._model = scenario, model
        # Makes a force of what the contacts hold as friction, if that is an impulse.
        self.force_per_impulse = 1.0
        self._bodies = scenario.mechanism.belt.bodies
        self._system = system = model.system
        self._energies = ["energy_input"]
        if system.friction is not None:
            self._energies.append("energy_friction")
        if any(effect.dissipates(parameters) for effect, parameters in model.present_effects):
            self._energies.append("energy_damping")
        contact = {"friction_force", "slip_velocity", "sticking"}
        absent = contact if system.friction is None else set()
        wanted = scenario.output.channels
        self._wanted = [
            name
            for name, channel in CHANNELS.items()
            if channel.axis and name not in absent and (wanted is None or name in wanted)
        ]
        self._before = np.arange(self._bodies) - 1
        self._patch = patch_bodies(scenario.effects.patch, system.chain)
        self.samples = SampleStore(
            {
                name: stored_type(channel)
                for name, channel in CHANNELS.items()
                if wanted is None or name in wanted
            }
        )
        self.energy_gain = 0.0  # energy that came from nowhere, over what was stored and put in

    def check_belt(self, stepper: Any) -> None:
        """Stop where the belt has left its pulleys, or is pressed through one."""
        contacts = self._system.contacts
        count = contacts.offsets[-1]
        if count == 0:
            raise BeltOffPulleys(
                f"the belt has left its pulleys at t = {stepper.t:.9g} s; is the pretension too"
                " low, or a torque too high?"
            )
        kinematics = self._kinematics(stepper.interpolate(stepper.t))
        radius = contacts.table[RADIUS, :count]
        filled = np.flatnonzero(radius > 0.0)
        body = contacts.body[filled].astype(np.int64)
        x, y = kinematics[X], kinematics[Y]
        centre_x, centre_y = contacts.table[CENTRE_X, filled], contacts.table[CENTRE_Y, filled]
        share = 1.0 - np.hypot(x[body] - centre_x, y[body] - centre_y) / radius[filled]
        deepest = int(np.argmax(share))
        if share[deepest] > MAX_PENETRATION:
            raise BeltOffPulleys(
                f"body {body[deepest]} of the belt is pressed {100 * share[deepest]:.0f} % of the"
                f" radius into a pulley at t = {stepper.t:.9g} s; stiffen effects.contact, or lower"
                " the tension"
            )

    def _kinematics(self, state: "Array") -> "Array":
        rows: Array = kinematics_of(state, self._system.layout)
        return rows[:, : self._bodies]

    @property
    def states(self) -> int:
        """How many numbers are integrated: those of the state that this scenario needs."""
        layout = self._system.layout
        rows = layout.angles // layout.width
        return rows * self._bodies + layout.energies - layout.angles + len(self._energies)

    def sample(self, t: float, state: "Array") -> None:
        """Add the sample of time t."""
        self.samples.append(self._seen(t, state))
        self._check_energy()

    def sample_at_start(self) -> dict[str, Any]:
        """Return a sample of the start as a template, whatever the forces are."""
        return self._seen(0.0, self._model.state)

    def _seen(self, t: float, state: "Array") -> dict[str, Any]:
        kinematics = self._kinematics(state)
        channels = {**self._of_bodies(kinematics), **self._of_pulleys(state)}
        seen = {name: channels[name] for name in self._wanted}
        return {"time": t, **seen, **self._quantities(state, kinematics, channels)}

    def _check_energy(self) -> None:
        """Compare what the belt has with what it was given.

        Dissipated energy is ignored: it can only lower the total.
        """
        samples = self.samples
        put_in = samples.gain("energy_input")
        has = samples.gain("energy_kinetic") + samples.gain("energy_potential")
        stored = abs(float(samples.first("energy_potential"))) + abs(put_in)
        self.energy_gain = (has - put_in) / stored if stored > 0.0 else 0.0

    def _of_bodies(self, kinematics: "Array") -> dict[str, "Array"]:
        contacts = self._system.contacts
        count = contacts.offsets[-1]
        # A body may be a candidate of two pulleys, and is pressed on one.
        pressed = (contacts.table[RADIUS, :count] > 0.0) & (contacts.table[NORMAL, :count] > 0.0)
        filled = np.flatnonzero(pressed)
        body = contacts.body[filled].astype(np.int64)
        found = self._places(kinematics)
        for name, row in (
            ("normal_force", NORMAL),
            ("friction_force", FRICTION),
            ("slip_velocity", SLIP),
            ("sticking", STICKING),
        ):
            found[name] = np.zeros(self._bodies)
            found[name][body] = contacts.table[row, filled]
        found["friction_force"] *= self.force_per_impulse
        found["pulley_index"] = np.full(self._bodies, -1.0)
        found["pulley_index"][body] = np.searchsorted(contacts.offsets, filled, side="right") - 1.0
        found["_utilisation"] = np.zeros(self._bodies)
        found["_utilisation"][body] = utilisation(
            contacts.table[:, filled], found["friction_force"][body]
        )
        found["tension"] = self._tension(kinematics)
        return found

    def _places(self, kinematics: "Array") -> dict[str, "Array"]:
        return {"x": kinematics[X], "y": kinematics[Y], "angle": kinematics[ANGLE]}

    def _tension(self, kinematics: "Array") -> "Array":
        """Return the tension of every joint; negative where the bodies are pressed together."""
        force_x = self._system.workspace[FORCE_X, : self._bodies]
        force_y = self._system.workspace[FORCE_Y, : self._bodies]
        angle = kinematics[ANGLE]
        cos, sin = np.cos(angle), np.sin(angle)
        along = force_x * (cos + cos[self._before]) + force_y * (sin + sin[self._before])
        return np.copysign(np.hypot(force_x, force_y), along)

    def _of_pulleys(self, state: "Array") -> dict[str, "Array"]:
        layout = self._system.layout
        return {
            "pulley_angle": state[layout.angles : layout.speeds],
            "pulley_speed": self._speeds(state),
            "pulley_torque": self._system.pulleys.table[TORQUE],
        }

    def _speeds(self, state: "Array") -> "Array":
        """Return the speeds of all pulleys; the free ones have theirs in the state."""
        pulleys = self._system.pulleys
        speeds = pulleys.table[SPEED].copy()
        layout = self._system.layout
        speeds[pulleys.free] = state[layout.speeds : layout.energies]
        return speeds

    def _quantities(
        self, state: "Array", kinematics: "Array", channels: dict[str, "Array"]
    ) -> dict[str, Any]:
        """Return the values of a sample that quantities and audit need, whatever is recorded."""
        table, layout = self._system.pulleys.table, self._system.layout
        speeds, tension, pulley = (
            channels[name] for name in ("pulley_speed", "tension", "pulley_index")
        )
        names = "energy_input", "energy_friction", "energy_damping"
        energies = dict(zip(names, state[layout.energies : layout.end], strict=True))
        members = range(table.shape[1])
        return {
            **{name: energies[name] for name in self._energies},
            "energy_kinetic": self._model.kinetic_energy(kinematics, speeds),
            "energy_potential": self._model.potential_energy(kinematics),
            "_speed": speeds,
            "_torque": table[TORQUE].copy(),
            "_mean_tension": tension.mean(),
            "_belt_speed": self._belt_speed(kinematics),
            "_span_tension": span_tensions(tension, pulley, len(members)),
            **self._contact_counts(channels),
            **self._friction_on_pulleys(),
            "_patch": np.sum(pulley[self._patch] >= 0.0),
            "_excess": self._friction_excess(),
            "_power": friction_power(channels),
        }

    def _contact_counts(self, channels: dict[str, "Array"]) -> dict[str, "Array"]:
        """Return how many bodies touch each pulley, and on how many lengths of them it sticks."""
        members = range(self._system.pulleys.table.shape[1])
        on = [np.flatnonzero(channels["pulley_index"] == j) for j in members]
        return {
            "_touching": np.array([len(bodies) for bodies in on]),
            "_sticking": np.array([adhesion(channels, i, np.ones(len(i))) for i in on]),
        }

    def _belt_speed(self, kinematics: "Array") -> float:
        return belt_speed(kinematics)

    def _friction_on_pulleys(self) -> dict[str, "Array"]:
        """Return the sum of the friction on the belt, N, and what it could be in full slip.

        And the sum of N s, whose sign is the direction of the slip.
        """
        contacts = self._system.contacts
        if self._system.friction is None:
            return {}
        ranges = [slice(*ends) for ends in pairwise(contacts.offsets)]
        friction = contacts.table[FRICTION] * self.force_per_impulse
        kinetic = contacts.table[KINETIC] * contacts.table[NORMAL]
        slip = contacts.table[NORMAL] * contacts.table[SLIP]
        return {
            "_friction": np.array([friction[of].sum() for of in ranges]),
            "_capacity": np.array([kinetic[of].sum() for of in ranges]),
            "_slip": np.array([slip[of].sum() for of in ranges]),
        }

    def _friction_excess(self) -> "Array":
        """Return by how much a friction is off its limits, N, and the largest limit, N.

        Above the one that holds it; or below that at rest, of a body that has no slip but does not
        stick: the static coefficient would hold it.
        """
        contacts = self._system.contacts
        if self._system.friction is None:
            return np.zeros(2)
        table = contacts.table[:, : contacts.offsets[-1]]
        friction, at_rest = table[FRICTION] * self.force_per_impulse, table[STATIC] * table[NORMAL]
        size, limit = np.abs(friction), at_rest
        off = size - at_rest
        law = self._system.effects.belt_friction
        if law is not None and law.set_valued is not None:
            limits = table[FORWARD_LIMIT], table[BACKWARD_LIMIT]
            limit = np.where(friction > 0.0, *limits) * self.force_per_impulse
            let_go = (table[SLIP] == 0.0) & (table[STICKING] == 0.0)
            off = np.maximum(size - limit, np.where(let_go, at_rest - size, 0.0))
            # A body that slides one way has no friction the other way, until its slip has ended.
            turning = (friction == 0.0) & (np.minimum(*limits) == 0.0)
            self._note_release((table[STICKING] == 0.0) & ~turning, limit - size, limit)
        return np.array([np.max(off, initial=0.0), np.max(at_rest, initial=0.0)])

    def _note_release(self, sliding: Any, missing: "Array", limit: "Array") -> None:
        """Note by how much the friction of a body that slides is below its limit, N, over it.

        Where static and kinetic friction differ, the steps note it when a body lets go.
        """
        some = sliding & (limit > 0.0)
        release = self._system.contacts.release
        release[0] = np.max(missing[some] / limit[some], initial=release[0])

    def observe_channels(self) -> SimulationResult:
        """Return the samples before the first that is not finite, and nothing that follows."""
        samples = self.samples
        sound = samples.n_finite()
        names = samples.names
        return SimulationResult(
            time=samples.channel("time", sound) if names else np.zeros(0),
            channels={name: samples.channel(name, sound) for name in CHANNELS if name in names},
            transitions=[],
            quantities={},
            checks={},
            non_finite_tail=sound < len(samples),
        )

    def observe(self) -> SimulationResult:
        """Return the samples before the first that is not finite, and what follows from them."""
        recorded = self.observe_channels()
        time = np.asarray(recorded.time)
        energies = [name for name in recorded.channels if name.startswith("energy")]
        others = [name for name in self.samples.names if name.startswith("_")]
        seen = self.samples.arrays(energies + others, len(time))
        quantities = quantities_of(self._scenario, self._model, time, seen)
        return recorded._replace(
            transitions=transitions_of(self._scenario, self._model, time, seen),
            quantities=quantities,
            checks=checks_of(self._scenario, self._model, time, seen),
            warnings=warnings_of(self._scenario, self._model, time, seen, quantities),
        )


def belt_speed(kinematics: "Array") -> float:
    """Return the mean velocity of the bodies along the belt, m/s."""
    along = kinematics[VX] * np.cos(kinematics[ANGLE]) + kinematics[VY] * np.sin(kinematics[ANGLE])
    return float(np.mean(along))


def utilisation(contacts: "Array", friction: "Array") -> "Array":
    """Return the friction of contacts over what they can have, from -1 to 1.

    Parameters
    ----------
    contacts : (21, n)
        Rows of `kernels.layout`.
    friction : (n,), N
    """
    coefficient = np.where(contacts[STICKING] > 0.0, contacts[STATIC], contacts[KINETIC])
    limit = coefficient * contacts[NORMAL]
    share = np.divide(friction, limit, out=np.zeros_like(limit), where=limit > 0.0)
    return np.clip(share, -1.0, 1.0)


def adhesion(channels: dict[str, "Array"], bodies: "Indices", length: "Array") -> float:
    """Return the length on which the belt sticks to a pulley; zero where no body sticks.

    The friction is at its limit on the sliding arc and zero on the arc of adhesion, but for waves,
    whose mean is zero, and for the body between the two: the share of its limit is that of its
    length that slides. Counted as a whole it would make an error of first order.

    Parameters
    ----------
    channels : dict of (n,)
    bodies : (m,)
        Those on the pulley.
    length : (m,)
        The length of each on it, in any unit.
    """
    if not channels["sticking"][bodies].any():
        return 0.0
    sliding = abs(float(np.sum(channels["_utilisation"][bodies] * length)))
    return max(float(np.sum(length)) - sliding, 0.0)


def friction_power(channels: dict[str, "Array"]) -> "Array":
    """Return the power with which friction drives bodies that slide, and that of all of it, W."""
    power = channels["friction_force"] * channels["slip_velocity"]
    sliding = channels["sticking"] == 0.0
    return np.array([np.sum((-power[sliding]).clip(min=0.0)), np.sum(np.abs(power))])
