"""report.html, one page that holds everything, pictures included; report.md with its pictures beside it."""

from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version
from importlib.resources import files
from typing import Any

import jinja2
from markupsafe import Markup

from ..._languages import as_code, as_html, as_markdown
from ..._parameters import list_parameters
from ...health import CampaignHealth, campaign_health
from ...identification import OUTPUT_UNITS, Candidate, Fit, Loop, plain_unit
from ...records import Campaign
from ..words import (
    GLOSSARY,
    alternative_words,
    budget_rows,
    budget_words,
    caveats,
    check_first_words,
    dwell_words,
    effect_words,
    finding_words,
    health_words,
    law_rows,
    mains_words,
    selected_laws_words,
    typeset_goodness,
    typeset_number,
    typeset_p_value,
    typeset_share,
    typeset_unit,
    verdict_sentence,
)
from ..words import typeset_with_error as with_error
from ._identified_response import IdentifiedResponse, identified_response
from ._or_a_line import or_a_line
from ._pictures import Picture, draw_pictures
from ._summary import error_rows, horizon_rows, parameter_words

_VERDICTS = {
    "none": "nothing missing",
    "found": "found",
    "partly_explained": "partly explained",
    "unexplained": "unexplained",
}
_RANKS_ON_PAGE = 12


def render_page(loop: Loop, health: CampaignHealth | None = None) -> str:
    """Give report.html: self-contained, no script, no outside resource.

    Args:
        loop: the closed loop.
        health: of its campaign; computed here if omitted.

    Returns:
        The page.
    """
    health = campaign_health(loop) if health is None else health
    return _rendered("report.html.jinja", page_content(loop, health))


def render_pages(content: Mapping[str, Any], *, markdown: bool = False) -> dict[str, str | bytes]:
    """Give the files of a report.

    Args:
        content: of the pages, as `page_content` gives it.
        markdown: whether to give report.md and its pictures as well.

    Returns:
        Content by file name.
    """
    pages: dict[str, str | bytes] = {"report.html": _rendered("report.html.jinja", content)}
    if markdown:
        pages["report.md"] = _rendered("report.md.jinja", content)
        pictures = [one for name, some in content.items() if name.endswith("_pictures") for one in some]
        pages |= {picture.file: picture.png for picture in pictures if picture.png}
    return pages


_LANGUAGES: Mapping[str, Callable[[str], str]] = {
    "report.html.jinja": as_html,
    "report.md.jinja": as_markdown,
}
"""What each template writes its texts with."""


def _rendered(template: str, content: Mapping[str, Any]) -> str:
    language = _LANGUAGES[template]
    environment = jinja2.Environment(
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        finalize=lambda one: one if hasattr(one, "__html__") else Markup(language(str(one))),
    )
    environment.filters["code"] = lambda words: Markup(as_code(words))
    source = files("isojax.reporting").joinpath(template).read_text(encoding="utf-8")
    return environment.from_string(source).render(content)


def page_content(loop: Loop, health: CampaignHealth) -> dict[str, Any]:
    """Give what the templates of a report ask for: words, rows of tables, pictures.

    Args:
        loop: the closed loop.
        health: of its campaign.

    Returns:
        Content by its name in the templates.
    """
    before, after = loop.before, loop.after
    same = before is after
    campaign = loop.campaign
    quantity = campaign.output.quantity
    remainder = loop.remainder
    laws = [] if remainder is None else law_rows(remainder.pursuit)
    bounds = [
        (
            effect,
            effect_words(effect),
            f"{typeset_number(upper, 3)} {typeset_unit(plain_unit(unit, campaign))}",
        )
        for effect, (upper, unit) in loop.bounds.items()
    ]
    response = or_a_line(
        "the response of the model",
        lambda: identified_response(loop),
        lambda line: IdentifiedResponse((line,)),
    )
    pictures = draw_pictures(loop, health, response)
    return {
        "title": campaign.title,
        "verdict": loop.verdict,
        "verdict_words": _VERDICTS[loop.verdict],
        "check_first": check_first_words(loop.check_first),
        "headline": verdict_sentence(loop),
        "reason": loop.last.reason,
        "same": same,
        "findings": [
            {
                "effect": one.effect,
                "words": effect_words(one.effect),
                "lines": finding_words(one),
                "ranking": [_candidate(candidate, campaign) for candidate in one.ranking[:_RANKS_ON_PAGE]],
            }
            for one in loop.findings
        ],
        "alternatives": alternative_words(loop),
        "last_ranking": [_candidate(candidate, campaign) for candidate in loop.last.ranking[:_RANKS_ON_PAGE]],
        "unit": typeset_unit(OUTPUT_UNITS[quantity]),
        "errors": error_rows(before, after),
        "horizons": horizon_rows(before, after),
        "declared": _elements(before),
        "added": " and ".join(effect_words(one.effect) for one in loop.findings),
        "parameters": [
            (
                "isolated mass" if entry.name == "mass" else effect_words(entry.name.partition(".")[0]),
                entry.name,
                entry.spec.symbol,
                parameter_words(before, entry.name),
                parameter_words(after, entry.name),
            )
            for entry in list_parameters(after.model)
        ],
        "contents": _contents(same, remainder is not None, len(bounds), pictures),
        "response_lines": response.lines,
        "bounds": bounds,
        "remainder": "" if remainder is None else selected_laws_words(remainder.pursuit),
        "remainder_laws": laws,
        "facts": _facts(loop),
        "health": (
            *health_words(health.data, after),
            *mains_words(health, OUTPUT_UNITS[quantity]),
            *dwell_words(health.dwells, campaign.input.quantity),
            *budget_words(health.budget, after, loop.findings),
        ),
        "budget": budget_rows(health.budget, after),
        "guess_notes": loop.guess.notes,
        "caveats": caveats(loop),
        "fit_report_before": str(before),
        "fit_report_after": str(after),
        **pictures,
        "glossary": GLOSSARY,
        "version": version("isojax"),
        "seconds": f"{loop.seconds:.0f}",
    }


def _contents(
    same: bool, residual: bool, bounds: int, pictures: Mapping[str, Sequence[Picture]]
) -> dict[str, dict[str, str]]:
    """Give the sections in their order: title, and what the folded ones hold."""
    listed = {
        "error": ("Error" if same else "Error before and after", ""),
        "coefficients": ("Coefficients", ""),
        "response": ("Response of the identified model", ""),
        "residual": ("Unexplained residual", "") if residual else None,
        "limits": ("Limits of this report", ""),
        "evidence": ("Evidence", "scores of the absent effects, errors"),
        "residual-detail": ("Laws of the residual", "where it is, and as a force") if residual else None,
        "records": ("Model against the records", "time histories, residuals")
        if pictures["record_pictures"]
        else None,
        "forces": ("Force laws", "receptance, backbone, equivalent stiffness and damping")
        if pictures["force_pictures"]
        else None,
        "bounds": ("Upper bounds", f"for {bounds} effects that were not found" if bounds else "none given"),
        "data": ("Data quality and start values", "noise, settling, folds, drift"),
        "fit": ("Fit report", "all coefficients, correlations"),
        "words": ("Word list", "terms of other schools"),
    }
    return {name: {"title": one[0], "hint": one[1]} for name, one in listed.items() if one is not None}


def _elements(fit: Fit) -> str:
    """Give the effects of a model in words."""
    return ", ".join(effect_words(element.name) for element in fit.model.elements)


def _facts(loop: Loop) -> list[tuple[str, str]]:
    campaign = loop.campaign
    length = sum(record.time.size for record in campaign.records) / campaign.rate
    levels = sorted({record.level for record in campaign.records if record.level is not None})
    kinds = sorted({record.kind.replace("_", " ") for record in campaign.records})
    facts = [
        ("isolated mass", f"{campaign.mass:g} kg"),
        ("input", campaign.input.quantity.replace("_", " ")),
        ("output", campaign.output.quantity),
        ("records", f"{len(campaign.fit_records)} fitted, {len(campaign.holdout_records)} held out"),
        ("length", f"{length:.0f} s, {campaign.timing}"),
        ("excitation", ", ".join(kinds)),
    ]
    if levels:
        facts.append(("levels", ", ".join(f"{level:g}" for level in levels)))
    return facts


def _candidate(one: Candidate, campaign: Campaign) -> dict[str, Any]:
    return {
        "effect": one.effect,
        "words": effect_words(one.effect),
        "z": typeset_number(one.z, 3),
        "p": typeset_p_value(one.p_value),
        "strength": with_error(one.strength, one.strength_error, plain_unit(one.unit, campaign)),
        "visibility": typeset_share(one.visibility),
        "chi2_per_dof": typeset_goodness(one.chi2_per_dof),
        "delta_bic": typeset_number(one.delta_bic, 3),
        "likeness": f"{round(one.likeness, 2) + 0.0:.2f}",  # no negative zero
        "admissible": one.admissible,
    }
