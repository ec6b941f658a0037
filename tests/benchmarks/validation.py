"""Holds belts and shafts to closed forms and to others: writes `results/validation.json`, the page.

Run it as `python -m tests.benchmarks.validation`, or with the names of some of its parts behind;
it takes about half an hour. `--page` writes the tables of `docs/validation.md` from the numbers
that are there. What stands there between `<!-- measured: PART -->` and `<!-- end -->` is replaced.
"""

import json
import re
import sys
from collections.abc import Callable
from math import isnan
from typing import Any, NamedTuple

from tests.benchmarks import (
    validation_drive,
    validation_others,
    validation_peer,
    validation_waves,
)
from tests.benchmarks.results_common import RESULTS, ROOT, provenance, say
from tests.benchmarks.validation_models import REFUSED

PAGE, NUMBERS = ROOT / "docs" / "validation.md", RESULTS / "validation.json"
MEASURED = re.compile(r"(<!-- measured: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


class Part(NamedTuple):
    """A table of the page: its heading with units, and what measures its rows."""

    heading: tuple[str, ...]
    measure: Callable[[], list[tuple[Any, ...]]]


PARTS = {
    "drive": Part(validation_drive.DRIVE, validation_drive.drive),
    "slip": Part(validation_drive.FULL_SLIP, validation_drive.full_slip),
    "waves": Part(validation_waves.WAVES, validation_waves.waves_and_weight),
    "conserved": Part(validation_waves.CONSERVED, validation_waves.conserved),
    "peer": Part(validation_peer.HEADING, validation_peer.peer),
    "den_hartog": Part(validation_others.DEN_HARTOG, validation_others.den_hartog),
    "siconos": Part(validation_others.SICONOS, validation_others.siconos),
    "exudyn": Part(validation_others.EXUDYN, validation_others.exudyn),
}


def load() -> dict[str, Any]:
    """Return the numbers of all parts that were measured."""
    if not NUMBERS.exists():
        return {}
    found: dict[str, Any] = json.loads(NUMBERS.read_text(encoding="utf-8"))
    return found


def measure(name: str) -> None:
    """Measure a part, and write its numbers down."""
    REFUSED.clear()
    rows = [[_plain(value) for value in row] for row in PARTS[name].measure()]
    numbers = load()
    numbers[name] = {
        "provenance": provenance(),
        "heading": list(PARTS[name].heading),
        "rows": rows,
        "left_out": sorted(set(REFUSED)),
    }
    ordered = {part: numbers[part] for part in PARTS if part in numbers}
    NUMBERS.write_text(json.dumps(ordered, indent=1) + "\n", encoding="utf-8")


def _plain(value: Any) -> Any:
    return None if isinstance(value, float) and isnan(value) else value


def rendered(page: str, numbers: dict[str, Any]) -> str:
    """Return the text of the page with the tables of the numbers."""

    def part(found: "re.Match[str]") -> str:
        begin, name, end = found.groups()
        return f"{begin}\n{_table(numbers[name])}\n{end}" if name in numbers else found[0]

    return MEASURED.sub(part, page)


def _table(numbers: dict[str, Any]) -> str:
    """Return a part as Markdown; columns that are empty throughout are left out."""
    rows = numbers["rows"]
    kept = [
        i for i in range(len(numbers["heading"])) if any(row[i] not in ("", None) for row in rows)
    ]
    lines = [[numbers["heading"][i] for i in kept], ["---"] * len(kept)]
    lines += [[_text(row[i]) for i in kept] for row in rows]
    notes = "".join(f"\n{note}\n" for note in numbers["left_out"])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n" + notes


def _text(value: Any) -> str:
    if value is None:
        return ""
    if not isinstance(value, float):
        return str(value)
    return f"{value:.4f}" if 0.1 <= abs(value) < 10.0 else f"{value:.5g}"


def main(names: list[str]) -> None:
    """Measure the parts that are named, or all, and write the page."""
    chosen = [] if names == ["--page"] else names or list(PARTS)
    for name in chosen:
        say(name)
        measure(name)
    page = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(rendered(page, load()), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
