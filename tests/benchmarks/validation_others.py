"""Benchmarks of others, each a scenario in `scenarios/validation`, beside their numbers.

The closed forms are in `tests/support/closed_forms_of_others.py`. What others have stored is from
their public repositories.
"""

import numpy as np

from frictionsim.results import Record
from tests.benchmarks.results_common import solve
from tests.support.closed_forms_of_others import (
    RATIOS,
    den_hartog_amplitude,
    flat_belt,
    friction_oscillator,
)

DEN_HARTOG = ("ratio r", "amplitude, P/k", "closed form", "off")
SICONOS = ("program", "rest at, s", "x at rest", "off the closed form")
EXUDYN = (
    *("program", "points", "speed of the driven pulley at 2.45 s, rad/s"),
    *("mean from 2.4 s on, rad/s", "T1, N", "T2, N", "steps"),
)
FREQUENCY = "couples.exciter.size.sine.frequency_hz"
# Stored there: FrictionOscillator.ref, the first row at rest, with steps of 0.01 s;
# wheel1angVel-tt245-hh10-nn8-ns4-cs10-fs10-ib1-df5-.txt, the last row, of 480 elements.
SICONOS_STORED = 22.44, 0.6820441351954105
EXUDYN_STORED = 480, 11.32501142


def steady_amplitude(ratio: float, *overrides: str) -> float:
    """Return the amplitude of Den Hartog's oscillator over the last two seconds of a run, rad."""
    done = solve("validation/den_hartog", f"{FREQUENCY}={ratio}", *overrides)
    late = done.time > done.time[-1] - 2.0
    return float(np.abs(done.channels["angle"][late]).max())


def den_hartog() -> list[tuple[str, ...]]:
    """Compare the amplitude at each ratio."""
    rows = []
    for ratio in RATIOS:
        found, expected = steady_amplitude(ratio), den_hartog_amplitude(ratio)
        values = (f"{found:.12f}", f"{expected:.12f}", f"{found - expected:.1e}")
        rows.append((f"{ratio:g}", *values))
    return rows


def siconos() -> list[tuple[str, ...]]:
    """Compare when and where the friction oscillator comes to rest."""
    done = solve("validation/friction_oscillator")
    time, place = friction_oscillator()
    ours = quantity(done, "last_rest_time"), quantity(done, "final_angle")
    rows = {"closed form": (time, place), "ours": ours, "Siconos": SICONOS_STORED}
    return [
        (name, f"{t:.12f}", f"{x:.12f}", "" if name == "closed form" else f"{x - place:.1e}")
        for name, (t, x) in rows.items()
    ]


def exudyn() -> list[tuple[str, ...]]:
    """Compare speeds and tensions of the loaded belt."""
    speed, tight, slack = flat_belt()
    points, stored = EXUDYN_STORED
    rows = [
        ("closed form", "", "", f"{speed:.5f}", f"{tight:.2f}", f"{slack:.2f}", ""),
        ("Exudyn", str(points), f"{stored:.5f}", "", "", "", ""),
    ]
    for bodies in (60, 240):
        done = solve("validation/flat_belt", f"mechanism.belt.bodies={bodies}")
        at = int(np.argmin(np.abs(done.time - 2.45)))
        names = "driven_speed", "tension_tight", "tension_slack"
        mean, *tensions = (quantity(done, name) for name in names)
        now = done.channels["pulley_speed"][at, 1]
        sizes = (f"{now:.5f}", f"{mean:.5f}", *(f"{tension:.2f}" for tension in tensions))
        rows.append(("ours", str(bodies), *sizes, str(done.statistics.steps)))
    return rows


def quantity(done: Record, name: str) -> float:
    """Return a quantity of a run that has it."""
    value = done.quantities[name].value
    assert value is not None, name
    return float(value)
