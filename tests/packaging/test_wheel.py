"""The wheel in a fresh environment, away from the sources, and the tests of the source archive."""

import os
import re
import subprocess
import sys
import tomllib
import venv
import zipfile
from email import message_from_bytes
from email.message import Message
from pathlib import Path
from typing import NamedTuple

import pytest

from frictionsim import __version__
from tests.support.scenarios import ROOT, SCENARIOS

pytestmark = pytest.mark.packaging

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
SCRIPTS = "Scripts" if sys.platform == "win32" else "bin"
FOR_TESTS = ("pytest", "pytest-xdist", "filelock", "hypothesis", "jsonschema", "taplo", "mpmath")
# Of most rooms one file, without compiled kernels; they read scenarios, stored cases and pages.
SOME_TESTS = (
    *("tests/api/test_load.py", "tests/api/test_solve.py", "tests/io/test_hdf5.py"),
    *("tests/mechanisms/test_effects.py", "tests/mechanisms/test_epicyclic.py"),
    *("tests/motion/test_belt_drive.py", "tests/packaging/test_metadata.py"),
    *("tests/sweeps/test_design.py", "tests/scenario/test_shipped.py"),
    *("tests/solvers/test_published_law.py", "tests/costs/test_error_estimate.py"),
)
# In turn, in one folder that is empty at first.
COMMANDS = {
    "frictionsim --version": __version__,
    "frictionsim new pulley p.toml": "",
    "frictionsim check p.toml": "p.toml: ok",
    "frictionsim solve p.toml -o p.h5": "result: p.h5",
    "frictionsim plot p.h5": "p.png",
    "frictionsim show p.h5": "breakaway_time",
    "frictionsim compare p.h5 p.h5": "the files agree",
}


class Archives(NamedTuple):
    """The wheel, and the folder that the source archive was unpacked in."""

    wheel: Path
    sources: Path


class Environment(NamedTuple):
    """A fresh environment in which the wheel is installed."""

    folder: Path

    def run(self, *command: str, cwd: Path) -> "subprocess.CompletedProcess[str]":
        """Run one of its programs with nothing of this process's environment for Python."""
        surroundings = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
        program = self.folder / SCRIPTS / command[0]
        return subprocess.run(
            [program, *command[1:]],
            cwd=cwd,
            env=surroundings,
            capture_output=True,
            text=True,
            check=False,
        )


@pytest.fixture(scope="module")
def archives(tmp_path_factory: pytest.TempPathFactory) -> Archives:
    """The archives; the wheel is built from the unpacked sources, which so are complete."""
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--outdir", str(folder), str(ROOT)]
    subprocess.run(command, capture_output=True, check=True)
    [archive], [wheel] = folder.glob("*.tar.gz"), folder.glob("*.whl")
    subprocess.run(["tar", "-xzf", archive, "-C", folder], check=True)
    return Archives(wheel, folder / archive.name.removesuffix(".tar.gz"))


@pytest.fixture(scope="module")
def environment(archives: Archives, tmp_path_factory: pytest.TempPathFactory) -> Environment:
    environment_of_wheel = Environment(tmp_path_factory.mktemp("environment"))
    venv.create(environment_of_wheel.folder, with_pip=True)
    install = ("python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check")
    done = environment_of_wheel.run(*install, str(archives.wheel), cwd=environment_of_wheel.folder)
    assert done.returncode == 0, done.stderr
    return environment_of_wheel


@pytest.fixture(scope="module")
def metadata(archives: Archives) -> Message:
    with zipfile.ZipFile(archives.wheel) as wheel:
        return message_from_bytes(wheel.read(f"frictionsim-{__version__}.dist-info/METADATA"))


def test_the_wheel_has_the_package_its_types_and_the_scenarios(archives: Archives) -> None:
    with zipfile.ZipFile(archives.wheel) as wheel:
        names = {name for name in wheel.namelist() if ".dist-info" not in name}
    sources = {str(p.relative_to(ROOT)) for p in (ROOT / "frictionsim").rglob("*.py")}
    shipped = {f"frictionsim/{p.relative_to(ROOT)}" for p in SCENARIOS.rglob("*") if p.is_file()}
    page = {str(p.relative_to(ROOT)) for p in (ROOT / "frictionsim/reports/page").iterdir()}
    assert names == {*sources, *shipped, *page, "frictionsim/py.typed"}


def test_its_description_is_the_readme(metadata: Message) -> None:
    assert metadata["Description-Content-Type"] == "text/markdown"
    description = metadata.get_payload(decode=True)
    assert isinstance(description, bytes)
    text, readme = description.decode(), (ROOT / "README.md").read_text(encoding="utf-8")
    targets = re.findall(r"\]\(([^)]*)\)|src=\"([^\"]*)\"", text)
    assert len(targets) > 10
    # Its links lead somewhere wherever it is read.
    home = PROJECT["urls"]["Homepage"]
    assert all(re.match("https?:|#", link or picture) for link, picture in targets)
    assert re.sub(f"{home}/(blob|raw)/main/", "", text) == readme


def test_the_wheel_works_in_an_empty_folder(environment: Environment, tmp_path: Path) -> None:
    for command, answer in COMMANDS.items():
        done = environment.run(*command.split(), cwd=tmp_path)
        assert done.returncode == 0, f"{command}: {done.stderr}"
        assert answer in done.stdout, command
    where = "import frictionsim; print(frictionsim.__file__)"
    done = environment.run("python", "-c", where, cwd=tmp_path)
    assert Path(done.stdout.strip()).is_relative_to(environment.folder)


def test_the_tests_of_the_source_archive_pass(archives: Archives, environment: Environment) -> None:
    install = ("python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check")
    done = environment.run(*install, *FOR_TESTS, cwd=environment.folder)
    assert done.returncode == 0, done.stderr
    command = ("python", "-m", "pytest", "-n", "2", *SOME_TESTS)
    done = environment.run(*command, cwd=archives.sources)
    assert done.returncode == 0, done.stdout
