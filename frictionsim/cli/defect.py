"""The message for an exception that nobody expected."""

from traceback import walk_tb

PACKAGE = "frictionsim"


def defect_message(error: Exception) -> str:
    """Return the message for an internal error, which names the plug-in that it comes from."""
    plugin = _plugin_of(error)
    whose = f"error in the plug-in {plugin}" if plugin else "internal error"
    to = f"to the authors of {plugin} " if plugin else ""
    return (
        f"{whose}: {type(error).__name__}: {error}\n"
        f"please report it {to}with the scenario; --debug before the command shows the traceback"
    )


def _plugin_of(error: Exception) -> str:
    """Return the installed package whose function failed or called what failed; empty if ours."""
    from importlib.metadata import entry_points

    from frictionsim.scenario.plugins import GROUP

    names = [frame.f_globals.get("__name__", "") for frame, _ in walk_tb(error.__traceback__)]
    try:
        points = {_top(point.value): point for point in entry_points(group=GROUP)}
    except Exception:  # of any installed package: entry points are text without a check
        return ""
    calling = (top for top in map(_top, reversed(names)) if top == PACKAGE or top in points)
    point = points.get(next(calling, ""))
    return "" if point is None else str(point.dist.name if point.dist else point.value)


def _top(module: str) -> str:
    """Return the package that is imported for a module."""
    return module.partition(":")[0].partition(".")[0]
