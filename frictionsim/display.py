"""How a result is shown: its numbers, the words for its modes, and the colours of its parts.

Tables, pictures, motions and pages read them here; `page_style` gives colours to a page.
"""

import re
from collections.abc import Mapping, Sequence
from math import isfinite

from frictionsim.results import BACKWARD, FORWARD, MODES, STICK

# Numbers.

MINUS = "\N{MINUS SIGN}"
DIGITS, STUDY_DIGITS = 10, 6  # of a quantity in the summary of a run, and of many runs
MESH_DIGITS = 3  # of a quantity that depends on the mesh of a belt, by some percent or tenths
TIME_DIGITS, PICTURE_DIGITS = 9, 4
NO_VALUE = "none"
MAX_DRAWN = 1e100  # a scale of larger numbers would overflow
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number_text(value: float | None, digits: int = DIGITS) -> str:
    """Return a number; `none` where it is not defined."""
    return NO_VALUE if value is None or value != value else f"{value:.{digits}g}"


def quantity_text(value: float | None, error: float | None = None, digits: int = DIGITS) -> str:
    """Return a quantity in the digits that the estimate of its error bears.

    The last digit has the place of the first one of the error, as `error_text` shows it: 2707.703
    with 4.2e-03. There is at least one digit, and at most DIGITS.

    Parameters
    ----------
    error : float or None
        None if it was not estimated; 0, where two runs agree to the last bit, tells no more.
    digits : int
        Their number where the error does not tell it.
    """
    if not value or not isfinite(value):
        return number_text(value)
    # The places of its first and last digit, 0 for units; rounding may move the first.
    first = int(f"{value:.{digits - 1}e}".partition("e")[2])
    is_known = bool(error) and isfinite(error or 0.0)
    last = int(error_text(error).partition("e")[2]) if is_known else first - digits + 1
    last = min(max(last, first - DIGITS + 1), first)
    text = number_text(round(value, -last))
    if last >= 0 or not (is_known or digits < DIGITS):
        return text
    # Its zeros at the end are known, too.
    return f"{value:.{first - last}e}" if "e" in text else f"{value:.{-last}f}"


def study_text(value: float | None) -> str:
    """Return a number of a sweep or a fit; `none` where it is not defined."""
    return number_text(value, STUDY_DIGITS)


def time_text(time: float | None) -> str:
    """Return a time, s, in as many digits as tell two events apart; empty if there is none."""
    return "" if time is None else number_text(time, TIME_DIGITS)


def picture_text(value: float, digits: int = PICTURE_DIGITS) -> str:
    """Return a number in a picture; it has an exponent only where the tables have one."""
    text = number_text(value, digits)
    return f"{value:.0f}" if "e" in text and "e" not in study_text(value) else text


def ratio_text(value: float) -> str:
    """Return a number between -1 and 1; `none` where it is not defined."""
    return NO_VALUE if value != value else f"{value:.3f}"


def short_text(value: float | None) -> str:
    """Return a number of which only the size matters; empty if there is none."""
    return "" if value is None else f"{value + 0.0:.3g}"  # no -0


def error_text(value: float | None) -> str:
    """Return the estimate of an error; empty if there is none."""
    return "" if value is None else f"{value:.1e}"


def with_minus(shown: str) -> str:
    """Return a number with the sign of minus that charts have; zero has none."""
    zero = shown.startswith("-") and not shown.strip("-0.")
    return shown.removeprefix("-") if zero else shown.replace("-", MINUS)


def unit_text(unit: str) -> str:
    """Return a unit for display: raised exponents; empty for a number, whose unit is 1."""
    if unit == "1":
        return ""
    return re.sub(r"\^(-?\d+)", lambda power: power[1].translate(RAISED), unit)


def with_unit(value: str, unit: str) -> str:
    """Return a number with its unit, such as "200 N"; without unit the number alone."""
    shown = unit_text(unit)
    return f"{value} {shown}" if shown else value


def labelled(words: str, unit: str) -> str:
    """Return the label of a quantity with its unit, such as "force, N"."""
    shown = unit_text(unit)
    return f"{words}, {shown}" if shown else words


# Overrides.

MAX_SET = 60  # characters of the value of an override


def overrides_of(attributes: Mapping[str, str], length: int = MAX_SET) -> dict[str, str]:
    """Return the values of a file's overrides as texts, by key; longer ones are cut."""
    pairs = (text.partition("=") for text in attributes.get("overrides", "").split("\n") if text)
    return {key: cut_text(value, length) for key, _, value in pairs}


def overrides_text(attributes: Mapping[str, str]) -> str:
    """Return the overrides of a file, such as "solver.rtol = 1e-09"; empty without any."""
    return ", ".join(f"{key} = {value}" for key, value in overrides_of(attributes).items())


def set_line(attributes: Mapping[str, str]) -> str:
    """Return the line of the overrides of a file, "set: ..."; empty without any."""
    return f"set: {text}" if (text := overrides_text(attributes)) else ""


def cut_text(text: str, length: int) -> str:
    """Return a text with at most so many characters, cut between words unless little is left."""
    if len(text) <= length:
        return text
    start = text[: length - 1]
    words = start.rpartition(" ")[0].rstrip(",;")
    return f"{words if 2 * len(words) > length else start}…"


# Words for modes.

MODE_WORDS = dict(MODES) | {FORWARD: "slip +", BACKWARD: "slip -"}
"""Of the modes before and after an event."""

CONTACT_WORDS = {STICK: "sticks", FORWARD: "slips forward", BACKWARD: "slips backward"}
"""Of the mode of a single contact at an instant."""

# Colours: Okabe and Ito, safe for colour-blind readers.

BLUE, VERMILION, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
SKY, BLACK, ORANGE, GREY = "#56B4E9", "#000000", "#E69F00", "#777777"
WINE, WHITE = "#882255", "#FFFFFF"
COLOURS = (BLUE, VERMILION, GREEN, PURPLE, SKY, BLACK, ORANGE, GREY)
"""Of lines, in this order."""

LINE_COLOURS = (*COLOURS, WINE)
SYMBOLS = {
    "o": "circle",
    "s": "square",
    "^": "triangle-up",
    "D": "diamond",
    "v": "triangle-down",
    "P": "cross",
    "*": "star",
    "<": "triangle-left",
    ">": "triangle-right",
    "h": "hexagon",
}
"""Of methods in a study of costs: colours and markers, each with its name in a chart.

Their numbers have no common divisor, so that no two of the first 90 methods look alike.
"""

FORCE_COLOURS = (BLUE, GREEN, PURPLE, SKY)
"""Of applied forces and couples; the others are those of reaction and weight."""

MAX_MARKS = 60
"""Events that a picture or chart marks; marks of more would hide the lines."""

COLOURS_ON_DARK = (
    *(SKY, ORANGE, GREEN, PURPLE),
    *("#F0E442", "#FFFFFF", VERMILION, "#AAAAAA", "#A58BFF"),
)
DASHES: tuple[tuple[float, ...], ...] = (
    *((), (6.0, 2.0), (6.0, 2.0, 1.0, 2.0), (2.0, 1.5)),
    *((12.0, 2.0), (6.0, 2.0, 1.0, 2.0, 1.0, 2.0), (1.0, 1.0), (12.0, 2.0, 2.0, 2.0)),
)
"""Of lines, one for each colour, for grey print: dashes and gaps in widths of a line."""

# Shades of areas, behind lines: sticking phases, and the arcs of pulleys, repeated.
STICK_SHADE = "#E5E5E5"
ARC_SHADES = ("#E8E8E8", "#D3D3D3", "#BEBEBE", "#A9A9A9")
CORD_STICKS_SHADE, CORD_SLIPS_SHADE = "#DCEBF5", "#FBE0CC"

BELT_CONTACT = {
    "sticks": ("sticks on the pulley", BLACK),
    "slips": ("slips on the pulley", WHITE),
}
"""Of a belt: words, and the colour of the strip on it."""

TENSION_COLOURS = "cividis"
"""A scale of matplotlib, whose lightness rises with the value, also for the colour-blind."""

TENSION_SCALE = (
    *("#00224e", "#083370", "#35456c", "#4f576c", "#666970", "#7d7c78"),
    *("#948e77", "#aea371", "#c8b866", "#e5cf52", "#fee838"),
)
"""The same scale in even steps, for pages."""

# Of the parts of a drawing.
EDGE, FAINT = "#2B2B2B", "#B9B9B9"
ROLES = {
    "fixed": GREY,
    "still": "#D0D0D0",
    "moving": "#CFE8F8",
    "marked": BLUE,
    "load": ORANGE,
    "path": "#B3589A",
    "force": FORCE_COLOURS[0],
    "force-2": FORCE_COLOURS[1],
    "force-3": FORCE_COLOURS[2],
    "force-4": FORCE_COLOURS[3],
    "friction": VERMILION,
    "cord": EDGE,
    "paper": "#FFFFFF",
}
ROLES_ON_DARK = {
    "fixed": "#8D939B",
    "still": "#41464D",
    "moving": "#25435A",
    "marked": "#6CC1EF",
    "load": ORANGE,
    "path": "#E08FC0",
    "force": "#6CC1EF",
    "force-2": "#2FC79D",
    "force-3": "#E3A3C7",
    "force-4": "#A9DBF7",
    "friction": "#FF8A3D",
    "cord": "#E2E2E2",
    "paper": "#16181B",
}
EVENT_COLOURS = {"cord": PURPLE, "car rope": BLUE, "counterweight rope": BLUE, "stop": WINE}
"""By contact; those of the shaft alone have none in their words, and pulleys of belts names."""


EVENT_DASHES = {
    **dict.fromkeys(("breakaway", "slips", "slack", "left"), (2.5, 2.0)),
    **dict.fromkeys(("comes to rest", "sticks", "taut"), (4.0, 1.5, 1.0, 1.5)),
}
OTHER_EVENTS = (1.0, 1.5)


def event_dashes(words: str) -> tuple[float, ...]:
    """Return dashes and gaps of the line of an event, in points, shorter than those of lines."""
    return EVENT_DASHES.get(words.rpartition(": ")[2], OTHER_EVENTS)


def event_colour(words: str) -> str:
    """Return the colour of an event, which is the same in pictures, charts and tables."""
    contact, _, event = words.rpartition(": ")
    named = {"comes to rest": GREEN, "breakaway": VERMILION, "reverses": ORANGE}
    named |= {"sticks": GREEN, "slips": VERMILION}
    return EVENT_COLOURS.get(contact) or named.get(event, GREY)


PAGE = {
    "background": "#FFFFFF",
    "text": "#1A1A1A",
    "faint": "#5C5C5C",
    "rule": "#D0D0D0",
    "panel": "#F5F5F5",
    "accent": BLUE,
    "good": "#00674B",
    "bad": "#B34700",
    "drawing-edge": EDGE,
}
PAGE_ON_DARK = {
    "background": "#16181B",
    "text": "#E8E8E8",
    "faint": "#A8A8A8",
    "rule": "#3C4046",
    "panel": "#1F2226",
    "accent": SKY,
    "good": "#2FC79D",
    "bad": "#F0A030",
    "drawing-edge": "#E2E2E2",
}


def page_style() -> str:
    """Return the colours of a page as variables of CSS, and looks of its parts by their roles.

    Charts have their colours within: those on dark replace them there.
    """
    light, dark = _variables(PAGE, ROLES), _variables(PAGE_ON_DARK, ROLES_ON_DARK)
    looks = "\n".join(
        f".fill-{role} {{ fill: var(--role-{role}); }}\n"
        f".line-{role} {{ stroke: var(--role-{role}); }}"
        for role in ROLES
    )
    lines = "\n".join(
        f'.plotly [style*="{what}: {_rgb(one)}"] {{ {what}: {other} !important; }}'
        for one, other in zip(LINE_COLOURS, COLOURS_ON_DARK, strict=True)
        for what in ("stroke", "fill")
    )
    lines += "".join(
        f'\n.dot[style*="{one}"] {{ background: {other} !important; }}'
        for one, other in zip(LINE_COLOURS, COLOURS_ON_DARK, strict=True)
    )
    return (
        f":root {{ color-scheme: light dark; {light} }}\n{looks}\n"
        f"@media screen and (prefers-color-scheme: dark) {{\n:root {{ {dark} }}\n{lines}\n}}\n"
    )


def _rgb(colour: str) -> str:
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return f"rgb({red}, {green}, {blue})"


def _variables(colours: Mapping[str, str], roles: Mapping[str, str]) -> str:
    named = {**colours, **{f"role-{role}": colour for role, colour in roles.items()}}
    return " ".join(f"--{name}: {colour.lower()};" for name, colour in named.items())


def short_names(names: Sequence[str]) -> list[str]:
    """Return the shortest ends of keys that tell them apart, and do not begin with a number."""

    def short(name: str) -> str:
        parts = name.split(".")
        for count in range(1, len(parts) + 1):
            end = ".".join(parts[-count:])
            same = [other for other in names if f".{other}".endswith(f".{end}")]
            if len(same) == 1 and not parts[-count].isdecimal():
                break
        return end

    return [short(name) for name in names]
