"""Shared fixtures: float64 before any array is made, shape checks, and the folder of third-party data."""

import gc
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FunctionType
from typing import Any

import jax
import jaxlib.version
import jaxtyping
import pytest
from jaxtyping import install_import_hook
from threadpoolctl import threadpool_limits


def _keep_to_own_cores() -> None:
    """Give each worker cores of its own: the threads of several on the same few wait for each other.

    XLA then need not cut what it compiles into parts for threads. BLAS, which counted the cores before, must
    not share its products among more threads than are left: they would wait for each other, too.
    """
    worker, count = os.environ.get("PYTEST_XDIST_WORKER"), int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", 1))
    if worker is None or count == 1 or not hasattr(os, "sched_setaffinity"):
        return
    cores, place = sorted(os.sched_getaffinity(0)), int(worker.removeprefix("gw"))
    own = cores[place::count] or [cores[place % len(cores)]]
    os.sched_setaffinity(0, own)
    threadpool_limits(len(own), user_api="blas")
    os.environ["OPENBLAS_NUM_THREADS"] = str(len(own))  # of the processes that tests start
    if jaxlib.version.__version_info__ < (0, 11):  # XLA ends a process for a flag that it does not know
        flags = os.environ.get("XLA_FLAGS", "")
        os.environ["XLA_FLAGS"] = f"{flags} --xla_cpu_parallel_codegen_split_count=1".strip()


_keep_to_own_cores()

# Tracing makes a million small objects that stay: looking for cycles among them takes a tenth of it all.
gc.set_threshold(100_000, 50, 100)

_ALREADY = os.environ.get("JAX_COMPILATION_CACHE_DIR")
_COMPILED = _ALREADY or tempfile.mkdtemp(prefix="isojax-tests-")
"""Compiled code of this run: its workers, their modules and the processes that tests start share it."""

os.environ["JAX_COMPILATION_CACHE_DIR"] = _COMPILED
jax.config.update("jax_compilation_cache_dir", _COMPILED)
os.environ["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] = "0"
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_rank_promotion", "raise")


def _sparing(check: Callable[..., Any]) -> Callable[..., Any]:
    """Leave out functions that tell no shape: each call would prepare them for the check, and Pyright sees
    the types that they do tell."""

    def jaxtyped(function: Any = None, **options: Any) -> Any:
        if function is None:
            return lambda function: jaxtyped(function, **options)
        if isinstance(function, FunctionType) and "jaxtyping" not in repr(function.__annotations__):
            return function
        return check(function, **options)

    return jaxtyped


jaxtyping.jaxtyped = _sparing(jaxtyping.jaxtyped)  # what the hook puts before each function
if "ISOJAX_UNCHECKED" not in os.environ:  # a run inside a test, of a copy of what the run outside checks
    install_import_hook("isojax", "beartype.beartype")


_MOST_MAPPINGS = 40_000
"""Memory mappings of the process from which compiled code is let go; Linux allows 65530, and every compiled
function takes several. Beyond that limit the compiler does not raise, it crashes."""

_MOST_MEMORY = 5e9
"""Resident memory of the process [B] from which compiled code is let go: there is one process a core."""

_compiled_since: list[str] = []
"""An entry for each function compiled, or read from the folder, since the mappings were last counted."""


def _note_compiled(event: str, _: float, **__: object) -> None:
    if event == "/jax/core/compile/backend_compile_duration":
        _compiled_since.append(event)


jax.monitoring.register_event_duration_secs_listener(_note_compiled)


@pytest.fixture
def unchecked():
    """The package as a user has it, without the runtime shape checks of the tests."""
    jaxtyping.config.update("jaxtyping_disable", True)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)


@pytest.fixture(autouse=True)
def _let_compiled_code_go() -> Iterator[None]:
    """Forget compiled functions after a test, once they crowd the address space or the memory.

    To count the mappings takes up to a tenth of a second, too long for a test that compiled next to nothing.
    """
    yield
    if len(_compiled_since) < 300:
        return
    _compiled_since.clear()
    process = Path("/proc/self")
    if not process.exists():
        return
    pages = int((process / "statm").read_text().split()[1])
    crowded = len((process / "maps").read_bytes().splitlines()) > _MOST_MAPPINGS
    if crowded or pages * os.sysconf("SC_PAGE_SIZE") > _MOST_MEMORY:
        from isojax._cores import give_memory_back  # here, because the hook above must see the import

        jax.clear_caches()
        gc.collect()
        give_memory_back()


def pytest_configure(config: pytest.Config) -> None:
    """Compile quickly, which is most of what tests do; here, because the hook above must see the import."""
    if config.getoption("numprocesses") and not hasattr(config, "workerinput"):
        return  # who only hands out tests needs no package, which takes long to import with its checks
    from isojax import compile_quickly

    compile_quickly()


_WORTH_OPTIMISING = (
    "test_map.py",
    "test_cli_map.py",
    "test_bifurcation_diagram.py",
    "test_fold_curve.py",
    "test_paper.py",
    "02_the_papers_map",
)
"""Tests that run longer than they compile: maps, attractors, many curves or campaigns of one shape."""


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Optimise compiled code where that is worth its time; before any fixture is made.

    Elsewhere small records run no slower than they would compile. Processes that the test starts do alike, so
    that they find what was compiled here.
    """
    optimise = any(part in item.nodeid for part in _WORTH_OPTIMISING)
    jax.config.update("jax_disable_most_optimizations", not optimise)
    os.environ["JAX_DISABLE_MOST_OPTIMIZATIONS"] = str(not optimise).lower()


_LONGEST = (
    "test_blind_sample.py",
    "test_examples.py",
    "test_fold_curve.py",
    "test_notebooks.py",
    "test_special_points.py",
    "test_orbit.py",
    "test_transients.py",
)
"""Files that take minutes, the longest first; the notebooks after the files that compile the same loop and
curves, so that they find these compiled."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the files that take longest: no worker is then left alone with one at the end."""
    places = {name: place for place, name in enumerate(_LONGEST)}
    items.sort(key=lambda item: places.get(item.path.name, len(places)))


def pytest_sessionfinish() -> None:
    """Clear the compiled code away, in the process that made its folder: workers inherit it."""
    if _ALREADY is None:
        shutil.rmtree(_COMPILED, ignore_errors=True)


@pytest.fixture
def every_core() -> Iterator[None]:
    """Let one test have all cores of the machine, so that work is shared among threads."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    own = os.sched_getaffinity(0)
    os.sched_setaffinity(0, range(os.cpu_count() or 1))
    yield
    os.sched_setaffinity(0, own)


@pytest.fixture(scope="session")
def demo_beside() -> Path | None:
    """Folder of `isojax demo` where .ci/run runs it beside the tests, once it has ended; else None."""
    if "ISOJAX_DEMO" not in os.environ:
        return None
    folder = Path(os.environ["ISOJAX_DEMO"])
    ended = folder.with_suffix(".ended")
    for _ in range(600):
        if ended.exists():
            break
        time.sleep(1.0)
    assert ended.exists(), "`isojax demo` did not end within ten minutes"
    assert ended.read_text().strip() == "0", folder.with_suffix(".err").read_text(encoding="utf-8")
    return folder


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of measurements that nobody on the project wrote; never part of the repository."""
    folder = Path(os.environ.get("ISOJAX_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not folder.is_dir():
        if os.environ.get("CI") == "true":
            pytest.fail(f"CI must see the measured data, but {folder} is not there; set ISOJAX_DATA")
        pytest.skip(f"measured data not found at {folder}; set ISOJAX_DATA to its folder")
    return folder
