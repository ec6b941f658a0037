"""What the package logs, as lines on stderr like those of `print_error`.

Imported where something runs: `logging` takes a tenth of the time of --help to import.
"""

import logging

LEVELS = (logging.WARNING, logging.INFO, logging.DEBUG)


def log_on_stderr(verbose: int) -> None:
    """Show warnings; with -v also information, with -vv also details.

    Parameters
    ----------
    verbose : int
        How often -v was given.
    """
    handler = logging.StreamHandler()
    handler.setFormatter(_Format())
    logger = logging.getLogger("frictionsim")
    logger.handlers = [handler]
    logger.setLevel(LEVELS[min(verbose, 2)])


class _Format(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        level = "" if record.levelno <= logging.INFO else f"{record.levelname.lower()}: "
        return f"frictionsim: {level}{record.getMessage()}"
