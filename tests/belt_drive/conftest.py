"""What tests of belts share."""

from collections.abc import Iterator

import numpy as np
import pytest

from frictionsim.mechanisms.belt_drive.kernels.jit import BeltKernel


@pytest.fixture
def uncompiled(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Kernels as plain Python: where a few evaluations are not worth a compilation."""
    monkeypatch.setattr(BeltKernel, "__call__", lambda self, *arguments: self.py_func(*arguments))
    with np.errstate(all="ignore"):  # indices wrap around, and what is open is divided by zero
        yield
