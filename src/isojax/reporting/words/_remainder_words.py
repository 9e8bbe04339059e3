"""The unexplained residual in words, tables and plain numbers."""

import math
from typing import Any

from ..._quantities import (
    finite_or_none,
    typeset_formula,
    typeset_goodness,
    typeset_number,
    typeset_share,
    typeset_unit,
)
from ..._quantities import typeset_with_error as with_error
from ...identification import Loop, MatchingPursuit, Remainder, SelectedLaw


def remainder_summary(loop: Loop) -> tuple[str, ...]:
    """Give the unexplained residual of a closed loop in a sentence or two.

    Args:
        loop: the closed loop.

    Returns:
        The lines; none where nothing is left to describe.
    """
    remainder = loop.remainder
    return () if remainder is None else (f"Unexplained residual: {selected_laws_words(remainder.pursuit)}",)


def selected_laws_words(pursuit: MatchingPursuit) -> str:
    """Give the selected laws in a sentence or two.

    Args:
        pursuit: the laws.

    Returns:
        The laws with their coefficients, and what they would explain.
    """
    if not pursuit.tried:
        return "Nothing of it comes back with the drive, so that no force law is sought in it."
    if not pursuit.laws:
        return f"None of {pursuit.tried} free force laws explains a significant share of it."
    names = ["c"] if len(pursuit.laws) == 1 else [f"c{place + 1}" for place in range(len(pursuit.laws))]
    named = list(zip(names, pursuit.laws, strict=True))
    terms = " + ".join(
        name if law.formula == "1" else f"{name} {typeset_formula(law.formula)}" for name, law in named
    )
    strengths = ", ".join(
        f"{name} = {with_error(law.coefficient, law.error, typeset_formula(law.unit))}" for name, law in named
    )
    refit = f" ({typeset_goodness(pursuit.refitted)} refitted)" if math.isfinite(pursuit.refitted) else ""
    share = pursuit.laws[-1].share
    explained = f"explain {typeset_share(share)} of it: " if math.isfinite(share) else "give "
    return (
        f"A force {terms}, {strengths}, selected from {pursuit.tried} free laws, would {explained}"
        f"χ²/dof {typeset_goodness(pursuit.chi2_per_dof)} → {typeset_goodness(pursuit.linear)} by a linear "
        f"step{refit}. It is a description and no finding."
    )


def law_rows(pursuit: MatchingPursuit) -> list[dict[str, str]]:
    """Give the selected laws for a table.

    Args:
        pursuit: the laws.

    Returns:
        One row per law.
    """
    return [
        {
            "formula": typeset_formula(law.formula),
            "words": law.words,
            "coefficient": with_error(law.coefficient, law.error, typeset_formula(law.unit)),
            "force": f"{typeset_number(abs(law.force), 3)} {typeset_unit('N')}",
            "share": typeset_share(law.share),
            "alike": ", ".join(typeset_formula(formula) for formula in law.alike[:5]) or "none",
        }
        for law in pursuit.laws
    ]


def law_dict(law: SelectedLaw) -> dict[str, Any]:
    """Give a free force law in plain numbers.

    Args:
        law: the law.

    Returns:
        What JSON holds; None where a number is not finite.
    """
    return {
        "formula": law.formula,
        "coefficient": finite_or_none(law.coefficient),
        "standard_error": finite_or_none(law.error),
        "unit": law.unit,
        "z": finite_or_none(law.z),
    }


def remainder_dict(remainder: Remainder) -> dict[str, Any]:
    """Give the unexplained residual as plain numbers.

    Args:
        remainder: the description.

    Returns:
        What JSON holds; None where a number is not finite.
    """
    pursuit = remainder.pursuit
    return {
        "laws": [
            law_dict(law) | {"share": finite_or_none(law.share), "alike": list(law.alike)}
            for law in pursuit.laws
        ],
        "laws_tried": pursuit.tried,
        "chi2_per_dof": finite_or_none(pursuit.chi2_per_dof),
        "chi2_per_dof_linear": finite_or_none(pursuit.linear),
        "chi2_per_dof_refitted": finite_or_none(pursuit.refitted),
    }
