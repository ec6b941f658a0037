"""The wrap factor of each body in contact: the effect of bending round a pulley on its velocity.

A belt of the pitch l that lies on a rim follows an arc; a chain of rigid bodies follows its chords.
Joints that turn by dphi bring the centres of their bodies closer together, by dphi^2/8 of half a
body on either side, but the arc that these halves stand for is longer than its chord by dphi^2/24:
bodies that wrap slow down by dphi^2/12 against the material line. Friction that compares the rim
with the velocity v_t of a body sees a slip that no belt has. With the factor of its own joints,

    kappa = 1 + (dphi_before^2 + dphi_after^2)/24,

kappa v_t is the velocity of the material on the arc: on a straight span, and half way round the
corner where it begins, it is that of the same material. The slip is

    s = R omega - kappa v_t

and the force that has the power -T s acts with kappa T on the body and with -R T on the pulley: the
energy closes for any kappa. Where the slip is given a body yields to T with the mass m/kappa^2.
Without factors, None, the slip is that of the body's centre, as published.
"""

import numpy as np

from frictionsim.mechanisms.belt_drive.kernels.contacts import run_end
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel, loop_kernel
from frictionsim.mechanisms.belt_drive.kernels.system import (
    ANGLE,
    BEND,
    BEND_RATE,
    SPIN,
    Array,
    Bodies,
    Chain,
    Contacts,
    WrapFactors,
    aligned_zeros,
    full_vectors,
)


def wrap_factors(contacts: int) -> WrapFactors:
    """Return arrays for the factors of a number of candidates."""
    factor, mass_ratio = aligned_zeros(2, contacts)
    return WrapFactors(factor, mass_ratio)


@loop_kernel
def differences(bodies: int, body_values: Array, joint_values: Array) -> None:
    """Write the difference of the bodies before and behind each joint but the first."""
    for k in range(full_vectors(bodies)):
        joint_values[k] = body_values[k + 1] - body_values[k]


@inline_kernel
def bend_joints(chain: Chain, kinematics: Array, workspace: Array) -> None:
    """Write BEND, by how much each joint is bent."""
    n, bend, angle = chain.bodies, workspace[BEND], kinematics[ANGLE]
    differences(n, angle, bend[1:])
    bend[0] = bend[n] = angle[0] - angle[n - 1] + chain.total_turning


@inline_kernel
def bend_rates(chain: Chain, kinematics: Array, workspace: Array) -> None:
    """Write BEND_RATE: how fast each joint is bent."""
    n, bend_rate, spin = chain.bodies, workspace[BEND_RATE], kinematics[SPIN]
    differences(n, spin, bend_rate[1:])
    bend_rate[0] = bend_rate[n] = spin[0] - spin[n - 1]


@loop_kernel
def factor_rows(body: Bodies, count: int, bend: Array, factor: Array, ratio: Array) -> None:
    """Write the factors and the mass ratios of the first `count` candidates."""
    start = 0
    while start < count:
        end = run_end(body, start, count)
        for s in range(np.uint64(start), np.uint64(end)):
            i = s + (body[start] - np.uint64(start))
            before, after = bend[i], bend[i + np.uint64(1)]
            kappa = 1.0 + (before * before + after * after) * (1.0 / 24.0)
            factor[s], ratio[s] = kappa, 1.0 / (kappa * kappa)
        start = end


@inline_kernel
def update_wrap_factors(wrap: WrapFactors | None, contacts: Contacts, workspace: Array) -> None:
    """Write the factors of all candidates; reads BEND."""
    if wrap is not None:
        count, bend = contacts.offsets[-1], workspace[BEND]
        factor_rows(contacts.body, count, bend, wrap.factor, wrap.mass_ratio)


@inline_kernel
def update_bend_rates(
    wrap: WrapFactors | None, chain: Chain, kinematics: Array, workspace: Array
) -> None:
    """Write BEND_RATE where the rates of factors depend on it."""
    if wrap is not None:
        bend_rates(chain, kinematics, workspace)


@inline_kernel
def wrap_rate(wrap: WrapFactors | None, i: int, bend: Array, bend_rate: Array) -> float:
    """Return the rate of kappa of body i, 1/s."""
    if wrap is not None:
        after = i + np.uint64(1)
        return (bend[i] * bend_rate[i] + bend[after] * bend_rate[after]) * (1.0 / 12.0)
    return 0.0


@inline_kernel
def times_factor(wrap: WrapFactors | None, s: int, value: float) -> float:
    """Return kappa times a value: a velocity on the rim from one of the body, or its force."""
    if wrap is not None:
        return value * wrap.factor[s]
    return value


@inline_kernel
def over_factor(wrap: WrapFactors | None, s: int, value: float) -> float:
    """Return a value over kappa: a velocity of the body from one on the rim."""
    if wrap is not None:
        return value / wrap.factor[s]
    return value


@inline_kernel
def mass_ratio(wrap: WrapFactors | None, s: int) -> float:
    """Return the mass that yields to friction over that of the body."""
    if wrap is not None:
        return wrap.mass_ratio[s]
    return 1.0
