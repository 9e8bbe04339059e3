"""How long JAX has been compiling, to report compiling and running apart."""

import functools
import time

import jax.monitoring

_COMPILE_STAGES = ("jaxpr_trace_duration", "jaxpr_to_mlir_module_duration", "backend_compile_duration")


def compile_seconds() -> float:
    """Give the seconds that JAX has traced, lowered and compiled since this was first called.

    Returns:
        Seconds [s]; a stage inside another, or beside it on another thread, counts once.
    """
    total, until = 0.0, -float("inf")
    for begin, end in sorted(_spans()):
        total += max(0.0, end - max(begin, until))
        until = max(until, end)
    return total


@functools.cache
def _spans() -> list[tuple[float, float]]:
    """Begin to listen; give the list to which each stage adds its begin and end."""
    spans: list[tuple[float, float]] = []

    def listen(event: str, duration_secs: float, **_: str | int) -> None:
        if event.endswith(_COMPILE_STAGES):
            now = time.perf_counter()
            spans.append((now - duration_secs, now))

    jax.monitoring.register_event_duration_secs_listener(listen)
    return spans
