"""Pictures of the evidence: ranking of the effects, errors before and after, scatter between records."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..._languages import as_mathtext
from ...identification import Candidate, Finding, Fit, Verdict
from ..words import typeset_number, typeset_unit
from ._style import AFTER, BEFORE, NEUTRAL, ROLES, axes_for, entitle, fits_meant, pair

_LIKE = "#8fb8de"
_WRONG = "#f0d5d0"
_RANKS_IN_PLOT = 10


def plot_ranking(
    ranking: Sequence[Candidate] | Verdict | Finding,
    *,
    effect: str | None = None,
    indistinguishable: Sequence[str] = (),
    ax: Axes | None = None,
) -> Figure:
    """Draw the score of each absent effect, |z|, the best ten.

    Args:
        ranking: candidates, best first; of a diagnosis or a finding, its own with the two that follow.
        effect: the one that was found, if any.
        indistinguishable: catalogue names that the data cannot distinguish from it.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    if isinstance(ranking, Verdict | Finding):
        finding = ranking.finding if isinstance(ranking, Verdict) else ranking
        effect = effect or (None if finding is None else finding.effect)
        indistinguishable = indistinguishable or ranking.indistinguishable
        ranking = ranking.ranking
    shown = list(ranking)[:_RANKS_IN_PLOT]
    figure, ax = axes_for(ax, height=0.9 + 0.27 * max(3, len(shown)))
    kinds = [_kind(candidate, effect, indistinguishable) for candidate in shown]
    styles = {
        "found": (AFTER, "", AFTER),
        "not distinguishable": (_LIKE, "//", AFTER),
        "wrong sign or gains energy": (_WRONG, "xx", BEFORE),
        "weaker": (NEUTRAL, "", NEUTRAL),
    }
    rows = np.arange(len(shown))
    sizes = np.array([max(abs(candidate.z), 1e-2) for candidate in shown])
    for kind, (colour, hatch, edge) in styles.items():
        mine = np.array([found == kind for found in kinds], dtype=bool)
        if np.any(mine):
            bars = ax.barh(rows[mine], sizes[mine], height=0.65, color=colour, label=kind, linewidth=0.6)
            for bar in bars:
                bar.set(hatch=hatch, edgecolor=edge)
    for row, candidate in enumerate(shown):
        ax.text(1.01, row, _beside(candidate), fontsize=7.5, va="center", transform=ax.get_yaxis_transform())
    ax.set_yticks(rows, [typeset_unit(candidate.words) for candidate in shown])
    ax.invert_yaxis()
    ax.set_xscale("log")
    ax.set_xlim(0.5 * np.min(sizes, initial=1.0), 2.0 * np.max(sizes, initial=10.0))
    ax.grid(False, axis="y")
    ax.set_xlabel("score |z| [standard deviations]")
    entitle(ax, "score of each absent effect")
    return figure


def _kind(candidate: Candidate, effect: str | None, indistinguishable: Sequence[str]) -> str:
    if candidate.effect == effect:
        return "found"
    if not candidate.admissible:
        return "wrong sign or gains energy"
    return "not distinguishable" if candidate.effect in indistinguishable else "weaker"


def _beside(candidate: Candidate) -> str:
    refitted = np.isfinite(candidate.chi2_per_dof)
    words = f"χ²/dof {candidate.chi2_per_dof:.3f}" if refitted else "not refitted"
    return f"|z| {typeset_number(abs(candidate.z), 3)}, {words}"


@fits_meant
def plot_errors(
    before: Fit,
    after: Fit | None = None,
    *,
    measure: Literal["chi2_per_dof", "nrmse", "nrmse_segments"] = "chi2_per_dof",
    ax: Axes | None = None,
) -> Figure:
    """Draw an error on fitted and held-out records, before and after.

    Args:
        before: the declared model, fitted.
        after: the extended model, fitted; omitted where there is none.
        measure: which error.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax, width=3.4)
    roles = [role for role in ROLES if before.errors[role] is not None]
    scale, label, form, title = {
        "chi2_per_dof": (1.0, "χ²/dof [1]", "{:.3g}", "squared error over squared noise"),
        "nrmse": (100.0, "NRMSE [%]", "{:.2f}", "error of free runs"),
        "nrmse_segments": (100.0, "NRMSE [%]", "{:.2f}", "error, segments restarted"),
    }[measure]
    shifts = (0.0,) if after is None else (-0.2, 0.2)
    for (name, fit, colour), shift in zip(pair(before, after), shifts, strict=True):
        values = np.array([scale * getattr(fit.errors[role], measure) for role in roles])
        bars = ax.bar(np.arange(len(roles)) + shift, values, 0.36, color=colour, label=name)
        ax.bar_label(bars, [form.format(value) for value in values], fontsize=8, padding=1)
    noise = [1.0 if measure == "chi2_per_dof" else scale * _noise_share(before, role) for role in roles]
    places = np.arange(len(roles))
    ax.hlines(
        noise, places - 0.45, places + 0.45, "black", linewidth=1.0, linestyle="--", label="noise alone"
    )
    ax.set_xticks(range(len(roles)), [ROLES[role] for role in roles])
    ax.margins(y=0.22)
    ax.set_xlim(-0.6, len(roles) - 0.4)
    ax.grid(False, axis="x")
    ax.set_ylabel(label)
    entitle(ax, title)
    return figure


def _noise_share(fit: Fit, role: str) -> float:
    """Give the NRMSE that the channel's noise alone leaves on the records of a role."""
    errors = fit.errors[role]
    if errors is None:
        return float("nan")
    own = [
        (level**2, run.counted.sum())
        for level, run in zip(fit.noise.levels, fit.free_runs, strict=True)
        if run.record.role == role
    ]
    squares, counted = np.array(own).T
    return float(np.sqrt(np.average(squares, weights=counted))) * errors.nrmse / errors.rmse


@fits_meant
def plot_stiffness_scatter(before: Fit, after: Fit | None = None, *, ax: Axes | None = None) -> Figure:
    """Draw how the linear stiffness deviates from record to record, in the order of the test.

    Args:
        before: the declared model, fitted.
        after: the extended model, fitted; omitted where there is none.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax)
    names = [as_mathtext(record.name) for record in before.campaign.records]
    for label, fit, colour in pair(before, after):
        deviation = 100.0 * fit.restarts.stiffness
        ax.plot(range(len(names)), deviation, "o-", color=colour, markersize=4, linewidth=0.8, label=label)
    ax.axhline(0.0, color="black", linewidth=0.8)
    ax.set_xticks(range(len(names)), names, rotation=35, ha="right", fontsize=7)
    ax.set_xlabel("record, in the order of the test")
    ax.set_ylabel("deviation of k1 [%]")
    entitle(ax, "linear stiffness from record to record")
    return figure
