"""Study files in TOML.

[study]
scenario = "pulley.toml"            # relative to this file; or the tables of a scenario
sample = 256                        # of the distributions below; without it all combinations
method = "sobol"                    # or lhs, random
seed = 1

[set]                               # overrides of all runs
"solver.rtol" = 1e-6

[vary]                              # keys as for --set
"effects.shaft_friction.mu_s" = "uniform(0.1, 0.3)"
"mechanism.load" = "normal(2224, 50)"   # keys joined by commas are equal
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, Self

from pydantic import BeforeValidator, Field, model_validator

from frictionsim.errors import InputError, ScenarioError
from frictionsim.scenario.loading import load_file, validated
from frictionsim.scenario.model_fields import names_in, unknown_key
from frictionsim.scenario.options import Options, by_name
from frictionsim.scenario.origin import Origin, scenario_file
from frictionsim.scenario.schema import inconsistent
from frictionsim.scenario.toml_data import (
    KeyPlaces,
    key_lines,
    keys_and_values,
    plain,
    tables_and_keys,
    tables_of,
)
from frictionsim.scenario.validation import ValidationFailure, key_text, validate_model
from frictionsim.sweeps.values import (
    Distribution,
    VariedValues,
    values_by_key,
)

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario

TABLES = ("study", "set", "vary")
SAMPLE_OPTIONS = ("method", "seed", "indices")
BOTH = "is both set for all runs and varied; leave out one"
MAX_SEED = 2**63 - 1  # the largest number of TOML


def _varied(raw: Any) -> dict[str, VariedValues]:
    varied, faults = values_by_key(by_name("KEY=VALUES, e.g. a.b=[1, 2]", str)(raw).items())
    if faults:
        raise InputError("\n".join(f"vary {key}: {fault}" for key, fault in faults.items()))
    return varied


class SweepOptions(Options):
    """The variation of a scenario: [vary], and [study] without its `scenario`."""

    vary: Annotated[dict[str, Any], BeforeValidator(_varied)] = Field({})  # values by key
    zip: bool = Field(False, description="Vary the keys together instead of in all combinations.")
    sample: int | None = Field(None, description="Number of runs of a sample.", gt=0)
    method: Literal["sobol", "lhs", "random"] = Field("sobol", description="How it is drawn.")
    seed: int = Field(0, description="Seed of the sample.", ge=0, le=MAX_SEED)
    indices: bool = Field(False, description="Run the combinations for Sobol indices.")
    keep_series: bool = Field(False, description="Keep the result of each run.")

    @property
    def sampled_runs(self) -> int:
        """The number of runs of a sample, with the combinations for Sobol indices."""
        return (self.sample or 0) * (len(self.vary) + 2 if self.indices else 1)

    @model_validator(mode="after")
    def _need_a_sample(self) -> Self:
        for name in SAMPLE_OPTIONS if self.sample is None else ():
            if name in self.model_fields_set and getattr(self, name) is not False:
                fault = "it applies to a sample; give the number of its runs as 'sample'"
                raise inconsistent((name,), fault)
        return self


class SweepStudy(NamedTuple):
    """A study: a scenario and its variation."""

    scenario: "Scenario"
    options: SweepOptions
    folder: Path  # of file names in the values
    place: Callable[[str], str] | None = None  # of a key: file and line, for messages

    @contextmanager
    def placed(self) -> Iterator[None]:
        """Return the context in which a fault of the variation names file and line of its key."""
        try:
            yield
        except InputError as error:
            if self.place is None:
                raise
            raise InputError(f"{self.place(error.key)}: {error}") from error


def is_study(data: Mapping[str, Any]) -> bool:
    """Return whether tables belong to a study rather than a scenario."""
    return "study" in data


def study_of(data: Mapping[str, Any], folder: Path | None, name: str, text: str = "") -> SweepStudy:
    """Return the study in some tables, which are those of a text; the name is for messages.

    The folder is the base of relative file names; None for a study in the file of a sweep, which
    names no files. Raises a ScenarioError with all faults.
    """
    tables = _Tables(data, name, text)
    for key in data:
        if key not in TABLES:
            tables.add(key_text((key,)), "unknown table of a study; known: [study], [set], [vary]")
        elif not isinstance(data[key], Mapping):
            tables.add(key, "expected a table of keys")
    options, fixed = _options(tables), tables.leaves("set")
    for key in _varied_too(fixed, options.vary):
        tables.add(f"set.{key}", BOTH)
    scenario, place = _scenario(tables, folder, fixed)
    if scenario is not None:
        for key in options.vary:
            faults = (unknown_key(type(scenario), name) for name in names_in(key))
            for fault in filter(None, faults):
                tables.add(f"vary.{key}", fault)
    if scenario is None or tables.faults:
        raise ScenarioError(sorted(tables.faults, key=tables.line_of))
    return SweepStudy(scenario, options, place, tables.place if text else None)


class _Tables:
    """The tables of a study, and their faults, each with file, line and key."""

    def __init__(self, data: Mapping[str, Any], name: str, text: str) -> None:
        self.data, self.name, self.faults = data, name, list[str]()
        self.lines = key_lines(text) if text else dict.fromkeys(tables_and_keys(data), 0)
        self.place = KeyPlaces(name, lambda: self.lines, start=0).where

    def add(self, key: str, message: str) -> None:
        self.faults.append(f"{self.place(key)}: {key}: {message}")

    def line_of(self, fault: str) -> float:
        """Return the line of a fault, which the scenario's own file does not have here."""
        line = fault.removeprefix(f"{self.name}:").partition(":")[0]
        return int(line) if line.isdecimal() else inf

    def table(self, name: str) -> Mapping[str, Any]:
        content = self.data.get(name, {})
        return content if isinstance(content, Mapping) else {}

    def leaves(self, name: str) -> dict[str, Any]:
        """Return values by keys with dots, from nested tables or quoted keys."""
        leaves: dict[str, Any] = {}
        for key, value in keys_and_values(self.table(name), lists="whole"):
            if key in leaves:
                self.add(f"{name}.{key}", "is given twice, with and without quotes; leave one out")
            if not isinstance(value, Mapping):
                leaves[key] = value
        return leaves


def _options(tables: _Tables) -> SweepOptions:
    """Return the variation in the tables of a study; the default one of those with faults."""
    settings = {key: value for key, value in tables.table("study").items() if key != "scenario"}
    vary, faults = values_by_key(tables.leaves("vary").items())
    for key, fault in faults.items():
        tables.add(f"vary.{key}", fault)
    if "vary" in settings:
        tables.add("study.vary", "expected a table of its own, [vary]")
        del settings["vary"]
    try:
        return validate_model(SweepOptions, settings | {"vary": vary})
    except ValidationFailure as failure:
        for path, fault in failure.faults:
            tables.add(f"study.{key_text(path)}", fault)
    return SweepOptions(vary=vary)


def _scenario(
    tables: _Tables, folder: Path | None, fixed: Mapping[str, Any]
) -> "tuple[Scenario | None, Path]":
    """Return the scenario of a study, None with faults, and the folder of its files."""
    above, start = ("study", "scenario"), folder or Path()
    key, source = ".".join(above), tables.table("study").get("scenario")

    def by_set(of: str) -> str:
        return f"{tables.place(f'set.{of}')}: set."

    try:
        if isinstance(source, Mapping):
            inside = {path[2:]: n for path, n in tables.lines.items() if path[:2] == above}
            place = KeyPlaces(tables.name, lambda: inside, f"{key}.", inside.pop((), 0))
            return validated(plain(source), place, Origin(), folder, fixed, by=by_set), start
        if folder is None:
            tables.add(
                key, "expected the tables of a scenario: the file of a sweep names no others"
            )
        elif not isinstance(source, str):
            example = 'e.g. scenario = "pulley.toml", or its tables'
            tables.add(key, f"expected the file of a scenario, {example}")
        else:
            path = scenario_file(source, folder)
            if not path.exists() or path.is_file():  # opening a pipe would wait for its writer
                return load_file(path, fixed, by=by_set), path.parent
            tables.add(key, f"expected a file, '{source}' is none")
    except ScenarioError as error:
        tables.faults += error.faults
    return None, start


def options_of(data: Mapping[str, Any]) -> SweepOptions:
    """Return the variation in the tables of a study, without reading its scenario."""
    tables = _Tables(data, "study", "")
    options = _options(tables)
    if tables.faults:
        raise ScenarioError(tables.faults)
    return options


def check_not_fixed(fixed: Iterable[str], vary: Mapping[str, Any]) -> None:
    """Raise InputError if a key is set for all runs and varied as well."""
    for key in _varied_too(fixed, vary):
        raise InputError(f"{key} {BOTH}")


def _varied_too(fixed: Iterable[str], vary: Mapping[str, Any]) -> list[str]:
    """Return the keys of all runs that are varied as well."""
    varied = {name for key in vary for name in names_in(key)}
    return [key.strip() for key in fixed if key.strip() in varied]


def study_toml(study: SweepStudy) -> str:
    """Return a study as TOML, including its scenario, for `study_of`."""
    import tomli_w

    scenario, options = tables_of(study.scenario), study.options
    sample_options = () if options.sample is None else ("sample", *SAMPLE_OPTIONS)
    settings = {name: getattr(options, name) for name in ("zip", "keep_series", *sample_options)}
    vary = {key: _toml_values(values) for key, values in options.vary.items()}
    return tomli_w.dumps({"study": settings | {"scenario": scenario}, "vary": vary})


def _toml_values(values: VariedValues) -> Any:
    if isinstance(values, Distribution) or values.text.startswith(("lin", "log")):
        return values.text
    return list(values.values)
