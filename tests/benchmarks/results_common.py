"""Shared parts of `results.py`: runs, quantities of belts, tables with their provenance."""

import csv
import platform
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from importlib.metadata import version
from math import isnan
from os import cpu_count
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import frictionsim as fs
from frictionsim.results import Record, failures

ROOT = Path(__file__).parents[2]
SCENARIOS, RESULTS = ROOT / "scenarios", ROOT / "results"


class Table(NamedTuple):
    """A table: lines above it, its rows by headings with units, lines below it."""

    title: str
    above: Sequence[str]
    rows: Sequence[Mapping[str, Any]]
    below: Sequence[str] = ()


def provenance() -> list[str]:
    """Return the provenance of numbers besides the sources: machine and versions."""
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba"))
    return [
        f"machine: {_processor()}, {cpu_count()} cores, {platform.system()} {platform.machine()}",
        f"versions: Python {platform.python_version()}, {libraries}",
    ]


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown processor"
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else "unknown processor"


def say(text: str) -> None:
    print(text, flush=True)


def solve(base: str, *overrides: str, without: Iterable[str] = ()) -> Record:
    """Run a shipped scenario with keys set and effects left out."""
    data = tomllib.loads((SCENARIOS / f"{base}.toml").read_text())
    for effect in without:
        data["effects"].pop(effect, None)
    return fs.solve(fs.load(data, overrides, folder=SCENARIOS)).record


def moreau(base: str, bodies: int, *overrides: str, without: Iterable[str] = ()) -> Record:
    """Run a shipped belt with fixed steps and a number of bodies."""
    say(f"  {base}, {bodies} bodies {' '.join(overrides)}")
    settings = "solver.backend=moreau", f"mechanism.belt.bodies={bodies}"
    return solve(base, *settings, *overrides, without=without)


def quantity_of(result: Record, name: str) -> float:
    """Return a figure of a run; nan where there is none."""
    quantity = result.quantities.get(name)
    return float("nan") if quantity is None or quantity.value is None else quantity.value


def tensions_of(result: Record) -> tuple[float, float]:
    """Return the tensions of the tight and of the slack span of a run, N."""
    return quantity_of(result, "tension_tight"), quantity_of(result, "tension_slack")


def warning_on(record: Record) -> str:
    """Return why a run failed, or what its self-audit found; nothing if all is well."""
    failed = failures(record.checks)
    return record.reason or (f"self-audit failed: {failed}" if failed else "")


def late(record: Record, share: float = 0.4) -> Any:
    """Return the mask of the samples of steady motion, for means."""
    return record.time >= share * record.time[-1]


def slip(record: Record) -> float:
    """Return the slip; a window that fades at its ends leaves nothing of the pulleys' swing."""
    speed = record.channels["pulley_speed"][late(record)]
    driver, driven = np.hanning(len(speed)) @ speed
    return float(1.0 - driven / driver)


def _inside(record: Record, which: Any, pulley: float) -> Any:
    """Return which joints are between two bodies on a pulley, or on none, -1."""
    on = record.channels["pulley_index"][which] == pulley
    return on & np.roll(on, 1, axis=1)


def where_it_sticks(record: Record, share: float = 0.4) -> float:
    """Return the median tension of the joints on the driver whose body sticks there, N.

    Most of that arc has one tension; at its entry it rises, or falls, to it.
    """
    which = late(record, share)
    inside = _inside(record, which, 0.0) & (record.channels["sticking"][which] > 0.0)
    return float(np.median(record.channels["tension"][which][inside]))


def arc_over_span(record: Record) -> float:
    """Return the mean tension on the driver over that of the joints that touch nothing."""
    tension = record.channels["tension"][late(record)]
    arc, span = (tension[_inside(record, late(record), pulley)] for pulley in (0.0, -1.0))
    return float(np.mean(arc) / np.mean(span))


def command(*arguments: str) -> str:
    """Run `frictionsim` from the root of the project; return its output."""
    say(f"  frictionsim {' '.join(arguments)}")
    line = [sys.executable, "-m", "frictionsim", *arguments]
    return subprocess.run(line, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout


def write(table: Table, name: str) -> None:
    """Write a table as Markdown and as CSV; cells that a row lacks stay empty."""
    heading = list(max(table.rows, key=len))
    rows = [[row.get(key, "") for key in heading] for row in table.rows]
    lines = [f"# {table.title}", "", *(f"- {line}" for line in provenance()), ""]
    lines += [*(f"{line}\n" for line in table.above), _row(heading), _row(["---"] * len(heading))]
    lines += [_row(map(_text, row)) for row in rows]
    lines += [f"\n{line}" for line in table.below]
    (RESULTS / f"{name}.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    with (RESULTS / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
        file.writelines(f"# {line}\n" for line in provenance())
        csv.writer(file).writerows([heading, *rows])
    say("\n".join(table.below))


def _row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _text(value: Any) -> str:
    if not isinstance(value, float):
        return str(value)
    return "" if isnan(value) else f"{value:.4g}"
