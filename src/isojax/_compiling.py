"""How XLA compiles: less of it where that costs nothing, and once a machine."""

import os
import sys
from pathlib import Path

import jaxlib.version

UNTRIED = (0, 11)
"""First jaxlib that was not tried: a flag that XLA does not know ends the process."""

_FLAG = "--xla_cpu_use_fusion_emitters"


def compile_quickly() -> bool:
    """Have XLA compile for CPUs without its fusion emitters: half the time, and the code is as fast.

    Fits, diagnoses, orbits, maps and curves are compiled so anyway. This is a flag of the process
    (`XLA_FLAGS`), for all that uses JAX there, functions of your own included, so isojax sets it only where
    asked; the command line does. Call it before the first computation: XLA reads its flags once. Results
    differ by rounding.

    Returns:
        Whether the flag is set; it is left alone where `XLA_FLAGS` names it already, and where jaxlib is
        newer than was tried.

    Example:
        >>> ij.compile_quickly()  # doctest: +SKIP
        True
    """
    flags = os.environ.get("XLA_FLAGS", "")
    if _FLAG in flags or jaxlib.version.__version_info__ >= UNTRIED:
        return f"{_FLAG}=false" in flags
    os.environ["XLA_FLAGS"] = f"{flags} {_FLAG}=false".strip()
    return True


def quick_options() -> dict[str, bool]:
    """Give the compiler options by which one function is compiled as quickly as by `compile_quickly`.

    Returns:
        The options; none where the user has set the flag, and where jaxlib is newer than was tried.
    """
    if _FLAG in os.environ.get("XLA_FLAGS", "") or jaxlib.version.__version_info__ >= UNTRIED:
        return {}
    return {_FLAG.lstrip("-"): False}


def compiled_code_folder() -> Path | None:
    """Give the folder in which JAX may keep what it compiles, for later runs on this machine.

    JAX keeps code apart by its own version, that of XLA, the flags and the processor. The folder is the
    one that ISOJAX_CACHE names, else JAX's own where the user has set one, else `isojax` in the user's cache
    folder. An empty ISOJAX_CACHE keeps nothing.

    Returns:
        The folder; None where nothing is kept, or where it cannot be written.
    """
    import jax

    usual = jax.config.values["jax_compilation_cache_dir"] or str(_user_cache())
    chosen = os.environ.get("ISOJAX_CACHE", usual)
    if not chosen:
        return None
    folder = Path(chosen)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return folder if os.access(folder, os.W_OK) else None


def _user_cache() -> Path:
    """Give the folder in which this system keeps what a program can make again."""
    home = Path(os.path.expanduser("~"))
    if sys.platform == "win32":
        root = Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local")
    elif sys.platform == "darwin":
        root = home / "Library" / "Caches"
    else:
        root = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    return root / "isojax"
