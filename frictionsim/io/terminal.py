"""Text on stdout and stderr: foreign control characters are escaped, and stderr never ends a run.

All printed text passes `visible`, the only place that handles control characters.
"""

import os
import sys
from contextlib import suppress
from typing import Any, TextIO

from frictionsim.errors import OutputError

# Control characters of ASCII except tab and newline, those above ASCII, line and paragraph
# separators, and marks that change the direction of writing: those in a foreign file could set a
# terminal's title, erase its lines or show a text in another order.
CONTROL = (
    *range(0x09),
    *range(0x0B, 0x20),
    *range(0x7F, 0xA0),
    *(0x061C, 0x200E, 0x200F, 0x2028, 0x2029),
    *range(0x202A, 0x202F),
    *range(0x2066, 0x206A),
)
ESCAPES = {code: f"\\x{code:02x}" if code < 0x80 else f"\\u{code:04x}" for code in CONTROL}
NO_STREAM = (OSError, ValueError)  # disk full or no reader; closed by the program itself


def visible(text: str) -> str:
    r"""Return text with its control characters as escapes: \x1b, \u202e.

    Characters that TOML allows in a text are escaped as in TOML, so that a printed scenario can be
    read.
    """
    return text.translate(ESCAPES)


def print_on_stderr(text: str) -> None:
    """Print a line on stderr; errors of printing are ignored.

    A full disk for the log, or a closed pipe, changes neither the run nor its exit code.
    """
    write_on_stderr(f"{visible(text)}\n")


def write_on_stderr(text: str) -> None:
    """Write text of this program on stderr, such as escape sequences, as `print_on_stderr`."""
    stream = sys.stderr
    if stream is None:  # print() would use stdout instead
        return
    with suppress(*NO_STREAM):
        stream.write(text)
        stream.flush()


def is_terminal(stream: TextIO | None) -> bool:
    """Return whether a stream is a terminal; False if it is closed."""
    with suppress(*NO_STREAM):
        return stream is not None and stream.isatty()
    return False


class Stderr:
    """Stderr for other libraries, such as a progress bar: writing never fails.

    It is looked up at each call, as `print` does: tests and notebooks replace it.
    """

    encoding = "utf-8"

    def write(self, text: str) -> int:
        """Write text that holds escape sequences on purpose."""
        write_on_stderr(text)
        return len(text)

    def flush(self) -> None:
        """Do nothing: each text is written at once."""

    def isatty(self) -> bool:
        """Return whether it is a terminal."""
        return is_terminal(sys.stderr)

    def __getattr__(self, name: str) -> Any:
        return getattr(sys.stderr, name)


class ReaderGone(Exception):
    """The reader of the pipe on stdout has closed it, as `head` does."""


class Stdout:
    """Stdout as a file for text of unknown origin.

    Text for a closed stdout is discarded.
    """

    def write(self, text: str) -> int:
        """Write text with its control characters escaped.

        OutputError is raised if it cannot be written, as on a full disk; ReaderGone if nobody reads
        the other end of the pipe.
        """
        self._try("write", visible(text))
        return len(text)

    def flush(self) -> None:
        """Write the buffered text; raise the errors of `write`."""
        self._try("flush")

    def _try(self, method: str, *arguments: str) -> None:
        if sys.stdout is None:
            return
        try:
            getattr(sys.stdout, method)(*arguments)
        except BrokenPipeError:
            _discard_stdout()
            raise ReaderGone from None
        except OSError as error:
            raise OutputError(f"cannot print the output: {error.strerror or error}") from None


def _discard_stdout() -> None:
    """Redirect stdout to the null device: its buffered text would fail again and again."""
    with suppress(OSError):
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, sys.stdout.fileno())
        os.close(null)
