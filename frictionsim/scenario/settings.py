"""The tables that scenarios of all kinds share: `[solver]`, `[output]`, and the base model."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

from pydantic import Field, PrivateAttr, field_validator, model_validator

from frictionsim.errors import ScenarioError, unknown
from frictionsim.results import Channel
from frictionsim.scenario import methods
from frictionsim.scenario.origin import Origin
from frictionsim.scenario.plausibility import MAX_SAMPLES, warnings_of
from frictionsim.scenario.schema import Params, inconsistent, unit_field

if TYPE_CHECKING:
    from frictionsim.scenario.overrides import Overrides

DEFAULT_SAMPLES = 500


class SolverSettings(Params):
    """`[solver]`: integration method, duration and tolerances.

    A step is accepted if the estimated error of every state y is at most atol + rtol |y|; by most
    of SciPy's methods if the root mean square of error over that is at most 1; a fixed step always.
    """

    backend: str = Field("events", description="Integration method.")
    duration: float = unit_field("s", "Simulated time.", 10.0, gt=0)
    # Below 1e-14, the error estimate consists of roundoff only.
    rtol: float = unit_field(
        "1",
        "Relative tolerance: the estimated error of a step is at most atol + rtol |y|.",
        1e-10,
        ge=1e-14,
        lt=1,
    )
    atol: float = unit_field("1", "Absolute tolerance, in the unit of each state.", 1e-12, gt=0)
    max_step: float | None = unit_field("s", "Longest step; without it no limit.", None, gt=0)
    step: float | None = unit_field(
        "s",
        "Length of fixed steps, of methods that have them (`moreau`; `rkf45` with law `published`);"
        " a belt chooses a stable one if it is left out.",
        None,
        gt=0,
    )
    max_steps: int = unit_field(
        "1", "Limit of steps; a resumed run may take as many again.", 10_000_000, gt=0
    )

    @field_validator("backend")
    @classmethod
    def _backend_exists(cls, backend: str) -> str:
        if backend not in methods.METHODS:
            raise inconsistent((), unknown("backend", backend, list(methods.METHODS)))
        return backend


class Output(Params):
    """`[output]`: sample times and recorded channels; they do not affect the steps.

    `checkpoint` is the interval, in wall time, at which an incomplete result is written.
    `at_events` adds a sample at each event.
    """

    interval: float | None = unit_field(
        "s", "Time between samples; without it a 500th of the duration.", None, gt=0
    )
    at_events: bool = Field(True, description="Add a sample at each event.")
    checkpoint: float | None = unit_field(
        "s",
        "Wall time between checkpoints of the result so far; without it 60, 0 for none.",
        None,
        ge=0,
    )
    channels: Annotated[tuple[str, ...], Field(strict=False)] | None = Field(
        None,
        description="Channels to record; without it all. Summary and audit do not depend on it.",
    )


class Scenario(Params):
    """A scenario; each kind of mechanism adds its `mechanism`, `drive` and `effects`.

    It cannot be changed: `replace` returns another one. Two are equal if their values are, wherever
    they came from.

    Attributes
    ----------
    PAIRS : mapping of (law, method) to Pair
        The pairs of friction law and method that support this kind.
    CHANNELS : mapping of name to Channel
        All channels of this kind.
    """

    PAIRS: ClassVar[methods.Pairs]
    CHANNELS: ClassVar[Mapping[str, Channel]]

    if TYPE_CHECKING:  # of the model of each kind, which type checkers cannot know
        mechanism: Any
        drive: Any
        effects: Any

    kind: str
    title: str = Field("", description="One line of text for the summary and for pictures.")
    solver: SolverSettings = SolverSettings()
    output: Output = Output()

    _origin: Origin = PrivateAttr(default_factory=Origin)

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self.__dict__ == other.__dict__

    __hash__ = Params.__hash__

    @property
    def origin(self) -> Origin:
        """Where it came from; not a part of its value."""
        return self._origin

    def with_origin(self, origin: Origin) -> Self:
        """Return the same scenario with another origin."""
        scenario = self.model_copy()
        scenario._origin = origin
        return scenario

    def to_dict(self) -> dict[str, Any]:
        """Return the tables, including overrides, defaults and the data of CSV files.

        `load` makes an equal scenario of them, but for `output.interval`, which is filled in.
        """
        tables = self.model_dump(by_alias=True, exclude_none=True)
        tables["output"] = {"interval": self.interval} | tables["output"]
        for section in ("solver", "output"):  # move these sections to the end
            tables[section] = tables.pop(section)
        return tables

    def to_toml(self) -> str:
        """Return the scenario as TOML, including overrides, defaults and the data of CSV files."""
        import tomli_w

        return tomli_w.dumps(self.to_dict())

    def replace(self, overrides: "Overrides | None" = None, **keys: Any) -> Self:
        """Return a scenario with other values; omitted keys stay omitted.

        Parameters
        ----------
        overrides : mapping or iterable of str, optional
            As of `frictionsim.load`: ``{"solver.rtol": 1e-9}``, or texts ``solver.rtol=1e-9``.
            File names in them are relative to the folder of the scenario's file.
        **keys
            Values of keys of the top level, such as ``title="..."``.

        Returns
        -------
        Scenario
            The one that `load` would have returned with these overrides.

        Raises
        ------
        ScenarioError
            If a key is unknown or a value does not fit.
        InputError
            If `overrides` is of another type.
        """
        from frictionsim.scenario.overrides import apply_overrides
        from frictionsim.scenario.toml_data import tables_of
        from frictionsim.scenario.validation import ValidationFailure, validate_model

        data = tables_of(self)
        texts = self._origin.overrides
        for given in (overrides, keys):
            if given:
                texts += apply_overrides(data, given)[1]
        try:
            scenario = validate_model(type(self), data, Path(self._origin.source).parent)
        except ValidationFailure as failure:
            raise ScenarioError([f"overrides: {line}" for line in failure.lines()]) from None
        return scenario.with_origin(Origin(self._origin.source, texts))

    @property
    def interval(self) -> float:
        """The sampling interval, s."""
        return self.output.interval or self.solver.duration / DEFAULT_SAMPLES

    @property
    def needs_samples(self) -> bool:
        """Whether quantities follow from samples besides those of start, events and end."""
        return True

    @property
    def effect_names(self) -> tuple[str, ...]:
        """The effects that are simulated."""
        effects = getattr(self, "effects", ())
        return tuple(name for name, effect in effects if effect is not None)

    @property
    def signals(self) -> dict[str, Any]:
        """The input signals, by their keys in the scenario."""
        return {f"drive.{name}": signal for name, signal in getattr(self, "drive", ())}

    def warnings(self) -> list[str]:
        """Return warnings about a valid scenario whose results may mislead."""
        return warnings_of(self)

    @field_validator("title")
    @classmethod
    def _title_is_printable(cls, title: str) -> str:
        if any(character < " " or character == "\x7f" for character in title):
            raise inconsistent((), "expected one line of text, without control characters")
        return title

    @property
    def friction_effects(self) -> dict[str, Any]:
        """The effects of dry friction, which have a law, by name."""
        effects = getattr(self, "effects", ())
        return {name: effect for name, effect in effects if hasattr(effect, "law")}

    @property
    def law(self) -> str:
        """The friction law; empty without dry friction."""
        return next((effect.law for effect in self.friction_effects.values()), "")

    @property
    def pairs(self) -> methods.Pairs:
        """The pairs of friction law and method that support this scenario, of those of its kind."""
        return self.PAIRS

    @property
    def called(self) -> str:
        """The name of the mechanism in messages."""
        return self.kind.replace("_", " ")

    @property
    def pair(self) -> methods.Pair:
        """The pair of friction law and method; without friction of all laws of the method."""
        fixed = [
            pair.fixed_step
            for (law, method), pair in self.pairs.items()
            if method == self.solver.backend and self.law in ("", law)
        ]
        return methods.Pair(fixed_step=any(fixed))

    @property
    def budget_advice(self) -> str:
        """Advice for a run that has exceeded its budget."""
        backend, law = self.solver.backend, self.law
        method, stiff = methods.METHODS[backend], []
        if law == methods.REGULARISED:  # whose speed does not limit the steps of these
            fit = methods.methods_of(self.pairs, law)
            stiff = [name for name in fit if methods.METHODS[name].implicit]
        fixed = method.fixed_steps or self.solver.step is not None
        ways = ["resume the run"] if method.resumable else []
        ways += ["raise the limit", "take longer steps" if fixed else "loosen the tolerances"]
        if not (fixed or method.implicit):
            unless = "a short time constant, such as inertia over damping, limits the steps"
            ways[-1] += f" (unless {unless})"
        if law in (methods.REGULARISED, methods.CREEP):
            ways.append("increase the transition_speed of the smoothed law")
        if stiff and not method.implicit:
            ways[-2:] = [
                f"take a stiff method, {', '.join(stiff[:-1])} or {stiff[-1]}"
                f" (--set solver.backend={stiff[0]}): the smoothed law limits the steps of"
                f" {backend}, whatever its tolerances"
            ]
        fit = methods.methods_of(self.pairs, law)
        if not fixed and (others := [name for name in fit if methods.METHODS[name].fixed_steps]):
            other = f"take {others[0]} (--set solver.backend={others[0]})"
            ways.append(f"{other}, whose steps stiff dampers do not limit")
        return " or ".join((", ".join(ways[:-1]), ways[-1]))

    @model_validator(mode="after")
    def _law_and_method_go_together(self) -> Self:
        backend, law = self.solver.backend, self.law
        fit = methods.methods_of(self.pairs, law)
        if backend not in fit:
            what = f"integrate the friction law '{law}'"
            if backend not in methods.methods_of(self.pairs):
                what = f"support {'an' if self.called[0] in 'aeiou' else 'a'} {self.called}"
            raise inconsistent(
                ("solver", "backend"),
                f"'{backend}' does not {what}; use one of {', '.join(fit)}"
                f" (--set solver.backend={fit[0]})",
            )
        if self.solver.step is not None and not self.pair.fixed_step:
            fixed = ", ".join(
                f"{method} with law '{of}'" if law else method
                for (of, method), pair in self.pairs.items()
                if pair.fixed_step
            )
            raise inconsistent(
                ("solver", "step"),
                f"'{backend}' chooses its steps by the tolerances; remove step,"
                + (f" use max_step, or use fixed steps: {fixed}" if fixed else " or use max_step"),
            )
        return self

    @model_validator(mode="after")
    def _channels_exist(self) -> Self:
        known = list(self.CHANNELS)
        for name in self.output.channels or ():
            if name not in known:
                raise inconsistent(("output", "channels"), unknown("channel", name, known))
        return self

    @model_validator(mode="after")
    def _samples_are_not_too_many(self) -> Self:
        if self.interval <= 0.0:  # underflow of a tiny duration
            raise inconsistent(
                ("solver", "duration"), f"{self.solver.duration} s is too short to sample"
            )
        samples = self.solver.duration / self.interval
        if samples > MAX_SAMPLES:
            raise inconsistent(
                ("output", "interval"),
                f"{self.interval} s over {self.solver.duration} s gives {samples:.3g} samples; the"
                f" limit is {MAX_SAMPLES}, so use an interval of at least"
                f" {self.solver.duration / MAX_SAMPLES:.3g} s",
            )
        return self
