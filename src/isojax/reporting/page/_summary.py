"""Summaries for the terminal: a diagnosis, a closed loop, the catalogue."""

import math
from collections.abc import Sequence
from io import StringIO
from typing import NamedTuple

from rich.box import SIMPLE_HEAD
from rich.console import Console, Group, RenderableType
from rich.table import Table

from ..._languages import as_rich
from ..._parameters import list_parameters, own_parameters
from ...elements import CATALOGUE
from ...identification import (
    OUTPUT_UNITS,
    Candidate,
    Finding,
    Fit,
    Loop,
    Verdict,
    plain_unit,
    prediction_errors,
)
from ..plots import ROLES, fits_meant
from ..words import (
    alternative_words,
    check_first_words,
    effect_words,
    finding_words,
    remainder_summary,
    typeset_goodness,
    typeset_number,
    typeset_p_value,
    typeset_share,
    typeset_unit,
    verdict_sentence,
)
from ..words import typeset_with_error as with_error

_RANKS_IN_SUMMARY = 8


def render_text(content: RenderableType, width: int = 110) -> str:
    """Give what the terminal would show as plain text.

    Args:
        content: what to render.
        width: columns.

    Returns:
        The text, without colours.
    """
    page = StringIO()
    Console(file=page, width=width, color_system=None, highlight=False, force_jupyter=False).print(content)
    return page.getvalue().rstrip("\n")


class PlainTable(Table):
    """A table for rich that `print` shows as text."""

    def __str__(self) -> str:
        """Give the table as text."""
        return render_text(self)

    __repr__ = __str__


class PlainGroup(Group):
    """Lines and tables for rich that `print` shows as text."""

    def __str__(self) -> str:
        """Give them as text."""
        return render_text(self)

    __repr__ = __str__


def new_table(title: str, *columns: str) -> Table:
    """Give a table without rows; its title and headings are shown letter by letter."""
    table = PlainTable(
        title=as_rich(title, "bold"), title_justify="left", header_style="dim", box=SIMPLE_HEAD
    )
    for place, column in enumerate(columns):
        table.add_column(as_rich(column), justify="right" if place else "left", no_wrap=place == 0)
    return table


def add_row(table: Table, *cells: str) -> None:
    """Add a row whose cells are shown letter by letter."""
    table.add_row(*map(as_rich, cells))


class ErrorRow(NamedTuple):
    """The errors of one model on the records of one role, in words.

    Attributes:
        role: "fitted" or "held out".
        label: "before", "after", or "" where there is one model.
        rmse: of free runs.
        nrmse: of free runs.
        nrmse_segments: segments restarted.
        chi2_per_dof: segments restarted.
    """

    role: str
    label: str
    rmse: str
    nrmse: str
    nrmse_segments: str
    chi2_per_dof: str


def _labelled(before: Fit, after: Fit | None) -> tuple[tuple[str, Fit], ...]:
    """Give the fits that differ, each with its label; one alone needs none."""
    if after is None or after is before:
        return (("", before),)
    return (("before", before), ("after", after))


@fits_meant
def error_rows(before: Fit, after: Fit | None = None) -> tuple[ErrorRow, ...]:
    """Give the errors before and after, role by role.

    Args:
        before: the declared model, fitted.
        after: the final fit; omitted where there is none.

    Returns:
        A row for each role that has records, and each fit.
    """
    return tuple(
        ErrorRow(
            words,
            label,
            typeset_number(errors.rmse, 3),
            typeset_share(errors.nrmse),
            typeset_share(errors.nrmse_segments),
            typeset_goodness(errors.chi2_per_dof),
        )
        for role, words in ROLES.items()
        for label, fit in _labelled(before, after)
        if (errors := fit.errors[role]) is not None
    )


class HorizonRow(NamedTuple):
    """The errors of one model's predictions on the records of one role, in words.

    Attributes:
        role: "fitted" or "held out".
        label: "before", "after", or "" where there is one model.
        shares: by how long they run, the free run last: rms over that of the measured output.
    """

    role: str
    label: str
    shares: tuple[str, ...]


@fits_meant
def horizon_rows(before: Fit, after: Fit | None = None) -> tuple[tuple[str, ...], tuple[HorizonRow, ...]]:
    """Give the errors of predictions before and after, by how long they run.

    Args:
        before: the declared model, fitted.
        after: the final fit; omitted where there is none.

    Returns:
        The times in words, and a row for each role that has records, and each fit.
    """
    fits = _labelled(before, after)
    found = [prediction_errors(fit) for _, fit in fits]
    times = sorted({time for one in found for time in one.horizons})
    rows = []
    for role, words in ROLES.items():
        for (label, fit), ahead in zip(fits, found, strict=True):
            errors = fit.errors[role]
            if errors is not None:
                scale = errors.nrmse / errors.rmse if errors.rmse > 0.0 else math.nan
                shares = dict(zip(ahead.horizons, scale * getattr(ahead, role), strict=True))
                cells = [typeset_share(shares[one]) if one in shares else "" for one in times]
                rows.append(HorizonRow(words, label, (*cells, typeset_share(errors.nrmse))))
    return (*(f"{one:g} s" for one in times), "free run"), tuple(rows)


@fits_meant
def error_table(before: Fit, after: Fit | None = None) -> Table:
    """Give the errors before and after; a notebook shows it, `print` as text.

    Args:
        before: the declared model, fitted.
        after: the final fit; omitted where there is none.

    Returns:
        A table for rich.
    """
    unit = typeset_unit(OUTPUT_UNITS[before.campaign.output.quantity])
    table = new_table(
        "Error", "records", "", f"free-run RMSE [{unit}]", "NRMSE", "NRMSE, restarted", "χ²/dof"
    )
    for row in error_rows(before, after):
        add_row(table, *row)
    return table


@fits_meant
def parameter_table(before: Fit, after: Fit | None = None) -> Table:
    """Give the coefficients before and after; a notebook shows it, `print` as text.

    Args:
        before: the declared model, fitted.
        after: the final fit; omitted where there is none.

    Returns:
        A table for rich.
    """
    fits = _labelled(before, after)
    table = new_table("Coefficients", "name", *(label or "fitted" for label, _ in fits))
    for entry in list_parameters(fits[-1][1].model):
        add_row(table, entry.name, *(parameter_words(fit, entry.name) for _, fit in fits))
    return table


def parameter_words(fit: Fit, name: str) -> str:
    """Give a coefficient of a fit with its error and unit.

    Args:
        fit: the fit.
        name: of the coefficient.

    Returns:
        Such as "3.983 ± 0.051 N", "800.0 kg (fixed)"; "" if the model lacks it.
    """
    listed = {entry.name: entry for entry in list_parameters(fit.model)}
    if name not in listed:
        return ""
    entry, error = listed[name], fit.standard_errors.get(name)
    unit = plain_unit(entry.spec.unit, fit.campaign)
    words = with_error(float(entry.value), float("nan") if error is None else error, unit)
    if error is None:
        return f"{words} (fixed)"
    return words if error == error else f"{words} (not determined)"


def ranking_table(ranking: Sequence[Candidate] | Verdict | Finding) -> Table:
    """Give the best candidates; a notebook shows it, `print` as text.

    Args:
        ranking: candidates, best first; of a diagnosis or a finding, its own.

    Returns:
        A table for rich.
    """
    ranking = ranking.ranking if isinstance(ranking, Verdict | Finding) else ranking
    table = new_table("Effects, best first", "effect", "z", "p", "strength", "χ²/dof", "ΔBIC", "admissible")
    for one in ranking[:_RANKS_IN_SUMMARY]:
        add_row(
            table,
            one.effect,
            typeset_number(one.z, 3),
            typeset_p_value(one.p_value),
            with_error(one.strength, one.strength_error, one.unit),
            typeset_goodness(one.chi2_per_dof),
            typeset_number(one.delta_bic, 3),
            "yes" if one.admissible else "no",
        )
    return table


def loop_summary(loop: Loop) -> RenderableType:
    """Give a closed loop for the terminal.

    Args:
        loop: the closed loop.

    Returns:
        Headline, evidence, unexplained residual if any, errors, coefficients.
    """
    lines = [line for finding in loop.findings for line in finding_words(finding)]
    return PlainGroup(
        *(as_rich(line, "bold red") for line in check_first_words(loop.check_first)),
        as_rich(verdict_sentence(loop), "bold"),
        *(as_rich(line) for line in (*lines, *alternative_words(loop), *remainder_summary(loop))),
        error_table(loop.before, loop.after),
        parameter_table(loop.before, loop.after),
    )


def verdict_summary(verdict: Verdict) -> RenderableType:
    """Give a diagnosis for the terminal.

    Args:
        verdict: the diagnosis.

    Returns:
        Verdict, reason, ranking.
    """
    finding = verdict.finding
    named = "" if finding is None else f": {effect_words(finding.effect)}"
    lines = () if finding is None else finding_words(finding)
    return PlainGroup(
        as_rich(f"{verdict.verdict.replace('_', ' ')}{named}", "bold"),
        as_rich(verdict.reason),
        *(as_rich(line) for line in lines),
        ranking_table(verdict.ranking),
    )


def catalogue_table() -> Table:
    """Give the effects that isojax knows.

    Returns:
        A table for rich.
    """
    table = new_table("Effects", "name", "strength", "unit", "states", "signed")
    table.add_column("what it is")
    for name, kind in sorted(CATALOGUE.items()):
        spec = dict(own_parameters(kind))[kind.strength]
        states, signed = str(kind.internal_states), "yes" if kind.signed else "no"
        add_row(table, name, kind.strength, spec.unit, states, signed, kind.words)
    return table
