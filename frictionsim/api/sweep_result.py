"""The result of a sweep: its table, its dataset and its summary."""

from collections.abc import Callable, Iterator
from functools import cached_property, partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionsim.api.result import Outcome, ResultBase
from frictionsim.display import (
    STUDY_DIGITS,
    quantity_text,
    ratio_text,
    set_line,
    short_names,
    study_text,
)
from frictionsim.document import Data, Document, Table
from frictionsim.errors import (
    EXIT_AUDIT_FAILED,
    EXIT_DONE,
    EXIT_SOLVER_FAILED,
    InputError,
    counted,
    exit_code_of_interruption,
)
from frictionsim.io.names import existing_name, partial_name, whole_name
from frictionsim.io.output_file import SUFFIXES
from frictionsim.io.sweep_file import read_any, write_sweep
from frictionsim.io.sweep_table import (
    AUDIT_FAILED,
    DONE,
    FAILED,
    NOT_RUN,
    STATUSES,
    SweepTable,
)
from frictionsim.results import finite
from frictionsim.scenario.arguments import as_path
from frictionsim.scenario.origin import heading_of, origin_of
from frictionsim.scenario.toml_data import toml_value
from frictionsim.sweeps.statistics import (
    Group,
    extreme_runs,
    grouped,
    independent_runs,
    is_constant,
    sampling_of,
    sound_values,
    statistics_of,
    varied_values,
)
from frictionsim.sweeps.study_file import SweepOptions

if TYPE_CHECKING:
    from collections.abc import Mapping

    import xarray
    from matplotlib.figure import Figure, SubFigure


class Sweep(ResultBase):
    """The result of a sweep, made by `sweep`, `resume_sweep` and `open_sweep`.

    It has the members of its `xarray.Dataset`: ``sweep["breakaway_time"]``, ``sweep.sel(...)``;
    a function that requires a dataset is given ``sweep.dataset``.

    Attributes
    ----------
    table : SweepTable
        The contents of its file.
    path : Path or None
        Its file.
    """

    def __init__(self, table: SweepTable, path: Path | None = None) -> None:
        self.table, self.path = table, path

    @cached_property
    def dataset(self) -> "xarray.Dataset":
        """The varied keys as coordinates, and each quantity of the summary with its unit.

        `status`, `failure`, `reason` and `warnings` of the runs are beside the quantities.
        """
        from frictionsim.api.dataset import sweep_dataset

        return sweep_dataset(self.table)

    @property
    def _outcome(self) -> Outcome:
        status, reason = (self.table.attributes[name] for name in ("status", "reason"))
        outcomes = {*self.table.status.tolist()}
        code = EXIT_DONE
        if DONE not in outcomes:
            code = EXIT_AUDIT_FAILED if AUDIT_FAILED in outcomes else EXIT_SOLVER_FAILED
        if status != "done":
            code = exit_code_of_interruption(reason)
        return Outcome(status, reason, code)

    @property
    def failures(self) -> list[str]:
        """The numbers of failed runs and of failed audits; empty without any."""
        counts = (
            (self.table.count(status), words)
            for status, words in ((FAILED, "failed"), (AUDIT_FAILED, "failed their audit"))
        )
        return [f"{count} of {self.table.runs} runs {words}" for count, words in counts if count]

    @property
    def missing_runs(self) -> str:
        """The number of remaining runs and the reason; empty if the sweep is done."""
        if self.status == "done":
            return ""
        left = f"{self.table.count(NOT_RUN)} of {self.table.runs} runs are left"
        return f"sweep {self.status}: {left}" + (f": {self.reason}" if self.reason else "")

    def to_toml(self, name: str = "scenario") -> str:
        """Return the varied `scenario`, or the `study`, in TOML."""
        return self.table.attributes[name].rstrip("\n")

    def _parts(self) -> Document:
        return sweep_parts(self.table, self.path)

    @property
    def _writers(self) -> "Mapping[str, Callable[[Path], Path]]":
        return {**dict.fromkeys((*SUFFIXES, ""), self._save_hdf5), ".csv": self.save_csv}

    @property
    def _fault(self) -> str:
        return "; ".join(filter(None, (self.reason, *self.failures)))

    def _save_hdf5(self, path: Path) -> Path:
        """Write the sweep for `open_sweep`, to NAME.partial.h5 if it is not done."""
        whole = whole_name(path)
        target = whole if self.status == "done" else partial_name(whole)
        write_sweep(self.table, target)
        self.path = self.path or target
        return target

    def save_csv(self, path: str | PathLike[str]) -> Path:
        """Write a line for each run, and the Sobol indices of a sample to NAME.sobol.csv."""
        from frictionsim.sweeps.sweep_csv import write_csv

        target = as_path("path", path)
        write_csv(self.table, target)
        return target

    def plot(
        self,
        quantities: str | None = None,
        *,
        at: "Mapping[str, Any] | None" = None,
        figure: "Figure | SubFigure | None" = None,
    ) -> "Figure":
        """Draw quantities; `frictionsim.plot` has further options.

        Parameters
        ----------
        quantities : str, optional
            Separated by commas; by default the first varying ones.
        at : mapping, optional
            Value to draw of a varied key, by key; of a grid.
        figure : Figure or SubFigure, optional
            An empty one that is drawn into.
        """
        from frictionsim.plots.style import drawn
        from frictionsim.plots.sweep import draw_sweep

        return drawn(partial(draw_sweep, self.table, quantities_of(quantities), at), figure)

    def equals(self, other: Any) -> bool:
        """Return whether another sweep or dataset has the same values and coordinates."""
        return bool(self.dataset.equals(getattr(other, "dataset", other)))

    def identical(self, other: Any) -> bool:
        """Return whether another sweep or dataset is equal, with the same attributes."""
        return bool(self.dataset.identical(getattr(other, "dataset", other)))

    def __getattr__(self, name: str) -> Any:
        """Return an attribute of the dataset.

        Raises
        ------
        AttributeError
            If it has none of this name.
        """
        if not name.startswith("_"):
            attribute = getattr(self.dataset, name, self)
            if attribute is not self:
                return attribute
        raise AttributeError(f"neither this sweep nor its .dataset has an attribute '{name}'")

    def __getitem__(self, key: Any) -> Any:
        return self.dataset[key]

    def __iter__(self) -> Iterator[Any]:
        return iter(self.dataset)

    def __len__(self) -> int:
        return len(self.dataset)

    def __contains__(self, key: Any) -> bool:
        return key in self.dataset

    def __enter__(self) -> "Sweep":
        return self

    def __exit__(self, *_: object) -> None:
        """Do nothing: the file is closed already."""

    def __repr__(self) -> str:
        kind, runs = self.table.attributes["kind"], self.table.runs
        keys = ", ".join(self.table.coordinates)
        return f"<frictionsim.Sweep {kind}: {self.status}, {runs} runs over {keys}>"


def open_sweep(path: str | PathLike[str]) -> Sweep:
    """Read the file of a sweep, or an unfinished sweep, NAME.partial.runs.

    Returns
    -------
    Sweep
        As returned by `sweep`. All data are read; the file is closed.

    Raises
    ------
    InputError
        If it does not exist or is not a sweep.
    """
    file = existing_name(as_path("path", path))
    content = read_any(file, "sweep")
    if isinstance(content, SweepTable):
        return Sweep(content, file)
    raise InputError(f"{file}: this is the result of a run, not a sweep; fs.open reads it")


def quantities_of(view: str | None) -> list[str]:
    """Return the quantities of a view of a sweep."""
    return [] if view is None else [name.strip() for name in view.split(",")]


MAX_GROUPS = 5  # of reasons, and of warnings
MAX_VALUES = 3  # of a key in a line
DESIGNS = {
    "grid": "all combinations of these keys",
    "zip": "these keys varied together",
    "sample": "a sample of these keys",
}
WORDS = {FAILED: "failed", AUDIT_FAILED: "with a failed audit", NOT_RUN: "not run"}
STATISTICS = ("mean", "standard_deviation", "quantile_5", "quantile_50", "quantile_95")
ENDS = ("least", "largest")
OF_SAMPLE = (">mean", ">standard deviation", ">5 %", ">50 %", ">95 %")
OF_GRID = (">least", ">in run", ">largest", ">in run")
INDICES = (">first-order", ">95 % of first-order", ">total", ">95 % of total")


def sweep_parts(table: SweepTable, path: Path | None) -> Document:
    """Yield the summary of a sweep and the path of its file; its text is made of its data.

    InputError is raised if the study in the file is not valid.
    """
    attributes = table.attributes
    sampling = sampling_of(table)
    groups = {"failed": grouped(_reasons(table)), "warnings": grouped(table.texts["warnings"])}
    varied: dict[str, dict[str, Any]] = {
        key: {
            "unit": coordinate.unit or None,
            "distribution": sampling.vary[key].text if sampling else None,
            "values": None if sampling else [_plain(value) for value in coordinate.values],
        }
        for key, coordinate in table.coordinates.items()
    }
    quantities = {
        name: {"unit": unit} | _summary(table, name, sampling) for name, unit in table.units.items()
    }
    indices = _indices(table)
    independent = independent_runs(table, sampling).stop
    yield f"{heading_of(attributes)}: sweep {attributes['status']}"
    yield f"kind {attributes['kind']}, {DESIGNS.get(attributes['design'], attributes['design'])}"
    if overrides := set_line(attributes):
        yield overrides
    keys = [
        (key, of_key["distribution"] or _range_text(of_key["values"]), of_key["unit"] or "")
        for key, of_key in varied.items()
    ]
    yield Table(("key", ">values", "unit"), keys)
    yield _counts_text(table)
    headings = OF_SAMPLE if sampling else OF_GRID
    rows, shown = [], _shown(table)
    for name, of in quantities.items():
        if sampling:
            cells = [shown(name, of[word]) for word in STATISTICS]
        else:  # which of equal runs is least is roundoff
            is_flat = is_constant(sound_values(table, name))
            pairs = ((of[end]["value"], "" if is_flat else str(of[end]["run"])) for end in ENDS)
            cells = [cell for value, run in pairs for cell in (shown(name, value), run)]
        rows.append((name, *cells, of["unit"], str(of["runs"])))
    yield Table(("quantity", *headings, "unit", ">defined in runs"), rows)
    if sampling and sampling.indices:
        yield (
            f"the first {independent} runs are independent and make these numbers; the others are"
            " for Sobol indices"
        )
    yield from _indices_parts(indices or {})
    for word, of_word in groups.items():
        yield from _group_lines(word, of_word)
    if attributes["reason"]:
        yield f"stopped: {attributes['reason']}"
    if path is not None:
        yield f"sweep: {path}"
    yield Data(
        {
            "quantities": quantities,
            "scenario": attributes["source"] or None,
            "overrides": origin_of(attributes).values,
            **{name: attributes[name] for name in ("kind", "title", "design", "status", "reason")},
            "runs": {"all": table.runs} | {word: table.count(status) for status, word in STATUSES},
            "varied": varied,
            "independent_runs": independent if sampling else None,
            "sobol_indices": indices,
            "failures": [group._asdict() for group in groups["failed"]],
            "warnings": [group._asdict() for group in groups["warnings"]],
            "output": None if path is None else str(path),
        }
    )


def _plain(value: Any) -> Any:
    """Return a value of a key as one of Python."""
    return value.item() if hasattr(value, "item") else value


def _reasons(table: SweepTable) -> dict[int, str]:
    """Return the reasons of failed runs and audits by their numbers, each in one line."""
    failures, reasons = table.texts["failure"], table.texts["reason"]
    texts = {
        run: (failures.get(run, ""), " ".join(reasons.get(run, "").split()))
        for run in sorted({*failures, *reasons})
    }
    return {run: ": ".join(filter(None, text)) for run, text in texts.items()}


def _summary(table: SweepTable, name: str, sampling: SweepOptions | None) -> dict[str, Any]:
    """Return the statistics of a quantity of a sample, else its extremes and where they are."""
    values = sound_values(table, name)
    if sampling is not None:
        statistics = statistics_of(values[independent_runs(table, sampling)])
        return {word: finite(number) for word, number in statistics._asdict().items()}
    found: dict[str, Any] = {"runs": int((values == values).sum())}
    for word, run in zip(ENDS, extreme_runs(values) or (None, None), strict=True):
        found[word] = {"value": None, "run": None, "at": None}
        if run is not None:
            at = {key: _plain(value) for key, value in varied_values(table, run).items()}
            found[word] = {"value": finite(float(values[run])), "run": run, "at": at}
    return found


def _indices(table: SweepTable) -> dict[str, Any] | None:
    """Return the Sobol indices of a sample by quantity and key, with their basis."""

    def of_key(column: list[float]) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for word, three in (("first", column[:3]), ("total", column[3:])):
            found[word], *ends = map(finite, three)
            found[f"{word}_interval"] = None if None in ends else ends
        return found

    if table.sobol is None:
        return None
    return {
        name: {
            "basis": basis,
            "keys": dict(zip(table.coordinates, map(of_key, values.T.tolist()), strict=True)),
        }
        for name, (basis, values) in table.sobol.items()
    }


def _counts_text(table: SweepTable) -> str:
    parts = [f"{table.count(s)} {words}" for s, words in WORDS.items() if table.count(s)]
    runs = "run is" if table.runs == 1 else "runs are"
    text = f"{table.count(DONE)} of {table.runs} {runs} done"
    return f"{text}; {', '.join(parts)}: not in the table below" if parts else text


def _range_text(values: list[Any]) -> str:
    """Return the values of a key in short."""
    shown = [
        study_text(v) if isinstance(v, float) else v if isinstance(v, str) else toml_value(v)
        for v in values
    ]
    if len(shown) <= MAX_VALUES + 1:
        return ", ".join(shown)
    return f"{', '.join(shown[: MAX_VALUES - 1])} ... {shown[-1]} ({len(shown)} values)"


def _shown(table: SweepTable) -> Callable[[str, float | None], str]:
    """Return how a quantity is shown: in as many digits as in the summary of a run, at most six."""
    from frictionsim.reports.run_tables import digits_of

    digits = digits_of(table.attributes["kind"], table.attributes["scenario"])
    # A given speed or pretension does not depend on the mesh.
    values = (_plain(value) for one in table.coordinates.values() for value in one.values)
    varied = {value for value in values if isinstance(value, float)}

    def shown(name: str, value: float | None) -> str:
        count = STUDY_DIGITS if value is None or value in varied else digits(name, value)
        return quantity_text(value, digits=count) if count < STUDY_DIGITS else study_text(value)

    return shown


def _indices_parts(indices: dict[str, Any]) -> Document:
    """Yield the Sobol indices with their basis, or why a quantity has none."""
    rows: dict[str, list[tuple[str, ...]]] = {}
    for name, data in indices.items():
        basis, keys = data["basis"], data["keys"]
        if all(found["first"] is None for found in keys.values()):
            yield f"{name}: {basis}"
            continue
        for key, found in zip(short_names([*keys]), keys.values(), strict=True):
            cells: list[str] = []
            for word in ("first", "total"):
                ends = found[f"{word}_interval"]
                cells += [ratio_text(found[word]), " to ".join(map(ratio_text, ends or ()))]
            rows.setdefault(basis, []).append((name, key, *cells))
    for basis, of_basis in rows.items():
        yield f"Sobol indices {basis}"
        yield Table(("Sobol indices of", "key", *INDICES), of_basis)


def _group_lines(word: str, groups: list[Group]) -> Document:
    for group in groups[:MAX_GROUPS]:
        several = group.runs > 1
        runs = f", {group.runs} runs" if several else f", run {group.first_run}"
        yield f"{word}{runs}: {group.text}" + f" (run {group.first_run})" * several
    if rest := groups[MAX_GROUPS:]:
        count = sum(group.runs for group in rest)
        yield f"{word}: {counted(len(rest), 'further kind')}, in {counted(count, 'run')}"
