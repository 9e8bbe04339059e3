"""Shared fixtures: float64 before any array is made, shape checks, and the folder of third-party data."""

import os
from pathlib import Path

import jax
import pytest
from jaxtyping import install_import_hook

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_rank_promotion", "raise")
install_import_hook("isojax", "beartype.beartype")


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of measurements that nobody on the project wrote; never part of the repository."""
    folder = Path(os.environ.get("ISOJAX_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not folder.is_dir():
        if os.environ.get("CI") == "true":
            pytest.fail(f"CI must see the measured data, but {folder} is not there; set ISOJAX_DATA")
        pytest.skip(f"measured data not found at {folder}; set ISOJAX_DATA to its folder")
    return folder
