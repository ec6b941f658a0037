"""The values that a key is to have: a list, a range of numbers, or a distribution.

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
from fractions import Fraction
from functools import partial
from math import exp, isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.errors import InputError, unknown
from frictionsim.scenario.model_fields import names_in
from frictionsim.scenario.toml_data import parsed_value, plain, toml_value

if TYPE_CHECKING:
    from frictionsim.results import Array

MAX_RUNS = 10_000_000
CALL = re.compile(r"\s*([a-z]+)\s*\((.*)\)\s*", re.DOTALL)
# The largest double below 1 and its distance from 1: no quantile of a distribution is infinite.
NEXT_TO_ZERO, NEXT_TO_ONE = 2.0**-53, 1.0 - 2.0**-53
EXPECTED = (
    "a TOML list, e.g. [0.1, 0.2], lin(a, b, n), log(a, b, n), or with a sample uniform(a, b),"
    " normal(m, s), lognormal(m, s), triangular(a, c, b)"
)


class Levels(NamedTuple):
    """The values of a key, one after the other, and the text that gives them."""

    size: int  # a design that has too many runs is refused before they are made
    text: str  # that gives them
    made: Callable[[], tuple[Any, ...]]

    @property
    def values(self) -> tuple[Any, ...]:
        """The values."""
        return self.made()


class Distribution(NamedTuple):
    """The distribution of a key."""

    name: str
    arguments: tuple[float, ...]

    @property
    def text(self) -> str:
        """As it is written in a study."""
        return f"{self.name}({', '.join(map(repr, self.arguments))})"

    def quantiles(self, probabilities: "Array") -> "Array":
        """Return the quantiles for numbers between 0 and 1."""
        import numpy as np

        return _frozen(self).ppf(np.clip(probabilities, NEXT_TO_ZERO, NEXT_TO_ONE))


Values = Levels | Distribution


def values_by_key(given: Iterable[tuple[str, Any]]) -> dict[str, Values]:
    """Return values by key, as of `values_of`; keys with commas between them have one."""
    found: dict[str, Values] = {}
    known: set[str] = set()
    for text, values in given:
        names = [name.strip() for name in names_in(text)]
        for name in names:
            if not name:
                raise InputError(
                    f"vary: expected a key, or several with commas between them, e.g. a.b,a.c; got"
                    f" '{text}'"
                )
            if name in known:
                raise InputError(f"vary: {name} is given twice; give all its values in one list")
            known.add(name)
        key = ",".join(names)
        found[key] = values_of(key, values)
    return found


def values_of(key: str, given: Any) -> Values:
    """Return the values that are given for a key: text as above, or of Python any iterable."""
    if isinstance(given, Levels | Distribution):
        return given
    if not isinstance(given, str):
        return _levels_of_python(key, given)
    called = CALL.fullmatch(given)
    if called:
        return _of_call(key, given.strip(), *called.groups())
    return _levels(key, _parsed(key, given), given.strip())


def _levels_of_python(key: str, given: Any) -> Levels:
    found = plain(list(given) if isinstance(given, range) else given, f"vary: {key}")
    return _levels(key, found, toml_value(found))


def _levels(key: str, found: Any, text: str) -> Levels:
    if not isinstance(found, list):
        raise InputError(f"vary {key}: expected {EXPECTED}; got {toml_value(found)}")
    if not found:
        raise InputError(f"vary {key}: the list is empty; give at least one value")
    return Levels(len(found), text, partial(tuple, found))


def _parsed(key: str, text: str) -> Any:
    try:
        return parsed_value(text)
    except ValueError:
        raise InputError(
            f'vary {key}: expected {EXPECTED}; words in quotes, e.g. ["a"]; got {text!r}'
        ) from None


def _of_call(key: str, text: str, name: str, arguments: str) -> Values:
    if name not in RANGES and name not in DISTRIBUTIONS:
        known = [*RANGES, *DISTRIBUTIONS]
        raise InputError(f"vary {key}: {unknown('range or distribution', name, known)}")
    parts = [part.strip() for part in arguments.split(",")]
    wanted = RANGES[name] if name in RANGES else DISTRIBUTIONS[name].arguments
    if len(parts) != len(wanted.split(",")):
        raise InputError(f"vary {key}: expected {name}({wanted}), got {text}")
    numbers = [_number(key, part, text) for part in parts]
    if name in RANGES:
        return _range(key, name, parts, numbers, text)
    fault = DISTRIBUTIONS[name].fault(*numbers)
    if fault:
        raise InputError(f"vary {key}: {text}: {fault}")
    return Distribution(name, tuple(numbers))


def _number(key: str, part: str, text: str) -> float:
    try:
        found = float(part)
    except ValueError:
        found = float("nan")
    if not isfinite(found):
        raise InputError(f"vary {key}: expected finite numbers in {text}, got '{part}'")
    return found


def _range(key: str, name: str, parts: list[str], numbers: list[float], text: str) -> Levels:
    first, last, count = numbers
    if count < 1.0 or count % 1.0:
        raise InputError(f"vary {key}: {text}: expected a whole number of values above 0")
    if count > MAX_RUNS:
        raise InputError(f"vary {key}: {text}: more values than the limit of {MAX_RUNS}")
    if count == 1.0 and first != last:
        raise InputError(f"vary {key}: {text}: one value cannot be both the first and the last")
    if name == "log" and min(first, last) <= 0.0:
        raise InputError(f"vary {key}: {text}: expected a and b above 0")
    return Levels(int(count), text, partial(_values_of_range, name, parts, numbers))


def _values_of_range(name: str, parts: list[str], numbers: list[float]) -> tuple[Any, ...]:
    """Return the values of a range."""
    import numpy as np

    first, last, count = numbers
    if name == "log":
        found = np.geomspace(first, last, int(count)).tolist()
        found[-1] = last
    else:
        found = _evenly(Fraction(parts[0]), Fraction(parts[1]), int(count))
    # Keys that are whole numbers, as the number of bodies, take no others.
    whole = not any(set(part) & set(".eE") for part in parts[:2])
    if whole and all(value % 1.0 == 0.0 for value in found):
        return tuple(map(int, found))
    return tuple(found)


def _evenly(first: Fraction, last: Fraction, count: int) -> list[float]:
    """Return numbers at equal distances, each the double next to the decimal number.

    In binary fractions the second of lin(0.1, 0.4, 31) is 0.11000000000000001.
    """
    steps = max(count - 1, 1)
    whole = first.denominator * last.denominator
    a, b = first.numerator * last.denominator, last.numerator * first.denominator
    return [(a * (steps - i) + b * i) / (whole * steps) for i in range(count)]


class _Family(NamedTuple):
    """A family of distributions: its arguments, and what is wrong with given ones."""

    arguments: str
    fault: Callable[..., str]


RANGES = {"lin": "a, b, n", "log": "a, b, n"}
DISTRIBUTIONS = {
    "uniform": _Family("a, b", lambda a, b: "" if a < b else "expected a below b"),
    "normal": _Family("m, s", lambda m, s: "" if s > 0.0 else "expected s above 0"),
    "lognormal": _Family("m, s", lambda m, s: "" if s > 0.0 else "expected s above 0"),
    "triangular": _Family(
        "a, c, b", lambda a, c, b: "" if a <= c <= b and a < b else "expected a <= c <= b, a < b"
    ),
}


def _frozen(distribution: Distribution) -> Any:
    """Return the distribution of SciPy."""
    from scipy import stats

    arguments = distribution.arguments
    if distribution.name == "uniform":
        a, b = arguments
        return stats.uniform(loc=a, scale=b - a)
    if distribution.name == "normal":
        return stats.norm(*arguments)
    if distribution.name == "lognormal":
        mean, deviation = arguments
        return stats.lognorm(deviation, scale=exp(mean))
    a, c, b = arguments
    return stats.triang((c - a) / (b - a), loc=a, scale=b - a)
