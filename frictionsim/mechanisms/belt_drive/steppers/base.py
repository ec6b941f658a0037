"""What the run of a belt asks of a method: steps, a state between samples, a checkpoint."""

from typing import TYPE_CHECKING, Any

from frictionsim.mechanisms.belt_drive.kernels.system import Array

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.model import BeltModel


class Stepper:
    """A belt drive between two steps of a method; each method has its own.

    Attributes
    ----------
    force_per_impulse : float, 1/s
        Makes a force of what the contacts hold as friction; 1 where they hold forces.
    """

    force_per_impulse = 1.0

    def __init__(self, model: "BeltModel") -> None:
        self._model = model

    @property
    def compile_seconds(self) -> float:
        """The expected time of the compilation of its kernels, s."""
        raise NotImplementedError

    @property
    def prepared(self) -> bool:
        """Whether the kernels of the next step are compiled, once `prepare` was called."""
        return True

    @property
    def t(self) -> float:
        """The end of the last step, s."""
        raise NotImplementedError

    @property
    def statistics(self) -> tuple[int, int, int]:
        """Steps, rejected steps, right-hand sides."""
        raise NotImplementedError

    def start(self) -> None:
        """Evaluate the start."""
        raise NotImplementedError

    def prepare(self) -> None:
        """Have the kernels of a step compiled, by taking none."""
        raise NotImplementedError

    def advance(self, limit: float, sample: float, max_steps: int) -> None:
        """Step until a limit or a sample time, s, is reached, or `max_steps` steps are taken."""
        raise NotImplementedError

    def interpolate(self, t: float) -> Array:
        """Return the state at a time in the last step; the system has the forces there."""
        raise NotImplementedError

    def checkpoint_arrays(self) -> dict[str, Any]:
        """Return all that the next steps depend on, by name; writing to them restores it."""
        return {**self._own_arrays(), **self._model.contact_state()}

    def _own_arrays(self) -> dict[str, Any]:
        raise NotImplementedError
