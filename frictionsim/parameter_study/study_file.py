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
from typing import TYPE_CHECKING, Any, NamedTuple

from pydantic import Field

from frictionsim.errors import InputError
from frictionsim.parameter_study.design import Sampling
from frictionsim.parameter_study.values import Distribution, Values, values_by_key
from frictionsim.scenario.loading import load, load_tables, read_toml
from frictionsim.scenario.model_fields import names_in
from frictionsim.scenario.model_validation import ValidationFailure, key_text, validate_table
from frictionsim.scenario.schema import Params
from frictionsim.scenario.shipped import scenario_file
from frictionsim.scenario.toml_data import keys_and_values

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario

TABLES = ("study", "set", "vary")
OF_SAMPLES = ("method", "seed", "indices")


class StudySettings(Params):
    """`[study]`, beside its `scenario`: a file, or the tables of one."""

    zip: bool = Field(False, description="Vary the keys together instead of in all combinations.")
    sample: int | None = Field(None, description="Number of runs of a sample.", gt=0)
    method: str = Field("sobol", description="How a sample is drawn: sobol, lhs or random.")
    seed: int = Field(0, description="Seed of the sample.", ge=0)
    indices: bool = Field(False, description="Run the combinations for Sobol indices.")
    keep_series: bool = Field(False, description="Keep the result of each run.")


class SweepStudy(NamedTuple):
    """A study: a scenario and its variation.

    Attributes
    ----------
    scenario : Scenario
    vary : dict of Values
        By key.
    together : bool
    sampling : Sampling or None
    keep_series : bool
    """

    scenario: "Scenario"
    vary: dict[str, Values]
    together: bool = False
    sampling: Sampling | None = None
    keep_series: bool = False


def is_study(data: Mapping[str, Any]) -> bool:
    """Return whether tables are those of a study, not of a scenario."""
    return "study" in data


def load_study(path: Path) -> SweepStudy:
    """Read a study."""
    return study_of(read_toml(path), path.parent, str(path))


def study_of(data: Mapping[str, Any], folder: Path | None, name: str) -> SweepStudy:
    """Return the study of tables.

    Parameters
    ----------
    data : mapping
    folder : Path or None
        Base of relative file names; None for a study in the file of a sweep, which names no files.
    name : str
        For messages.
    """
    unknown = [key for key in data if key not in TABLES]
    if unknown:
        raise InputError(
            f"{name}: {key_text((unknown[0],))}: unknown table of a study; known: [study], [set],"
            " [vary]"
        )
    given = dict(_table(data, "study", name))
    source = given.pop("scenario", None)
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
    settings = _settings_of_file(given, name)
    fixed = dict(_leaves(data, "set", name))
    if isinstance(source, dict):
        scenario = load_tables(source, folder, fixed)
    else:
        path = scenario_file(source, folder or Path())
        if path.exists() and not path.is_file():  # to open a pipe would wait for its writer
            raise InputError(f"{name}: study.scenario: expected a file, '{source}' is none")
        scenario = load(path, fixed)
    vary = _vary(data, name)
    check_not_fixed(fixed, vary)
    return study_with(scenario, vary, settings)


def study_with(
    scenario: "Scenario", vary: dict[str, Values], settings: StudySettings
) -> SweepStudy:
    """Return the study of a scenario with these settings."""
    return SweepStudy(scenario, vary, settings.zip, _sampling(settings), settings.keep_series)


def variation_of(data: Mapping[str, Any], name: str) -> tuple[dict[str, Values], Sampling | None]:
    """Return the variation in the tables of a study, without reading its scenario.

    Parameters
    ----------
    data : mapping
    name : str
        For messages.

    Returns
    -------
    dict of Values
        By key.
    Sampling or None
    """
    given = {key: value for key, value in _table(data, "study", name).items() if key != "scenario"}
    return _vary(data, name), _sampling(_settings_of_file(given, name))


def settings_of(given: Mapping[str, Any], table: str = "") -> StudySettings:
    """Return the settings of a study; messages name them with the table, if there is one."""
    try:
        return validate_table(StudySettings, dict(given))
    except ValidationFailure as failure:
        raise InputError("; ".join(f"{table}{line}" for line in failure.lines())) from None


def _settings_of_file(given: dict[str, Any], name: str) -> StudySettings:
    try:
        return settings_of(given, "study.")
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def _vary(data: Mapping[str, Any], name: str) -> dict[str, Values]:
    return values_by_key(_leaves(data, "vary", name))


def _sampling(settings: StudySettings) -> Sampling | None:
    if settings.sample is not None:
        return Sampling(settings.sample, settings.method, settings.seed, settings.indices)
    for name in OF_SAMPLES:
        if name in settings.model_fields_set:
            raise InputError(
                f"{name}: it applies to a sample; give the number of its runs with --sample N"
            )
    return None


def check_not_fixed(fixed: Iterable[str], vary: Mapping[str, Any]) -> None:
    """Raise InputError if a key is set for all runs and varied as well."""
    varied = {name for key in vary for name in names_in(key)}
    for key in fixed:
        if key.strip() in varied:
            raise InputError(f"{key.strip()} is both set for all runs and varied; leave out one")


def study_toml(study: SweepStudy) -> str:
    """Return a study as TOML with its scenario in it, for `study_of`."""
    import tomli_w

    scenario = study.scenario.model_dump(by_alias=True, exclude_none=True, exclude_unset=True)
    settings: dict[str, Any] = {"zip": study.together, "keep_series": study.keep_series}
    if study.sampling is not None:
        count, method, seed, indices = study.sampling
        settings |= {"sample": count, "method": method, "seed": seed, "indices": indices}
    vary = {key: _written(values) for key, values in study.vary.items()}
    return tomli_w.dumps({"study": settings | {"scenario": scenario}, "vary": vary})


def _written(values: Values) -> Any:
    if isinstance(values, Distribution):
        return values.text
    text = values.text
    return text if text.startswith(("lin", "log")) else list(values.values)


def _table(data: Mapping[str, Any], table: str, name: str) -> Mapping[str, Any]:
    found = data.get(table, {})
    if not isinstance(found, Mapping):
        raise InputError(f"{name}: {table}: expected a table of keys")
    return found


def _leaves(data: Mapping[str, Any], table: str, name: str) -> Iterator[tuple[str, Any]]:
    """Yield keys with dots and their values, whether these are nested tables or quoted keys."""
    for key, value in keys_and_values(_table(data, table, name), lists="whole"):
        if not isinstance(value, Mapping):  # else an empty table
            yield key, value
