"""The values of a varied key: a list, a range of numbers, or a distribution.

[0.1, 0.2, 0.3]         a list, in TOML
lin(a, b, n)            n numbers from a to b at equal distances
log(a, b, n)            n numbers from a to b at equal ratios
uniform(a, b)           between a and b
normal(m, s)            mean m, standard deviation s
lognormal(m, s)         the natural logarithm is normal with mean m and standard deviation s
triangular(a, c, b)     between a and b, most probable at c
"""

import re
from collections.abc import Callable, Iterable
from decimal import Decimal, localcontext
from functools import partial
from math import exp, isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.errors import InputError, unknown
from frictionsim.scenario.model_fields import names_in
from frictionsim.scenario.overrides import REMOVED, REMOVED_TEXT
from frictionsim.scenario.toml_data import parsed_value, plain, toml_value

if TYPE_CHECKING:
    from frictionsim.results import Array

MAX_RUNS = 10_000_000
DIGITS = 50  # of decimal arithmetic; a double has 17
CALL = re.compile(r"\s*([a-z]+)\s*\((.*)\)\s*", re.DOTALL)
# The largest double below 1 and its distance from 1: no quantile of a distribution is infinite.
NEXT_TO_ZERO, NEXT_TO_ONE = 2.0**-53, 1.0 - 2.0**-53
EXPECTED = (
    "a TOML list, e.g. [0.1, 0.2], lin(a, b, n), log(a, b, n), or with a sample uniform(a, b),"
    " normal(m, s), lognormal(m, s), triangular(a, c, b)"
)


class Levels(NamedTuple):
    """The values of a key, in their order, and their text."""

    size: int  # a design with too many runs is refused before its values exist
    text: str  # as in the study
    make: Callable[[], tuple[Any, ...]]

    @property
    def values(self) -> tuple[Any, ...]:
        """The values."""
        return self.make()


class Distribution(NamedTuple):
    """The distribution of a key."""

    name: str
    arguments: tuple[float, ...]

    @property
    def text(self) -> str:
        """The text of the distribution in a study."""
        return f"{self.name}({', '.join(map(repr, self.arguments))})"

    def quantiles(self, probabilities: "Array") -> "Array":
        """Return the quantiles for numbers between 0 and 1."""
        import numpy as np
        from scipy import stats

        frozen = DISTRIBUTIONS[self.name].frozen(stats, *self.arguments)
        quantiles: Array = frozen.ppf(np.clip(probabilities, NEXT_TO_ZERO, NEXT_TO_ONE))
        return quantiles


VariedValues = Levels | Distribution


def values_by_key(
    entries: Iterable[tuple[str, Any]],
) -> tuple[dict[str, VariedValues], dict[str, str]]:
    """Return values by key, from `values_of`, and the faults of others.

    Keys separated by commas have one value.
    """
    varied: dict[str, VariedValues] = {}
    faults: dict[str, str] = {}
    known: set[str] = set()
    for text, values in entries:
        names = [name.strip() for name in names_in(text)]
        twice = [name for name in names if name in known or names.count(name) > 1]
        if "" in names:
            faults[text] = "expected a key, or several with commas between them, e.g. a.b,a.c"
        elif twice:
            faults[text] = f"{twice[0]} is given twice; give all its values in one list"
        else:
            try:
                varied[",".join(names)] = values_of(values)
            except InputError as error:
                faults[text] = str(error)
        known.update(names)
    return varied, faults


def values_of(spec: Any) -> VariedValues:
    """Return values from a specification: text as above, or any iterable; None is `none`."""
    if isinstance(spec, Levels | Distribution):
        return spec
    if not isinstance(spec, str):
        values = list(spec) if isinstance(spec, range | tuple) else spec
        if isinstance(values, list):
            values = [REMOVED_TEXT if value is REMOVED else value for value in values]
        values = plain(values, "values")
        return _levels(values, toml_value(values))
    called = CALL.fullmatch(spec)
    if called:
        return _parse_call(spec.strip(), *called.groups())
    try:
        values = parsed_value(spec)
    except ValueError:
        raise InputError(
            f'expected {EXPECTED}; words in quotes, e.g. ["a"]; got {spec!r}'
        ) from None
    return _levels(values, spec.strip())


def _levels(values: Any, text: str) -> Levels:
    if not isinstance(values, list):
        raise InputError(f"expected {EXPECTED}; got {toml_value(values)}")
    if not values:
        raise InputError("the list is empty; give at least one value")
    return Levels(len(values), text, partial(tuple, values))


def _parse_call(text: str, name: str, arguments: str) -> VariedValues:
    if name not in RANGES and name not in DISTRIBUTIONS:
        raise InputError(unknown("range or distribution", name, [*RANGES, *DISTRIBUTIONS]))
    parts = [part.strip() for part in arguments.split(",")]
    wanted = RANGES[name] if name in RANGES else DISTRIBUTIONS[name].arguments
    if len(parts) != len(wanted.split(",")):
        raise InputError(f"expected {name}({wanted}), got {text}")
    numbers = [_number(part, text) for part in parts]
    if name in RANGES:
        return _range(name, parts, numbers, text)
    fault = DISTRIBUTIONS[name].fault(*numbers)
    if fault:
        raise InputError(f"{text}: {fault}")
    return Distribution(name, tuple(numbers))


def _number(part: str, text: str) -> float:
    try:
        number = float(part)
    except ValueError:
        number = float("nan")
    if not isfinite(number):
        raise InputError(f"expected finite numbers in {text}, got '{part}'")
    return number


def _range(name: str, parts: list[str], numbers: list[float], text: str) -> Levels:
    first, last, count = numbers
    faults = {
        "expected a whole number of values above 0": count < 1.0 or count % 1.0,
        f"more values than the limit of {MAX_RUNS}": count > MAX_RUNS,
        "one value cannot be both the first and the last": count == 1.0 and first != last,
        "expected a and b above 0": name == "log" and min(first, last) <= 0.0,
    }
    for fault in (fault for fault, is_there in faults.items() if is_there):
        raise InputError(f"{text}: {fault}")
    return Levels(int(count), text, partial(_values_of_range, name, parts, numbers))


def _values_of_range(name: str, parts: list[str], numbers: list[float]) -> tuple[Any, ...]:
    """Return the values of a range, each the double nearest to its decimal number."""
    count = int(numbers[2])
    steps = max(count - 1, 1)
    # In binary arithmetic the second of lin(0.1, 0.4, 31) would be 0.11000000000000001.
    with localcontext(prec=DIGITS):
        a, b = map(Decimal, parts[:2])
        if name == "log":
            ratio = (b / a) ** (Decimal(1) / steps)
            values = [float(a * ratio**i) for i in range(count)]
        else:
            values = [float((a * (steps - i) + b * i) / steps) for i in range(count)]
    # Integer keys, such as the number of bodies, take no floats.
    whole = not any(set(part) & set(".eE") for part in parts[:2])
    if whole and all(value % 1.0 == 0.0 for value in values):
        return tuple(map(int, values))
    return tuple(values)


class _Family(NamedTuple):
    """A family of distributions."""

    arguments: str
    fault: Callable[..., str]  # of the arguments; empty if there is none
    frozen: Callable[..., Any]  # the distribution of `scipy.stats` with these arguments


RANGES = {"lin": "a, b, n", "log": "a, b, n"}
DISTRIBUTIONS = {
    "uniform": _Family(
        "a, b",
        lambda a, b: "" if a < b else "expected a below b",
        lambda stats, a, b: stats.uniform(loc=a, scale=b - a),
    ),
    "normal": _Family(
        "m, s",
        lambda m, s: "" if s > 0.0 else "expected s above 0",
        lambda stats, m, s: stats.norm(m, s),
    ),
    "lognormal": _Family(
        "m, s",
        lambda m, s: "" if s > 0.0 else "expected s above 0",
        lambda stats, m, s: stats.lognorm(s, scale=exp(m)),
    ),
    "triangular": _Family(
        "a, c, b",
        lambda a, c, b: "" if a <= c <= b and a < b else "expected a <= c <= b, a < b",
        lambda stats, a, c, b: stats.triang((c - a) / (b - a), loc=a, scale=b - a),
    ),
}
