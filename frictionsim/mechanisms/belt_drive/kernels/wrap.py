"""The wrap factor of each body in contact: what bending round a pulley does to its velocity.

A belt of the pitch l that lies on a rim follows an arc; a chain of rigid bodies follows its chords.
Joints that turn by dphi bring the centres of their bodies closer together, by dphi^2/8 of half a
body on either side, but the arc that these halves stand for is longer than its chord by dphi^2/24:
bodies that wrap slow down by dphi^2/12 against the material line. Friction that compares the rim
with the velocity v_t of a body so meets a slip that no belt has. With the factor of its own joints,

    kappa = 1 + (dphi_before^2 + dphi_after^2)/24,

kappa v_t is the velocity of the material on the arc: on a straight span, and half way round the
corner where it begins, it is that of the same material. The slip is

    s = R omega - kappa v_t

and the force that has the power -T s acts with kappa T on the body and with -R T on the pulley: the
energy closes for any kappa. Where the slip is given a body yields to T with the mass m/kappa^2.
Without factors, None, the slip is that of the body's centre, as published.

What else was tried, on the belt of the paper at 150 bodies, where fine meshes have a slip of 0.91
of the elastic creep, and 0.90 with bending; an arc without load, 0.93 and 0.88 of the tension of
its spans:

    without, with bending                     slip            arc over span without load
    this factor                               0.965, 1.056    1.02, 1.07
    1 + (dphi_before + dphi_after)^2/48       0.900, 0.992
    1 + max(dphi_before, dphi_after)^2/12     1.392, 1.318
    joints longer by l dphi^2/12, as arcs     1.086, 1.057    1.16
    joints longer by R dphi^3/12              fails, 1.062    0.91 with bending
    two normal forces, at +-l/sqrt(6)         0.629

The second one is worse at 300 bodies, 0.868 and 0.869 where this one has 0.883 and 0.872. Joints
that are longer where they are bent pull at the angles of the bodies with T l dphi/6, a bending
stiffness below zero. Bodies that touch at two points have the right perimeter, but the leading
point meets the rim at an angle of l/(2.4 R), as on a contact that is so much softer; and friction
at both points would couple the contacts, which now have one scalar equation a pulley.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel
from frictionsim.mechanisms.belt_drive.kernels.layout import ANGLE, SPIN, aligned_zeros

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.effects.base import Chain

    Array = npt.NDArray[np.float64]
    Bodies = npt.NDArray[np.uint64]


class WrapFactors(NamedTuple):
    """The wrap factors of a state, with workspace.

    Attributes
    ----------
    angle, product : (width,)
        Of each joint: the angle that it is bent by, rad, and its square, or its rate times it.
    factor : (contacts,)
        kappa of the body of each candidate.
    mass_ratio : (contacts,)
        1/kappa^2, of the mass that yields to friction over that of the body.
    rate : (contacts,)
        The time derivative of kappa, 1/s; where it is needed.
    """

    angle: "Array"
    product: "Array"
    factor: "Array"
    mass_ratio: "Array"
    rate: "Array"


def wrap_factors(width: int, contacts: int) -> WrapFactors:
    """Return workspace for rows of joints and for so many candidates."""
    angle, product = aligned_zeros(2, width)
    factor, mass_ratio, rate = aligned_zeros(3, contacts)
    return WrapFactors(angle, product, factor, mass_ratio, rate)


@inline_kernel
def update_wrap_factors(
    wrap: WrapFactors | None, body: "Bodies", count: int, chain: "Chain", kinematics: "Array"
) -> None:
    """Write the factors of so many candidates."""
    if wrap is not None:
        n, phi = chain.bodies, kinematics[ANGLE]
        angle, product, factor, ratio = wrap.angle, wrap.product, wrap.factor, wrap.mass_ratio
        for k in range(1, n):
            angle[k] = phi[k] - phi[k - 1]
        angle[0] = phi[0] - phi[n - 1] + chain.total_turning
        angle[n] = angle[0]
        for k in range(n + 1):
            product[k] = angle[k] * angle[k]
        for s in range(count):
            factor[s] = 1.0 + (product[body[s]] + product[body[s] + 1]) * (1.0 / 24.0)
        for s in range(count):
            ratio[s] = 1.0 / (factor[s] * factor[s])


@inline_kernel
def update_wrap_rates(
    wrap: WrapFactors | None, body: "Bodies", count: int, chain: "Chain", kinematics: "Array"
) -> None:
    """Write the rates of the factors that `update_wrap_factors` has written."""
    if wrap is not None:
        n, spin = chain.bodies, kinematics[SPIN]
        angle, product, rate = wrap.angle, wrap.product, wrap.rate
        for k in range(1, n):
            product[k] = angle[k] * (spin[k] - spin[k - 1])
        product[0] = angle[0] * (spin[0] - spin[n - 1])
        product[n] = product[0]
        for s in range(count):
            rate[s] = (product[body[s]] + product[body[s] + 1]) * (1.0 / 12.0)


@inline_kernel
def times_factor(wrap: WrapFactors | None, s: int, value: float) -> float:
    """Return kappa times a value: a velocity on the rim from one of the body, or its force."""
    if wrap is not None:
        return value * wrap.factor[s]
    return value


@inline_kernel
def factor_rate(wrap: WrapFactors | None, s: int) -> float:
    """Return the rate of kappa that `update_wrap_rates` has written, 1/s."""
    if wrap is not None:
        return wrap.rate[s]
    return 0.0


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
