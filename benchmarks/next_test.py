"""Does the suggested record shrink the interval as it was predicted to?

Run `python benchmarks/next_test.py`, then `python benchmarks/next_test.py --report`. A run can be stopped and
goes on where it stopped: a line of the file is a refit, about two seconds. The plant is the paper's y
direction with every coefficient moved by up to 10 %, on the rig simulator, as in `covered.py`; its stiffness
scatters from record to record by 0.05 %. Three stepped sines are fitted. `next_test` then suggests a fourth
record, once for all coefficients (D-optimal), once for the largest transmissibility and once for the force at
the fold (c-optimal).

- From the posterior: what a test of this one campaign is predicted to say is a prediction given its three
  records. So the truth is drawn from what they leave open: the scatter of the stiffness, the coefficients at
  that scatter, and the noise. The suggested record is measured on the rig of that truth, and fitted together
  with the same three records.
- Many campaigns: the three records are measured anew as well, and the prediction is made from them.
- From the rig: as from the posterior, but every time on the rig that the three records came from. Where they
  happen to scatter less, or more, than this rig does, the prediction from them differs from what it shows.

The report prints the standard error as predicted and as the refits gave it, both as root mean squares over
the standard error before, for all coefficients the geometric mean along the axes of their ellipsoid. PASS or
FAIL beside the mark of 15 %; the exit status is 1 after a FAIL.
"""

import argparse
import dataclasses
import json
import tempfile
import time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

import isojax as ij
from _marks import Marks
from _set_up_jax import set_up_jax
from _trial_campaign import Sketch, sketch
from covered import BAND, DRIVE, FOLD_FREQUENCY, records_of
from isojax import rig
from isojax.identification import Fit, Proposal
from isojax.identification.fitting import _covariance, _scatter_mixture

RESULTS = Path(__file__).parent / "results" / "next_test.jsonl"
SEED, RECORDS, SCATTER = 400000, 3, 5e-4
MARK = 0.15
"""By which the shrinkage may differ from the predicted one."""

TRUTHS = {"posterior": "drawn from the posterior", "anew": "many campaigns", "rig": "from the rig"}
"""Where the truth of a refit comes from, in words."""

CRITERIA = ("all coefficients", "peak transmissibility", "fold force")


class Planned(rig.Plan):
    """A suggested record, as the rig drives it."""

    def __init__(self, proposal: Proposal):
        """Keep the proposal."""
        self.proposal = proposal

    def trials(self, shaker: rig.Shaker, seed: int) -> tuple[rig.Trial, ...]:
        """The one record."""
        experiment, level = self.proposal.experiment, self.proposal.level
        seconds = experiment.seconds
        direction = "backward" if experiment.backward else "forward"
        if experiment.waveform == "stepped sine":
            rows = [[float(one) for one in row.split(",")] for row in self.proposal.schedule.split()[1:]]
            ends = [*(row[0] for row in rows[1:]), seconds]
            pieces = tuple(
                shaker.sine(level, row[1], row[0], end) for row, end in zip(rows, ends, strict=True)
            )
            schedule = tuple(tuple(row) for row in rows)
            return (
                rig.Trial("next", pieces, seconds, level, direction, 0, "fit", schedule=schedule),  # pyright: ignore
            )
        drive = experiment.drive[0]
        lines = np.fft.rfft(drive) / drive.size * 2.0
        if experiment.waveform == "multisine":
            held = np.flatnonzero(np.abs(lines) > 1e-6 * np.abs(lines).max())
            tones = rig.Tones(
                0.0,
                seconds,
                0.0,
                tuple(np.abs(lines[held]).tolist()),
                tuple((2.0 * np.pi * held / seconds).tolist()),
                tuple((np.angle(lines[held]) + 0.5 * np.pi).tolist()),
            )
            return (rig.Trial("next", (tones,), seconds, level, "none", 0, "fit"),)
        low, high = (float(one) for one in experiment.name.split("_")[3:5])
        first, last = (high, low) if experiment.backward else (low, high)
        sweep = shaker.sweep(level, first, (last - first) / seconds, 0.0, seconds)
        return (rig.Trial("next", (sweep,), seconds, level, direction, 0, "fit"),)


def measured(drawn: Sketch, plan: rig.Plan, seed: int) -> ij.records.Campaign:
    """Give what the rig records."""
    with tempfile.TemporaryDirectory() as folder:
        return ij.read_campaign(
            rig.write_campaign(Path(folder), drawn.plant, plan, seed, "next test", drawn.bench)
        )


def quantities(drawn: Sketch) -> dict:
    """Give what is asked of the model, by criterion."""
    natural = float(np.sqrt(drawn.base[0] / 800.0) / (2.0 * np.pi))

    def peak(model: ij.Isolator) -> jax.Array:
        return jnp.max(ij.transmissibility(model, DRIVE * drawn.levels[0], BAND * natural).magnitude)

    def fold(model: ij.Isolator) -> jax.Array:
        branch = ij.continue_branch(
            model, parameter="amplitude", frequency=FOLD_FREQUENCY * natural, start=1.0, stop=400.0
        )
        return branch.special_points[0].amplitude

    return dict(zip(CRITERIA, (None, peak, fold), strict=True))


def size_of(fit: Fit, gradient: np.ndarray | None) -> float:
    """Give the standard error that counts."""
    if gradient is not None:
        return float(np.sqrt(gradient @ fit.covariance @ gradient))
    known = fit.estimate.uncertainty
    logarithm = np.linalg.slogdet(known.correlation)[1]
    return float(np.exp(np.mean(np.log(known.standard_error)) + 0.5 * logarithm / len(fit.free)))


def drawn_truth(drawn: Sketch, fit: Fit, run: int) -> Sketch:
    """Give a rig drawn from what the records of a fit leave open: scatter, coefficients at it, noise."""
    draw = np.random.default_rng([SEED, run])
    reduced, nuisances = fit.estimate.point.reduced, fit.estimate.point.nuisances
    inflation = max(1.0, fit.stats.chi2 / fit.stats.dof)
    known = _covariance.find_determined(reduced.matrix[:-1, :-1])
    basis = known.vectors / known.size[:, None]
    records = _scatter_mixture._with_scales(reduced, nuisances, basis, inflation)
    mixture = _scatter_mixture._at(records, _scatter_mixture._SCATTERS)
    place = draw.choice(mixture.weight.size, p=mixture.weight)
    own = _scatter_mixture._at(records, np.array([nuisances.spread.records])).step[0]
    step = draw.multivariate_normal(mixture.step[place] - own, mixture.covariance[place])
    moved = basis @ step
    base = tuple(float(fit.model[name]) + float(by) for name, by in zip(fit.free, moved, strict=True))
    noise = drawn.bench.noise * np.sqrt(inflation * fit.stats.dof / draw.chisquare(fit.stats.dof))
    scatter = float(_scatter_mixture._SCATTERS[place])
    bench = dataclasses.replace(drawn.bench, drift=scatter, noise=float(noise))
    return dataclasses.replace(drawn, base=base, bench=bench)


def report(rows: list[dict]) -> None:
    """Print predicted and found errors."""
    marks = Marks()
    for name in CRITERIA:
        for truth, words in TRUTHS.items():
            some = [row for row in rows if row["criterion"] == name and row["truth"] == truth]
            if not some:
                continue
            predicted, found = (
                float(np.sqrt(np.mean([(row[key] / row["now"]) ** 2 for row in some])))
                for key in ("predicted", "found")
            )
            line = (
                f"{name}, {words}, {len(some)} refits: predicted {predicted:.3f}, found {found:.3f}, "
                f"ratio {found / predicted:.3f} in the rms and "
                f"{np.median([row['found'] / row['predicted'] for row in some]):.2f} in the median"
            )
            met = abs(found / predicted - 1.0) <= MARK
            marks.judge(f"{line} (mark 1 +- {MARK}); {some[0]['words']}", met)
    marks.leave()


def gradient_of(quantity, fit: Fit) -> np.ndarray | None:
    """Give the derivatives of a quantity by the coefficients."""
    if quantity is None:
        return None
    slopes = ij.sensitivity(quantity, fit.model, parameters=fit.free)
    return np.array(slopes.derivatives["value"])


def same_again(best: Proposal, fit: Fit, quantity) -> Proposal:
    """Give what the same record promises beside other records of the first three kinds."""
    experiment = best.experiment
    names = experiment.name.split("_")
    low, high = (float(one) for one in names[3 if "sine_" in experiment.name else 2 :][:2])
    test = ij.next_test(fit, quantity, levels=(float(np.std(experiment.drive)),), bands=((low, high),))
    how = experiment.waveform, experiment.backward
    return next(one for one in test.proposals if (one.experiment.waveform, one.experiment.backward) == how)


def main() -> None:
    """Run what is not there yet, or report."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=50, help="refits of each suggestion")
    parser.add_argument("--criteria", nargs="+", default=list(CRITERIA), choices=CRITERIA)
    parser.add_argument("--truths", nargs="+", default=list(TRUTHS), choices=TRUTHS, help="of the refits")
    parser.add_argument("--out", type=Path, default=RESULTS, help="one line a refit")
    parser.add_argument("--minutes", type=float, default=np.inf, help="begin no refit after so long")
    parser.add_argument("--cache", type=Path, help="folder in which compiled code is kept between runs")
    parser.add_argument("--report", action="store_true", help="print the table")
    options = parser.parse_args()
    rows = [json.loads(line) for line in options.out.read_text().splitlines()] if options.out.exists() else []
    if options.report:
        report(rows)
    set_up_jax(options.cache)
    begin = time.perf_counter()
    drawn = sketch(SEED, "coverage", ())
    drawn = dataclasses.replace(drawn, bench=dataclasses.replace(drawn.bench, drift=SCATTER))
    campaign = measured(drawn, records_of(drawn, RECORDS), SEED)
    first = ij.fit(drawn.model, campaign)
    for name, quantity in quantities(drawn).items():
        done = {(row["truth"], row["run"]) for row in rows if row["criterion"] == name}
        left = [
            (truth, run)
            for truth in options.truths
            for run in range(options.runs)
            if (truth, run) not in done
        ]
        if name not in options.criteria or not left:
            continue
        test = ij.next_test(first, quantity)
        print(repr(test), flush=True)
        assert test.best is not None
        best = test.best
        for truth, run in left:
            if time.perf_counter() - begin > 60.0 * options.minutes:
                return
            fit, promise, rig_now = first, best, drawn
            if truth == "posterior":
                rig_now = drawn_truth(drawn, first, run)
            if truth == "anew":
                fit = ij.fit(drawn.model, measured(drawn, records_of(drawn, RECORDS), 8000 + run))
                promise = same_again(best, fit, quantity)
            gradient = gradient_of(quantity, fit)
            further = measured(rig_now, Planned(promise), 7000 + run)
            whole = dataclasses.replace(fit.campaign, records=(*fit.campaign.records, *further.records))
            now = size_of(fit, gradient)
            row = {
                "criterion": name,
                "truth": truth,
                "run": run,
                "words": best.experiment.words,
                "now": now,
                "predicted": promise.shrinkage * now,
                "found": size_of(ij.fit(fit.model, whole), gradient),
            }
            with options.out.open("a") as file:
                file.write(json.dumps(row) + "\n")
            print(f"{name} {run}: {row['found'] / now:.3f}, predicted {promise.shrinkage:.3f}", flush=True)


if __name__ == "__main__":
    main()
