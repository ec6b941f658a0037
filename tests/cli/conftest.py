"""What the tests of the command line share."""

import json
from collections.abc import Callable
from typing import Any

Run = Callable[..., tuple[str, str]]


def strict_json(text: str) -> Any:
    """Return JSON; NaN and Infinity are refused."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    return json.loads(text, parse_constant=refuse)
