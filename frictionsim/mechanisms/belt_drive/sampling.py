"""What is seen of a belt drive: channels to record, the quantities of the summary, the audit."""

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.mechanisms.belt_drive.assembly import patch_bodies
from frictionsim.mechanisms.belt_drive.kernels.chain import (
    ANGLE,
    FORCE_X,
    FORCE_Y,
    SPIN,
    VX,
    VY,
    X,
    Y,
)
from frictionsim.mechanisms.belt_drive.kernels.contact import (
    BACKWARD_LIMIT,
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
)
from frictionsim.mechanisms.belt_drive.quantities import checks_of, quantities_of
from frictionsim.mechanisms.belt_drive.run_warnings import warnings_of
from frictionsim.mechanisms.belt_drive.schema import CHANNELS
from frictionsim.mechanisms.belt_drive.spans import span_tensions
from frictionsim.results import SimulationResult

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.assembly import BeltModel
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

    Array = npt.NDArray[np.float64]


class Observer:
    """Samples of a belt drive, in arrays that grow.

    Only the channels that are wanted are kept whole; of the others what the quantities need.

    Parameters
    ----------
    scenario : BeltDriveScenario
    assembly : Assembly
        Its room holds the forces of the state that a sample is taken of.
    """

    def __init__(self, scenario: "BeltDriveScenario", model: "BeltModel") -> None:
        self._scenario, self._model = scenario, model
        # Makes a force of what the slots hold as friction, if that is an impulse.
        self.force_per_impulse = 1.0
        self._bodies = scenario.mechanism.belt.bodies
        self._width = model.workspace.shape[1]
        self._energies = ["energy_input"]
        if model.friction is not None:
            self._energies.append("energy_friction")
        laws = model.laws
        bending = laws.bending is not None and laws.bending.damping > 0.0
        if laws.axial_damping is not None or laws.contact_damping is not None or bending:
            self._energies.append("energy_damping")
        self.energies = len(self._energies)
        contact = {"friction_force", "slip_velocity", "sticking"}
        absent = contact if model.friction is None else set()
        wanted = scenario.output.channels
        self._wanted = [
            name
            for name, channel in CHANNELS.items()
            if channel.axis and name not in absent and (wanted is None or name in wanted)
        ]
        self._before = np.arange(self._bodies) - 1
        self._patch = patch_bodies(scenario, laws.chain.length)
        self._samples: dict[str, list[Any]] = {}
        self.energy_gain = 0.0  # energy that came from nowhere, over what was stored and put in

    def positions(self, stepper: Any) -> tuple["Array", "Array"]:
        """Return where the bodies are at the end of the last step, m."""
        kinematics = self._kinematics(stepper.interpolate(stepper.t))
        return kinematics[X], kinematics[Y]

    def _kinematics(self, state: "Array") -> "Array":
        return state[: 6 * self._width].reshape(6, self._width)[:, : self._bodies]

    def sample(self, t: float, state: "Array") -> None:
        """Add the sample of time t."""
        kinematics = self._kinematics(state)
        channels = {**self._of_bodies(kinematics), **self._of_pulleys(state)}
        seen = {name: channels[name].copy() for name in self._wanted}
        seen |= self._quantities(state, kinematics, channels)
        for name, values in seen.items():
            self._samples.setdefault(name, []).append(values)
        self._samples.setdefault("time", []).append(t)
        self._check_energy()

    def _check_energy(self) -> None:
        """Compare what the belt has with what it was given; heats only take, and are left out."""
        samples = self._samples

        def gained(name: str) -> float:
            return float(samples[name][-1] - samples[name][0])

        put_in = gained("energy_input")
        has = gained("energy_kinetic") + gained("energy_potential")
        stored = abs(samples["energy_potential"][0]) + abs(put_in)
        self.energy_gain = (has - put_in) / stored if stored > 0.0 else 0.0

    def state(self) -> dict[str, "Array"]:
        """Return the samples so far."""
        return {
            f"samples.{name}": np.array(values, dtype=np.float64)
            for name, values in self._samples.items()
        }

    def restore(self, state: dict[str, "Array"]) -> None:
        """Take over the samples of another run of the same scenario."""
        self._samples = {
            name.removeprefix("samples."): list(values)
            for name, values in state.items()
            if name.startswith("samples.")
        }

    def _of_bodies(self, kinematics: "Array") -> dict[str, "Array"]:
        contacts = self._model.contacts
        count = contacts.offsets[-1]
        filled = np.flatnonzero(contacts.table[RADIUS, :count] > 0.0)
        body = contacts.body[filled].astype(np.int64)
        found: dict[str, Array] = {
            "x": kinematics[X],
            "y": kinematics[Y],
            "angle": kinematics[ANGLE],
        }
        for name, row in (
            ("normal_force", NORMAL),
            ("friction_force", FRICTION),
            ("slip_velocity", SLIP),
            ("sticking", STICKING),
        ):
            found[name] = np.zeros(self._bodies)
            found[name][body] = contacts.table[row, filled]
        touching = found["normal_force"] > 0.0
        found["friction_force"] *= self.force_per_impulse
        found["slip_velocity"] *= touching
        found["sticking"] *= touching
        pulley = np.searchsorted(contacts.offsets, filled, side="right") - 1.0
        found["pulley_index"] = np.full(self._bodies, -1.0)
        found["pulley_index"][body] = np.where(touching[body], pulley, -1.0)
        found["tension"] = self._tension(kinematics)
        return found

    def _tension(self, kinematics: "Array") -> "Array":
        """Return the tension of every joint; negative where the bodies are pressed together."""
        force_x = self._model.workspace[FORCE_X, : self._bodies]
        force_y = self._model.workspace[FORCE_Y, : self._bodies]
        angle = kinematics[ANGLE]
        cos, sin = np.cos(angle), np.sin(angle)
        along = force_x * (cos + cos[self._before]) + force_y * (sin + sin[self._before])
        return np.copysign(np.hypot(force_x, force_y), along)

    def _of_pulleys(self, state: "Array") -> dict[str, "Array"]:
        table = self._model.pulleys.table
        angles = state[6 * self._width : 6 * self._width + table.shape[1]]
        return {
            "pulley_angle": angles,
            "pulley_speed": self._speeds(state),
            "pulley_torque": table[TORQUE],
        }

    def _speeds(self, state: "Array") -> "Array":
        """Return the speeds of all pulleys; the free ones have theirs in the state."""
        pulleys = self._model.pulleys
        speeds = pulleys.table[SPEED].copy()
        at = 6 * self._width + len(speeds)
        speeds[pulleys.free] = state[at : at + len(pulleys.free)]
        return speeds

    def _quantities(
        self, state: "Array", kinematics: "Array", channels: dict[str, "Array"]
    ) -> dict[str, Any]:
        """Return what quantities and audit need of a sample, whatever is recorded."""
        model = self._model
        table = model.pulleys.table
        at = 6 * self._width + table.shape[1] + len(model.pulleys.free)
        speeds, tension, pulley = (
            channels[name] for name in ("pulley_speed", "tension", "pulley_index")
        )
        energies = dict(
            zip(("energy_input", "energy_friction", "energy_damping"), state[at:], strict=False)
        )
        members = range(table.shape[1])
        return {
            **{name: energies[name] for name in self._energies},
            "energy_kinetic": kinetic_energy(model, kinematics, speeds),
            "energy_potential": potential_energy(model, kinematics),
            "_speed": speeds,
            "_torque": table[TORQUE].copy(),
            "_mean_tension": tension.mean(),
            "_belt_speed": belt_speed(kinematics),
            "_span_tension": span_tensions(tension, pulley, len(members)),
            "_touching": np.array([np.sum(pulley == j) for j in members]),
            "_sticking": np.array([channels["sticking"][pulley == j].sum() for j in members]),
            **self._friction_on_pulleys(),
            "_patch": np.sum(pulley[self._patch] >= 0.0),
            "_excess": self._friction_excess(),
            "_power": friction_power(channels),
        }

    def _friction_on_pulleys(self) -> dict[str, "Array"]:
        """Return the sum of the friction on the belt, N, and what it could be in full slip."""
        contacts, a = self._model.contacts, self._model
        if a.friction is None:
            return {}
        ranges = [slice(*ends) for ends in pairwise(contacts.offsets)]
        friction = contacts.table[FRICTION] * self.force_per_impulse
        kinetic = contacts.table[KINETIC] * contacts.table[NORMAL]
        return {
            "_friction": np.array([friction[of].sum() for of in ranges]),
            "_capacity": np.array([kinetic[of].sum() for of in ranges]),
        }

    def _friction_excess(self) -> "Array":
        """Return by how much a friction is off its limits, N, and the largest limit, N.

        Above the one that holds it; or below that at rest, of a body that has no slip but does not
        stick: the static coefficient would hold it.
        """
        contacts, a = self._model.contacts, self._model
        if a.friction is None:
            return np.zeros(2)
        table = contacts.table[:, : contacts.offsets[-1]]
        friction, at_rest = table[FRICTION] * self.force_per_impulse, table[STATIC] * table[NORMAL]
        size, limit = np.abs(friction), at_rest
        off = size - at_rest
        if a.laws.set_valued:
            limits = table[FORWARD_LIMIT], table[BACKWARD_LIMIT]
            limit = np.where(friction > 0.0, *limits) * self.force_per_impulse
            let_go = (table[SLIP] == 0.0) & (table[STICKING] == 0.0)
            off = np.maximum(size - limit, np.where(let_go, at_rest - size, 0.0))
        return np.array([np.max(off, initial=0.0), np.max(at_rest, initial=0.0)])

    def observe(self) -> SimulationResult:
        """Return the samples before the first that is not finite, and what follows from them."""
        samples = {name: np.array(values) for name, values in self._samples.items()}
        time = samples.pop("time", np.zeros(0))
        sound = _n_finite(time, samples)
        samples = {name: values[:sound] for name, values in samples.items()}
        channels = {name: samples[name] for name in CHANNELS if name in samples}
        energies = {name: v for name, v in channels.items() if name.startswith("energy")}
        seen = {**energies, **{name: v for name, v in samples.items() if name.startswith("_")}}
        time = time[:sound]
        quantities = quantities_of(self._scenario, self._model, time, seen)
        return SimulationResult(
            time=time,
            channels=channels,
            transitions=[],
            quantities=quantities,
            checks=checks_of(self._scenario, self._model, time, seen),
            non_finite_tail=sound < len(self._samples.get("time", ())),
            warnings=warnings_of(self._scenario, self._model, time, seen, quantities),
        )


def _n_finite(time: "Array", samples: dict[str, "Array"]) -> int:
    """Return how many samples come before the first that is not finite."""
    sound = len(time)
    for values in samples.values():
        good = np.isfinite(values).reshape(len(time), -1).all(axis=1)
        sound = min(sound, int(np.argmin(good)) if not good.all() else len(time))
    return sound


def belt_speed(kinematics: "Array") -> float:
    """Return the mean velocity of the bodies along the belt, m/s."""
    along = kinematics[VX] * np.cos(kinematics[ANGLE]) + kinematics[VY] * np.sin(kinematics[ANGLE])
    return float(np.mean(along))


def kinetic_energy(model: "BeltModel", kinematics: "Array", speeds: "Array") -> float:
    """Return the kinetic energy of bodies and pulleys, J."""
    chain, pulley = model.laws.chain, model.pulleys.table
    linear = chain.mass * np.sum(kinematics[VX] ** 2 + kinematics[VY] ** 2)
    turning = chain.inertia * np.sum(kinematics[SPIN] ** 2) + np.sum(pulley[3] * speeds**2)
    return float(0.5 * (linear + turning))


def potential_energy(model: "BeltModel", kinematics: "Array") -> float:
    """Return the energy of springs, contacts and weight, J."""
    laws, chain = model.laws, model.laws.chain
    half_x = 0.5 * chain.length * np.cos(kinematics[ANGLE])
    half_y = 0.5 * chain.length * np.sin(kinematics[ANGLE])
    before = np.arange(kinematics.shape[1]) - 1
    dx = kinematics[X] - half_x - (kinematics[X] + half_x)[before]
    dy = kinematics[Y] - half_y - (kinematics[Y] + half_y)[before]
    energy = 0.5 * chain.stiffness * np.sum(dx * dx + dy * dy)
    if laws.bending is not None:
        turned = np.diff(kinematics[ANGLE], prepend=kinematics[ANGLE, -1] - chain.turn)
        energy += 0.5 * laws.bending.stiffness * np.sum(turned * turned)
    if laws.weight is not None:
        energy -= chain.mass * np.sum(laws.weight.x * kinematics[X] + laws.weight.y * kinematics[Y])
    for x, y, radius in model.pulleys.table[:3].T:
        p = np.maximum(radius - np.hypot(kinematics[X] - x, kinematics[Y] - y), 0.0)
        energy += np.sum(p * p * (laws.contact.c1 * p / 3.0 + laws.contact.c2 / 2.0))
    return float(energy)


def friction_power(channels: dict[str, "Array"]) -> "Array":
    """Return the largest power with which friction drives a body that slides, and brakes, W."""
    power = channels["friction_force"] * channels["slip_velocity"]
    sliding = channels["sticking"] == 0.0
    driving = np.max(-power[sliding], initial=0.0)
    return np.array([driving, np.max(np.abs(power), initial=0.0)])
