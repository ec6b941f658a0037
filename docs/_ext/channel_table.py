"""The channels of all kinds, as result files describe them."""

from markdown import table
from scenario_keys import model_of

from frictionsim.scenario.kinds import KINDS


def channels() -> str:
    """Return a table of the channels; kinds in which a channel has one meaning share a row."""
    kinds: dict[tuple[str, str, str], list[str]] = {}
    for kind in KINDS:
        for name, channel in model_of(kind).CHANNELS.items():
            axis = f"({channel.axis})" if channel.axis else ""
            meaning = " ".join(filter(None, (channel.long_name, axis)))
            kinds.setdefault((f"`{name}`", channel.unit, meaning), []).append(f"`{kind}`")
    rows = [(*channel, ", ".join(names)) for channel, names in kinds.items()]
    return table(("channel", "unit", "meaning", "kind"), rows)
