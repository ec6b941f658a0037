"""Cases of a test of which a few are default tests and the others are slow ones."""

from collections.abc import Iterable
from typing import Any

import pytest


def slow(*values: Any) -> Any:
    """Return a case of a parametrised test that is a slow one."""
    return pytest.param(*values, marks=pytest.mark.slow)


def one_in(count: int, cases: Iterable[Any]) -> list[Any]:
    """Return cases of which the first and each `count`-th after it are default tests.

    The others are slow: they say the same of other inputs.

    """
    marked = []
    for number, case in enumerate(cases):
        if number % count == 0:
            marked.append(case)
        elif hasattr(case, "marks"):  # a case that has marks of its own
            marked.append(pytest.param(*case.values, marks=[*case.marks, pytest.mark.slow]))
        else:
            marked.append(slow(*case) if isinstance(case, tuple) else slow(case))
    return marked
