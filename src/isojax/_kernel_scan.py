"""A scan whose loop XLA compiles into one kernel."""

from collections.abc import Callable
from typing import Any

import jax
import jaxlib.version
from jax.experimental.xla_metadata import set_xla_metadata

from ._compiling import UNTRIED


def kernel_scan(body: Callable[[Any, Any], tuple[Any, Any]], carry: Any, tables: Any) -> tuple[Any, Any]:
    """Scan as `jax.lax.scan` does; in one kernel, where JAX computes on a CPU.

    XLA runs each fused operation of a loop's body as a kernel of its own, at some 0.1 us each. A step of a
    few lanes computes for less than that. XLA makes one kernel of loops up to a size, which is a flag of the
    process. The attribute that it gives such loops marks this one alone. Sorts, scatters and LAPACK must stay
    outside. XLA ends the process where what the loop takes is known while it compiles, and is moved into the
    loop: use this where all numbers are arguments, as in what `quick_jit` calls by itself.

    Args:
        body: from a carry and a row of the tables to a carry and a row of the result.
        carry: at the start.
        tables: rows first.

    Returns:
        The carry at the end, and the rows of the result.

    Source: openxla/xla, `SmallWhileLoopHoistingPass` and `ThunkEmitter::EmitCallThunk`.
    """
    if jax.default_backend() != "cpu" or jaxlib.version.__version_info__ >= UNTRIED:
        return jax.lax.scan(body, carry, tables)

    def unmarked(carry: Any, tables: Any) -> tuple[Any, Any]:
        # A mark holds for all that is traced within: what the loop calls goes back to the usual.
        with set_xla_metadata(xla_cpu_small_call="false", inlineable="true"):
            return jax.lax.scan(body, carry, tables)

    with set_xla_metadata(xla_cpu_small_call="true", inlineable="false"):
        return jax.jit(unmarked)(*jax.lax.optimization_barrier((carry, tables)))
