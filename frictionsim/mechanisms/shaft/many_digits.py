"""Numbers of sixty digits, in which a balance of forces may cancel without a loss.

Roots of eq 24 are sensitive where loads nearly cancel or a force has nearly no arm. With these
numbers they are those of the numbers in the scenario, as they are written there.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from decimal import Decimal, localcontext
from functools import lru_cache
from math import inf

DIGITS = 60
PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459230781640628621")
# Terms below it do not change a sum of numbers of the size of 1.
_NEGLIGIBLE = Decimal(10) ** -(DIGITS + 2)
_HALVINGS = 4


@contextmanager
def many_digits() -> Iterator[None]:
    """Return the context in which numbers have so many digits."""
    with localcontext() as context:
        context.prec = DIGITS
        yield


def exact(number: float | Decimal) -> Decimal:
    """Return a number as it is written in a scenario: 0.15, not the nearest number of base 2."""
    return number if isinstance(number, Decimal) else Decimal(repr(float(number)))


@lru_cache(maxsize=4)  # of what is given and of what is sought
def cosine_and_sine(degrees: Decimal) -> tuple[Decimal, Decimal]:
    """Return cosine and sine of an angle, deg; those of quarter turns are exact."""
    quarters = (degrees / 90).to_integral_value()
    x = (degrees - 90 * quarters) * PI / 180
    c, s = _near_zero(x)
    return ((c, s), (-s, c), (-c, -s), (s, -c))[int(quarters % 4) % 4]


def _near_zero(x: Decimal) -> tuple[Decimal, Decimal]:
    """Return cosine and sine by their series at a fraction of x, rad, and doubled angles."""
    x = x / 2**_HALVINGS
    term, n, power = x, 1, x * x
    sine = x
    while abs(term) > _NEGLIGIBLE:
        n += 2
        term = -term * power / (n * (n - 1))
        sine += term
    # 1 - cos, which keeps its digits when it is doubled.
    versine = 1 - (1 - sine * sine).sqrt()
    for _ in range(_HALVINGS):
        versine, sine = 2 * sine * sine, 2 * sine * (1 - versine)
    return 1 - versine, sine


def rounded(number: Decimal | None) -> float | None:
    """Return the nearest number of double precision; None beyond its range."""
    if number is None:
        return None
    found = float(number)
    return found if abs(found) < inf else None
