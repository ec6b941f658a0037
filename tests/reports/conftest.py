from collections.abc import Iterator
from typing import Any

import pytest

from tests.support import browser as browsers


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """A headless browser."""
    with browsers.browser() as program:
        yield program
