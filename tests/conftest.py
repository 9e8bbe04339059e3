"""Shared fixtures: float64 before any array is made, shape checks, and the folder of third-party data."""

import gc
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import jax
import pytest
from jaxtyping import install_import_hook

_ALREADY = os.environ.get("JAX_COMPILATION_CACHE_DIR")
_COMPILED = _ALREADY or tempfile.mkdtemp(prefix="isojax-tests-")
"""Compiled code of this run: its workers, their modules and the processes that tests start share it."""

os.environ["JAX_COMPILATION_CACHE_DIR"] = _COMPILED
jax.config.update("jax_compilation_cache_dir", _COMPILED)
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)
jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_rank_promotion", "raise")
install_import_hook("isojax", "beartype.beartype")


_MOST_MAPPINGS = 40_000
"""Memory mappings of the process from which compiled code is let go; Linux allows 65530, and every compiled
function takes several. Beyond that limit the compiler does not raise, it crashes."""


@pytest.fixture(autouse=True)
def _let_compiled_code_go() -> Iterator[None]:
    """Forget compiled functions after a test, once they crowd the address space."""
    yield
    mappings = Path("/proc/self/maps")
    if mappings.exists() and len(mappings.read_bytes().splitlines()) > _MOST_MAPPINGS:
        jax.clear_caches()
        gc.collect()


def pytest_configure() -> None:
    """Compile quickly, which is most of what tests do; here, because the hook above must see the import.

    Nor is the code optimised: small records run no slower than they would compile.
    """
    from isojax import compile_quickly

    if compile_quickly() and "_optimization_level" not in os.environ["XLA_FLAGS"]:
        os.environ["XLA_FLAGS"] += " --xla_backend_optimization_level=0"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the file that takes longest: no worker is then left alone with it at the end."""
    items.sort(key=lambda item: item.path.name != "test_blind_sample.py")


def pytest_sessionfinish() -> None:
    """Clear the compiled code away, in the process that made its folder: workers inherit it."""
    if _ALREADY is None:
        shutil.rmtree(_COMPILED, ignore_errors=True)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of measurements that nobody on the project wrote; never part of the repository."""
    folder = Path(os.environ.get("ISOJAX_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not folder.is_dir():
        if os.environ.get("CI") == "true":
            pytest.fail(f"CI must see the measured data, but {folder} is not there; set ISOJAX_DATA")
        pytest.skip(f"measured data not found at {folder}; set ISOJAX_DATA to its folder")
    return folder
