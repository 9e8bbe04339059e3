"""Which test separates effects that the records cannot."""

from ...elements import CATALOGUE


def separating_experiment(effect: str, others: tuple[str, ...]) -> str:
    """Give the test that separates an effect from its look-alikes, in words, as the elements declare it.

    Args:
        effect: catalogue name of the finding.
        others: catalogue names that the records cannot distinguish from it.

    Returns:
        A sentence; empty where there is nothing to separate.
    """
    if not others:
        return ""
    together = {effect, *others}
    advice = [
        alike.test
        for name, kind in CATALOGUE.items()
        for alike in kind.look_alikes
        if alike.separates(name, together)
    ]
    if not advice:
        names = ", ".join(CATALOGUE[name].words for name in (effect, *others))
        advice.append(
            f"add one level a factor of three lower and one higher; {names} scale differently with level"
        )
    words = "; ".join(advice)
    return words[0].upper() + words[1:] + "."


def is_exact(effect: str, other: str, free: set[str]) -> bool:
    """Say whether two effects are one law by two names, beside what is free in the model.

    Args:
        effect: catalogue name.
        other: catalogue name.
        free: catalogue names of the effects whose strengths are free.

    Returns:
        True if an exact likeness is declared and all that it needs is free.
    """
    return any(
        alike.exact and alike.separates(name, {effect, other}) and free.issuperset(alike.beside)
        for name, kind in CATALOGUE.items()
        for alike in kind.look_alikes
    )
