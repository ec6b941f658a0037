"""The limit of static friction in a panel of the friction torque."""

from typing import TYPE_CHECKING, Any

from frictionsim.errors import InputError
from frictionsim.mechanisms.effects import friction_radius
from frictionsim.plots.style import BLACK, Style
from frictionsim.scenario.recorded import scenario_value

if TYPE_CHECKING:
    from frictionsim.results import Record

LIMIT_LINE: Style = {"color": BLACK, "linestyle": (0, (3, 2)), "linewidth": 0.8}


def draw_static_limit(axes: dict[str, Any], result: "Record") -> list[Any]:
    """Draw the static limit of the friction torque of a journal; return legend handles.

    There is none without the panel of the friction torque, the reaction, or the friction of a
    shaft.

    Parameters
    ----------
    axes : dict of Axes
        By channel.
    result : Record
    """
    if "friction_torque" not in axes or "shaft_reaction" not in result.channels:
        return []
    try:
        journal = scenario_value(result, "effects", "shaft_friction")
        radius = friction_radius(float(journal["shaft_radius"]), float(journal["mu_s"]))
    except (InputError, KeyError, TypeError, ValueError):
        return []
    time, limit = result.channels["time"], radius * result.channels["shaft_reaction"]
    ax = axes["friction_torque"]
    ax.plot(time, -limit, **LIMIT_LINE)
    return list(ax.plot(time, limit, **LIMIT_LINE, label="limit of static friction"))
