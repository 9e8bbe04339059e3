"""Which test would part effects that the data cannot."""

from ..elements import CATALOGUE

GAIN_CLASS = {"added_mass", "input_gain", "sensor_gain"}
LAG_CLASS = {"input_delay", "maxwell_branch", "added_mass"}
HYSTERESIS = {"dahl_friction", "bouc_wen", "coulomb_friction"}
OFFSETS = {"quadratic_stiffness", "input_offset", "sensor_offset"}


def separating_experiment(effect: str, others: tuple[str, ...]) -> str:
    """Give the test that parts an effect from its look-alikes, in words.

    Args:
        effect: catalogue name of the finding.
        others: catalogue names that the data cannot tell from it.

    Returns:
        A sentence; empty where nothing needs parting.
    """
    if not others:
        return ""
    together = {effect, *others}
    advice = []
    if len(together & GAIN_CLASS) > 1:
        advice.append(
            "weigh a known extra mass onto the isolator and repeat one level: a mass error stays in "
            "kilograms, a gain error "
            "stays in per cent"
        )
    if len(together & LAG_CLASS) > 1 and "input_delay" in together:
        advice.append(
            "extend the band to twice the resonance: a delay's apparent damping changes sign at the "
            "resonance and "
            "grows above it, that of a relaxation does not"
        )
    if len(together & HYSTERESIS) > 1:
        advice.append(
            "repeat at a third of the lowest level: presliding turns friction into stiffness there, while "
            "dry friction "
            "keeps its force"
        )
    if len(together & OFFSETS) > 1:
        advice.append(
            "measure the mean displacement (a DC-capable sensor), or repeat with a known static load"
        )
    if not advice:
        names = ", ".join(CATALOGUE[name].words for name in (effect, *others))
        advice.append(
            f"add one level a factor of three lower and one higher; {names} scale differently with level"
        )
    return "; ".join(advice)[0].upper() + "; ".join(advice)[1:] + "."
