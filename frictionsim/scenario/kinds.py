"""The kinds of mechanism, by the name that a scenario gives as `kind`: built in or installed.

An installed package adds kinds by entry points of the group `frictionsim.kinds`, which give the
kind and its module: `block_brake = "frictionsim_brake.block_brake"`. They are read only for a kind
that is not built in, since searching the installed packages takes longer than simulating a
pulley. A faulty plug-in is reported where it is needed; it does not disturb the other kinds: lists
leave it out, with a warning.
"""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple, get_args

from frictionsim.errors import InputError, unknown

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "frictionsim.kinds"
REQUIRED = ("SCENARIO", "simulation", "statics", "PANELS", "METRICS")

# Checked modules by kind: a study asks for the module of its kind before each run.
_checked: dict[str, ModuleType] = {}
_warned: set[str] = set()

# The built-in kinds and their modules.
KINDS = {
    "pulley": "frictionsim.mechanisms.pulley",
    "marble_machine": "frictionsim.mechanisms.marble_machine",
    "epicyclic": "frictionsim.mechanisms.epicyclic",
    "shaft": "frictionsim.mechanisms.shaft",
    "belt_drive": "frictionsim.mechanisms.belt_drive",
}
# Those of them that have a mesh; the summary of a result imports the module of no other one.
KINDS_WITH_MESH = ("belt_drive",)


def kind_names() -> tuple[str, ...]:
    """Return all kinds: the built-in ones, then those of installed packages, sorted."""
    return (*KINDS, *_names())


def sound_kinds() -> tuple[str, ...]:
    """Return the kinds as `kind_names`, without those whose plug-in is faulty."""
    return (*KINDS, *_sound_names())


def mechanism_module(kind: str) -> ModuleType:
    """Import the module of a kind, without the other kinds; see `frictionsim.mechanisms`."""
    if kind in KINDS:
        return import_module(KINDS[kind])
    module = _module_of(kind)
    if module is None:
        raise InputError(unknown("kind", kind, list(kind_names())))
    return module


class Provider(NamedTuple):
    """An entry point: the module of a kind, and name and version of the installed package."""

    module: str
    package: str
    version: str

    def __str__(self) -> str:
        return f"{self.package} {self.version} (module {self.module})"


def _names() -> tuple[str, ...]:
    """Return the kinds of installed packages, sorted, without importing their modules.

    A kind that several packages provide, or that is built in, is left out with a warning.
    """
    try:
        by_kind = _providers()
    except InputError as error:
        _warn(error)
        return ()
    return tuple(kind for kind, providers in by_kind.items() if _is_usable(kind, providers))


def _sound_names() -> tuple[str, ...]:
    """Return the kinds of installed packages whose modules can be imported and are complete.

    The others are left out with a warning.
    """
    kinds = []
    for kind in _names():
        try:
            _module_of(kind)
        except InputError as error:
            _warn(error)
        else:
            kinds.append(kind)
    return tuple(kinds)


def _is_usable(kind: str, providers: list[Provider]) -> bool:
    """Return whether one package provides a kind that is not built in; else warn."""
    try:
        if kind in KINDS:
            raise InputError(
                f"the kind '{kind}' is built in, but is also provided by"
                f" {', '.join(map(str, providers))}; uninstall {providers[0].package} or rename"
                f" the kind in its entry point '{GROUP}'"
            )
        _check_unique(kind, providers)
    except InputError as error:
        _warn(error)
        return False
    return True


def _warn(error: InputError) -> None:
    """Warn of a faulty plug-in, once in a process."""
    import logging

    if str(error) not in _warned:
        _warned.add(str(error))
        logging.getLogger(__name__).warning("%s", error)


def _module_of(kind: str) -> ModuleType | None:
    """Import and check the module of a kind; None if no installed package provides the kind."""
    if kind not in _checked:
        providers = _providers().get(kind)
        if providers is None:
            return None
        _check_unique(kind, providers)
        _checked[kind] = _imported(kind, providers[0])
    return _checked[kind]


def _providers() -> dict[str, list[Provider]]:
    """Return the providers of each kind, sorted."""
    from importlib.metadata import entry_points

    try:
        points = entry_points(group=GROUP)
    except Exception as error:  # of any installed package: entry points are text without a check
        raise InputError(
            f"cannot read the entry points of the installed packages: {_text_of(error)};"
            " reinstall the package that was installed or changed last"
        ) from error
    providers: dict[str, list[Provider]] = {}
    for kind, provider in sorted({(point.name, _provider(point)) for point in points}):
        providers.setdefault(kind, []).append(provider)
    return providers


def _provider(point: "EntryPoint") -> Provider:
    metadata: Any = {}
    with suppress(OSError):  # what the package importlib_metadata says of a package without any
        metadata = getattr(point.dist, "metadata", None) or {}
    package, version = metadata.get("Name"), metadata.get("Version")
    return Provider(point.value, package or "a package without a name", version or "(no version)")


def _check_unique(kind: str, providers: list[Provider]) -> None:
    if len(providers) > 1:
        raise InputError(
            f"the kind '{kind}' is provided by {' and by '.join(map(str, providers))};"
            " uninstall all but one of them"
        )


def _imported(kind: str, provider: Provider) -> ModuleType:
    with _reported(
        f"the plug-in of the kind '{kind}', {provider}, cannot be imported",
        f'{provider.package} (python -c "import {provider.module}" shows where it fails)',
    ):
        module = import_module(provider.module)
    incomplete = f"the plug-in of the kind '{kind}', {provider}, is not complete"
    with _reported(incomplete, provider.package):
        faults = "; ".join(_faults(kind, module))
    if faults:
        raise InputError(f"{incomplete}: {faults}; repair or uninstall {provider.package}")
    return module


@contextmanager
def _reported(fault: str, package: str) -> Iterator[None]:
    """Raise any error of a plug-in as InputError: its module may raise anything, also exit."""
    try:
        yield
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        text = f"{fault}: {_text_of(error)}; repair or uninstall {package}"
        raise InputError(text) from error


def _faults(kind: str, module: ModuleType) -> Iterator[str]:
    """Yield the faults of a plug-in module: missing names, wrong types."""
    missing = [name for name in REQUIRED if not hasattr(module, name)]
    # `build` is what the default ladders and references of a study need.
    if not all(hasattr(module, name) for name in ("ladders", "references")):
        missing += [] if hasattr(module, "build") else ["build (or ladders and references)"]
    if missing:
        yield f"its module lacks {', '.join(missing)}"
    for name in ("simulation", "statics"):
        if hasattr(module, name) and not callable(getattr(module, name)):
            yield f"expected a function {name}, got {_shown(getattr(module, name))}"
    if hasattr(module, "SCENARIO"):
        yield from _faults_of_model(kind, module.SCENARIO)


def _faults_of_model(kind: str, model: Any) -> Iterator[str]:
    from frictionsim.scenario.settings import Scenario

    if not (isinstance(model, type) and issubclass(model, Scenario)):
        yield f"expected SCENARIO to be a class derived from Scenario, got {_shown(model)}"
        return
    for name in ("PAIRS", "CHANNELS"):
        if not hasattr(model, name):
            yield f"its SCENARIO {model.__name__} lacks {name}"
    kinds = get_args(model.model_fields["kind"].annotation)
    if kind not in kinds:
        yield (
            f"expected kind: Literal['{kind}'] in SCENARIO {model.__name__}, as in the entry point,"
            f" got {_shown(model.model_fields['kind'].annotation)}"
        )


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _text_of(error: BaseException) -> str:
    """Return type and text of an exception on one line; the type alone if the text fails."""
    text = ""
    try:
        text = " ".join(str(error).split())
    except KeyboardInterrupt:
        raise
    except BaseException:  # of the class of a plug-in
        pass
    return f"{type(error).__name__}: {text}".removesuffix(": ")
