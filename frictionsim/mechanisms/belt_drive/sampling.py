"""Samples of a belt drive: channels, and what the summary and the audit need."""

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import BeltOffPulleys, Diverged
from frictionsim.mechanisms.belt_drive.belt import patch_bodies
from frictionsim.mechanisms.belt_drive.channels import CHANNELS, BeltSamples
from frictionsim.mechanisms.belt_drive.effects.base import previous_rows
from frictionsim.mechanisms.belt_drive.kernels.system import (
    ANGLE,
    ARC_LENGTH,
    ARC_START,
    FORCE_X,
    FORCE_Y,
    MIDDLE,
    POSITION,
    PULLEY_RADIUS,
    RADIUS,
    SPEED,
    TENSION,
    TORQUE,
    VELOCITY,
    VX,
    VY,
    Array,
    ContactRows,
    Indices,
    X,
    Y,
    kinematics_of,
)
from frictionsim.mechanisms.belt_drive.quantities import checks_of, quantities_of
from frictionsim.mechanisms.belt_drive.run_warnings import warnings_of
from frictionsim.mechanisms.belt_drive.slip import span_tensions
from frictionsim.mechanisms.belt_drive.transitions import transitions_of
from frictionsim.results import SimulationResult
from frictionsim.simulation.sample_store import SampleStore

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.model import BeltModel
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario


# Of the pretension: a belt whose tension is above mass_per_length times speed squared by less than
# that is about to lift off. Its friction fades before it does.
LIGHT = 0.02
MAX_PENETRATION = 0.5  # of a radius: a body that gets further into a pulley does not come out again


class Observer:
    """Samples of a belt drive, in a `SampleStore`.

    Only the channels that are wanted are kept whole; of the others what the quantities need. The
    system of the model holds the forces of the state that a sample is taken of.
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
        if model.belt.has_dampers:
            self._energies.append("energy_damping")
        contact = {"friction_force", "slip_velocity", "sticking"}
        absent = contact if system.friction is None else set()
        wanted = scenario.output.channels
        self._wanted = [
            name
            for name, channel in CHANNELS.items()
            if channel.axis and name not in absent and (wanted is None or name in wanted)
        ]
        self._patch = patch_bodies(scenario, system.chain.length)
        self.samples = SampleStore()
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
        filled = np.flatnonzero(contacts.table[RADIUS, :count] > 0.0)
        body, near = contacts.body[filled].astype(np.int64), ContactRows(*contacts.table[:, filled])
        x, y = kinematics[X, body] - near.centre_x, kinematics[Y, body] - near.centre_y
        share = 1.0 - np.hypot(x, y) / near.radius
        deepest = int(np.argmax(share))
        if share[deepest] > MAX_PENETRATION:
            raise BeltOffPulleys(
                f"body {body[deepest]} of the belt is pressed {100 * share[deepest]:.0f} % of the"
                f" radius into a pulley at t = {stepper.t:.9g} s; stiffen effects.contact, or lower"
                " the tension"
            )

    def _kinematics(self, state: Array) -> Array:
        rows: Array = kinematics_of(state, self._system.layout)
        return rows[:, : self._bodies]

    @property
    def states(self) -> int:
        """How many numbers are integrated: those of the state that this scenario needs."""
        layout = self._system.layout
        rows = layout.angles // layout.width
        return rows * self._bodies + layout.energies - layout.angles + len(self._energies)

    def sample(self, t: float, state: Array) -> None:
        """Add the sample of time t."""
        self.samples.append(self._sample(t, state))
        self._check_energy()

    def sample_at_start(self) -> dict[str, Any]:
        """Return a sample of the start as a template, whatever the forces are."""
        return self._sample(0.0, self._model.state)

    def _sample(self, t: float, state: Array) -> dict[str, Any]:
        kinematics = self._kinematics(state)
        channels = {**self._body_channels(kinematics), **self._pulley_channels(state)}
        seen = {name: channels[name] for name in self._wanted}
        return {"time": t, **seen, **self._quantities(state, kinematics, channels)}

    def _check_energy(self) -> None:
        """Compare what the belt has with what it was given.

        Dissipated energy is ignored: it can only lower the total.
        """
        samples = self.samples
        energy_input = samples.gain("energy_input")
        has = samples.gain("energy_kinetic") + samples.gain("energy_potential")
        stored = abs(float(samples.first("energy_potential"))) + abs(energy_input)
        self.energy_gain = (has - energy_input) / stored if stored > 0.0 else 0.0

    def _body_channels(self, kinematics: Array) -> dict[str, Array]:
        contacts = self._system.contacts
        count = contacts.offsets[-1]
        # A body may be a candidate of two pulleys, and is pressed on one.
        candidates = ContactRows(*contacts.table[:, :count])
        filled = np.flatnonzero((candidates.radius > 0.0) & (candidates.normal > 0.0))
        body, pressed = (
            contacts.body[filled].astype(np.int64),
            ContactRows(*contacts.table[:, filled]),
        )
        friction = pressed.friction * self.force_per_impulse
        rows = self._places(kinematics)
        rows["pulley_index"] = np.full(self._bodies, -1.0)
        rows["pulley_index"][body] = np.searchsorted(contacts.offsets, filled, side="right") - 1.0
        for name, values in (
            ("normal_force", pressed.normal),
            ("friction_force", friction),
            ("slip_velocity", pressed.slip),
            ("sticking", pressed.sticking),
            ("_mode", pressed.mode),
            ("_utilisation", utilisation(pressed, friction)),
        ):
            rows[name] = np.zeros(self._bodies)
            rows[name][body] = values
        rows["tension"] = self._tension(kinematics)
        return rows

    def _places(self, kinematics: Array) -> dict[str, Array]:
        return {"x": kinematics[X], "y": kinematics[Y], "angle": kinematics[ANGLE]}

    def _tension(self, kinematics: Array) -> Array:
        """Return the tension of every joint; negative in compression."""
        force_x = self._system.workspace[FORCE_X, : self._bodies]
        force_y = self._system.workspace[FORCE_Y, : self._bodies]
        angle = kinematics[ANGLE]
        cos, sin = np.cos(angle), np.sin(angle)
        along = force_x * (cos + previous_rows(cos)) + force_y * (sin + previous_rows(sin))
        return np.copysign(np.hypot(force_x, force_y), along)

    def _pulley_channels(self, state: Array) -> dict[str, Array]:
        layout = self._system.layout
        return {
            "pulley_angle": state[layout.angles : layout.speeds],
            "pulley_speed": self._speeds(state),
            "pulley_torque": self._system.pulleys.table[TORQUE],
        }

    def _speeds(self, state: Array) -> Array:
        """Return the speeds of all pulleys; the free ones have theirs in the state."""
        pulleys = self._system.pulleys
        speeds = pulleys.table[SPEED].copy()
        layout = self._system.layout
        speeds[pulleys.free] = state[layout.speeds : layout.energies]
        return speeds

    def _quantities(
        self, state: Array, kinematics: Array, channels: dict[str, Array]
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
            "_span_tension": span_tensions(tension[None], pulley[None], len(members))[0],
            **self._contact_counts(channels),
            **self._friction_on_pulleys(),
            "_patch": np.sum(pulley[self._patch] >= 0.0),
            "_excess": self._friction_excess(),
            "_power": friction_power(channels, self._model.distinct_static_friction),
        }

    def _contact_counts(self, channels: dict[str, Array]) -> dict[str, Array]:
        """Return how many bodies touch each pulley, and on how many lengths of them it sticks."""
        members = range(self._system.pulleys.table.shape[1])
        on = [np.flatnonzero(channels["pulley_index"] == j) for j in members]
        return {
            "_touching": np.array([len(bodies) for bodies in on]),
            "_sticking": np.array([adhesion(channels, i, np.ones(len(i))) for i in on]),
        }

    def _belt_speed(self, kinematics: Array) -> float:
        return belt_speed(kinematics)

    def _friction_on_pulleys(self) -> dict[str, Array]:
        """Return the sum of the friction on the belt, N, and what it could be in full slip.

        And the sum of N s, whose sign is the direction of the slip.
        """
        contacts = self._system.contacts
        if self._system.friction is None:
            return {}
        ranges = [slice(*ends) for ends in pairwise(contacts.offsets)]
        rows = ContactRows(*contacts.table)
        terms = {
            "_friction": rows.friction * self.force_per_impulse,
            "_capacity": rows.kinetic * rows.normal,
            "_slip": rows.normal * rows.slip,
        }
        return {
            name: np.array([values[of].sum() for of in ranges]) for name, values in terms.items()
        }

    def _friction_excess(self) -> Array:
        """Return by how much a friction is off its limits, N, and the largest limit, N.

        Above the one that holds it; or below that at rest, of a body that has no slip but does not
        stick: the static coefficient would hold it.
        """
        contacts = self._system.contacts
        if self._system.friction is None:
            return np.zeros(2)
        rows = ContactRows(*contacts.table[:, : contacts.offsets[-1]])
        friction, at_rest = rows.friction * self.force_per_impulse, rows.static * rows.normal
        size, limit = np.abs(friction), at_rest
        off = size - at_rest
        law = self._system.effects.belt_friction
        if law is not None and law.set_valued is not None:
            limits = rows.forward_limit, rows.backward_limit
            limit = np.where(friction > 0.0, *limits) * self.force_per_impulse
            let_go = (rows.slip == 0.0) & (rows.sticking == 0.0)
            off = np.maximum(size - limit, np.where(let_go, at_rest - size, 0.0))
        return np.array([np.max(off, initial=0.0), np.max(at_rest, initial=0.0)])

    def observe(self) -> SimulationResult:
        """Return the samples before the first that is not finite, and what follows from them."""
        samples, sound = self.samples, self.samples.n_finite()
        names = samples.names
        channels = {name: samples.channel(name, sound) for name in CHANNELS if name in names}
        time = samples.channel("time", sound) if names else np.zeros(0)
        seen = {n: samples.channel(n, sound) for n in names if n.startswith(("energy", "_"))}
        length, tension = self._system.chain.length, self._model.equilibrium.tension
        run = BeltSamples(self._scenario, length, float(np.mean(tension)), time, seen)
        quantities = quantities_of(run)
        return SimulationResult(
            time=time,
            channels=channels,
            transitions=transitions_of(run),
            quantities=quantities,
            checks=checks_of(run),
            non_finite_tail=sound < len(samples),
            warnings=warnings_of(run, quantities),
        )


class StringObserver(Observer):
    """Samples of a guided string."""

    def __init__(self, scenario: "BeltDriveScenario", model: "BeltModel") -> None:
        super().__init__(scenario, model)
        self._pretension = float(np.mean(model.equilibrium.tension))
        self._path = scenario.mechanism.path()

    def check_belt(self, stepper: Any) -> None:
        """Stop where points have passed each other."""
        position = self._kinematics(stepper.interpolate(stepper.t))[POSITION]
        spacing = np.diff(position, append=position[0] + self._path.length)
        if np.min(spacing) <= 0.0:
            raise Diverged(
                f"bodies {int(np.argmin(spacing))} and the next have passed each other at"
                f" t = {stepper.t:.9g} s: without effects.contact a slack span goes into"
                " compression instead of sagging; raise mechanism.belt.pretension, or add"
                " [effects.contact]"
            )

    def _places(self, kinematics: Array) -> dict[str, Array]:
        rounds = np.floor(kinematics[POSITION] / self._path.length)
        within = kinematics[POSITION] - rounds * self._path.length
        points = self._path.at(np.minimum(within, np.nextafter(self._path.length, 0.0)))
        return {
            "x": points.position[:, 0],
            "y": points.position[:, 1],
            "angle": points.angle + rounds * self._path.total_turning,
        }

    def _tension(self, kinematics: Array) -> Array:
        tension: Array = self._system.workspace[TENSION, : self._bodies].copy()
        return tension

    def _belt_speed(self, kinematics: Array) -> float:
        return float(np.mean(kinematics[VELOCITY]))

    def _contact_counts(self, channels: dict[str, Array]) -> dict[str, Array]:
        """Return how many bodies' lengths are on each pulley, and on how many of them it sticks.

        They are exact: parts of lengths count as such. And over which angle, rad, they are hardly
        pressed on it.
        """
        middle, normal = self._system.workspace[MIDDLE], channels["normal_force"]
        contacts, length = self._system.contacts, self._system.chain.length
        radius = self._system.pulleys.table[PULLEY_RADIUS]
        touching, stuck, unpressed = np.zeros((3, len(radius)))
        for j, ends in enumerate(pairwise(contacts.offsets)):
            table = contacts.table[:, slice(*ends)]
            filled = table[RADIUS] > 0.0
            body = contacts.body[slice(*ends)][filled].astype(np.int64)
            start, arc = table[ARC_START, filled], table[ARC_LENGTH, filled]
            part = np.clip(middle[body + 1] - start, 0.0, arc)
            part -= np.clip(middle[body] - start, 0.0, arc)
            on = channels["pulley_index"][body] == j
            light = normal[body] * radius[j] < LIGHT * self._pretension * part
            touching[j] = np.sum(part[on]) / length
            stuck[j] = adhesion(channels, body[on], part[on]) / length
            unpressed[j] = np.sum(part[light]) / radius[j]
        return {"_touching": touching, "_sticking": stuck, "_unpressed": unpressed}


def observer_of(scenario: "BeltDriveScenario", model: "BeltModel") -> Observer:
    """Return the sampler of a belt drive, in the plane or guided."""
    return (StringObserver if scenario.guided else Observer)(scenario, model)


def belt_speed(kinematics: Array) -> float:
    """Return the mean velocity of the bodies along the belt, m/s."""
    along = kinematics[VX] * np.cos(kinematics[ANGLE]) + kinematics[VY] * np.sin(kinematics[ANGLE])
    return float(np.mean(along))


def utilisation(rows: ContactRows, friction: Array) -> Array:
    """Return the friction of contacts, N, over its limit, from -1 to 1."""
    coefficient = np.where(rows.sticking > 0.0, rows.static, rows.kinetic)
    limit = coefficient * rows.normal
    share = np.divide(friction, limit, out=np.zeros_like(limit), where=limit > 0.0)
    return np.clip(share, -1.0, 1.0)


def adhesion(channels: dict[str, Array], bodies: Indices, length: Array) -> float:
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


def friction_power(channels: dict[str, Array], modes_count: bool) -> Array:
    """Return the power with which friction drives bodies that slide, and that of all of it, W.

    What residual slip a body has that is held relaxes within steps, in either direction. Where
    static and kinetic friction differ, its mode says that it is held; at its limit, too.
    """
    power = channels["friction_force"] * channels["slip_velocity"]
    sliding = channels["sticking"] == 0.0
    if modes_count:
        sliding &= channels["_mode"] != 0.0
    return np.array([np.sum((-power[sliding]).clip(min=0.0)), np.sum(np.abs(power))])
