"""What a fit costs and changes where diffrax simulates it, beside the default: RK4, locked to the samples.

Run `python benchmarks/fit_solvers.py` (some minutes). Printed for each integrator: seconds of the first fit,
which compiles, and of the fastest of `--repeats` after it; the ratio of that to the default's; chi2/dof; by
how many standard errors the coefficients lie from the default's; and the same ratio of times for one whole
record, simulated from its start to its end without derivatives.

Data: the paper's y model, stepped sine of two levels (60 and 120 N) and 13 frequencies from 4 to 7 Hz, 20
cycles a dwell at 500 Hz, white noise of 0.01 m/s^2. All fits start from the classical guess.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import diffrax
import jax
import numpy as np

from isojax import Campaign, Fit, Integrator, Isolator, classical_guess, fit, read_campaign, rig
from isojax.identification.jacobian import Segment, prepare, readings

INTEGRATORS = {
    "default": None,
    "Tsit5, rtol 1e-4": Integrator(diffrax.Tsit5(), rtol=1e-4, atol=1e-10),
    "Dopri8, rtol 1e-3": Integrator(diffrax.Dopri8(), rtol=1e-3),
    "Dopri8, rtol 1e-6": Integrator(diffrax.Dopri8(), rtol=1e-6),
    "Dopri8, rtol 1e-10": Integrator(diffrax.Dopri8(), rtol=1e-10, atol=1e-14),
}


def make_campaign(folder: Path) -> Campaign:
    """Simulate the records, and read them."""
    plan = rig.SteppedSine((60.0, 120.0), tuple(np.arange(4.0, 7.1, 0.25).tolist()), 20, ("forward",))
    bench = rig.Bench(rate=500.0, noise=0.01, drift=0.0)
    rig.write_campaign(folder, rig.y_plant(), plan, 1, "2 records", bench)
    return read_campaign(folder)


def fastest(work: Callable[[], object], repeats: int) -> float:
    """Give the seconds of the fastest of some calls."""
    taken = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work()
        taken.append(time.perf_counter() - begin)
    return min(taken)


def whole_record(model: Isolator, campaign: Campaign, integrator: Integrator) -> Callable[[], object]:
    """Give the function that simulates the first record from rest."""
    record = campaign.records[0]
    prepared = prepare(
        (record,),
        (Segment(0, 0, record.output.size, 0),),
        quantity=campaign.output.quantity,
        hold=campaign.input.hold,
        substeps=integrator.table_steps(model),
        integrator=integrator,
    )
    lanes = prepared.record.size
    return lambda: readings(model, np.ones(lanes), np.zeros((2, lanes)), prepared)


def main() -> None:
    """Time every integrator and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=3, help="timed calls after the first")
    repeats = parser.parse_args().repeats
    jax.config.update("jax_enable_x64", True)
    with tempfile.TemporaryDirectory() as folder:
        campaign = make_campaign(Path(folder))
    start = classical_guess(campaign).model
    samples = sum(record.output.size for record in campaign.records)
    print(f"{samples} samples in {len(campaign.records)} records, {len(start.parameters) - 1} coefficients\n")
    print(
        f"{'':20s}{'first [s]':>10s}{'fit [s]':>10s}{'ratio':>8s}{'chi2/dof':>12s}{'moved [se]':>12s}", end=""
    )
    print(f"{'one record [s]':>16s}{'ratio':>8s}")
    default: tuple[Fit, float, float] | None = None
    for name, integrator in INTEGRATORS.items():

        def search(integrator: Integrator | None = integrator) -> Fit:
            return fit(start, campaign, integrator=integrator)

        begin = time.perf_counter()
        found = search()
        first = time.perf_counter() - begin
        taken = fastest(search, repeats)
        alone = whole_record(found.model, campaign, found.estimate.problem.integrator)
        alone()
        single = fastest(alone, repeats)
        if default is None:
            default = found, taken, single
        errors = default[0].standard_errors
        moved = max(abs(float(found.model[one] - default[0].model[one])) / errors[one] for one in found.free)
        print(f"{name:20s}{first:10.2f}{taken:10.2f}{taken / default[1]:8.1f}", end="")
        print(
            f"{found.stats.chi2 / found.stats.dof:12.6f}{moved:12.2g}{single:16.3f}{single / default[2]:8.1f}"
        )
    assert default is not None
    print(f"\nThe default is {default[0].integration}.")


if __name__ == "__main__":
    main()
