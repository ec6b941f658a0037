"""What a run is judged by. A kind of mechanism names its own as `MEASURES`; no numpy here."""

from typing import Literal, NamedTuple


class Measure(NamedTuple):
    """One error of a run against a reference.

    Attributes
    ----------
    name : str
        Of a column of the table.
    what : str
        `events`    the worst difference of an event's time, over the duration; 1 where the
                    events are not the same ones
        `quantity`  the difference of a figure of the summary, over its size or the way of `scale`
        `course`    the mean difference of a course, over its mean size
        `check`     a figure of the run's own audit, which needs no reference
    source : str
        The figure, the course or the check; nothing for events.
    unit : str
        Of the absolute error.
    scale : str
        A course whose largest change from its start is what a quantity is compared with.
    """

    name: str
    what: Literal["events", "quantity", "course", "check"]
    source: str = ""
    unit: str = "1"
    scale: str = ""


ENERGY_BALANCE = Measure("energy_balance", "check", "energy")

# Of any mechanism of one coordinate.
OF_ONE_COORDINATE = (
    Measure("event_time", "events", unit="s"),
    Measure("final_angle", "quantity", "final_angle", "rad", scale="angle"),
    Measure("velocity_L1", "course", "angular_velocity", "rad/s"),
    ENERGY_BALANCE,
)
