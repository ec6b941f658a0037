"""What every table of a scenario has in common: strict, frozen, finite, with units."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Self

from pydantic import Field, field_validator, model_validator

from frictionsim.errors import unknown
from frictionsim.results import Channel
from frictionsim.scenario import methods
from frictionsim.scenario.schema import Params, inconsistent, unit_field

# More than this does not fit in the memory of an ordinary machine with all its channels.
MAX_SAMPLES = 10_000_000
DEFAULT_SAMPLES = 500


class SolverSettings(Params):
    """`[solver]`: who integrates, how long and how exactly.

    A step is accepted when the estimated error of every state y is at most atol + rtol |y|.
    """

    backend: str = Field("events", description="Integration method.")
    duration: float = unit_field("s", "Simulated time.", 10.0, gt=0)
    # Below 1e-14 the rounding of double precision is all that an error estimate sees.
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
        "s", "Length of fixed steps; a belt chooses a stable one if it is left out.", None, gt=0
    )
    max_steps: int = unit_field(
        "1", "Budget of steps; a resumed run has as many again.", 10_000_000, gt=0
    )
    transition_speed: float | None = unit_field(
        "rad/s", "Speed over which a regularised law rises to its full friction.", None, gt=0
    )

    @field_validator("backend")
    @classmethod
    def _backend_exists(cls, backend: str) -> str:
        if backend not in methods.BACKENDS:
            raise inconsistent((), unknown("backend", backend, list(methods.BACKENDS)))
        return backend


class Output(Params):
    """`[output]`: when the run is sampled, and what is recorded. Neither changes the steps.

    `checkpoint` is a time on the wall: how often the result so far is written while it runs.
    `at_events` has each event sampled, too.
    """

    interval: float | None = unit_field(
        "s", "Time between samples; without it a 500th of the duration.", None, gt=0
    )
    at_events: bool = Field(True, description="Whether each event is sampled, too.")
    checkpoint: float | None = unit_field(
        "s", "Wall time between checkpoints of the result so far; without it none.", None, gt=0
    )
    # All where it is left out. The quantities and the audit of a run do not depend on it.
    channels: Annotated[tuple[str, ...], Field(strict=False)] | None = Field(
        None,
        description="Channels to record; without it all. Summary and audit do not depend on it.",
    )


class Scenario(Params):
    """A scenario file; each kind of mechanism adds its `mechanism`, `drive` and `effects`.

    Attributes
    ----------
    BACKENDS : tuple of str
        Those that can do this kind.
    CHANNELS : mapping of name to Channel
        The channels that a scenario of this kind may have.
    """

    BACKENDS: ClassVar[tuple[str, ...]]
    CHANNELS: ClassVar[Mapping[str, Channel]]

    kind: str
    title: str = Field("", description="One line of text for the summary and for pictures.")
    solver: SolverSettings = SolverSettings()
    output: Output = Output()

    @property
    def interval(self) -> float:
        """The time between two samples, s."""
        return self.output.interval or self.solver.duration / DEFAULT_SAMPLES

    @property
    def effect_names(self) -> tuple[str, ...]:
        """The effects that are simulated."""
        effects = getattr(self, "effects", ())
        return tuple(name for name, effect in effects if effect is not None)

    @property
    def signals(self) -> dict[str, Any]:
        """What drives it, by the keys of the scenario."""
        return {f"drive.{name}": signal for name, signal in getattr(self, "drive", ())}

    def warnings(self) -> list[str]:
        """Return what is odd about the scenario, though it can be simulated."""
        from frictionsim.scenario.signal_checks import period_of, shorter, too_long

        interval, duration = self.interval, self.solver.duration
        if interval > duration:
            return [
                f"output.interval = {interval} s is longer than the run: only its two ends"
                " are sampled"
            ]
        periods = {name: period_of(signal, duration) for name, signal in self.signals.items()}
        return [
            f"output.interval = {interval:g} s is longer than a tenth of the period of {name},"
            f" {period:.6g} s: the samples do not show it;"
            f" {shorter(period, duration, MAX_SAMPLES)}"
            for name, period in periods.items()
            if period is not None and too_long(interval, period)
        ]

    @field_validator("title")
    @classmethod
    def _title_is_printable(cls, title: str) -> str:
        if any(character < " " or character == "\x7f" for character in title):
            raise inconsistent((), "expected one line of text, without control characters")
        return title

    @model_validator(mode="after")
    def _backend_can_do_it(self) -> Self:
        backend, able = self.solver.backend, self.BACKENDS
        if backend not in able:
            article = "an" if self.kind[0] in "aeiou" else "a"
            raise inconsistent(
                ("solver", "backend"),
                f"'{backend}' cannot do {article} {self.kind.replace('_', ' ')}; these can:"
                f" {', '.join(able)}",
            )
        if self.solver.step is not None and not methods.BACKENDS[backend].fixed_step:
            fixed = [name for name in able if methods.BACKENDS[name].fixed_step]
            raise inconsistent(
                ("solver", "step"),
                f"'{backend}' chooses its steps by the tolerances; leave step out, give"
                f" max_step, or take a backend with fixed steps: {', '.join(fixed) or 'none here'}",
            )
        if self.solver.transition_speed is not None and not methods.BACKENDS[backend].regularised:
            smooth = [name for name in able if methods.BACKENDS[name].regularised]
            raise inconsistent(
                ("solver", "transition_speed"),
                f"'{backend}' does not smooth friction; leave transition_speed out, or take a"
                f" backend that does: {', '.join(smooth) or 'none here'}",
            )
        return self

    @model_validator(mode="after")
    def _channels_exist(self) -> Self:
        for name in self.output.channels or ():
            if name not in self.CHANNELS:
                raise inconsistent(
                    ("output", "channels"), unknown("channel", name, list(self.CHANNELS))
                )
        return self

    @model_validator(mode="after")
    def _samples_fit_in_memory(self) -> Self:
        if self.interval <= 0.0:  # the duration is of the order of the smallest number
            raise inconsistent(
                ("solver", "duration"), f"{self.solver.duration} s is too short to sample"
            )
        samples = self.solver.duration / self.interval
        if samples > MAX_SAMPLES:
            raise inconsistent(
                ("output", "interval"),
                f"{self.interval} s over {self.solver.duration} s makes {samples:.3g} samples; at"
                f" most {MAX_SAMPLES} are kept, so give an interval of at least"
                f" {self.solver.duration / MAX_SAMPLES:.3g} s",
            )
        return self
