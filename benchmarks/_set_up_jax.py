"""JAX as every benchmark that diagnoses campaigns wants it."""

import os
from pathlib import Path

import jax

from isojax import compile_quickly


def set_up_jax(cache: Path | None) -> None:
    """Work in double precision, compile quickly, and keep what is compiled in a folder if one is given.

    Args:
        cache: the folder.
    """
    jax.config.update("jax_enable_x64", True)
    compile_quickly()
    if cache:
        jax.config.update("jax_compilation_cache_dir", os.fspath(cache))
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.2)
