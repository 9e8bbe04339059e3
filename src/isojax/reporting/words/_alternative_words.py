"""Force laws that would do in the place of a finding, in words and plain numbers."""

from typing import Any

from ..._quantities import finite_or_none, typeset_formula
from ...identification import AlternativeLaw, Alternatives, Loop
from ._sentences import effect_words

_LAWS_SHOWN = 4


def alternative_words(loop: Loop) -> tuple[str, ...]:
    """Give, for each finding and for all together, the force laws that explain the records as well.

    Args:
        loop: the closed loop.

    Returns:
        A sentence each; none where nothing was found.
    """
    return tuple(_sentence(one) for one in loop.alternatives)


def _sentence(alternatives: Alternatives) -> str:
    findings = " and ".join(effect_words(name) for name in alternatives.effects)
    laws = [law for law in alternatives.laws if not law.is_the_same]
    if not laws:
        return f"None of {alternatives.tried} free force laws explains the records as well as {findings}."
    shown = ", ".join(_law(law) for law in laws[:_LAWS_SHOWN])
    more = f" and {len(laws) - _LAWS_SHOWN} more" if len(laws) > _LAWS_SHOWN else ""
    verb = "explain" if len(laws) > 1 else "explains"
    return (
        f"In the place of {findings}, {len(laws)} of {alternatives.tried} free force laws {verb} the records "
        f"as well or better (change of χ²): {shown}{more}."
    )


def _law(law: AlternativeLaw) -> str:
    return f"{typeset_formula(law.formula)} ({law.delta_chi2:+.0f})".replace("-", "−")


def alternatives_list(loop: Loop) -> list[dict[str, Any]]:
    """Give the same as plain numbers.

    Args:
        loop: the closed loop.

    Returns:
        What JSON holds; None where a number is not finite.
    """
    return [
        {
            "effects": list(one.effects),
            "laws_tried": one.tried,
            "laws": [
                {
                    "formula": law.formula,
                    "coefficient": finite_or_none(law.coefficient),
                    "standard_error": finite_or_none(law.error),
                    "unit": law.unit,
                    "delta_chi2": finite_or_none(law.delta_chi2),
                    "likeness": finite_or_none(law.likeness),
                }
                for law in one.laws
            ],
        }
        for one in loop.alternatives
    ]
