"""matplotlib's parameters at their defaults, so that a picture does not depend on who draws it."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from threading import RLock
from typing import Any
from warnings import catch_warnings, simplefilter

from frictionsim.errors import InputError, OutputError

try:
    import matplotlib as mpl
    import matplotlib.font_manager  # which keeps a list of fonts in a folder
except UnicodeDecodeError as error:
    raise InputError(
        f"cannot draw: the file matplotlibrc, of this folder or the user, is not text: {error}"
    ) from None
except OSError as error:
    raise OutputError(
        f"cannot draw: matplotlib found no folder for its settings and fonts ({error}); set"
        " MPLCONFIGDIR to one that can be written to"
    ) from None

# Of matplotlib.style: what is about windows and files and not about how a picture looks.
NOT_OF_STYLE = {
    "backend",
    "backend_fallback",
    "date.epoch",
    "docstring.hardcopy",
    "figure.max_open_warning",
    "figure.raise_window",
    "interactive",
    "savefig.directory",
    "timezone",
    "tk.window_focus",
    "toolbar",
    "webagg.address",
    "webagg.open_in_browser",
    "webagg.port",
    "webagg.port_retries",
}

_lock = RLock()


def defaults() -> dict[str, Any]:
    """Return the defaults of all parameters that are about how a picture looks."""
    return _of_style(mpl.rcParamsDefault)


def of_user() -> dict[str, Any]:
    """Return the parameters that the user has set, in matplotlibrc or in Python."""
    return _of_style(mpl.rcParams)


def _of_style(values: Any) -> dict[str, Any]:  # whose names are typed one by one
    return {name: value for name, value in values.items() if name not in NOT_OF_STYLE}


@contextmanager
def parameters(wanted: Mapping[str, Any]) -> Iterator[None]:
    """Have some of matplotlib's parameters at given values, in one thread at a time.

    Parameters belong to the whole process: two threads that change and restore them in turn would
    leave the values of the first. Only those that differ are changed, and only those that nobody
    has changed since are restored, so that a change by the user in another thread is not lost.

    Parameters
    ----------
    wanted : mapping
        By name; the others stay.
    """
    current: Any = mpl.rcParams
    with _lock:
        before = {name: current[name] for name, value in wanted.items() if current[name] != value}
        _set(current, {name: wanted[name] for name in before})
        try:
            yield
        finally:
            _set(current, {k: v for k, v in before.items() if current[k] == wanted[k]})


def _set(parameters: Any, values: dict[str, Any]) -> None:
    with catch_warnings():
        simplefilter("ignore")  # of parameters that are deprecated
        parameters.update(values)
