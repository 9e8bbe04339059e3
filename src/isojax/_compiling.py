"""How XLA compiles: less of it where that costs nothing."""

import os

import jaxlib.version

_UNTRIED = (0, 11)
"""First jaxlib that was not tried: a flag that XLA does not know ends the process."""

_FLAG = "--xla_cpu_use_fusion_emitters"


def compile_quickly() -> bool:
    """Have XLA compile for CPUs without its fusion emitters: half the time, and the code is as fast.

    It is a flag of the process (`XLA_FLAGS`), for all that uses JAX there, so isojax sets it only where
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
    if _FLAG in flags or jaxlib.version.__version_info__ >= _UNTRIED:
        return f"{_FLAG}=false" in flags
    os.environ["XLA_FLAGS"] = f"{flags} {_FLAG}=false".strip()
    return True
