"""Mechanisms in which dry friction decides: exact stick, located breakaway.

    import frictionsim as fs

    result = fs.solve("pulley.toml", {"effects.shaft_friction.mu_s": 0.3})
    print(result.quantities["breakaway_time"], result.dataset["angle"])

Modules are imported when one of their names is first used, so that this import takes no time.
"""

from frictionsim.version import __version__ as __version__

TYPE_CHECKING = False  # for type checkers it is true; importing `typing` for it would take 10 ms
if TYPE_CHECKING:
    from frictionsim.api.comparing import compare as compare
    from frictionsim.api.fitting import Fit as Fit
    from frictionsim.api.fitting import fit as fit
    from frictionsim.api.pictures import animate as animate
    from frictionsim.api.pictures import plot as plot
    from frictionsim.api.reporting import report as report
    from frictionsim.api.result import Result as Result
    from frictionsim.api.result import open as open
    from frictionsim.api.scenarios import WarmedUp as WarmedUp
    from frictionsim.api.scenarios import kinds as kinds
    from frictionsim.api.scenarios import new as new
    from frictionsim.api.scenarios import scenarios as scenarios
    from frictionsim.api.scenarios import static as static
    from frictionsim.api.scenarios import warm_up as warm_up
    from frictionsim.api.solving import resume as resume
    from frictionsim.api.solving import solve as solve
    from frictionsim.api.studies import Study as Study
    from frictionsim.api.studies import cost as cost
    from frictionsim.api.sweep_result import Sweep as Sweep
    from frictionsim.api.sweep_result import open_sweep as open_sweep
    from frictionsim.api.sweeping import resume_sweep as resume_sweep
    from frictionsim.api.sweeping import sweep as sweep
    from frictionsim.cli.commands import run_command_line as run_command_line
    from frictionsim.errors import ArgumentError as ArgumentError
    from frictionsim.errors import AuditError as AuditError
    from frictionsim.errors import FrictionsimError as FrictionsimError
    from frictionsim.errors import InputError as InputError
    from frictionsim.errors import Interrupted as Interrupted
    from frictionsim.errors import OutputError as OutputError
    from frictionsim.errors import ScenarioError as ScenarioError
    from frictionsim.errors import SolverError as SolverError
    from frictionsim.io.comparison import Comparison as Comparison
    from frictionsim.results import Check as Check
    from frictionsim.results import Quantity as Quantity
    from frictionsim.scenario.authoring import schema as schema
    from frictionsim.scenario.loading import load as load
    from frictionsim.scenario.loading import loads as loads
    from frictionsim.scenario.settings import Scenario as Scenario

_MODULES = {
    name: module
    for module, names in {
        "scenario.loading": "load loads",
        "scenario.settings": "Scenario",
        "api.solving": "solve resume",
        "api.scenarios": "static new scenarios kinds warm_up WarmedUp",
        "api.result": "open Result",
        "api.studies": "cost Study",
        "api.sweeping": "sweep resume_sweep",
        "api.sweep_result": "open_sweep Sweep",
        "api.fitting": "fit Fit",
        "api.comparing": "compare",
        "io.comparison": "Comparison",
        "api.pictures": "plot animate",
        "api.reporting": "report",
        "scenario.authoring": "schema",
        "cli.commands": "run_command_line",
        "results": "Quantity Check",
        "errors": "FrictionsimError InputError ArgumentError Interrupted ScenarioError SolverError"
        " AuditError OutputError",
    }.items()
    for name in names.split()
}

# Without `open`, which `from frictionsim import *` would hide.
__all__ = [name for name in _MODULES if name != "open"]


if not TYPE_CHECKING:  # a type checker would take every name for one of this module

    def __getattr__(name: str) -> object:
        """Import a public name when it is first used."""
        if name not in _MODULES:
            raise AttributeError(f"module 'frictionsim' has no attribute '{name}'")
        from importlib import import_module

        module = import_module(f"frictionsim.{_MODULES[name]}")
        value = getattr(module, name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return sorted([*_MODULES, "__version__"])
