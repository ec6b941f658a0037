"""Shell completions of arguments; nothing here may fail, since nobody would see why."""

from collections.abc import Iterable

from frictionsim.errors import FrictionsimError


def kinds(incomplete: str) -> list[str]:
    """Return the kinds of mechanism that begin with a text."""
    return _beginning(incomplete, _kinds())


def kinds_and_scenarios(incomplete: str) -> list[str]:
    """Return the kinds and the shipped scenarios that begin with a text."""
    from frictionsim.scenario.shipped import shipped_scenarios

    try:
        shipped = tuple(shipped_scenarios())
    except FrictionsimError:  # an installation without them
        shipped = ()
    return _beginning(incomplete, dict.fromkeys((*_kinds(), *shipped)))


def views(incomplete: str) -> list[str]:
    """Return the views of all kinds that begin with a text."""
    from frictionsim.plots import ALL, VIEWS

    return _beginning(
        incomplete, dict.fromkeys((*(v for views in VIEWS.values() for v in views), ALL))
    )


def styles(incomplete: str) -> list[str]:
    """Return the styles of pictures that begin with a text."""
    from frictionsim.plots.style import STYLES

    return _beginning(incomplete, STYLES)


def backends(incomplete: str) -> list[str]:
    """Return the backends of all kinds that begin with a text."""
    from frictionsim.scenario.methods import METHODS

    return _beginning(incomplete, METHODS)


def sampling_methods(incomplete: str) -> list[str]:
    """Return the ways to draw a sample that begin with a text."""
    from frictionsim.api.sweeping import METHODS

    return _beginning(incomplete, METHODS)


def _kinds() -> tuple[str, ...]:
    from frictionsim.scenario.kinds import KINDS, kind_names

    try:
        return kind_names()
    except FrictionsimError:  # plug-ins that conflict
        return tuple(KINDS)


def _beginning(incomplete: str, names: Iterable[str]) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]
