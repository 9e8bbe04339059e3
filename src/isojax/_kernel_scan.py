"""Loops that XLA compiles into one kernel."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import jaxlib.version
from jax.experimental.xla_metadata import set_xla_metadata
from jax.extend.core import ClosedJaxpr, jaxpr_as_fun

from ._compiling import UNTRIED


def in_one_kernel(function: Callable[..., Any], *operands: Any) -> Any:
    """Call a function whose loops become one kernel, where JAX computes on a CPU.

    XLA runs each fused operation of a loop's body as a kernel of its own, at some 0.1 us each. A step of a
    few lanes computes for less than that. XLA makes one kernel of loops up to a size, which is a flag of the
    process. The attribute that it gives such loops marks this call alone. Sorts, scatters and LAPACK must
    stay outside.

    Args:
        function: of the operands; what else it takes from around it may be traced.
        operands: any arrays.

    Returns:
        What the function gives.

    Source: openxla/xla, `SmallWhileLoopHoistingPass` and `ThunkEmitter::EmitCallThunk`.
    """
    if jax.default_backend() != "cpu" or jaxlib.version.__version_info__ >= UNTRIED:
        return function(*operands)
    closed, shape = jax.make_jaxpr(function, return_shape=True)(*operands)

    def unmarked(known: Any) -> Any:
        # A mark holds for all that is traced within: what the loop calls goes back to the usual.
        with set_xla_metadata(xla_cpu_small_call="false", inlineable="true"):
            done = jaxpr_as_fun(ClosedJaxpr(closed.jaxpr, known[0]))(*known[1:])
            return done, [jnp.ravel(one)[:1] for one in jax.tree.leaves(known) if jnp.size(one)]

    # XLA ends the process where the call takes what it does not read, or what is known while it compiles: so
    # everything is read, and hidden from what simplifies the program.
    known = jax.lax.optimization_barrier((closed.consts, *jax.tree.leaves(operands)))
    with set_xla_metadata(xla_cpu_small_call="true", inlineable="false"):
        done = jax.jit(unmarked)(known)
    return jax.tree.unflatten(jax.tree.structure(shape), jax.lax.optimization_barrier(done)[0])


def kernel_scan(body: Callable[[Any, Any], tuple[Any, Any]], carry: Any, tables: Any) -> tuple[Any, Any]:
    """Scan as `jax.lax.scan` does; `in_one_kernel`.

    Args:
        body: from a carry and a row of the tables to a carry and a row of the result.
        carry: at the start.
        tables: rows first.

    Returns:
        The carry at the end, and the rows of the result.
    """
    return in_one_kernel(lambda carry, tables: jax.lax.scan(body, carry, tables), carry, tables)
