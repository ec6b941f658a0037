"""A line of a terminal that shows what a study is at, and is erased at the end."""

import sys

from frictionsim.cli.monitor import CLEAR_LINE
from frictionsim.io.terminal import is_terminal, visible, write_on_stderr


class StatusLine:
    """Shows a text in one line of a terminal; the line is erased at the end."""

    def __enter__(self) -> "StatusLine":
        self._shown = is_terminal(sys.stderr)
        return self

    def __call__(self, text: str) -> None:
        if self._shown:
            write_on_stderr(f"{CLEAR_LINE}{visible(text)}")

    def __exit__(self, *_: object) -> None:
        if self._shown:
            write_on_stderr(CLEAR_LINE)
