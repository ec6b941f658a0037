"""Compiled runs, as Python."""

from collections.abc import Callable
from typing import Any

import pytest

from frictionsim.solvers.compilation import Kernel


def interpret(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let Python run what is compiled elsewhere: compiling each form takes ten seconds."""
    monkeypatch.setattr(Kernel, "compiled", lambda self, call: _interpreted(self._function))


def _interpreted(function: Callable[..., int]) -> Callable[..., int]:
    """Return the function for arrays whose parts share their memory, as in compiled code."""

    def call(
        template: Any, numbers: Any, states: Any, rows: Any, events: Any, progress: Any, steps: Any
    ) -> int:
        views = [memoryview(state) for state in states]
        buffers = memoryview(rows), memoryview(events)
        return function(template, numbers, views, *buffers, progress, steps)

    return call
