"""A plugin of pytest for trials: it writes what failed, ends what hangs, and sees what is used.

`FAULTS_FAILED` is the file for the names of what failed, a line each. `FAULTS_AMONG` is a file with
the names of tests, or files of tests, that alone are run, if there are any.

`FAULTS_USED` is a file for what is used, a line of JSON for each test after one for imports: which
functions of the package ran in this process, by their files and first lines, what was read there,
what the processes that it started have imported or read (`started_python`), and whether one was
started in which that cannot be seen. Each test is run in a process of its own then, forked after
the imports, so that nothing is hidden there by what another test has left in a cache.
"""

import cProfile
import faulthandler
import importlib
import json
import os
import resource
import sys
import tempfile
import threading
from collections import defaultdict
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import pytest
from hypothesis import Phase, settings

from tests.faults.started_python import read_for_a_digest

ROOT = str(Path(__file__).parents[2])
PACKAGE = os.path.join(ROOT, "frictionsim") + os.sep
CPU_LIMIT = 150  # s a test, which other work of the machine does not use up; the slowest takes 30
WALL_LIMIT = 900.0  # s a test, of one that waits for ever
FORKS = {"os.fork", "os.forkpty"}  # run what is imported here
STARTS = {"os.posix_spawn", "os.system"}
HARMLESS = (("uname",), ("fc-list",))  # asked by numba and matplotlib for what is installed
SLOW_TO_IMPORT = ("h5py", "matplotlib.figure", "numba", "scipy.optimize", "xarray")
UNSEEING = {"-I", "-S", "-E", "-IS"}  # options of a Python that imports no `sitecustomize`

profiles: list[cProfile.Profile] = []
read: set[str] = set()  # as a text here, or in any way by a process that was started
started: set[str] = set()
of_imports: dict[str, set[int]] = {}  # what ran before the first test
place = os.environ.get("FAULTS_USED", "")


def _look(event: str, arguments: tuple[Any, ...]) -> None:
    if event in FORKS:
        started.add("fork")
    elif event in STARTS or (event == "subprocess.Popen" and not _is_seen(*arguments)):
        started.add("unseen")
    elif event == "open" and isinstance(arguments[0], str | os.PathLike):
        path = os.path.abspath(arguments[0])
        imported = "importlib" in sys._getframe(1).f_code.co_filename
        if path.startswith(PACKAGE) and not imported and not read_for_a_digest():
            read.add(path)


def _is_seen(program: Any, arguments: Any, folder: Any, environment: Any) -> bool:
    """Return whether a process, if it is a Python, tells what it imports."""
    given = os.environ if environment is None else environment
    tells = "FAULTS_STARTED" in given and ROOT in given.get("PYTHONPATH", "").split(os.pathsep)
    return (program,) in HARMLESS or (tells and not UNSEEING & set(map(str, arguments)))


def _profile(*_: Any) -> None:
    """Profile this thread from its next call on."""
    sys.setprofile(None)
    profiles.append(cProfile.Profile(subcalls=False, builtins=False))
    profiles[-1].enable()


if place:
    os.environ["FAULTS_STARTED"] = place + "-elsewhere"
    _start = BaseProcess.start

    def _seen(process: BaseProcess) -> None:
        started.add("fork")
        _start(process)

    BaseProcess.start = _seen  # type: ignore[method-assign]
    sys.addaudithook(_look)
    threading.setprofile(_profile)
    _profile()


def pytest_sessionstart() -> None:
    """Have Hypothesis end a test at its first failing example: no smaller one is wanted."""
    settings.register_profile("first", settings.default, phases=(Phase.explicit, Phase.generate))
    settings.load_profile("first")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave out what is not asked for."""
    if names := set(Path(os.environ["FAULTS_AMONG"]).read_text(encoding="utf-8").splitlines()):
        items[:] = [one for one in items if {one.nodeid, one.nodeid.partition("::")[0]} & names]


def pytest_collection_finish() -> None:
    """Write what was used by imports."""
    if place:
        for name in SLOW_TO_IMPORT:
            importlib.import_module(name)
        _write_used("")


def _write_used(test: str) -> None:
    ran: dict[str, set[int]] = defaultdict(set)
    for profile in profiles:
        for entry in profile.getstats():
            if not isinstance(entry.code, str) and entry.code.co_filename.startswith(PACKAGE):
                ran[entry.code.co_filename].add(entry.code.co_firstlineno)
    imported = {getattr(module, "__file__", None) or "" for module in list(sys.modules.values())}
    if {name for name in imported if name.startswith(PACKAGE)} - set(ran):
        started.add("unseen")  # a profile is lost now and then
    elsewhere = Path(os.environ["FAULTS_STARTED"])
    names = elsewhere.read_text().splitlines() if elsewhere.exists() else []
    own = {name: lines - of_imports.get(name, set()) for name, lines in ran.items()}
    used = {
        "test": test,
        "ran": {os.path.relpath(name, ROOT): sorted(of) for name, of in own.items() if of},
        "read": sorted(os.path.relpath(name, ROOT) for name in {*read, *names}),
        "started": sorted(started),
    }
    of_imports.update(ran)
    with Path(place).open("a", encoding="utf-8") as file:
        file.write(json.dumps(used) + "\n")


@pytest.hookimpl(tryfirst=True)
def pytest_runtestloop(session: pytest.Session) -> bool | None:
    """Run each test in a process of its own where what it uses is asked for."""
    if not place:
        return None
    for item in session.items:
        with tempfile.TemporaryDirectory() as folder:
            if (child := _forked()) == 0:
                _run_and_exit(item, folder)
            if os.waitpid(child, 0)[1]:
                started.add("unseen")
                _write_used(item.nodeid)
                started.remove("unseen")
    return True


def _run_and_exit(item: pytest.Item, folder: str) -> None:
    os.environ["PYTEST_DEBUG_TEMPROOT"] = folder  # also of what tests share
    os.environ["FAULTS_STARTED"] += f"-{os.getpid()}"
    code = 1
    try:
        item.config.hook.pytest_runtest_protocol(item=item, nextitem=None)
        _write_used(item.nodeid)
        code = 0
    finally:
        os._exit(code)


def _forked() -> int:
    before = set(started)
    child = os.fork()
    started.intersection_update(before)
    return child


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Any:
    """End this worker where a test hangs, by what goes on without Python, as in a kernel."""
    if hasattr(item.config, "workerinput"):
        used = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
        resource.setrlimit(resource.RLIMIT_CPU, (int(used) + CPU_LIMIT, resource.RLIM_INFINITY))
        faulthandler.dump_traceback_later(WALL_LIMIT, exit=True, file=sys.__stderr__)
    try:
        return (yield)
    finally:
        faulthandler.cancel_dump_traceback_later()


def _write(report: pytest.TestReport | pytest.CollectReport) -> None:
    # The controller of pytest-xdist has the reports of its workers, also of those that ended.
    if report.failed and "PYTEST_XDIST_WORKER" not in os.environ:
        with Path(os.environ["FAULTS_FAILED"]).open("a") as file:
            file.write(report.nodeid + "\n")


pytest_runtest_logreport = pytest_collectreport = _write
