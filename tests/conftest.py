"""Fixtures that several test files use."""

from __future__ import annotations

import gc
import json
import os
import re
import shutil
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
import xarray as xr
from filelock import FileLock
from hypothesis import settings
from hypothesis.internal.constants_ast import Constants

from rockframe.cli.main import main, parser
from rockframe.ingest import collection
from rockframe.options.respond import ScreenOptions
from rockframe.wavelets.pulse import Pulse

REPOSITORY = Path(__file__).resolve().parents[1]
SHARED = REPOSITORY.parent / "shared"  # next to the repository; absent in a plain clone
#: Standalone programs, not tests; some need an extra of the package.
collect_ignore = ["benchmarks", "fuzz", "validation"]
EXPECTED = Path(__file__).resolve().parent / "expected"
#: Run Chromium as root, without a screen and without network requests of its own.
SWITCHES: Final = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
)

# No test depends on how long an example takes: the machine may be busy. Each run draws the same
# examples, a quarter of those of `make test-all`, which draws others with
# --hypothesis-profile=others.
settings.register_profile("others", deadline=None, max_examples=100)
settings.register_profile("same", deadline=None, derandomize=True, database=None, max_examples=25)
settings.load_profile("same")
# Print tables at the width used without a terminal, whatever terminal runs the tests.
os.environ.pop("COLUMNS", None)
# A shell makes background jobs ignore Ctrl-C, and the processes that tests start inherit that.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_configure(config: pytest.Config) -> None:
    """Draw no number that Hypothesis reads from the source of loaded modules.

    Which modules these are depends on the tests that the process happened to run before.
    """
    if config.getoption("--hypothesis-profile") != "others":
        name = "hypothesis.internal.conjecture.providers._get_local_constants"
        pytest.MonkeyPatch().setattr(name, Constants)


def pytest_collectstart() -> None:
    """Look for no garbage while tests are collected: what is made then lives until the end."""
    gc.disable()


#: Files of tests that take longest, from the longest on. They begin first: a process that began one
#: of them last would work on it alone.
LONGEST: Final = (
    *("cli/test_commands", "stages/test_compare", "rocking/test_ensemble", "cli/test_figure"),
    *("unequal/test_equal_columns", "runs/test_further", "results/test_foreign_files"),
    *("runs/test_run", "runs/test_engines", "runs/test_damage", "stages/test_screen_members"),
    *("structures/test_contract", "report/test_client", "stages/test_screen", "cli/test_streams"),
    *("results/test_damaged_netcdf", "results/test_batches", "rocking/test_touching"),
    *("test_compiled", "test_quantities", "stages/test_late_channels", "test_loading"),
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the tests of the longest files first; the others keep their order."""
    places = {REPOSITORY / "tests" / f"{name}.py": k for k, name in enumerate(LONGEST)}
    items.sort(key=lambda item: places.get(item.path, len(places)))


def pytest_collection_finish() -> None:
    """Look for garbage again, but not among the objects that exist already."""
    gc.freeze()
    gc.enable()


@pytest.fixture(scope="session", autouse=True)
def readers_in_this_process() -> Iterator[None]:
    """Start no worker to read the few files of a test, which takes 0.2 s; `tests/ingest` has tests
    of workers.
    """
    counted = collection.worker_count

    def count(workers: int | None, paths: Sequence[Path]) -> int:
        return 0 if workers in (None, 1) else counted(workers, paths)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(collection, "worker_count", count)
        yield


@pytest.fixture(scope="session", autouse=True)
def parsers_are_kept() -> Iterator[None]:
    """Make the parser of each command once, not for each of the thousand commands of the tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rockframe.cli.main.parser", cache(parser))
        yield


@pytest.fixture(scope="session", autouse=True)
def compiling_is_not_said() -> Iterator[None]:
    """Print nothing before kernels are compiled: tests of messages would depend on the cache."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rockframe.cli.main.before_compiling", lambda _tell: None)
        yield


@pytest.fixture(scope="session", autouse=True)
def files_need_not_survive_a_power_cut() -> Iterator[None]:
    """Do not wait until the disk has each of the thousands of files that the tests write."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda _: None)
        yield


def share_of(count: int) -> int:
    """Return a number of random cases: all in `make test-all`, a quarter elsewhere."""
    return max(5, count * settings().max_examples // 100)


def examples(count: int) -> settings:
    """Return settings of a property: `count` examples in `make test-all`, a quarter elsewhere."""
    return settings(max_examples=share_of(count))


@contextmanager
def coarse() -> Iterator[None]:
    """Draw with few dots and without ticks, do not arrange panels, and compile in no other process,
    for tests of files and texts of figures; `tests/figures` has tests of what figures show.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rockframe.cli.shipped._helped", nullcontext)
        for resolution in ("_PRINT", "_SCREEN"):
            patch.setattr(f"rockframe.figures.captioned.{resolution}", 20)
        for what in ("axis.Axis.draw", "layout_engine.ConstrainedLayoutEngine.execute"):
            patch.setattr(f"matplotlib.{what}", lambda _self, _renderer_or_figure: None)
        yield


def shared_folder(
    temporary: pytest.TempPathFactory, name: str, make: Callable[[Path], object]
) -> Path:
    """Return a folder that one process of a session makes and all read; no test changes it."""
    home = temporary.getbasetemp()
    home = home.parent if "PYTEST_XDIST_WORKER" in os.environ else home
    folder, whole = home / name, home / f"{name}.whole"
    with FileLock(home / f"{name}.lock"):
        if not whole.exists():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            make(folder)
            whole.touch()
    return folder


@pytest.fixture(scope="session")
def table1(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run of `rockframe table1`, coarsely drawn; a test that changes it changes a copy."""

    def make(folder: Path) -> None:
        with coarse():
            assert main(["table1", "--output", str(folder)]) == 0

    return shared_folder(tmp_path_factory, "table1", make)


@pytest.fixture(scope="session")
def expected() -> Callable[[str], Any]:
    """Return a function that loads tests/expected/NAME.json."""

    def load(name: str) -> Any:
        return json.loads((EXPECTED / f"{name}.json").read_text(encoding="utf-8"))

    return load


@pytest.fixture(scope="session")
def bundled_records() -> Path:
    """The folder of the records that come with the repository."""
    return REPOSITORY / "records" / "ridgecrest2019"


@pytest.fixture(scope="session")
def peer_records() -> Path:
    """The folder of the paper's own records, which may not be redistributed."""
    beside = SHARED / "records" / "table1"
    folder = Path(os.environ.get("ROCKFRAME_PEER_RECORDS", beside))
    if not folder.is_dir():
        pytest.skip("no PEER records: set ROCKFRAME_PEER_RECORDS to the folder that holds them")
    return folder


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """A headless Chromium."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="no playwright: make test-browser")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        pytest.skip("no Chromium: apt-get install chromium")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=[*SWITCHES])
        yield browser
        browser.close()


@pytest.fixture
def own_addresses() -> str:
    """The pattern of the addresses that a page may request: its own file and its blobs."""
    return r"(file:.*\.html|blob:)"


@pytest.fixture
def complaints() -> list[str]:
    """Console messages, errors and dialogs of the page; a test removes those that it expects."""
    return []


@pytest.fixture
def page(browser: Any, own_addresses: str, complaints: list[str]) -> Iterator[Any]:
    """A browser page; at teardown it must have no complaints and only requests to its addresses."""
    context = browser.new_context(viewport={"width": 1280, "height": 900}, accept_downloads=True)
    page = context.new_page()
    page.on("console", lambda message: complaints.append(message.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("dialog", lambda dialog: complaints.append(f"dialog: {dialog.message}"))
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url.split("#")[0]))
    yield page
    context.close()
    assert complaints == []
    assert all(re.match(own_addresses, url) for url in asked), asked


@pytest.fixture(scope="session")
def overlaps() -> str:
    """A script that finds texts and controls of a page that overlap or cross its edge."""
    return (Path(__file__).parent / "overlaps.js").read_text(encoding="utf-8")


@pytest.fixture
def motion(tmp_path: Path) -> Path:
    """A text record without metadata: one column of accelerations in g."""
    pulse = Pulse(wavelet="antisymmetric_ricker", a_p=0.4, T_p=1.0, time=3.0)
    path = tmp_path / "motion.csv"
    np.savetxt(path, pulse.acceleration(0.01 * np.arange(801)), fmt="%.8f")
    return path


@pytest.fixture
def screen(tmp_path: Path) -> Callable[..., xr.Dataset]:
    """Return a function that screens records, by default without margins."""
    from tests.screening import stored, structures

    from rockframe.results.screen import read_screening
    from rockframe.stages.screen import screen_stage

    def run(records: Any, **options: Any) -> xr.Dataset:
        output = tmp_path / "screen.nc"
        names = ("filters", "pulses_path", "engine")
        stage = {name: options.pop(name) for name in names if name in options}
        screen_stage(
            stored(records, tmp_path),
            output,
            ScreenOptions(**{"margins": "none", "scales": [0.5, 1.0, 2.0], **options}),
            structures_path=structures(tmp_path),
            **stage,
        )
        return read_screening(output)

    return run
