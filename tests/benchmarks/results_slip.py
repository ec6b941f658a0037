"""Slip over torque and pretension, which Kubas 2014 leaves open, section 4.

A string creeps by (T1 - T2)/(EA + T1) with T1 - T2 = M/R, whatever its pretension, until it slips
as a whole, T1/T2 = exp(mu pi) on two equal pulleys. If the mean of the sides were the pretension
T0, that would be below T0 = M/(2 R tanh(mu pi/2)). But the stretch of the whole belt is what stays:
with the spans s, and the mean (T1 - T2)/(mu pi) of an exponential on the arcs,

    T0 (s + pi R) = s M/(2 R tanh(mu pi/2)) + M/mu.
"""

from math import pi, tanh
from typing import Any

from frictionsim.results import Record
from tests.benchmarks.results_common import Table, moreau, quantity_of, say, warning_on, write
from tests.support.belt_closed_forms import SECTION_4, creep
from tests.support.belt_scenarios import CONTINUED

TORQUES = (5.0, 10.0, 15.0, 20.0, 25.0)  # N m
PRETENSIONS = (250.0, 300.0, 350.0, 555.0, 800.0)  # N
MODELS = {"guided": ("belt_string", 150), "bodies": ("belt_drive", 600)}
SLOW, DURATIONS = 10.0, (2.0, 1.0)  # N m: what turns no faster takes longer, s
FULL = 5.0  # %, several times what creeps: the driver runs away
NEAR, HALVINGS = (0.8, 1.2), 7  # of the pretension in closed form
MU = 1.0


def slip() -> None:
    """Write the slip of the guided belt and of 600 bodies, and where they slip as a whole."""
    rows = [_row(model, torque) for model in MODELS for torque in TORQUES]
    above = [
        "`slip_percent`, %, of `belt_string.toml` with 150 points (2 s) and of `belt_drive.toml`"
        " with 600 bodies (1 s, 2 s up to 10 N m), `moreau`, means of the last fifth. The"
        " resistance is continued, so that the speed is proportional to the torque. The closed form"
        " is Reynolds's creep (T1 - T2)/(EA + T1) at a pretension of"
        f" {SECTION_4.pretension:g} N. The belt slips as a whole below M/(2 R tanh(mu pi/2)) if the"
        " mean of its sides is the pretension, and below somewhat less as its arcs count, too,"
        " whose tension falls in full slip; of the guided belt that is bisected.",
    ]
    below = [
        "Elastic creep follows the torque, and depends on the pretension by its part in EA + T1"
        " only, 0.4 % from 250 to 800 N. In the plane the depth of the contact takes a tenth of it."
        " Friction decides nothing but where the belt slips as a whole. So at 15 N m no pretension"
        " gives the paper's 1.5 %: such a belt creeps by 0.36 %, or slips as a whole.",
        "In the plane the slack span bows out as its tension falls, and stretches the belt: at"
        " 25 N m a belt of 300 N has 992 and 66 N, with the mean 529 N, and holds what a string"
        " does not.",
    ]
    write(Table("Slip over torque and pretension", above, rows, below), "belt_slip")


def _row(model: str, torque: float) -> dict[str, Any]:
    drive, sides = SECTION_4, torque / (2.0 * SECTION_4.radius * tanh(0.5 * MU * pi))
    limit = (drive.distance * sides + torque / MU) / (0.5 * drive.length)
    speed = SECTION_4.radius * torque / CONTINUED["value"][0] * abs(CONTINUED["speed"][0])
    row: dict[str, Any] = {
        "model": model,
        "torque [N m]": torque,
        "closed form": 100.0 * creep(SECTION_4, torque, MU, speed).slip,
    }
    for pretension in PRETENSIONS:
        done = _solved(model, torque, pretension)
        value = quantity_of(done, "slip_percent")
        shown: Any = "slips as a whole" if value > FULL else value
        row[f"at {pretension:g} N"] = shown
        say(f"  {model}, {torque:g} N m, {pretension:g} N: {shown} {warning_on(done)}")
    row |= {"slips as a whole below, by the sides [N]": sides, "with the arcs [N]": limit}
    if model == "guided":
        low, high = (share * limit for share in NEAR)
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            slips = quantity_of(_solved(model, torque, middle), "slip_percent") > FULL
            low, high = (middle, high) if slips else (low, middle)
        row["measured [N]"] = 0.5 * (low + high)
    return row


def _solved(model: str, torque: float, pretension: float) -> Record:
    base, bodies = MODELS[model]
    duration = DURATIONS[0 if model == "guided" or torque <= SLOW else 1]
    return moreau(
        base,
        bodies,
        f"solver.duration={duration}",
        f"mechanism.belt.pretension={pretension!r}",
        f"drive.driver.torque={{time = [0.0, 0.3], value = [0.0, {-torque}]}}",
        f"drive.driven.torque={{speed = {CONTINUED['speed']}, value = {CONTINUED['value']}}}",
        "output.channels=[]",
        "output.interval=1e-3",
    )
