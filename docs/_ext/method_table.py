"""Which friction laws and integration methods go together, as the registry has them."""

from markdown import table
from scenario_keys import model_of

from frictionsim.scenario.kinds import KINDS
from frictionsim.scenario.methods import laws_of, methods_of


def methods() -> str:
    """Return a table of the methods that go with each law; kinds with the same rows share them."""
    kinds: dict[tuple[tuple[str, str], ...], list[str]] = {}
    for kind in KINDS:
        kinds.setdefault(tuple(pairs(kind).items()), []).append(f"`{kind}`")
    rows = [
        (", ".join(names) if number == 0 else "", f"`{law}`", able)
        for laws, names in kinds.items()
        for number, (law, able) in enumerate(laws)
    ]
    return table(("kind", "`law`", "`solver.backend`"), rows)


def pairs(kind: str) -> dict[str, str]:
    """Return the methods that go with each law of a kind."""
    table_of_pairs = model_of(kind).PAIRS
    return {
        law: " ".join(f"`{name}`" for name in methods_of(table_of_pairs, law))
        for law in laws_of(table_of_pairs)
    }
