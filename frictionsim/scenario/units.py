"""Units of measured numbers, and their sizes in the units of the model."""

import re
from math import pi
from typing import NamedTuple

from frictionsim.errors import InputError

# The sizes of the units of each SI unit.
SIZES: dict[str, dict[str, float]] = {
    "1": {"1": 1.0, "%": 0.01},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0},
    "rad": {"rad": 1.0, "deg": pi / 180.0, "rev": 2.0 * pi},
    "rad/s": {
        "rad/s": 1.0,
        "deg/s": pi / 180.0,
        "rev/s": 2.0 * pi,
        "Hz": 2.0 * pi,
        "rpm": pi / 30.0,
        "1/min": pi / 30.0,
    },
    "rad/s^2": {"rad/s^2": 1.0, "deg/s^2": pi / 180.0},
    "m": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "in": 0.0254},
    "m/s": {"m/s": 1.0, "mm/s": 1e-3, "km/h": 1.0 / 3.6},
    "N": {
        "N": 1.0,
        "mN": 1e-3,
        "daN": 10.0,
        "kN": 1e3,
        "MN": 1e6,
        "kgf": 9.80665,
        "lbf": 4.4482216152605,
    },
    "N m": {
        "N m": 1.0,
        "mN m": 1e-3,
        "daN m": 10.0,
        "kN m": 1e3,
        "N cm": 1e-2,
        "N mm": 1e-3,
        "gf cm": 9.80665e-5,
        "kgf cm": 9.80665e-2,
        "kgf m": 9.80665,
        "lbf ft": 1.3558179483314004,
    },
    "J": {"J": 1.0, "mJ": 1e-3, "kJ": 1e3},
    "W": {"W": 1.0, "mW": 1e-3, "kW": 1e3},
}
UNITS = {name: si for si, sizes in SIZES.items() for name in sizes}
# Other ways to write a unit; the product of two is N*m, N·m, N.m, N-m or Nm.
_WRITTEN = {
    name.replace(" ", sign): name
    for name in UNITS
    if " " in name
    for sign in ("*", "·", ".", "-", "")
} | {
    "-": "1",
    "sec": "s",
    "µs": "us",
    "μs": "us",
    "µm": "um",
    "μm": "um",
    "°": "deg",
    "°/s": "deg/s",
    "min^-1": "1/min",
    "min-1": "1/min",
    "kp": "kgf",
    "KN": "kN",
    **dict.fromkeys(("RPM", "rev/min", "r/min", "U/min"), "rpm"),
    **dict.fromkeys(("lbft", "lb ft", "lb-ft", "lb.ft", "ft lb", "ft-lb", "ftlb"), "lbf ft"),
}
# The longest first: of n_rad/s the unit is not s.
WRITTEN = sorted({*UNITS, *_WRITTEN} - {"1", "-"}, key=len, reverse=True)

BRACKETS = re.compile(r"\s*[\[({<]([^][(){}<>]*)[\])}>]")
# A known unit alone, or behind a name and `/`, `,`, `in`, or a blank or `_`.
AT_END = re.compile(
    rf"(?:(.*?\S)(?:(\s*[/,]\s*|\s+in\s+)|_|\s+))??({'|'.join(map(re.escape, WRITTEN))})"
)
# What stands behind the last `,` or `in`, or the first `/`: a unit, known or not;
# not what begins with a digit, as in a date.
BEHIND = re.compile(r"(.*\S)(?:\s*,\s*|\s+in\s+)([^\s\d].*)|([^/]*[^/\s])\s*/\s*([^\s\d].*)")


class Heading(NamedTuple):
    """The name of a column and its unit, which may be a part of the name if not certain."""

    name: str
    unit: str = ""
    is_certain: bool = True


def heading(cell: str) -> Heading:
    """Return name and unit of a heading.

    The unit is the last known one in brackets, or else what ends the heading in brackets, or a
    known one at its end, or else what is there behind `/`, `,` or `in`. A known one behind a blank
    or `_`, or alone, is not certain.
    """
    found = [match for match in BRACKETS.finditer(cell) if bare(match[1])]
    units = [m for m in found if is_unit(bare(m[1]))] or [m for m in found if m.end() == len(cell)]
    for match in units[-1:]:
        name = f"{cell[: match.start()]} {cell[match.end() :]}".strip()
        return Heading(name or cell, bare(match[1]))
    if alone := AT_END.fullmatch(cell):
        return Heading(alone[1] or cell, alone[3], alone[2] is not None)
    if behind := BEHIND.fullmatch(cell):
        name, unit = filter(None, behind.groups())
        return Heading(name, unit)
    return Heading(cell)


def bare(cell: str) -> str:
    """Return a unit without the brackets that may be around it."""
    return cell.strip(" []()<>{}")


def is_unit(text: str) -> bool:
    """Return whether a text is a unit that is known."""
    return text in UNITS or text in _WRITTEN


def fits(unit: str, model_unit: str) -> bool:
    """Return whether a unit is one of those of the model's unit."""
    try:
        return bool(factor(unit, model_unit))
    except InputError:
        return False


def factor(unit: str, model_unit: str) -> float:
    """Return the size of a unit in the unit of the model; raise InputError if it does not fit."""
    unit = _WRITTEN.get(unit, unit)
    if unit == model_unit:
        return 1.0
    sizes = SIZES.get(UNITS.get(model_unit, model_unit), {})
    if unit not in sizes:
        known = f"one of {', '.join(sizes)}" if sizes else f"'{model_unit}'"
        raise InputError(f"expected {known if model_unit else 'no unit'}, got '{unit}'")
    return sizes[unit] / sizes[model_unit]
