"""An independent reference for a belt drive made of rigid links, written to be read.

The model is that of K. Kubas, "A two-dimensional discrete model for dynamic analysis of belt
transmission with dry friction" (2014): a closed ring of thin links joined by spring-dampers, in
penalty contact with round pulleys. Nothing here is fast and nothing is shared with the package.

A link on a pulley slips with its velocity along the rim times kappa, which makes up for the corners
to its neighbours, and takes kappa T of the friction T on the rim; without ``wrap`` kappa is 1.

Axes: x and y in the plane, Z out of it, angles and torques positive counter-clockwise.
Arrays over links have ``n`` entries, arrays over pulleys ``n_pulleys``. A link may touch one
pulley at a time. Joint ``k`` stands between link ``k - 1`` (cyclic) and link ``k``.

Energy:  d(kinetic + potential)/dt = input - joint - bending - contact - friction.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

Array = np.ndarray
NO_PULLEY = -1


# --- parameters and results ----------------------------------------------------------------------


@dataclass(frozen=True)
class Belt:
    """Parameters of a belt drive; what is given per pulley may be one number for all of them.

    A link has the mass ``m = rho l`` and the inertia ``m l^2 / 12`` about its centre.
    """

    n: int  # links
    l: float  # noqa: E741  length of a link
    rho: float  # mass per length
    EA: float  # axial section stiffness: c = EA / l
    centres: Array  # (n_pulleys, 2)
    radii: Array  # (n_pulleys,)
    inertias: Array  # (n_pulleys,)
    c2: float | Array  # contact stiffness, linear term
    c1: float | Array = 0.0  # contact stiffness, quadratic term
    b_c: float | Array = 0.0  # contact damping
    p_max: float | Array = 1e-3  # penetration of full contact damping
    b_joint: float | None = None  # damping of a joint; None: from the section
    b_section: float = 0.0  # axial section damping: b = b_section / l
    EI: float = 0.0  # bending stiffness of the section: c_tor = EI / l
    b_tor: float = 0.0  # bending damping of a joint
    wrap: bool = True  # kappa of the corners; False: 1, as published
    turns: int = 1  # full turns of the links round the ring: +1 counter-clockwise, -1 clockwise
    gravity: tuple[float, float] = (0.0, 0.0)
    law: str = "set-valued"  # or "regularised", "creep"
    tau: float = 1e-4  # capture time of the set-valued law
    mu_s: float | Array = 0.0  # the regularised and creep laws only
    mu_k: float | Array = 0.0
    dv: float = 1e-5
    delta_max: float = 1e-4  # largest creep of the creep law
    torque: Callable[[float, Array, Array], Array] | None = None  # M(t, theta, omega), None: 0
    prescribed: dict[int, Callable[[float], float]] = field(default_factory=dict)  # alpha_j(t)

    @property
    def m(self) -> float:
        return self.rho * self.l

    @property
    def inertia(self) -> float:
        return self.m * self.l**2 / 12.0

    @property
    def c(self) -> float:
        return self.EA / self.l

    @property
    def b(self) -> float:
        return self.b_section / self.l if self.b_joint is None else self.b_joint

    @property
    def c_tor(self) -> float:
        return self.EI / self.l

    @property
    def n_pulleys(self) -> int:
        return len(self.radii)

    def of(self, name: str, j: int) -> float:
        """The parameter ``name`` at pulley ``j``, given per pulley or once for all."""
        return float(np.broadcast_to(getattr(self, name), (self.n_pulleys,))[j])


@dataclass(frozen=True)
class Powers:
    """The losses by kind, and what the torques on the pulleys bring in."""

    joint: float  # sum b (d|d_k|/dt)^2
    bending: float  # sum b_tor (w_k - w_{k-1})^2
    contact: float  # sum (N - c1 p^2 - c2 p) pdot
    friction: float  # sum T_i s_i
    input: float  # sum M_j omega_j, with the torque that a prescribed speed needs


@dataclass(frozen=True)
class Accelerations:
    """Accelerations and what made them; the arrays N to pulley run over the links."""

    ax: Array
    ay: Array
    aphi: Array
    alpha: Array  # of the pulleys
    N: Array
    T: Array
    slip: Array  # 0 where there is no contact
    p: Array  # penetration, 0 where there is no contact
    pulley: Array  # index of the pulley touched, NO_PULLEY where there is none
    tension: Array  # F_k, over the joints
    torque: Array  # M_j, over the pulleys; with prescribed speed I alpha + R sum T
    powers: Powers


@dataclass(frozen=True)
class Contact:
    """Link ``i`` on pulley ``j``."""

    i: int
    j: int
    rhat: Array
    t: Array
    p: float
    pdot: float
    N: float
    N_elastic: float
    slip: float
    turning: float  # v . dt/dt
    kappa: float
    kappa_gain: float  # dkappa/dt v . t


# --- joints --------------------------------------------------------------------------------------


def cross(a: Array, b: Array) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


def half_link(belt: Belt, phi: float) -> Array:
    """From the centre of a link to its + end: (l/2) (cos phi, sin phi)."""
    return 0.5 * belt.l * np.array([np.cos(phi), np.sin(phi)])


def gap(belt: Belt, k: int, P: Array, phi: Array) -> Array:
    """d_k = L_k - R_{k-1}, with the ends L = P - half and R = P + half."""
    before = k - 1  # -1 is the last link: the ring is closed
    return (P[k] - half_link(belt, phi[k])) - (P[before] + half_link(belt, phi[before]))


def gap_rate(belt: Belt, k: int, phi: Array, V: Array, w: Array) -> Array:
    """The time derivative of d_k: the ends move with v +- w Z x half."""
    before = k - 1
    here, there = half_link(belt, phi[k]), half_link(belt, phi[before])
    left = V[k] - w[k] * np.array([-here[1], here[0]])
    right = V[before] + w[before] * np.array([-there[1], there[0]])
    return left - right


def bend(belt: Belt, k: int, phi: Array) -> float:
    """phi_k - phi_{k-1}; at the closing joint (k = 0) without the jump of 2 pi turns."""
    jump = 2.0 * np.pi * belt.turns if k == 0 else 0.0
    return float(phi[k] - phi[k - 1] + jump)


def stretch_force(belt: Belt, d: Array, d_rate: Array) -> tuple[float, Array, float]:
    """F = c |d| + b d|d|/dt, its direction d/|d| and d|d|/dt = d_rate . d/|d|.

    At d = 0 there is no direction and no force.
    """
    size = float(np.hypot(d[0], d[1]))
    if size == 0.0:
        return 0.0, np.zeros(2), 0.0
    direction = d / size
    rate = float(d_rate @ direction)
    return belt.c * size + belt.b * rate, direction, rate


def add_stretching(
    belt: Belt, P: Array, phi: Array, V: Array, w: Array, force: Array, moment: Array
) -> tuple[Array, float]:
    """Add the forces of the joints at the ends of the links; the tensions and the loss.

    -F_k dhat acts on link k at -half, +F_k dhat on link k - 1 at +half.
    """
    tension, loss = np.zeros(belt.n), 0.0
    for k in range(belt.n):
        d, d_rate = gap(belt, k, P, phi), gap_rate(belt, k, phi, V, w)
        tension[k], direction, rate = stretch_force(belt, d, d_rate)
        pull = tension[k] * direction
        force[k] -= pull
        force[k - 1] += pull
        moment[k] += cross(-half_link(belt, phi[k]), -pull)
        moment[k - 1] += cross(half_link(belt, phi[k - 1]), pull)
        loss += belt.b * rate**2
    return tension, loss


def add_bending(belt: Belt, phi: Array, w: Array, moment: Array) -> float:
    """Add c_tor (phi_k - phi_{k-1}) + b_tor (w_k - w_{k-1}) to k - 1, and its opposite to k."""
    loss = 0.0
    for k in range(belt.n):
        rate = w[k] - w[k - 1]
        torque = belt.c_tor * bend(belt, k, phi) + belt.b_tor * rate
        moment[k] -= torque
        moment[k - 1] += torque
        loss += belt.b_tor * rate**2
    return loss


# --- contact -------------------------------------------------------------------------------------


def smooth(d: float) -> float:
    d = min(max(d, 0.0), 1.0)
    return d * d * (3.0 - 2.0 * d)


def normal_force(belt: Belt, j: int, p: float, pdot: float) -> tuple[float, float]:
    """N = c1 p^2 + c2 p + delta(p) b_c pdot, never negative; and its elastic part."""
    if p <= 0.0:
        return 0.0, 0.0
    elastic = belt.of("c1", j) * p**2 + belt.of("c2", j) * p
    damped = smooth(p / belt.of("p_max", j)) * belt.of("b_c", j) * pdot
    return max(elastic + damped, 0.0), elastic


def corners(belt: Belt, i: int, phi: Array, w: Array) -> tuple[float, float]:
    """kappa = 1 + (a^2 + b^2)/24 of the bends at both ends of link i, and its rate."""
    if not belt.wrap:
        return 1.0, 0.0
    kappa, rate = 1.0, 0.0
    for k in (i, (i + 1) % belt.n):
        kappa += bend(belt, k, phi) ** 2 / 24.0
        rate += 2.0 * bend(belt, k, phi) * float(w[k] - w[k - 1]) / 24.0
    return kappa, rate


def contact(
    belt: Belt, i: int, j: int, P: Array, phi: Array, V: Array, w: Array, omega: Array
) -> Contact | None:
    """The kinematics and the normal force of link i on pulley j; None where they are apart.

    rhat = (P - C)/r,  t = Z x rhat,  p = R - r,  pdot = -v . rhat,  s = omega R - kappa v . t.
    rhat turns with v_t/r, so dt/dt = -(v_t/r) rhat and v . dt/dt = -v_n v_t/r.
    """
    arm = P[i] - belt.centres[j]
    r = float(np.hypot(arm[0], arm[1]))
    p = float(belt.radii[j]) - r
    if p <= 0.0:
        return None
    rhat = arm / r
    t = np.array([-rhat[1], rhat[0]])
    v_n, v_t = float(V[i] @ rhat), float(V[i] @ t)
    N, elastic = normal_force(belt, j, p, -v_n)
    kappa, kappa_rate = corners(belt, i, phi, w)
    slip = float(omega[j] * belt.radii[j]) - kappa * v_t
    turning = -v_n * v_t / r
    along = kappa_rate * v_t
    return Contact(i, j, rhat, t, p, -v_n, N, elastic, slip, turning, kappa, along)


def contacts(belt: Belt, P: Array, phi: Array, V: Array, w: Array, omega: Array) -> list[Contact]:
    """All contacts; a link on two pulleys at once is refused."""
    pairs = [(i, j) for i in range(belt.n) for j in range(belt.n_pulleys)]
    touches = [
        c for c in (contact(belt, i, j, P, phi, V, w, omega) for i, j in pairs) if c is not None
    ]
    if len({c.i for c in touches}) < len(touches):
        raise ValueError("a link touches two pulleys")
    return touches


# --- friction ------------------------------------------------------------------------------------


def beta(x: float) -> float:
    x = min(x, 1.0)
    return 0.5 * (3.0 * x - x**3)


def beyond(belt: Belt, j: int, speed: float) -> float:
    """mu above dv: from mu_s to mu_k between dv and 1.5 dv, then mu_k."""
    d = (speed - belt.dv) / (0.5 * belt.dv)
    mu_s, mu_k = belt.of("mu_s", j), belt.of("mu_k", j)
    return mu_s + (mu_k - mu_s) * smooth(d)


def mu_regularised(belt: Belt, j: int, slip: float) -> float:
    speed = abs(slip)
    if speed > belt.dv:
        return beyond(belt, j, speed)
    return belt.of("mu_s", j) * beta(speed / belt.dv)


def mu_creep(belt: Belt, j: int, slip: float, h: float) -> float:
    """(1 - beta) mu_1 + beta mu_s below dv; beta of |s|/dv, mu_1 = mu_s beta(|s| h/delta_max)."""
    speed = abs(slip)
    if speed > belt.dv:
        return beyond(belt, j, speed)
    mu_s, share = belt.of("mu_s", j), beta(speed / belt.dv)
    mu_1 = mu_s * beta(speed * h / belt.delta_max)
    return (1.0 - share) * mu_1 + share * mu_s


def friction_of_slip(belt: Belt, c: Contact, h: float | None) -> float:
    """T = mu(|s|) N sign(s), the laws that know the force from the slip."""
    if belt.law == "regularised":
        mu = mu_regularised(belt, c.j, c.slip)
    elif belt.law == "creep":
        if h is None:
            raise ValueError("the creep law needs the step h")
        mu = mu_creep(belt, c.j, c.slip, h)
    else:
        raise ValueError(f"unknown law {belt.law!r}")
    return float(mu * c.N * np.sign(c.slip))


def friction_set_valued(belt: Belt, c: Contact, alpha: float, free: Array, mu: Array) -> float:
    """T(alpha) = clip(m/kappa^2 (R alpha - a + s/tau), -mu_1 N, mu_0 N).

    a = kappa (F . t/m + v . dt/dt) + dkappa/dt v . t is the rate of kappa v . t under the force F,
    ``free``, of the link without friction. kappa T adds kappa^2 T/m to it. Where nothing clips,
    ds/dt = -s/tau.
    """
    a = c.kappa * (float(free[c.i] @ c.t) / belt.m + c.turning) + c.kappa_gain
    wanted = belt.m / c.kappa**2 * (float(belt.radii[c.j]) * alpha - a + c.slip / belt.tau)
    forward, backward = mu[:, c.i] * c.N
    return float(min(max(wanted, -backward), forward))


def bisect(g: Callable[[float], float], low: float, high: float) -> float:
    """The root of an increasing g, until no number lies between the two bounds."""
    while True:
        middle = low + 0.5 * (high - low)
        if not low < middle < high:
            return low if abs(g(low)) < abs(g(high)) else high
        value = g(middle)
        if value == 0.0:
            return middle
        low, high = (low, middle) if value > 0.0 else (middle, high)


def solve_alpha(
    belt: Belt, j: int, touching: list[Contact], M: float, free: Array, mu: Array
) -> float:
    """alpha of I alpha = M - R sum T_i(alpha); the left side less the right one increases."""
    R, inertia = float(belt.radii[j]), float(belt.inertias[j])

    def g(alpha: float) -> float:
        total = sum(friction_set_valued(belt, c, alpha, free, mu) for c in touching)
        return inertia * alpha - M + R * total

    reach = R * sum(float(np.max(mu[:, c.i])) * c.N for c in touching)
    if reach == 0.0:
        return M / inertia
    return bisect(g, (M - 1.01 * reach) / inertia, (M + 1.01 * reach) / inertia)


def turn_pulley(
    belt: Belt,
    j: int,
    t: float,
    M: float,
    touching: list[Contact],
    free: Array,
    mu: Array | None,
    h: float | None,
) -> tuple[float, float, list[float]]:
    """alpha_j, the torque M_j and the friction forces of the links that touch pulley j."""
    R, inertia = float(belt.radii[j]), float(belt.inertias[j])
    given = belt.prescribed[j](t) if j in belt.prescribed else None
    if belt.law == "set-valued":
        if mu is None:
            raise ValueError("the set-valued law needs mu, one per link")
        alpha = solve_alpha(belt, j, touching, M, free, mu) if given is None else given
        T = [friction_set_valued(belt, c, alpha, free, mu) for c in touching]
    else:
        T = [friction_of_slip(belt, c, h) for c in touching]
        alpha = (M - R * sum(T)) / inertia if given is None else given
    return alpha, (M if given is None else inertia * alpha + R * sum(T)), T


# --- the whole drive -----------------------------------------------------------------------------


def accelerations(
    belt: Belt,
    t: float,
    x: Array,
    y: Array,
    phi: Array,
    vx: Array,
    vy: Array,
    w: Array,
    theta: Array,
    omega: Array,
    mu: float | Array | None = None,
    h: float | None = None,
) -> Accelerations:
    """Newton's equations of the links and the pulleys.

    m a = joints + gravity + N rhat + kappa T t,   (m l^2/12) aphi = joints,
    I alpha = M - R sum T.
    ``mu``: for T > 0 and T < 0 one number per link (or one for all), set-valued law;
    ``h``: the step, creep law.
    """
    P, V = np.column_stack([x, y]), np.column_stack([vx, vy])
    limits = None if mu is None else np.broadcast_to(np.asarray(mu, dtype=float), (2, belt.n))
    free = np.tile(belt.m * np.asarray(belt.gravity, dtype=float), (belt.n, 1))
    moment = np.zeros(belt.n)
    tension, joint_loss = add_stretching(belt, P, phi, V, w, free, moment)
    bending_loss = add_bending(belt, phi, w, moment)
    touches = contacts(belt, P, phi, V, w, omega)
    for c in touches:
        free[c.i] += c.N * c.rhat

    force, T = free.copy(), np.zeros(belt.n)
    alpha, torque = np.zeros(belt.n_pulleys), np.zeros(belt.n_pulleys)
    if belt.torque is not None:
        torque[:] = belt.torque(t, theta, omega)
    for j in range(belt.n_pulleys):
        touching = [c for c in touches if c.j == j]
        alpha[j], torque[j], on_links = turn_pulley(
            belt, j, t, torque[j], touching, free, limits, h
        )
        for c, T_i in zip(touching, on_links, strict=True):
            T[c.i] = T_i
            force[c.i] += c.kappa * T_i * c.t

    powers = Powers(
        joint=joint_loss,
        bending=bending_loss,
        contact=sum((c.N - c.N_elastic) * c.pdot for c in touches),
        friction=float(sum(T[c.i] * c.slip for c in touches)),
        input=float(torque @ omega),
    )
    return Accelerations(
        ax=force[:, 0] / belt.m,
        ay=force[:, 1] / belt.m,
        aphi=moment / belt.inertia,
        alpha=alpha,
        N=over_links(belt, {c.i: c.N for c in touches}),
        T=T,
        slip=over_links(belt, {c.i: c.slip for c in touches}),
        p=over_links(belt, {c.i: c.p for c in touches}),
        pulley=over_links(belt, {c.i: c.j for c in touches}, NO_PULLEY).astype(int),
        tension=tension,
        torque=torque,
        powers=powers,
    )


def over_links(belt: Belt, values: dict[int, float], elsewhere: float = 0.0) -> Array:
    """An array over the links from the values of those that touch."""
    return np.array([values.get(i, elsewhere) for i in range(belt.n)], dtype=float)


def potential(belt: Belt, x: Array, y: Array, phi: Array) -> float:
    """sum c d^2/2 + c_tor bend^2/2 - m g . P + c1 p^3/3 + c2 p^2/2."""
    P = np.column_stack([x, y])
    energy = 0.0
    for k in range(belt.n):
        d = gap(belt, k, P, phi)
        energy += 0.5 * belt.c * float(d @ d) + 0.5 * belt.c_tor * bend(belt, k, phi) ** 2
        energy -= belt.m * float(P[k] @ np.asarray(belt.gravity, dtype=float))
        for j in range(belt.n_pulleys):
            arm = P[k] - belt.centres[j]
            p = max(float(belt.radii[j]) - float(np.hypot(arm[0], arm[1])), 0.0)
            energy += belt.of("c1", j) * p**3 / 3.0 + belt.of("c2", j) * p**2 / 2.0
    return energy


# --- motion --------------------------------------------------------------------------------------


def pack(*parts: Array) -> Array:
    return np.concatenate([np.asarray(part, dtype=float) for part in parts])


def unpack(belt: Belt, state: Array) -> list[Array]:
    sizes = [belt.n] * 6 + [belt.n_pulleys] * 2
    return np.split(state, np.cumsum(sizes)[:-1])


def integrate(
    belt: Belt,
    y0: Array,
    times: Array,
    rtol: float,
    atol: float,
    mu: float | Array,
) -> Array:
    """The states at ``times`` (one row each) from ``y0`` at ``times[0]``, by DOP853."""

    def rate(t: float, state: Array) -> Array:
        x, y, phi, vx, vy, w, theta, omega = unpack(belt, state)
        a = accelerations(belt, t, x, y, phi, vx, vy, w, theta, omega, mu=mu)
        return pack(vx, vy, w, a.ax, a.ay, a.aphi, omega, a.alpha)

    span = (float(times[0]), float(times[-1]))
    solution = solve_ivp(rate, span, y0, method="DOP853", t_eval=times, rtol=rtol, atol=atol)
    if not solution.success:
        raise RuntimeError(solution.message)
    return solution.y.T
