"""Variables, limits and folders of the surroundings: a documented outcome, never another result."""

import random
from pathlib import Path

from tests.attacks.disturbed import COMMANDS, check_undisturbed, originals, prepare, run

VARIABLES: dict[str, tuple[str | None, ...]] = {
    "HOME": (None, "", "/nonexistent", "/dev/null"),
    "TMPDIR": (None, "/nonexistent", "/dev/null"),
    "XDG_CACHE_HOME": (None, "", "/nonexistent", "relative"),
    "XDG_CONFIG_HOME": (None, "/nonexistent"),
    "MPLCONFIGDIR": ("/nonexistent", "/dev/null"),
    "MPLBACKEND": ("tkagg", "nonsense"),
    "PYTHONHASHSEED": ("0", "123"),
    "PYTHONOPTIMIZE": ("1",),  # with 2 there are no docstrings, which `new` makes comments of
    "PYTHONWARNINGS": ("error", "default"),
    "PYTHONIOENCODING": ("ascii", "utf-16"),
    "PYTHONUTF8": ("0", "1"),
    "PYTHONUNBUFFERED": ("1",),
    "PYTHONDEVMODE": ("1",),
    "LC_ALL": ("C", "tr_TR.UTF-8", "de_DE.UTF-8", "nonsense"),
    "NO_COLOR": ("1",),
    "FORCE_COLOR": ("1",),
    "COLUMNS": ("1", "0", "-5", "99999", "x"),
    "TERM": (None, "dumb", "xterm-256color"),
    "TZ": ("Asia/Kolkata", "nonsense"),
}
LIMITS = (
    *("ulimit -n 24;", "ulimit -c 0;", "ulimit -s 512;", "umask 077;", "ulimit -v 1000000;"),
    *("trap '' INT;", "trap '' TERM HUP;", "ulimit -f 100000;"),
)
PARAMETERS = (
    "text.usetex: True\n",
    "font.size: 20\nsavefig.dpi: 7\n",
    "backend: nonsense\n",
    "nonsense\x00: 1\n",
    "svg.fonttype: none\naxes.grid: True\nsavefig.transparent: True\n",
)


def attack(rng: random.Random, folder: Path) -> str:
    """Run a command in random surroundings and compare with the usual ones."""
    line, _ = rng.choice([outcome for outcome in COMMANDS if outcome[0] != "--help"])
    names = rng.sample(sorted(VARIABLES), k=rng.randint(0, 4))
    surroundings = {name: rng.choice(VARIABLES[name]) for name in names}
    limits = "".join(rng.sample(LIMITS, k=rng.randint(0, 2)))
    prepare(folder)
    if rng.random() < 0.3:
        (folder / "matplotlibrc").write_text(rng.choice(PARAMETERS))
    outcome = run(line, folder, environment=surroundings, before=limits)
    return check_undisturbed(line, outcome, f"{surroundings} {limits} {line}")


warm_up = originals
