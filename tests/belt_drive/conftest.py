"""What tests of belts share."""

from collections.abc import Iterator

import numpy as np
import pytest

from tests.support.belt_kernels import COMPILED_MODULES


@pytest.fixture
def uncompiled(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Kernels as plain Python: where a few evaluations are not worth a compilation."""
    for module in COMPILED_MODULES:
        for name, value in vars(module).copy().items():
            monkeypatch.setattr(module, name, getattr(value, "py_func", value))
    with np.errstate(all="ignore"):  # indices wrap around, and what is open is divided by zero
        yield
