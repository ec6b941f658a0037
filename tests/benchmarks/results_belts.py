"""Belts of bodies against a string: wrap factors, the depth of the contact, Kubas 2014.

In the mean the torques balance, T1 - T2 = M/R. A string creeps by (T1 - T2)/(EA + T1), and has the
tension of the tight span where it sticks to the driver; without load it has that of its spans
everywhere. The limit of fine meshes is not that string: bodies that press themselves into a soft
rim enter it at an angle.
"""

from itertools import pairwise
from math import degrees, log, log2, sqrt
from typing import Any

import numpy as np

import frictionsim as fs
from frictionsim.results import Record
from tests.benchmarks.results_common import (
    RESULTS,
    Table,
    arc_over_span,
    command,
    moreau,
    quantity_of,
    slip,
    solve,
    tensions_of,
    warning_on,
    where_it_sticks,
    write,
)
from tests.support.belt_closed_forms import SECTION_4, slip_over_creep
from tests.support.belt_scenarios import shipped
from tests.support.second_way_belt import upper_and_lower

BENDING = ("with", "without")
# The resistance goes on with the speed: so coarse meshes have one, too.
LOAD = (
    "drive.driven.torque={speed = [-251.327412, 251.327412], value = [150.0, -150.0]}",
    "output.interval=1e-3",
)
IDLE = (
    "drive.driver={speed = {time = [0.0, 0.1], value = [0.0, -25.0]}}",
    "drive.driven.torque={time = [0.0], value = [0.0]}",
    "output.interval=1e-3",
)
RECORDED = "output.channels=['pulley_speed', 'pulley_index', 'sticking', 'tension']"


def bent(bending: str, bodies: int, duration: float, *overrides: str) -> Record:
    """Run `belt_drive` with bending or without."""
    without = () if bending == "with" else ("bending",)
    return moreau("belt_drive", bodies, f"solver.duration={duration}", *overrides, without=without)


# Wrap factors

WRAPPED = (60, 100, 150, 300, 600, 1200)  # bodies
MODELS = ("polygon", "corrected")
# Loaded and without load, s: enough of a fine mesh passes in less time.
DURATIONS, FINE, OF_FINE = (2.0, 2.0), 1200, (1.2, 0.8)
RATIO, OFF = "slip over creep", "off its limit [%]"
STUCK = "tension where it sticks to the driver, over T1"


def wrap() -> None:
    """Write the effect of the wrap factor of the bodies."""
    families = {
        (bending, model): [_wrapped(model, bending, count) for count in WRAPPED]
        for bending in reversed(BENDING)
        for model in MODELS
    }
    rows = [row for family in families.values() for row in family]
    above = [
        "`belt_drive` with its resistance continued beyond 8 pi rad/s, and without load behind a"
        " driver of 25 rad/s; fixed steps (`moreau`). `polygon` takes the slip from the velocity"
        " of a body's centre, `corrected` from that times its wrap factor. The torque asks for"
        " T1 - T2 = 555.56 N; a string without mass, bending or depth has T1 = 835.7 N, T2 ="
        " 280.1 N, and 1 in each of the ratios. The limit of the slip is that of `corrected` at"
        " the two finest meshes, extrapolated with the square of the length of a body."
    ]
    limits = {bending: _limit(families[bending, "corrected"]) for bending in BENDING}
    for row in rows:
        row[OFF] = 100.0 * (row[RATIO] / limits[row["bending"]] - 1.0)
    below = [_order(family, limits[bending]) for (bending, _), family in families.items()]
    write(Table("What the wrap factor is worth", above, rows, below), "belt_wrap")


def _wrapped(model: str, bending: str, count: int) -> dict[str, Any]:
    """Return the figures of a mesh, loaded and without load; nan in the place of its error."""
    loaded, idle = (
        bent(bending, count, time, f"mechanism.belt.wrap={model}", *drive, RECORDED)
        for time, drive in zip(OF_FINE if count >= FINE else DURATIONS, (LOAD, IDLE), strict=True)
    )
    tight, slack = tensions_of(loaded)
    return {
        "model": model,
        "bending": bending,
        "bodies": count,
        "T1 [N]": tight,
        "T2 [N]": slack,
        "T1 - T2 [N]": tight - slack,
        RATIO: slip_over_creep(SECTION_4, slip(loaded), tight, slack),
        OFF: float("nan"),
        STUCK: where_it_sticks(loaded) / tight,
        "unloaded: arc over span": arc_over_span(idle),
        "unloaded: slip [%]": 100.0 * slip(idle),
        "warning": warning_on(loaded) or warning_on(idle),
    }


def _limit(family: list[dict[str, Any]]) -> float:
    """Return the slip of bodies without length, over creep."""
    coarse, fine = family[-2:]
    grown = (fine["bodies"] / coarse["bodies"]) ** 2
    return float(fine[RATIO] + (fine[RATIO] - coarse[RATIO]) / (grown - 1.0))


def _order(family: list[dict[str, Any]], limit: float) -> str:
    """Return in words how fast the slip comes to its limit, from mesh to mesh.

    Where the limit follows from the two finest meshes, these say nothing about an order.
    """
    model, bending = family[0]["model"], family[0]["bending"]
    known = family[:-1] if model == "corrected" else family
    orders = [
        log2(abs((coarse[RATIO] - limit) / (fine[RATIO] - limit)))
        / log2(fine["bodies"] / coarse["bodies"])
        for coarse, fine in pairwise(known)
    ]
    listed = ", ".join(f"{order:.1f}" for order in orders)
    return (
        f"{model}, {bending} bending: slip goes to {limit:.4f} with the orders"
        f" {listed} from mesh to mesh; its own two finest meshes give {_limit(family):.4f}."
    )


# The depth of the contact
#
# A body that presses itself p deep into a rim of the radius R comes on to it at an angle of about
# sqrt(2 p/R) at most, and where it is seated it is on a circle smaller by p: friction catches it
# before that. What is left between the slip and the creep of a string goes with that depth, not
# with the mesh.

STIFFNESSES = (1, 4, 16, 64)  # over that of `belt_drive`, c1 and c2 alike
# Bending changes little but the level of both spans: the finest mesh does without.
SEATS = ((300, "without"), (600, "without"), (300, "with"))
DURATION = 1.2  # s
CONTACT = shipped("belt_drive")["effects"]["contact"]  # of a body of a belt of 150
LENGTH = 1.2 / 150  # m, of such a body


def seat() -> None:
    """Write slip and tension over the depth of the contact, on firmer and firmer rims."""
    rows = [_seat_row(*mesh, stiffness) for mesh in SEATS for stiffness in STIFFNESSES]
    above = [
        "`belt_drive` with its resistance continued beyond 8 pi rad/s and contacts whose c1 and c2"
        " are so many times the paper's; their damping goes with the root of that, their p_max with"
        " the depth. Wrap factors, fixed steps (`moreau`), each as long as the method takes by"
        f" itself; {DURATION} s, means of the last 0.6 of it. A string without mass, bending or"
        " depth has T1 = 835.7 N, T2 = 280.1 N, and 1 in both ratios."
    ]
    write(Table("What the depth of the contact does", above, rows), "belt_seat")


def _depth(stiffness: float) -> float:
    """Return how deep a body rests in the rim, m: N = T l/R = c1 p^2 + c2 p."""
    force = SECTION_4.pretension * LENGTH / SECTION_4.radius
    c1, c2 = (stiffness * CONTACT[key] for key in ("c1", "c2"))
    return 2.0 * force / (c2 + sqrt(c2 * c2 + 4.0 * c1 * force))


def _seat_row(bodies: int, bending: str, stiffness: int) -> dict[str, Any]:
    stiff = {"c1": stiffness, "c2": stiffness, "damping": sqrt(stiffness)}
    factors = stiff | {"p_max": _depth(stiffness) / _depth(1.0)}
    contact = [f"effects.contact.{key}={by * CONTACT[key]!r}" for key, by in factors.items()]
    record = bent(bending, bodies, DURATION, *contact, *LOAD, RECORDED)
    tight, slack = tensions_of(record)
    return {
        "stiffness over the paper's": stiffness,
        "bodies": bodies,
        "bending": bending,
        "depth at rest [mm]": 1e3 * _depth(stiffness),
        "angle of entry [deg]": degrees(sqrt(_depth(stiffness) / SECTION_4.radius)),
        "T1 [N]": tight,
        "T2 [N]": slack,
        RATIO: slip_over_creep(SECTION_4, slip(record), tight, slack),
        STUCK: where_it_sticks(record) / tight,
        "step [us]": 1e6 * DURATION / record.statistics.steps,
        "warning": warning_on(record),
    }


# What Kubas 2014 shows of its drive

START = 0.5  # s, from which on means are taken
PRINTED = {
    "speed of the driver [rad/s]": "about -22.5 from 0.3 s on (expected -25.1)",
    "speed of the driven pulley [rad/s]": "",
    "slip [%]": "almost 1.5",
    "tension of the active span [N]": "about 780",
    "tension of the passive span [N]": "about 250",
    "mean of the two spans [N]": "515, below the pretension of 555",
    "torque lost at the driver [N m]": "0.69 (of the printed spans)",
    "torque lost at the driven pulley [N m]": "1.08 (at 22.2 rad/s)",
    "sliding angle by the capstan, ln(T1/T2)/mu [rad]": "1.14, yet slip on all of 3.14",
    "efficiency": "",
    "median relative speed [m/s]": "far above 1.5e-5",
    "share of touching bodies that stick": "only slip occurs",
    "end [s]": "",
    "audit": "",
}


def paper() -> None:
    """Solve the drive by both laws, draw it, and write its numbers next to the paper's."""
    exact = solve("belt_drive")
    continued = solve("belt_drive", *LOAD)
    # 1e-3 takes minutes, 1e-4 a quarter of an hour.
    published = solve("belt_drive_published", "solver.duration=2.0", "solver.rtol=1e-2")
    fs.Result(exact).save(RESULTS / "belt_drive.h5")
    for view in ("speeds", "drive"):
        options = ("--view", view, "-o", f"results/belt_drive_{view}.png")
        command("plot", "results/belt_drive.h5", *options)
    runs = {
        "exact stick": _quantities(exact),
        "exact stick, resistance continued": _quantities(continued),
        "published law, rtol 1e-2": _quantities(published),
    }
    rows = [
        {"quantity": name, "paper": words} | {law: values[name] for law, values in runs.items()}
        for name, words in PRINTED.items()
    ]
    above = [
        f"Means from {START:g} to 2 s of `belt_drive.toml` and `belt_drive_published.toml`. As"
        " printed, drive and resistance are both 15 N m beyond 8 pi = 25.13 rad/s: nothing holds"
        " the speed there, and ripples push its mean up. That speed is no property of the drive."
        " Where the resistance goes on with the speed, it is."
    ]
    below = [
        "The printed numbers contradict each other, so that no refinement leads to them:",
        "(a) Slip everywhere at mu = 1 takes T1/T2 = e^pi = 23.1. The printed ratio, 3.12, takes"
        " 1.14 rad of the 3.14 rad of an arc: friction of both signs acts on it, bodies chatter.",
        '(b) "Two-fold" in the active part and "nearly zero" in the passive one is said of 15 N m.'
        " A perfect drive has 833 and 277 N then, 1.5 and 0.5 times the pretension; two-fold takes"
        " 30 N m, and all slips above 27.5 N m.",
        "(c) Between the torques and the printed spans 0.69 N m are lost at the driver and 1.08 N m"
        " at the driven pulley, 44 W of 338 W, of which a slip of 1.5 % is 5 W. Here the heat of"
        " friction and dampers is 0.4 %, nearly all of it creep.",
        "(d) The mean of the printed spans, 515 N, is below the pretension of 555 N; here it is"
        " above it (a string without depth or bending: 558 N).",
    ]
    write(Table("The belt drive of Kubas 2014 and ours", above, rows, below), "belt_paper")


def _quantities(done: Record) -> dict[str, Any]:
    """Return the means of a run; none of them if it ended before."""
    channels = done.channels
    values = dict.fromkeys(PRINTED, float("nan")) | {
        "end [s]": float(done.time[-1]),
        "audit": warning_on(done) or "passed",
    }
    which = done.time >= START
    if not which.any():
        return values
    turned = np.ptp(channels["pulley_angle"][which], axis=0)
    touching = channels["pulley_index"][which] >= 0
    speeds = np.abs(channels["slip_velocity"][which][touching])
    passive, active = sorted(upper_and_lower(done, which))
    carried = SECTION_4.radius * (active - passive)
    given = np.abs(np.mean(channels["pulley_torque"][which], axis=0))
    return values | {
        "speed of the driver [rad/s]": float(np.mean(channels["pulley_speed"][which, 0])),
        "speed of the driven pulley [rad/s]": float(np.mean(channels["pulley_speed"][which, 1])),
        "slip [%]": 100.0 * float(1.0 - turned[1] / turned[0]),
        "tension of the active span [N]": active,
        "tension of the passive span [N]": passive,
        "mean of the two spans [N]": 0.5 * (active + passive),
        "torque lost at the driver [N m]": float(given[0] - carried),
        "torque lost at the driven pulley [N m]": float(carried - given[1]),
        "sliding angle by the capstan, ln(T1/T2)/mu [rad]": log(active / passive),
        "efficiency": quantity_of(done, "efficiency"),
        "median relative speed [m/s]": float(np.median(speeds)),
        "share of touching bodies that stick": float(
            np.mean(channels["sticking"][which][touching])
        ),
    }
