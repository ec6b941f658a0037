"""What the package logs, as lines on stderr like those of `print_error`.

Imported where something runs: `logging` takes a tenth of the time of --help to import.
"""

import logging

from frictionsim.cli.messages import print_error

LEVELS = (logging.WARNING, logging.INFO, logging.DEBUG)


def log_on_stderr(verbose: int) -> None:
    """Show warnings; with -v also information, with -vv also details.

    Parameters
    ----------
    verbose : int
        How often -v was given.
    """
    logger = logging.getLogger("frictionsim")
    logger.handlers = [_Lines()]
    logger.setLevel(LEVELS[min(verbose, 2)])


class _Lines(logging.Handler):
    """Prints records as messages: one that cannot be printed does not end the run."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print a record."""
        level = "" if record.levelno <= logging.INFO else f"{record.levelname.lower()}: "
        print_error(f"{level}{record.getMessage()}")
