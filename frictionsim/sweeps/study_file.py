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

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, Self

from pydantic import BeforeValidator, Field, model_validator

from frictionsim.errors import InputError
from frictionsim.scenario.loading import load, load_tables
from frictionsim.scenario.model_fields import names_in
from frictionsim.scenario.options import Options, by_name
from frictionsim.scenario.schema import inconsistent
from frictionsim.scenario.shipped import scenario_file
from frictionsim.scenario.toml_data import keys_and_values
from frictionsim.scenario.validation import ValidationFailure, key_text, validate_model
from frictionsim.sweeps.design import Sampling
from frictionsim.sweeps.values import Distribution, VariedValues, values_by_key

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario

TABLES = ("study", "set", "vary")
SAMPLE_OPTIONS = ("method", "seed", "indices")
MAX_SEED = 2**63 - 1  # the largest number of TOML


def _varied(raw: Any) -> dict[str, VariedValues]:
    return values_by_key(by_name("KEY=VALUES, e.g. a.b=[1, 2]", str)(raw).items())


class SweepOptions(Options):
    """The variation of a scenario: [vary], and [study] without its `scenario`."""

    vary: Annotated[dict[str, Any], BeforeValidator(_varied)] = Field({})  # values by key
    zip: bool = Field(False, description="Vary the keys together instead of in all combinations.")
    sample: int | None = Field(None, description="Number of runs of a sample.", gt=0)
    method: str = Field("sobol", description="How a sample is drawn: sobol, lhs or random.")
    seed: int = Field(0, description="Seed of the sample.", ge=0, le=MAX_SEED)
    indices: bool = Field(False, description="Run the combinations for Sobol indices.")
    keep_series: bool = Field(False, description="Keep the result of each run.")

    @property
    def given_names(self) -> list[str]:
        """The given options, and the switches that are on."""
        return [
            name
            for name in type(self).model_fields
            if name in self.model_fields_set and getattr(self, name) is not False
        ]

    @property
    def sampling(self) -> Sampling | None:
        """The sampling; None without a sample."""
        if self.sample is None:
            return None
        return Sampling(self.sample, self.method, self.seed, self.indices)

    @model_validator(mode="after")
    def _need_a_sample(self) -> Self:
        for name in SAMPLE_OPTIONS if self.sample is None else ():
            if name in self.given_names:
                fault = "it applies to a sample; give the number of its runs as 'sample'"
                raise inconsistent((name,), fault)
        return self


class SweepStudy(NamedTuple):
    """A study: a scenario and its variation."""

    scenario: "Scenario"
    options: SweepOptions
    folder: Path  # of file names in the values


def is_study(data: Mapping[str, Any]) -> bool:
    """Return whether tables belong to a study rather than a scenario."""
    return "study" in data


def study_of(data: Mapping[str, Any], folder: Path | None, name: str) -> SweepStudy:
    """Return the study in some tables; the name is for messages.

    The folder is the base of relative file names; None for a study in the file of a sweep, which
    names no files.
    """
    unknown = [key for key in data if key not in TABLES]
    if unknown:
        raise InputError(
            f"{name}: {key_text((unknown[0],))}: unknown table of a study; known: [study], [set],"
            " [vary]"
        )
    source = _table(data, "study", name).get("scenario")
    if folder is None and not isinstance(source, dict):
        raise InputError(
            f"{name}: study.scenario: expected the tables of a scenario: the file of a sweep names"
            " no other files"
        )
    if not isinstance(source, str | dict):
        raise InputError(
            f"{name}: study.scenario: expected the file of a scenario, e.g."
            ' scenario = "pulley.toml", or its tables'
        )
    options = options_of(data, name)
    fixed = dict(_leaves(data, "set", name))
    if isinstance(source, dict):
        scenario, place = load_tables(source, folder, fixed), folder or Path()
    else:
        path = scenario_file(source, folder or Path())
        if path.exists() and not path.is_file():  # opening a pipe would wait for its writer
            raise InputError(f"{name}: study.scenario: expected a file, '{source}' is none")
        scenario, place = load(path, fixed), path.parent
    check_not_fixed(fixed, options.vary)
    return SweepStudy(scenario, options, place)


def options_of(data: Mapping[str, Any], name: str) -> SweepOptions:
    """Return the variation in the tables of a study, without reading its scenario."""
    settings = {
        key: value for key, value in _table(data, "study", name).items() if key != "scenario"
    }
    if "vary" in settings:
        raise InputError(f"{name}: study.vary: expected a table of its own, [vary]")
    vary = values_by_key(_leaves(data, "vary", name))
    try:
        return validate_model(SweepOptions, settings | {"vary": vary})
    except ValidationFailure as failure:
        lines = "; ".join(f"study.{line}" for line in failure.lines())
        raise InputError(f"{name}: {lines}") from None


def check_not_fixed(fixed: Iterable[str], vary: Mapping[str, Any]) -> None:
    """Raise InputError if a key is set for all runs and varied as well."""
    varied = {name for key in vary for name in names_in(key)}
    for key in fixed:
        if key.strip() in varied:
            raise InputError(f"{key.strip()} is both set for all runs and varied; leave out one")


def study_toml(study: SweepStudy) -> str:
    """Return a study as TOML, including its scenario, for `study_of`."""
    import tomli_w

    scenario = study.scenario.model_dump(by_alias=True, exclude_none=True, exclude_unset=True)
    options = study.options
    sample_options = () if options.sample is None else ("sample", *SAMPLE_OPTIONS)
    settings = {name: getattr(options, name) for name in ("zip", "keep_series", *sample_options)}
    vary = {key: _toml_values(values) for key, values in options.vary.items()}
    return tomli_w.dumps({"study": settings | {"scenario": scenario}, "vary": vary})


def _toml_values(values: VariedValues) -> Any:
    if isinstance(values, Distribution) or values.text.startswith(("lin", "log")):
        return values.text
    return list(values.values)


def _table(data: Mapping[str, Any], table: str, name: str) -> Mapping[str, Any]:
    content = data.get(table, {})
    if not isinstance(content, Mapping):
        raise InputError(f"{name}: {table}: expected a table of keys")
    return content


def _leaves(data: Mapping[str, Any], table: str, name: str) -> Iterator[tuple[str, Any]]:
    """Yield dotted keys and their values, from nested tables or quoted keys."""
    for key, value in keys_and_values(_table(data, table, name), lists="whole"):
        if not isinstance(value, Mapping):  # else an empty table
            yield key, value
