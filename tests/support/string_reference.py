"""A guided string in plain Python, written from its equations alone, with a smoothed friction."""

from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from tests.support.belt_scenarios import Array, names_of, path_of, torques


class Arc(NamedTuple):
    """An arc of a pitch line from a to b, m, passed in the sense of a pulley of some radius."""

    a: float
    b: float
    sense: int
    radius: float


def arcs_of(scenario: Any) -> tuple[list[Arc], float]:
    """Return the arcs in the order of the pulleys, and the length of the line, m."""
    path, pulleys = path_of(scenario), scenario.mechanism.pulleys
    at, arcs = 0.0, []
    for k, span in enumerate(path.spans):
        j = (k + 1) % len(pulleys)
        at += float(np.hypot(*np.subtract(span.end, span.start)))
        length = abs(path.arcs[j].wrap_angle) * pulleys[j].radius
        sense = 1 if path.arcs[j].wrap_angle > 0 else -1
        arcs.append(Arc(at, at + length, sense, pulleys[j].radius))
        at += length
    return [arcs[-1], *arcs[:-1]], at


def overlap(low: Array, high: Array, arc: Arc, length: float) -> Array:
    """Return how much of low to high is on an arc, on whatever round."""
    rounds = np.arange(-2, 3)[:, None] * length
    return np.clip(
        np.minimum(high, arc.b + rounds) - np.maximum(low, arc.a + rounds), 0.0, None
    ).sum(axis=0)


def smoothed(mu: float, slip: Array, speed: float) -> Array:
    """Return the coefficient of friction of a smoothed law with mu_s = mu_k = mu (Threlfall)."""
    x = np.abs(slip) / speed
    return mu * np.where(x < 1.0, 0.5 * (3.0 * x - x**3), 1.0) * np.sign(slip)


def end_state(scenario: Any) -> Array:
    """Return the state at the end of a run: positions, velocities, angles and speeds."""
    belt, friction = scenario.mechanism.belt, scenario.effects.belt_friction
    arcs, length = arcs_of(scenario)
    n, m = belt.bodies, len(arcs)
    rest = length / n / (1.0 + (belt.pretension or 0.0) / belt.axial_rigidity)
    mass, c = belt.mass_per_length * rest, belt.axial_rigidity / rest
    damper = scenario.effects.axial_damping
    b = 0.0 if damper is None else damper.coefficient / (1.0 if damper.basis == "joint" else rest)
    data, names = scenario.to_dict(), names_of(scenario)
    inertia = np.array([p.inertia for p in scenario.mechanism.pulleys])

    def rates(t: float, state: Array) -> Array:
        s, v = state[:n], state[n : 2 * n]
        omega = state[2 * n + m :]
        before = np.append(s[-1] - length, s[:-1])
        tension = c * (s - before - rest) + b * (v - np.roll(v, 1))
        force = np.roll(tension, -1) - tension
        moment = torques(data, t, omega)
        after = np.append(s[1:], s[0] + length)
        low, high = 0.5 * (before + s), 0.5 * (s + after)
        pull = 0.5 * (tension + np.roll(tension, -1)) - mass / (high - low) * v**2
        for j, arc in enumerate(arcs):
            normal = np.maximum(pull * overlap(low, high, arc, length) / arc.radius, 0.0)
            own = friction.pulleys.get(names[j], friction)
            slip = arc.radius * omega[j] - arc.sense * v
            rub = smoothed(own.mu_k, slip, friction.transition_speed) * normal
            force += arc.sense * rub
            moment[j] -= arc.radius * np.sum(rub)
        return np.concatenate([v, force / mass, omega, moment / inertia])

    start = np.concatenate([(np.arange(n) + 0.5) * length / n, np.zeros(n + 2 * m)])
    end = scenario.solver.duration
    done = solve_ivp(rates, (0.0, end), start, method="DOP853", rtol=1e-9, atol=1e-11)
    assert done.success
    return np.asarray(done.y[:, -1])
