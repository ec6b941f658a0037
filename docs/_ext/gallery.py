"""The pictures of the gallery and of the walk-through, and the commands that make them.

    python docs/_ext/gallery.py

makes all of `docs/pictures` anew, in some minutes; with words, as `path report`, those whose files
have such a word in their name. `--results FOLDER` takes results of shipped scenarios from there.
Screenshots of reports need a Chromium and Playwright (`screenshots`).
"""

import argparse
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

DOCS = Path(__file__).parents[1]
PICTURES = DOCS / "pictures"
SCENARIOS = DOCS.parent / "scenarios"
VIEW_OF = "plot results/{}.h5 --view"
FRICTION = "effects.shaft_friction."


class Picture(NamedTuple):
    """A picture of the gallery."""

    file: str  # in `docs/pictures`
    title: str
    commands: tuple[str, ...]  # the last writes the picture, or the report shown; `-o` is added
    scheme: str = ""  # of a screenshot of a report `light` or `dark`
    place: str = ""  # CSS selector of what a screenshot begins with; empty for the top
    time: float | None = None  # of the clock of a report, s

    @property
    def shown(self) -> tuple[str, ...]:
        """The commands as a reader would type them."""
        target = f"{Path(self.file).stem}.html" if self.scheme else f"docs/pictures/{self.file}"
        option = "--animate" if self.file.endswith(".gif") else "-o"
        if self.commands[-1].startswith(("frictionsim cost", "frictionsim fit")):
            option = "--plot"
        return (*self.commands[:-1], f"{self.commands[-1]} {option} {target}")


# By kind: the scenario that its views are drawn of, and what each view shows.
VIEWS = {
    "pulley": (
        "pulley_return",
        {
            "response": "a pulley on a dry shaft: breakaway, slip, and rest again",
            "friction": "its friction over what acts and over the speed, with limits and law",
            "mechanism": "the pulley with its forces, and the friction circles of its shaft",
        },
    ),
    "marble_machine": (
        "marble_machine",
        {
            "response": "a marble machine: channels over time, stick shaded",
            "friction": "its friction over what acts and over the speed",
            "torque": "its torques over the angle of the gear",
            "mechanism": "the forces on gear and pinion, enlarged at the teeth and at the shaft",
        },
    ),
    "epicyclic": (
        "epicyclic",
        {
            "response": "an epicyclic gear: channels over time, stick shaded",
            "friction": "its friction over what acts and over the speed",
            "torque": "its torques over the angle of the crank",
            "path": "the path of its tracer point, and where this dwells",
            "mechanism": "the gear at an instant with its forces and couples",
        },
    ),
    "belt_drive": (
        "belt_drive",
        {
            "speeds": "a belt drive: speeds of the pulleys and torques on them",
            "drive": "the drive in place: tension as colour, stick, normal forces and friction",
            "tension": "the tension along the belt",
            "body": "what one body of the belt meets",
            "friction": "friction over normal force against the slip of its bodies, and the law",
            "wear": "friction work along a belt with oil on a part of it",
        },
    ),
    "shaft": (
        "shaft",
        {
            "response": "a bell crank on a dry shaft: channels over time, stick shaded",
            "friction": "its friction over what acts and over the speed",
            "friction_circle": "its forces, and the friction circles of its shaft, as it slips",
        },
    ),
}
# Of a view of an instant that is not the end, and of a body on the passive span, as in Kubas 2014.
OPTIONS = {"friction_circle": "--time 0.8", "body": "--body 120", "mechanism": "--time 1"}
# By view: another scenario than that of its kind, and what is set in it.
OF_ANOTHER = {"wear": ("belt_patch", " --set 'effects.wear={}'")}
# By scenario: its kind, and further views or what else they show.
MORE_VIEWS = {
    "lift": (
        "pulley",
        {
            "response": "a lift with counterweight: two starts, a stop and an emergency stop",
            "traction": "its traction: the tensions of the ropes against the limits of friction",
        },
    ),
}
# By the beginning of the names of pictures: scenario, views, and what they show.
DRAWN = VIEWS | {name: (name, views) for name, (_, views) in MORE_VIEWS.items()}


def solved(file: str, title: str, name: str, then: str, *screen: Any, more: str = "") -> Picture:
    """Return the picture of the result of a scenario, by a command in which {} is its name."""
    commands = f"frictionsim solve scenarios/{name}.toml{more}", f"frictionsim {then.format(name)}"
    return Picture(file, title, commands, *screen)


def of_views() -> list[Picture]:
    """Return the pictures of all views of all kinds, and of further scenarios."""
    pictures = []
    for kind, (name, views) in DRAWN.items():
        for view, title in views.items():
            own, more = OF_ANOTHER.get(view, (name, ""))
            then = f"{VIEW_OF} {view} {OPTIONS.get(view, '')}".rstrip()
            pictures.append(solved(f"{kind}_{view}.png", title, own, then, more=more))
    return pictures


def reported(name: str, title: str, of: str, time: float) -> Picture:
    """Return the screenshot of the viewer in the report of a result, at a time of its clock."""
    file, then = f"report_{name}.png", "report results/{}.h5"
    return solved(file, f"the report of {title}", of, then, "light", "#viewer", time)


def swept(name: str, view: str, *options: str) -> tuple[str, ...]:
    """Return the commands that sweep the pulley and draw a view."""
    target = f"results/{name}.h5"
    sweep = f"frictionsim sweep scenarios/pulley.toml {' '.join(options)} -o {target}"
    return sweep, f"frictionsim plot {target} --view {view}"


VARY = f"--vary '{FRICTION}mu_s=lin(0.1, 0.4, 13)'"
MADE = (
    f"frictionsim solve scenarios/pulley.toml --set {FRICTION}mu_s=0.23 --set {FRICTION}mu_k=0.12"
    f" --set {FRICTION}law=regularised --set {FRICTION}transition_speed=0.5 --backend lsoda"
    " --set output.interval=0.05 -o results/measured.h5"
)
FIT = (
    "frictionsim fit scenarios/pulley.toml --data measured.csv --channel angular_velocity"
    f" --free {FRICTION}mu_s=0.05:0.4 --free {FRICTION}mu_k=0.02:0.3"
)
BOTH = (
    "frictionsim solve scenarios/pulley.toml",
    "frictionsim solve scenarios/pulley.toml --set mechanism.load=2300 -o results/heavy.h5",
)
HOIST = ("frictionsim new pulley hoist.toml", "frictionsim solve hoist.toml")
HOISTS = (
    "frictionsim sweep hoist.toml --vary 'mechanism.load=lin(1800, 2600, 9)'"
    f" --vary '{FRICTION}mu_s=lin(0.1, 0.4, 7)' -o results/hoist_sweep.h5"
)
OF_RUN = (*HOIST, "frictionsim report results/hoist.h5")
OF_SWEEP = (*HOIST, HOISTS, "frictionsim report results/hoist_sweep.h5")
OF_COST = ("frictionsim cost hoist.toml --csv hoist_cost.csv", "frictionsim report hoist_cost.csv")
OF_COST = (*HOIST, *OF_COST)
MAP = swept("map", "breakaway_time", VARY, "--vary 'mechanism.load=lin(1800, 2600, 9)'")
SAMPLE = swept(
    "sample",
    "breakaway_time",
    f"--vary '{FRICTION}mu_s=uniform(0.2, 0.3)'",
    "--vary 'mechanism.load=normal(2200, 50)'",
    "--sample 64 --indices",
)
OTHERS = [
    Picture(
        "overlay.png",
        "two results over each other",
        (*BOTH, "frictionsim plot results/pulley.h5 results/heavy.h5"),
    ),
    solved(
        "epicyclic.gif",
        "an epicyclic gear in motion",
        *("epicyclic", "plot results/{}.h5 --fps 8"),
    ),
    Picture(
        "sweep_curves.png",
        "a sweep over one key",
        swept("curves", "force_to_lift,force_to_hold", VARY),
    ),
    Picture("sweep_map.png", "a sweep over two keys", MAP),
    Picture("sweep_sample.png", "a sample: histogram and Sobol indices", SAMPLE),
    Picture("cost.png", "what accuracy costs in time", ("frictionsim cost scenarios/pulley.toml",)),
    Picture(
        "fit.png",
        "a fit to measured data",
        (MADE, "frictionsim show results/measured.h5 --csv > measured.csv", FIT),
    ),
    Picture(
        "hoist.png", "a hoist that lifts its load", (*HOIST, "frictionsim plot results/hoist.h5")
    ),
    Picture(
        "hoist_map.png",
        "the force that lifts a load, over load and friction",
        (*HOIST, HOISTS, "frictionsim plot results/hoist_sweep.h5 --view force_to_lift"),
    ),
]
OF_GEAR = [
    solved(
        "epicyclic_dwell.png",
        "the gear at a uniform speed: its tracer point swings while it dwells",
        *("epicyclic_dwell", f"{VIEW_OF} path --time 1"),
    ),
    solved(
        "epicyclic_ring.png",
        "a planet inside a ring of twice its size: a straight line",
        *("epicyclic_ring", f"{VIEW_OF} mechanism --time 1"),
    ),
]
# Further scenarios of a kind, in its group.
FURTHER = [
    solved(
        "pulley_cases.png",
        "the five cases of the pulley's paper, and the radius c against that of static friction",
        "pulley_cases",
        "plot results/{}.h5 --channels drive_force,lever_arm,case,angular_velocity",
    ),
    solved(
        "shaft_hoist_drum.png",
        "a hoist drum with an eccentric mass: couples as curved arrows",
        *("hoist_drum", f"{VIEW_OF} friction_circle --time 2"),
    ),
    solved(
        "shaft_swing_door.png",
        "a swing door that the friction of its hinges holds half open",
        *("swing_door", f"{VIEW_OF} response"),
    ),
]
PAPERS = [
    solved(
        f"paper_{kind}.png",
        f"{kind}: a column of a paper, 84 mm wide",
        DRAWN[kind][0],
        "plot results/{}.h5 --width 84mm --style paper --no-title --dpi 200",
    )
    for kind in ("pulley", "epicyclic")
]
# By kind, or name of a further scenario: the time of the clock in a screenshot of its report, and
# what is seen then.
INSTANTS = {
    "pulley": (0.75, "a pulley that slips: the load, the forces and the reaction of the shaft"),
    "marble_machine": (2.0, "a marble machine with four marbles delivered"),
    "epicyclic": (1.2, "an epicyclic gear with the path of its tracer point"),
    "belt_drive": (1.0, "a belt drive: tension as colour, stick and slip"),
    "shaft": (0.8, "a bell crank that slips: forces, reaction and friction circles"),
    "lift": (12.2, "a lift whose ropes slip over a sheave that stands still"),
    "hoist_drum": (2.0, "a hoist drum: the cord, the eccentric mass, the shaft enlarged"),
    "swing_door": (3.0, "a swing door with its torsion spring, seen from above"),
}
REPORTS = [
    Picture("report_run_light.png", "the report of a run", OF_RUN, "light"),
    Picture("report_run_dark.png", "the same, where the system is dark", OF_RUN, "dark"),
    Picture("report_sweep_light.png", "the report of a sweep", OF_SWEEP, "light", "#charts"),
    Picture(
        "report_cost_dark.png",
        "the report of a study of accuracy and time",
        *(OF_COST, "dark", "#charts"),
    ),
    *(
        reported(name, title, DRAWN[name][0] if name in DRAWN else name, time)
        for name, (time, title) in INSTANTS.items()
    ),
    Picture(
        "report_comparison.png",
        "the report of two results, side by side on one clock",
        (*BOTH, "frictionsim report results/pulley.h5 results/heavy.h5"),
        *("light", "#viewer", 0.9),
    ),
]
GALLERY = [*of_views(), *OF_GEAR, *FURTHER, *PAPERS, *OTHERS, *REPORTS]


def gallery() -> str:
    """Return the body of the page: each picture with the command that draws it."""
    parts = []
    views = [*of_views(), *OF_GEAR, *FURTHER]
    groups = [(kind, [p for p in views if p.file.startswith(f"{kind}_")]) for kind in DRAWN]
    groups += [
        ("for papers", PAPERS),
        ("comparisons, motion, sweeps, costs and fits", OTHERS),
        ("reports", REPORTS),
    ]
    for heading, pictures in groups:
        parts.append(f"## {heading.replace('_', ' ').capitalize()}")
        for picture in pictures:
            title = f"{picture.title[0].upper()}{picture.title[1:]}"
            parts += [f"![{title}](pictures/{picture.file})", f"{title}: `{picture.shown[-1]}`"]
    return "\n\n".join(parts)


def make(pictures: list[Picture], results: Path | None) -> None:
    """Make pictures in `docs/pictures`; each command is run once.

    Results of shipped scenarios that are in the folder `results` are not solved again.
    """
    done: set[str] = set()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(SCENARIOS, folder / "scenarios")
        (folder / "results").mkdir()
        (folder / "docs" / "pictures").mkdir(parents=True)
        for picture in pictures:
            for command in picture.shown:
                if command not in done and not _is_there(command, folder, results):
                    _run(command, folder)
                done.add(command)
            made = folder / picture.shown[-1].split()[-1]
            target = PICTURES / picture.file
            if picture.scheme:
                from screenshots import take

                take(made, target, picture.scheme, picture.place, picture.time)
            else:
                shutil.copyfile(made, target)
            print(f"{target}: {target.stat().st_size} bytes", flush=True)


def _is_there(command: str, folder: Path, results: Path | None) -> bool:
    words = shlex.split(command)
    if results is None or words[1] != "solve" or len(words) > 3:
        return False
    result = results / Path(words[2]).with_suffix(".h5").name
    if result.exists():
        shutil.copyfile(result, folder / "results" / result.name)
    return result.exists()


def _run(command: str, folder: Path) -> None:
    words, _, target = command.partition(" > ")
    line = [sys.executable, "-m", *shlex.split(words)]
    done = subprocess.run(line, cwd=folder, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"{command}: exit {done.returncode}")
    if target:
        (folder / target).write_text(done.stdout, encoding="utf-8")


def main() -> None:
    """Make the pictures that are asked for."""
    parser = argparse.ArgumentParser(prog="python docs/_ext/gallery.py", description=__doc__)
    parser.add_argument("words", nargs="*", help="of the names of pictures; all of them without")
    parser.add_argument("--results", type=Path, help="folder with results of shipped scenarios")
    given = parser.parse_args()
    words = given.words or [""]
    PICTURES.mkdir(exist_ok=True)
    make([p for p in GALLERY if any(word in p.file for word in words)], given.results)
    if not given.words:
        for left in {*PICTURES.iterdir()} - {PICTURES / picture.file for picture in GALLERY}:
            left.unlink()


if __name__ == "__main__":
    main()
