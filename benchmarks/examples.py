"""Run the closed loop on the four example campaigns and hold each verdict against what hides in the data.

Run `python benchmarks/examples.py [quiet friction relaxation asymmetry]`; the campaigns are looked for in
`$ISOJAX_DATA/examples`, else in `../shared/data/examples` beside the repository. Printed for each:
verdict, finding and its indistinguishable set, strength with standard error beside the truth, held-out
chi2/dof and nrmse before and after, seconds (compilation included), and PASS or FAIL:

- quiet: nothing found, every coefficient within three standard errors of the truth;
- friction, relaxation, asymmetry: `coulomb_friction`, `maxwell_branch`, `quadratic_stiffness` found and
  nothing else, its strength within 5 % or three standard errors of the truth;
- all: held-out chi2/dof at most 1.05 at the end.

Where a coefficient is farther than three standard errors from the truth, all are printed once more after a
gain of `1 + 7.4e-6 f^2` (f in Hz), which both channels of the examples share, is taken out of both: it leaves
no trace in a residual, and no record shows it.

The exit status is 1 if anything failed.
"""

import argparse
import dataclasses
import json
import os
import sys
import time
from pathlib import Path

import jax
import numpy as np

EXAMPLES = {
    "quiet": None,
    "friction": "coulomb_friction",
    "relaxation": "maxwell_branch",
    "asymmetry": "quadratic_stiffness",
}
NOISE_FLOOR = 1.05
MOST_ERRORS = 3.0
CLOSE = 0.05
SHARED_GAIN = 7.4e-6
"""Gain of both channels beyond 1, over the square of the frequency in Hz."""

MOTION_HZ = 60.0
"""Above it there is noise alone, which keeps its size."""


def find_data() -> Path:
    """Give the folder of the shared data."""
    beside = Path(__file__).resolve().parents[2] / "shared" / "data"
    return Path(os.environ.get("ISOJAX_DATA", beside))


def print_errors(loop) -> None:
    """Print the errors before and after, fitted and held-out records."""
    for role in ("fit", "holdout"):
        for when, fit in (("before", loop.before), ("after", loop.after)):
            errors = fit.errors[role]
            if errors is not None:
                print(f"  {role:8s} {when:7s} chi2/dof {errors.chi2_per_dof:9.4f}", end="")
                print(f"   nrmse {errors.nrmse:.5f} free, {errors.nrmse_segments:.5f} restarted")


def print_coefficients(fit, base: list[float]) -> float:
    """Print the declared coefficients beside the truth; give the largest distance in standard errors."""
    values = {entry.name: float(entry.value) for entry in fit.model.parameters}
    names = [name for name in values if name != "mass"][: len(base)]
    off = []
    for name, truth in zip(names, base, strict=True):
        error = fit.standard_errors[name]
        off.append((values[name] - truth) / error)
        print(f"  {name:34s} {values[name]:14.7g} +- {error:9.3g}   truth {truth:14.7g}   {off[-1]:+6.2f} se")
    return float(np.max(np.abs(off)))


def without_shared_gain(campaign):
    """Give the campaign with the gain that both channels share taken out of both."""

    def corrected(signal: np.ndarray, rate: float) -> np.ndarray:
        # mirrored, so that the ends meet
        spectrum = np.fft.rfft(np.concatenate([signal, signal[::-1]]))
        frequency = np.fft.rfftfreq(2 * signal.size, 1.0 / rate)
        gain = 1.0 + SHARED_GAIN * np.minimum(frequency, MOTION_HZ) ** 2
        return np.fft.irfft(spectrum / gain, 2 * signal.size)[: signal.size]

    records = tuple(
        dataclasses.replace(
            record, input=corrected(record.input, record.rate), output=corrected(record.output, record.rate)
        )
        for record in campaign.records
    )
    return dataclasses.replace(campaign, records=records)


def print_finding(loop, finding, truth: list[float]) -> bool:
    """Print a finding and its strength beside the truth; say whether the strength is close to it."""
    print(
        f"  found {finding.effect} (p {finding.p_value:.2g}), indistinguishable: {finding.indistinguishable}"
    )
    print(
        f"  it explains {finding.excess_explained:.2%} of the excess, {finding.transfer:.2%} on unseen data"
    )
    element = loop.after.model.element(finding.effect)
    strength = f"{finding.effect}.{element.strength}"
    value, error = float(loop.after.model[strength]), loop.after.standard_errors[strength]
    print(f"  {strength:34s} {value:14.7g} +- {error:9.3g}   truth {truth[0]:14.7g}", end="")
    print(f"   {(value - truth[0]) / error:+6.2f} se, {value / truth[0] - 1:+.2%}")
    return abs(value - truth[0]) <= max(CLOSE * abs(truth[0]), MOST_ERRORS * error)


def check_example(name: str, folder: Path, talk: bool) -> bool:
    """Run one example, print what came of it, and say whether it passed."""
    from isojax import read_campaign
    from isojax.identification import close_loop, fit

    print(f"\n{name}", flush=True)
    truth = json.loads((folder / "truth.json").read_text())
    begin = time.perf_counter()
    progress = (lambda line: print(f"    {line}", flush=True)) if talk else (lambda line: None)
    loop = close_loop(read_campaign(folder / "campaign.toml"), progress=progress)
    seconds = time.perf_counter() - begin
    print(f"  verdict {loop.verdict} after {seconds:.0f} s: {loop.last.reason}")
    found = [finding.effect for finding in loop.findings]
    close = True
    for finding in loop.findings:
        if finding.effect == EXAMPLES[name]:
            close = print_finding(loop, finding, truth["spec"]["q"])
        else:
            print(f"  found {finding.effect}, which is not in the data")
    farthest = print_coefficients(loop.after, truth["base"])
    if farthest > MOST_ERRORS:
        print("  with the gain that both channels share taken out:")
        print_coefficients(fit(loop.after.model, without_shared_gain(loop.campaign)), truth["base"])
    print_errors(loop)
    held_out = loop.after.errors["holdout"]
    at_floor = held_out is not None and held_out.chi2_per_dof <= NOISE_FLOOR
    expected = EXAMPLES[name]
    checks = {f"finding is {expected or 'none'}": found == ([] if expected is None else [expected])}
    if name == "quiet":
        checks["verdict is none"] = loop.verdict == "none"
        checks[f"coefficients within {MOST_ERRORS:g} standard errors"] = farthest <= MOST_ERRORS
    else:
        checks[f"strength within {CLOSE:.0%} or {MOST_ERRORS:g} standard errors"] = close
    checks[f"held-out chi2/dof at most {NOISE_FLOOR}"] = at_floor
    for words, passed in checks.items():
        print(f"  {'PASS' if passed else 'FAIL'}  {words}", flush=True)
    return all(checks.values())


def main() -> None:
    """Run the examples that were asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "names", nargs="*", metavar="EXAMPLE", help=f"any of {', '.join(EXAMPLES)}; default all"
    )
    parser.add_argument("--progress", action="store_true", help="print each step of each search")
    options = parser.parse_args()
    unknown = [name for name in options.names if name not in EXAMPLES]
    if unknown:
        parser.error(f"no such example: {', '.join(unknown)}; there are {', '.join(EXAMPLES)}")
    jax.config.update("jax_enable_x64", True)
    folder = find_data() / "examples"
    if not folder.is_dir():
        sys.exit(f"There is no folder {folder}: set ISOJAX_DATA to the folder that holds `examples`.")
    names = options.names or list(EXAMPLES)
    passed = [check_example(name, folder / name, options.progress) for name in names]
    print(f"\n{sum(passed)} of {len(passed)} examples passed.")
    sys.exit(0 if all(passed) else 1)


if __name__ == "__main__":
    main()
