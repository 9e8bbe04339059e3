"""Time first calls, which compile: each case in a fresh process, with nothing kept from earlier ones.

Run: python benchmarks/first_calls.py

Prints seconds of the import, then wall time and processor time of the first call and of the second, which
compiles nothing; PASS or FAIL against ten seconds of wall time, and the functions that took longest to
compile. Then the wall time of notebook 02 from top to bottom, with its kernel and all that compiles, against
two minutes. Ends with code 1 if any fails. Run it on quiet cores: compiling is work of the processor.
"""

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

LIMIT = 10.0
"""Wall time that a first call may take [s]."""

NOTEBOOK, NOTEBOOK_LIMIT = "02_the_papers_map.ipynb", 120.0
"""Notebook that is run, and the wall time that it may take [s]."""

SHOWN = 4
"""Functions whose compile time is printed."""


def call(case: str) -> Any:
    """Make the call of a case."""
    import jax
    import numpy as np

    import isojax as ij

    model = ij.paper.y_direction()
    if case == "branch, response":
        branch = ij.continue_branch(model, parameter="amplitude", frequency=4.3, start=1.0, stop=400.0)
        return branch, ij.frequency_response(model, 150.0, (3.5, 6.0))
    if case == "curve of folds":
        return ij.fold_curve(model, amplitude_range=(100.0, 250.0), frequency_range=(3.8, 4.8))
    if case == "orbit with end stops":
        springs = (ij.LinearStiffness(5e5), ij.LinearDamping(2e3), ij.EndStop(1e6, 1e-3, 0.0, 1e-5))
        return ij.find_periodic_orbit(ij.Isolator(800.0, springs), ij.Harmonic(500.0, 4.3))
    if case == "derivative of an orbit":
        drive = ij.Harmonic(150.0, 4.3)
        return jax.jacfwd(lambda own: ij.find_periodic_orbit(own, drive).floquet.spectral_radius)(model)
    return ij.stability_map(model, np.linspace(1.0, 300.0, 60), np.linspace(3.0, 8.0, 60))


CASES = ("branch, response", "curve of folds", "orbit with end stops", "derivative of an orbit", "map")


def time_case(case: str) -> None:
    """Print the times of one case, in this process."""
    begun = time.perf_counter()
    import jax

    jax.config.update("jax_enable_x64", True)
    import isojax.stability

    assert isojax.stability
    imported = time.perf_counter() - begun
    compiled: list[tuple[float, str]] = []

    def heard(event: str, duration_secs: float, **kwargs: str | int) -> None:
        if event.endswith("backend_compile_duration"):
            compiled.append((duration_secs, str(kwargs.get("fun_name", "?"))))

    jax.monitoring.register_event_duration_secs_listener(heard)
    times = []
    for _ in range(2):
        wall, work = time.perf_counter(), time.process_time()
        jax.block_until_ready(call(case))
        times += [time.perf_counter() - wall, time.process_time() - work]
    first, first_work, second, second_work = times
    verdict = "PASS" if first <= LIMIT else "FAIL"
    print(
        f"{case:<24} import {imported:4.1f} s; first {first:5.1f} s, of processors {first_work:5.1f} s; "
        f"second {second:5.2f} s, {second_work:5.2f} s  {verdict}"
    )
    longest = ", ".join(f"{name} {seconds:.2f}" for seconds, name in sorted(compiled, reverse=True)[:SHOWN])
    total = sum(seconds for seconds, _ in compiled)
    print(f"  {len(compiled)} functions compiled in {total:.1f} s, longest: {longest}", flush=True)


def time_notebook() -> None:
    """Print the time of a notebook, run as the tests run it."""
    root = Path(__file__).parents[1]
    sys.path.insert(0, str(root / "tests"))
    from run_notebook import executed

    begun = time.perf_counter()
    executed(root / "notebooks" / NOTEBOOK)
    seconds = time.perf_counter() - begun
    verdict = "PASS" if seconds <= NOTEBOOK_LIMIT else "FAIL"
    print(f"notebook {NOTEBOOK}: {seconds:.0f} s  {verdict}")


def main() -> int:
    """Run each case in a process of its own."""
    environment = {name: value for name, value in os.environ.items() if name != "JAX_COMPILATION_CACHE_DIR"}
    failed = 0
    for case in (*CASES, NOTEBOOK):
        done = subprocess.run(
            [sys.executable, __file__, case], env=environment, capture_output=True, text=True, check=True
        )
        print(done.stdout, end="", flush=True)
        failed += "FAIL" in done.stdout
    return 1 if failed else 0


if __name__ == "__main__":
    if len(sys.argv) > 1:
        time_notebook() if sys.argv[1] == NOTEBOOK else time_case(sys.argv[1])
    else:
        sys.exit(main())
