"""What is left, in words, tables and plain numbers."""

import math
import re
from typing import Any

from ...identification import Ceiling, Exponents, Loop, Pursuit, Remainder
from ._quantities import typeset_goodness, typeset_number, typeset_share, typeset_unit
from ._quantities import typeset_with_error as with_error

_LARGE, _SMALL = 0.8, 0.5
"""Shares from which on a ceiling is high, and below which it is low."""

_IDLE = 0.2
"""Share of the black box below which what is left has nothing to do with the motion."""

_RAISED = str.maketrans("0123456789.", "⁰¹²³⁴⁵⁶⁷⁸⁹·")

_ROUGH = 0.3
"""Standard error of a ceiling above which it says nothing."""


def remainder_words(remainder: Remainder) -> tuple[str, ...]:
    """Give what is left in sentences.

    Args:
        remainder: the description.

    Returns:
        What the free laws make of it, how it grows, and how much any law could explain.
    """
    lines = [
        _pursuit_words(remainder.pursuit),
        _exponent_words(remainder.exponents),
        _part_words(remainder.parts),
        _ceiling_words(remainder),
    ]
    return tuple(line for line in lines if line)


def remainder_summary(loop: Loop) -> tuple[str, ...]:
    """Give what a closed loop leaves in two or three lines.

    Args:
        loop: the closed loop.

    Returns:
        The lines; none where nothing is left to describe.
    """
    remainder = loop.remainder
    if remainder is None:
        return ()
    lines = (
        _pursuit_words(remainder.pursuit),
        _exponent_words(remainder.exponents),
        _ceiling_words(remainder),
    )
    return tuple(f"What is left: {line}" if place == 0 else line for place, line in enumerate(lines) if line)


def _pursuit_words(pursuit: Pursuit) -> str:
    if not pursuit.laws:
        return f"None of {pursuit.tried} free force laws stands out of what is left."
    names = ["c"] if len(pursuit.laws) == 1 else [f"c{place + 1}" for place in range(len(pursuit.laws))]
    named = list(zip(names, pursuit.laws, strict=True))
    terms = " + ".join(f"{name} {typeset_formula(law.formula)}" for name, law in named)
    strengths = ", ".join(
        f"{name} = {with_error(law.coefficient, law.error, typeset_formula(law.unit))}" for name, law in named
    )
    after = typeset_goodness(pursuit.linear)
    again = f" ({typeset_goodness(pursuit.refitted)} fitted again)" if math.isfinite(pursuit.refitted) else ""
    return (
        f"A force {terms}, {strengths}, pursued among {pursuit.tried} free laws, would make up "
        f"{typeset_share(pursuit.laws[-1].share)} of it: χ²/dof {typeset_goodness(pursuit.chi2_per_dof)} → "
        f"{after} by a linear step{again}. It describes the remainder and is no finding."
    )


def _exponent_words(found: Exponents | None) -> str:
    if found is None:
        return ""
    kind = "damping-like" if found.damping > 0.5 else "spring-like"
    share = found.damping if found.damping > 0.5 else 1.0 - found.damping
    like = f", like {' or '.join(found.like[:2])}" if found.like else ", like no law of the table"
    return (
        f"Its energy in a cycle grows as X^({with_error(found.amplitude, found.amplitude_error, '')}) "
        f"ω^({with_error(found.frequency, found.frequency_error, '')}), {typeset_share(share)} of it "
        f"{kind}{like}."
    )


def _part_words(parts: dict[str, float]) -> str:
    largest = sorted((name for name in parts if parts[name] >= 0.05), key=lambda name: -parts[name])[:3]
    if not largest:
        return ""
    words = ", ".join(f"{typeset_share(parts[name])} {_PARTS.get(name, name)}" for name in largest)
    return f"In the dwells the missing force is {words}."


_PARTS = {
    "mean": "mean",
    "with x": "in phase with the displacement",
    "with v": "in phase with the velocity",
    "the rest": "not locked to the drive",
}


def _told(ceiling: Ceiling) -> bool:
    return math.isfinite(ceiling.share) and ceiling.error <= _ROUGH


def _ceiling_words(remainder: Remainder) -> str:
    static, box = remainder.static, remainder.black_box
    lines = []
    idle = _told(box) and max(box.share, static.share) < _IDLE
    if _told(static):
        meaning = ""
        if static.share >= _LARGE:
            meaning = ", so that neither memory nor delay nor drift is needed"
        elif static.share < _SMALL and not idle:
            meaning = ", so that memory, delay, sensor or drift is at work"
        lines.append(
            f"Any force law of x and v alone could explain {_share(static)} of the missing force{meaning}."
        )
    if _told(box):
        where = "on held-out records" if box.held_out else "on samples left out"
        meaning = ", so that what is left does not follow the motion: no channel records it" if idle else ""
        lines.append(f"A black box of {box.weights} weights explains {_share(box)} {where}{meaning}.")
    if not lines:
        return "The missing force stands too little out of the noise to say how much any law could explain."
    return " ".join(lines)


def _share(ceiling: Ceiling) -> str:
    return f"{100.0 * max(0.0, ceiling.share):.0f} ± {max(1.0, 100.0 * ceiling.error):.0f} %"


def typeset_formula(formula: str) -> str:
    """Give a force law with raised exponents.

    Args:
        formula: such as "|x|^1.5 v".

    Returns:
        Such as "|x|¹·⁵ v".
    """
    return re.sub(r"\^([0-9.]+)", lambda match: match[1].translate(_RAISED), formula)


def law_rows(pursuit: Pursuit) -> list[dict[str, str]]:
    """Give the pursued laws for a table.

    Args:
        pursuit: the laws.

    Returns:
        A row a law.
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


def remainder_dict(remainder: Remainder) -> dict[str, Any]:
    """Give what is left as plain numbers.

    Args:
        remainder: the description.

    Returns:
        What JSON holds; None where a number is not finite.
    """
    pursuit, found = remainder.pursuit, remainder.exponents
    return {
        "laws": [
            {
                "formula": law.formula,
                "coefficient": _number(law.coefficient),
                "standard_error": _number(law.error),
                "unit": law.unit,
                "share": _number(law.share),
                "alike": list(law.alike),
            }
            for law in pursuit.laws
        ],
        "laws_tried": pursuit.tried,
        "chi2_per_dof": _number(pursuit.chi2_per_dof),
        "chi2_per_dof_linear": _number(pursuit.linear),
        "chi2_per_dof_refitted": _number(pursuit.refitted),
        "parts": {name: _number(share) for name, share in remainder.parts.items()},
        "exponents": None
        if found is None
        else {
            "amplitude": _number(found.amplitude),
            "amplitude_error": _number(found.amplitude_error),
            "frequency": _number(found.frequency),
            "frequency_error": _number(found.frequency_error),
            "damping": _number(found.damping),
            "like": list(found.like),
        },
        "static": _ceiling(remainder.static),
        "black_box": _ceiling(remainder.black_box),
    }


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _ceiling(one: Ceiling) -> dict[str, Any]:
    return {
        "share": _number(one.share),
        "error": _number(one.error),
        "weights": one.weights,
        "held_out": one.held_out,
    }
