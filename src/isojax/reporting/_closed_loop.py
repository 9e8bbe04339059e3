"""The closed loop with its report: what `isojax.close_loop` gives."""

import dataclasses
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from .._progress import silent
from .._show import Row, shown
from ..health import CampaignHealth, campaign_health
from ..identification import DEFAULT_SOLVER, ClassicalGuess, Extension, Finding, Fit, Loop, Rules
from ..identification import close_loop as find_loop
from ..models import Isolator
from ..records import Campaign
from .page import loop_summary, render_text, write_report
from .plots import plot_time_history


@shown
@dataclasses.dataclass(frozen=True, eq=False)
class ClosedLoop:
    """From records to a model that explains them, or to the admission that it does not.

    Attributes:
        loop: all of it.
    """

    loop: Loop

    @property
    def before(self) -> Fit:
        """The declared model, fitted."""
        return self.loop.before

    @property
    def after(self) -> Fit:
        """The final fit; the same as `before` where nothing was added."""
        return self.loop.after

    @property
    def findings(self) -> tuple[Finding, ...]:
        """The effects found, in the order of discovery."""
        return self.loop.findings

    @property
    def verdict(self) -> str:
        """Over all iterations: "none", "found", "partly_explained" or "unexplained"."""
        return self.loop.verdict

    @property
    def bounds(self) -> dict[str, tuple[float, str]]:
        """For each effect not found: how large its strength could still be, with its unit."""
        return self.loop.bounds

    @property
    def guess(self) -> ClassicalGuess:
        """The classical start."""
        return self.loop.guess

    @property
    def seconds(self) -> float:
        """Wall time [s]."""
        return self.loop.seconds

    @cached_property
    def health(self) -> CampaignHealth:
        """State of the data: dwells beside folds, drift budget; computed at its first use."""
        return campaign_health(self.loop)

    def report(self, folder: str | Path, *, markdown: bool = False) -> None:
        """Write report.html, result.json and, unless the last fit failed, model.json.

        Args:
            folder: where they go; made if it is not there.
            markdown: whether to write report.md with its pictures as well.

        Raises:
            ValueError: if something else than a folder is in the way, or a model that was found is not
                finite.
        """
        write_report(self.loop, folder, lambda: self.health, markdown=markdown)

    def __str__(self) -> str:
        """Give the summary that the terminal shows."""
        return render_text(loop_summary(self.loop))

    def _headline(self) -> str:
        # Not the headline of the report: that asks held-out records, which may have to be simulated first.
        return self.loop._headline()

    def _rows(self) -> list[Row]:
        return self.after.parameters._rows()

    def _lines(self) -> list[str]:
        return ["  print(loop) gives the summary, loop.report(folder) writes the report"]

    @property
    def model(self) -> Isolator:
        """The isolator of the last fit."""
        return self.after.model

    @property
    def extensions(self) -> tuple[Extension, ...]:
        """Each effect that was added, with the fits before and after, in the order of discovery."""
        return self.loop.extensions

    def plot(self, **options: Any) -> Figure:
        """Draw the record that the declared model explains worst, with free runs before and after.

        Args:
            **options: of `isojax.plot.time_history`.

        Returns:
            The figure, shown nowhere.
        """
        return plot_time_history(self.before, self.after, **options)


def close_loop(
    campaign: Campaign | str | Path,
    *,
    max_iterations: int = 3,
    excluded: tuple[str, ...] = (),
    solver: Any = DEFAULT_SOLVER,
    progress: Callable[[str], None] = silent,
    rules: Rules = Rules(),
    anyway: bool = False,
    checkpoint: str | Path | None = None,
) -> ClosedLoop:
    """Fit the declared model, find the effect that it lacks, add it, and again until nothing is left.

    Args:
        campaign: the measurements, or the path of their campaign.toml or its folder.
        max_iterations: effects that may be added at most; with 0 the declared model is fitted and diagnosed.
        excluded: catalogue names that are not to be considered.
        solver: an optimistix least-squares solver.
        progress: receives a `Stage` and a `KeyFigure` for each stage, and a line for each of its steps.
        rules: the numbers that decide verdicts.
        anyway: whether records that contradict their declaration are fitted all the same.
        checkpoint: file in which the answer of each computation is kept as it comes. A run that was killed
            goes on from there and ends with the same digits; what other data, another declaration or another
            version of isojax left there is not used.

    Returns:
        The closed loop; `.report(folder)` writes it, `print` shows it.

    Raises:
        ValueError: if the campaign has no record to fit, or names an effect that is not in the catalogue;
            if `excluded` holds what is no catalogue name; if the records contradict their declaration, as
            `isojax.records.refuse_contradictions` says it.
        RuntimeError: if JAX is not in 64-bit mode.

    Example:
        With the campaign of `read_campaign`'s example:

        >>> loop = ij.close_loop(campaign)
        >>> loop.verdict, [finding.effect for finding in loop.findings]
        ('found', ['coulomb_friction'])
        >>> loop.report("out")
    """
    loop = find_loop(
        campaign,
        max_iterations=max_iterations,
        excluded=excluded,
        solver=solver,
        progress=progress,
        rules=rules,
        anyway=anyway,
        checkpoint=checkpoint,
    )
    return ClosedLoop(loop)
