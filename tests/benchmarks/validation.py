"""Holds belts and shafts to closed forms and to others: writes `results/validation.json`, the page.

Run it as `python -m tests.benchmarks.validation`, or with the names of some of its parts behind;
it takes about half an hour. The closed forms of the benchmarks of others are in
`tests/support/closed_forms_of_others.py`; what others have stored is from their public
repositories. `--page` writes the tables of `docs/validation.md` from the numbers
that are there. What stands there between `<!-- measured: PART -->` and `<!-- end -->` is replaced.
"""

import json
import re
import sys
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from tests.benchmarks import validation_belts as belts
from tests.benchmarks.results_common import RESULTS, ROOT, provenance, quantity_of, say, solve
from tests.support.closed_forms_of_others import (
    RATIOS,
    den_hartog_amplitude,
    flat_belt,
    friction_oscillator,
)

PAGE, NUMBERS = ROOT / "docs" / "validation.md", RESULTS / "validation.json"
MEASURED = re.compile(r"(<!-- measured: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


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
    rows = []
    for ratio in RATIOS:
        amplitude, expected = steady_amplitude(ratio), den_hartog_amplitude(ratio)
        values = (f"{amplitude:.12f}", f"{expected:.12f}", f"{amplitude - expected:.1e}")
        rows.append((f"{ratio:g}", *values))
    return rows


def siconos() -> list[tuple[str, ...]]:
    """Compare when and where the friction oscillator comes to rest."""
    done = solve("validation/friction_oscillator")
    time, place = friction_oscillator()
    ours = quantity_of(done, "last_rest_time"), quantity_of(done, "final_angle")
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
        mean, *tensions = (quantity_of(done, name) for name in names)
        now = done.channels["pulley_speed"][at, 1]
        sizes = (f"{now:.5f}", f"{mean:.5f}", *(f"{tension:.2f}" for tension in tensions))
        rows.append(("ours", str(bodies), *sizes, str(done.statistics.steps)))
    return rows


class Part(NamedTuple):
    """A table of the page: its heading with units, and what measures its rows."""

    heading: tuple[str, ...]
    measure: Callable[[], list[Any]]


PARTS = {
    "drive": Part(belts.DRIVE, belts.drive),
    "slip": Part(belts.FULL_SLIP, belts.full_slip),
    "waves": Part(belts.WAVES, belts.waves_and_weight),
    "peer": Part(belts.PEER, belts.peer),
    "den_hartog": Part(DEN_HARTOG, den_hartog),
    "siconos": Part(SICONOS, siconos),
    "exudyn": Part(EXUDYN, exudyn),
}


def load() -> dict[str, Any]:
    if not NUMBERS.exists():
        return {}
    numbers: dict[str, Any] = json.loads(NUMBERS.read_text(encoding="utf-8"))
    return numbers


def measure(name: str) -> None:
    heading, measured = PARTS[name]
    rows = [[None if value != value else value for value in row] for row in measured()]  # nan
    part = {"provenance": provenance(), "heading": list(heading), "rows": rows}
    numbers = load() | {name: part}
    ordered = {part: numbers[part] for part in PARTS if part in numbers}
    NUMBERS.write_text(json.dumps(ordered, indent=1) + "\n", encoding="utf-8")


def rendered(page: str, numbers: dict[str, Any]) -> str:
    """Return the text of the page with the tables of the numbers."""

    def part(match: "re.Match[str]") -> str:
        begin, name, end = match.groups()
        return f"{begin}\n{_table(numbers[name])}\n{end}" if name in numbers else match[0]

    return MEASURED.sub(part, page)


def _table(numbers: dict[str, Any]) -> str:
    """Return a part as Markdown; columns that are empty throughout are left out."""
    heading, rows = numbers["heading"], numbers["rows"]
    kept = [i for i in range(len(heading)) if any(row[i] not in ("", None) for row in rows)]
    lines = [[heading[i] for i in kept], ["---"] * len(kept)]
    lines += [[_text(row[i]) for i in kept] for row in rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _text(value: Any) -> str:
    if not isinstance(value, float):
        return "" if value is None else str(value)
    return f"{value:.4f}" if 0.1 <= abs(value) < 10.0 else f"{value:.5g}"


def main(names: list[str]) -> None:
    """Measure the parts that are named, or all, and write the page."""
    for name in [] if names == ["--page"] else names or list(PARTS):
        say(name)
        measure(name)
    page = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(rendered(page, load()), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
