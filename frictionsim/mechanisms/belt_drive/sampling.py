"""Samples of a belt drive: channels, and what the summary and the audit need.

Contacts have rows over bodies, so that a channel of bodies is a row of contacts: of the pulley that
presses each body.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import BeltOffPulleys, Diverged
from frictionsim.mechanisms.belt_drive import belt as row
from frictionsim.mechanisms.belt_drive.belt import Array, Belt, Line, patch_of_bodies, zones_of
from frictionsim.mechanisms.belt_drive.energy import (
    Shape,
    before,
    energies,
    energy_on_line,
    kinetic_energy,
    shape_of,
)
from frictionsim.mechanisms.belt_drive.quantities import BeltSamples, checks_of, quantities_of
from frictionsim.mechanisms.belt_drive.run_warnings import warnings_of
from frictionsim.mechanisms.belt_drive.schema import CHANNELS
from frictionsim.mechanisms.belt_drive.slip import span_tensions
from frictionsim.mechanisms.belt_drive.transitions import transitions_of
from frictionsim.results import SimulationResult
from frictionsim.simulation.checkpoint import Arrays
from frictionsim.simulation.sample_store import SampleStore

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.equilibrium import Rest
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

# Of the pretension: a belt whose tension is above mass_per_length times speed squared by less than
# that is about to lift off. Its friction fades before it does.
LIGHT = 0.02
MAX_PENETRATION = 0.5  # of a radius: a body that gets further into a pulley does not come out again
GAIN_OF_DIVERGENCE = 1.0  # of the energy that was stored at the start or put in since
OF_FRICTION = {"friction_force", "slip_velocity", "sticking"}
OF_WEAR = {"friction_work", "pulley_friction_work"}
# So many samples are worked out at once, of so many contacts: of more no time is saved.
MOST_AT_ONCE, NUMBERS_AT_ONCE = 64, 40_000
IN_PLANE, ON_LINE = slice(row.FX, row.FY + 1), slice(row.TENSION, row.MIDDLE + 1)  # rows of joints
CONTACT_ROWS = slice(row.NORMAL, row.MODE + 1)


class States(NamedTuple):
    """Samples, m of them, or one without that axis: copies of the state and of the belt's rows."""

    time: Array  # (m,), s
    kin: Array  # (m, rows, n), the kinematics
    rest: Array  # (m, ...), the state behind them
    con: Array  # (m, rows, pulleys, n), the contacts' rows from NORMAL to MODE
    joints: Array  # (m, 2, n + 1), FX and FY, on a line TENSION and MIDDLE
    speed: Array  # (m, pulleys), rad/s
    torque: Array  # (m, pulleys), N m
    works: Array  # (m, pulleys, n), J, of friction; of no pulley without wear

    def contacts(self, which: int) -> Array:
        """Return a row of the contacts, (m, pulleys, n)."""
        return self.con[:, which - row.NORMAL]


class Observer:
    """Samples of a belt drive, in a `SampleStore`.

    A sample is a copy of rows. What is recorded of it, the wanted channels and what the quantities
    need, is worked out for many samples at once: for one of 150 bodies NumPy takes twenty times as
    long to be called as to calculate.

    Parameters
    ----------
    scenario : BeltDriveScenario
    belt : Belt
    rest : Rest
    force_per_impulse : float, 1/s
        Makes a force of what the contacts hold as friction, if that is an impulse.
    """

    def __init__(
        self, scenario: "BeltDriveScenario", belt: Belt, rest: "Rest", force_per_impulse: float
    ) -> None:
        self._scenario, self._belt = scenario, belt
        self._force_per_impulse = force_per_impulse
        self._pretension = float(np.mean(rest.tension))
        self._path = scenario.mechanism.path()
        places = patch_of_bodies(scenario, rest.body_length)
        self._patches = np.arange(len(scenario.effects.patches))[:, None] == places
        self._pulleys = np.arange(belt.pul.shape[1])[:, None]
        self._zones = np.array([*zones_of(scenario, rest.body_length).values()])
        self._mu_s, self._mu_k = belt.con[[row.MU_S, row.MU_K], :, : belt.n]
        self._distinct = belt.distinct
        self._energies = {"energy_input": row.INPUT_ENERGY}
        if belt.has_friction:
            self._energies["energy_friction"] = row.FRICTION_HEAT
        if belt.has_dampers:
            self._energies["energy_damping"] = row.DAMPING_HEAT
        absent = set() if belt.has_friction else OF_FRICTION
        absent |= set() if belt.wear else OF_WEAR
        wanted = scenario.output.channels
        self._wanted = [
            name
            for name, channel in CHANNELS.items()
            if channel.axis and name not in absent and (wanted is None or name in wanted)
        ]
        self._samples = SampleStore()
        self._waiting: list[States] = []
        self._at_once = min(MOST_AT_ONCE, NUMBERS_AT_ONCE // belt.con[0].size)
        self._checked = 0  # samples
        self._first_velocity = belt.angles // belt.width // 2  # row of the kinematics
        self._squares = 0.0  # the largest sum of squares of velocities of those worked out

    @property
    def states(self) -> int:
        """How many numbers are integrated: those of the state that this scenario needs."""
        belt = self._belt
        rows = belt.angles // belt.width
        works = belt.pul.shape[1] * belt.n if belt.wear else 0
        return rows * belt.n + belt.energies - belt.angles + len(self._energies) + works

    def check_belt(self, t: float, state: Array) -> None:
        """Stop where the belt has left its pulleys, is pressed through one, or passes itself."""
        belt, kin = self._belt, self._belt.kinematics(state)[:, : self._belt.n]
        if belt.line is not None:
            spacing = np.diff(kin[row.POSITION], append=kin[row.POSITION, 0] + belt.line.length)
            if np.min(spacing) <= 0.0:
                body = int(np.argmin(spacing))
                raise Diverged(
                    f"bodies {body} and {(body + 1) % belt.n} have passed each other at"
                    f" t = {t:.9g} s: without effects.contact a slack span goes into compression"
                    " instead of sagging; raise mechanism.belt.pretension, or add [effects.contact]"
                )
            return
        if belt.n_runs[0] == 0:
            raise BeltOffPulleys(
                f"the belt has left its pulleys at t = {t:.9g} s; is the pretension too low, or a"
                " torque too high?"
            )
        x, y, radius = belt.pul[[row.PX, row.PY, row.RADIUS]][..., None]
        depth = 1.0 - np.sqrt((kin[row.X] - x) ** 2 + (kin[row.Y] - y) ** 2) / radius
        if np.max(depth) > MAX_PENETRATION:
            body = int(np.argmax(np.max(depth, axis=0)))
            raise BeltOffPulleys(
                f"body {body} of the belt is pressed {100 * np.max(depth):.0f} % of the radius into"
                f" a pulley at t = {t:.9g} s; stiffen effects.contact, or lower the tension"
            )

    # --- samples are taken ----------------------------------------------------------------------

    def sample(self, t: float, state: Array) -> None:
        """Take the sample of time t, of whose state the belt's rows have the forces.

        Raises
        ------
        Diverged
            There is more energy than was stored or put in; of this sample or one before.
        """
        taken = self._copy(t, state)
        velocities = taken.kin[self._first_velocity :].ravel()
        squares = float(velocities @ velocities)
        self._waiting.append(taken)
        # Energy that comes from nowhere may grow beyond all numbers within a few samples.
        if len(self._waiting) >= self._at_once or not squares <= 2.0 * self._squares:
            self._squares = max(self._squares, squares)
            self.finish()

    def _copy(self, t: float, state: Array) -> States:
        belt, n = self._belt, self._belt.n
        speed = belt.pul[row.SPEED].copy()
        speed[belt.free] = state[belt.speeds : belt.energies]
        return States(
            np.array(t),
            belt.kinematics(state)[:, :n].copy(),
            state[belt.angles : belt.energies + row.ENERGIES].copy(),
            belt.con[CONTACT_ROWS, :, :n].copy(),
            belt.work[IN_PLANE if belt.line is None else ON_LINE, : n + 1].copy(),
            speed,
            belt.pul[row.TORQUE].copy(),
            belt.works(state)[:, :n].copy(),
        )

    def finish(self) -> None:
        """Work out the samples that wait, and check their energies; `Diverged` as of `sample`."""
        self._work_out()
        first, last = self._checked, len(self._samples)
        gained = {
            name: self._samples.channel(name, last)[first:] - self._samples.first(name)
            for name in ("energy_input", "energy_kinetic", "energy_potential")
        }
        stored = abs(float(self._samples.first("energy_potential"))) + abs(gained["energy_input"])
        # Dissipated energy is ignored: it can only lower the total.
        created = sum(gained.values()) - 2.0 * gained["energy_input"]
        for k in np.flatnonzero(created > GAIN_OF_DIVERGENCE * stored)[:1]:
            raise Diverged(
                f"at t = {self._samples.channel('time', last)[first + k]:.9g} s the belt has"
                f" {created[k] / stored[k]:.3g} times the energy that it was given: the steps are"
                " unstable; give a smaller solver.step or solver.max_step, or a smaller rtol"
            )
        self._checked = last

    def _work_out(self) -> None:
        if self._waiting:
            self._samples.extend(self._worked_out(self._waiting))
            self._waiting.clear()

    # --- what is recorded of them ---------------------------------------------------------------

    def _worked_out(self, taken: list[States]) -> dict[str, Any]:
        """Return the wanted channels and what quantities need, (m, ...), of samples."""
        belt, line = self._belt, self._belt.line
        states = States(*map(np.array, zip(*taken, strict=True)))
        velocities = states.kin[:, self._first_velocity :]
        if line is None:
            places = states.kin[:, [row.X, row.Y, row.PHI]]
            x, y, angle = np.moveaxis(places, 1, 0)
            shape = shape_of(belt, places)
            potential = energies(belt, shape).sum(axis=-1)
            along = velocities[:, 0] * shape.cos + velocities[:, 1] * shape.sin
            tension = _tension(states.joints[:, :, : belt.n], shape)
        else:
            x, y, angle = self._places_on_line(states.kin[:, row.POSITION])
            potential = energy_on_line(belt, line.length, states.kin[:, row.POSITION])
            along, tension = velocities[:, 0], states.joints[:, 0, : belt.n]
        bodies, power = self._contacts_of_bodies(states)
        pulley = bodies["pulley_index"]
        channels = {
            "pulley_angle": states.rest[:, : belt.speeds - belt.angles],
            "pulley_speed": states.speed,
            "pulley_torque": states.torque,
            "x": x,
            "y": y,
            "angle": angle,
            **bodies,
            "tension": tension,
            "friction_work": states.works.sum(axis=1),
            "pulley_friction_work": states.works.sum(axis=2),
        }
        behind = belt.energies - belt.angles
        return {
            "time": states.time,
            **{name: channels[name] for name in self._wanted},
            **{name: states.rest[:, behind + k] for name, k in self._energies.items()},
            "energy_kinetic": kinetic_energy(belt, velocities, belt.pul[row.INERTIA], states.speed),
            "energy_potential": potential,
            "_speed": states.speed,
            "_torque": states.torque,
            "_mean_tension": tension.mean(axis=-1),
            "_belt_speed": along.mean(axis=-1),
            "_span_tension": span_tensions(tension, pulley, belt.pul.shape[1]),
            **self._lengths_on_pulleys(states),
            **self._friction_on_pulleys(states),
            "_patches": (pulley[:, None] == self._pulleys) @ self._patches.T,
            "_power": power,
            **({"_zone_work": self._work_of_zones(channels["friction_work"])} if belt.wear else {}),
        }

    def _work_of_zones(self, work: Array) -> Array:
        """Return the work of friction in each zone, (m, zones), J, of that of bodies, (m, n)."""
        # Not a product of matrices: its rounding depends on how many samples there are at once.
        return np.asarray((work[:, None] * self._zones).sum(axis=-1))

    def _contacts_of_bodies(self, states: States) -> tuple[dict[str, Any], Array]:
        """Return the channels of contact, (m, n), of the pulley that presses each body.

        And the power with which friction drives bodies that slide, and that of all of it, (m, 2),
        W. What residual slip a body has that is held relaxes within steps, in either direction.
        Where static and kinetic friction differ, its mode says that it is held; at its limit, too.
        """
        pressed = states.contacts(row.NORMAL) > 0.0
        own, touched = pressed.argmax(axis=1)[:, None], pressed.any(axis=1)
        normal, friction, slip, sticking, mode = (
            np.take_along_axis(states.contacts(which), own, axis=1)[:, 0] * touched
            for which in (row.NORMAL, row.FRICTION, row.SLIP, row.STICKING, row.MODE)
        )
        friction *= self._force_per_impulse
        power = friction * slip
        slides = (sticking == 0.0) & ((mode != 0.0) if self._distinct else True)
        driving = (-power * slides).clip(min=0.0).sum(axis=-1)
        channels = {
            "normal_force": normal,
            "friction_force": friction,
            "slip_velocity": slip,
            "sticking": sticking,
            "pulley_index": np.where(touched, own[:, 0], -1),
        }
        return channels, np.stack([driving, np.abs(power).sum(axis=-1)], axis=-1)

    def _places_on_line(self, position: Array) -> tuple[Array, Array, Array]:
        length = self._path.length
        rounds = np.floor(position / length)
        within = np.minimum(position - rounds * length, np.nextafter(length, 0.0))
        points = self._path.at(within.ravel())
        x, y = points.position.T.reshape(2, *position.shape)
        angle = points.angle.reshape(position.shape) + rounds * self._path.total_turning
        return x, y, angle

    def _lengths_on_pulleys(self, states: States) -> dict[str, Array]:
        """Return how many bodies' lengths touch each pulley, and on how many of them it sticks.

        On a line parts of lengths count as such, and there is the angle, rad, over which a string
        is hardly pressed on a pulley.

        The friction is at its limit on the sliding arc and zero on the arc of adhesion, but for
        waves, whose mean is zero, and for the body between the two: the share of its limit is that
        of its length that slides. Counted as a whole it would make an error of first order. Where
        no body sticks there is no adhesion.
        """
        normal, friction = states.contacts(row.NORMAL), states.contacts(row.FRICTION)
        on, sticking = normal > 0.0, states.contacts(row.STICKING) > 0.0
        lengths, light = on.astype(np.float64), {}
        if self._belt.line is not None:
            parts = self._parts_on_arcs(states.joints[:, 1], self._belt.line)
            lengths = on * parts / self._belt.length
            radius = self._belt.pul[row.RADIUS, :, None]
            lightly = normal * radius < LIGHT * self._pretension * parts
            light = {"_unpressed": np.sum(lightly * parts / radius, axis=-1)}
        limit = np.where(sticking, self._mu_s, self._mu_k) * normal
        share = np.zeros_like(limit)
        np.divide(friction * self._force_per_impulse, limit, out=share, where=limit > 0.0)
        sliding = np.abs((lengths * share.clip(-1.0, 1.0)).sum(axis=-1))
        touching = lengths.sum(axis=-1)
        adhesion = np.where((on & sticking).any(axis=-1), (touching - sliding).clip(min=0.0), 0.0)
        return {"_touching": touching, "_sticking": adhesion, **light}

    def _parts_on_arcs(self, middle: Array, line: Line) -> Array:
        """Return the length of each point's part of the belt on each arc, (m, pulleys, n), m."""
        first, last = middle[:, None, :-1], middle[:, None, 1:]
        starts, arcs = line.starts[:, None], line.arcs[:, None]
        # Of the round that the point is in, as the kernels have it.
        rounds = np.floor((first - starts + self._belt.skin) / line.length)
        begin = starts + line.length * rounds
        parts: Array = (last - begin).clip(0.0, arcs) - (first - begin).clip(0.0, arcs)
        return parts

    def _friction_on_pulleys(self, states: States) -> dict[str, Array]:
        """Return friction on the belt, what it could be in full slip, and its excess, N.

        `_slip` is the sum of N s, whose sign is the direction of the slip. `_excess` has by how
        much a friction is off its limits, and the largest limit: above the one that holds it; or
        below that at rest, of a body that has no slip but does not stick: the static coefficient
        would hold it.
        """
        if not self._belt.has_friction:
            return {"_excess": np.zeros((len(states.time), 2))}
        scale, normal = self._force_per_impulse, states.contacts(row.NORMAL)
        slip = states.contacts(row.SLIP)
        friction, at_rest = states.contacts(row.FRICTION) * scale, self._mu_s * normal
        size = np.abs(friction)
        off = size - at_rest
        if self._belt.inv_tau is not None:
            forward, backward = states.contacts(row.FORWARD), states.contacts(row.BACKWARD)
            limit = np.where(friction > 0.0, forward, backward) * scale
            let_go = (slip == 0.0) & (states.contacts(row.STICKING) == 0.0)
            off = np.maximum(size - limit, np.where(let_go, at_rest - size, 0.0))
        return {
            "_friction": friction.sum(axis=-1),
            "_capacity": (self._mu_k * normal).sum(axis=-1),
            "_slip": (normal * slip).sum(axis=-1),
            "_excess": np.stack([off, at_rest], axis=-1).max(axis=(1, 2), initial=0.0),
        }

    # --- the samples so far ---------------------------------------------------------------------

    def state(self) -> Arrays:
        """Return the samples, for a checkpoint."""
        self._work_out()
        return self._samples.state()

    def restore(self, state: Arrays, belt_state: Array) -> int:
        """Take over the samples of another run of the scenario; return how many these are.

        `belt_state` is a state of the belt, any: of it a sample is made that theirs are to be like.
        """
        one = self._worked_out([self._copy(0.0, belt_state)])
        like = {name: values[0] for name, values in one.items()}
        self._samples.restore(state, like)
        self._checked = len(self._samples)
        return self._checked

    def observe(self) -> SimulationResult:
        """Return the samples before the first that is not finite, and what follows from them."""
        self._work_out()
        samples, sound = self._samples, self._samples.n_finite()
        names = samples.names
        seen = {n: samples.channel(n, sound) for n in names if n.startswith(("energy", "_"))}
        time = samples.channel("time", sound) if names else np.zeros(0)
        run = BeltSamples(self._scenario, self._belt.length, self._pretension, time, seen)
        quantities = quantities_of(run)
        return SimulationResult(
            channels={"time": time}
            | {name: samples.channel(name, sound) for name in CHANNELS if name in names},
            transitions=transitions_of(run),
            quantities=quantities,
            checks=checks_of(run),
            non_finite_tail=sound < len(samples),
            warnings=warnings_of(run, quantities),
        )


def _tension(force: Array, shape: Shape) -> Array:
    """Return the size of the joints' forces, (m, 2, n), N; negative in compression."""
    fx, fy = force[:, 0], force[:, 1]
    along = fx * (shape.cos + before(shape.cos)) + fy * (shape.sin + before(shape.sin))
    tension: Array = np.copysign(np.sqrt(fx * fx + fy * fy), along)
    return tension
