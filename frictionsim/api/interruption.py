"""Ctrl-C during a run that writes a file: the run stops after its step and the file is written."""

import signal
import threading
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Any

from frictionsim.errors import Interrupted


class StopAfterStep:
    """A context in which the first SIGINT stops a run after its current step.

    A second one raises KeyboardInterrupt at once. Nothing is changed outside of the main thread, or
    if the program handles SIGINT itself.
    """

    def __init__(self) -> None:
        self.received = False

    def __enter__(self) -> "StopAfterStep":
        self._installed = (
            threading.current_thread() is threading.main_thread()
            and signal.getsignal(signal.SIGINT) is signal.default_int_handler
        )
        if self._installed:
            signal.signal(signal.SIGINT, self._on_signal)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._installed:
            signal.signal(signal.SIGINT, signal.default_int_handler)

    def after(self, on_step: Callable[[float], Any]) -> Callable[[float], Any]:
        """Return an `on_step` that stops the run after a signal, with the attributes of another."""
        if not self._installed:
            return on_step

        def stop_or_go_on(t: float) -> None:
            if self.received:
                raise Interrupted(signal.SIGINT, t)
            on_step(t)

        compiling = getattr(on_step, "compiling", None)
        if compiling is not None:
            stop_or_go_on.compiling = compiling  # type: ignore[attr-defined]
        return stop_or_go_on

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self.received:
            raise KeyboardInterrupt
        self.received = True
