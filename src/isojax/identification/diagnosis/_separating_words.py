"""Which test would part effects that the data cannot."""

from typing import NamedTuple

from ...elements import CATALOGUE


class LookAlikes(NamedTuple):
    """Effects that one test parts.

    Attributes:
        names: catalogue names, any two of which call for the test.
        test: what to do and why it parts them, in words.
        needed: one of the names without which the test says nothing; empty if none.
    """

    names: frozenset[str]
    test: str
    needed: str = ""


CLASSES = (
    LookAlikes(
        frozenset({"added_mass", "input_gain", "sensor_gain"}),
        "weigh a known extra mass onto the isolator and repeat one level: a mass error stays in kilograms, a "
        "gain error stays in per cent",
        needed="added_mass",
    ),
    LookAlikes(
        frozenset({"input_gain", "sensor_gain"}),
        "calibrate either channel against another instrument: in no motion of the isolator do their gains "
        "differ",
    ),
    LookAlikes(
        frozenset({"end_stop", "freeplay"}),
        "look at the rig, or measure the linear stiffness at motion smaller than the gap: a stiffness added "
        "beyond a gap and one that is missing within it give the same records",
    ),
    LookAlikes(
        frozenset({"asymmetric_friction", "input_offset"}),
        "read the force channel with the exciter uncoupled: its offset is still there, and friction is not",
    ),
    LookAlikes(
        frozenset({"polytropic_gas", "quadratic_stiffness"}),
        "repeat at three times the top level: gas hardens with the cube of the motion, by a coefficient tied "
        "to that of its square, while a parabola goes on as it is",
    ),
    LookAlikes(
        frozenset({"input_delay", "maxwell_branch", "added_mass", "dual_chamber", "fractional_damping"}),
        "extend the band to twice the resonance: a delay's apparent damping changes sign at the resonance "
        "and grows above it, that of a relaxation does not",
        needed="input_delay",
    ),
    LookAlikes(
        frozenset({"dahl_friction", "bouc_wen", "coulomb_friction", "lugre_friction"}),
        "repeat at a third of the lowest level: presliding turns friction into stiffness there, while dry "
        "friction keeps its force",
    ),
    LookAlikes(
        frozenset({"quadratic_stiffness", "input_offset", "sensor_offset"}),
        "measure the mean displacement (a DC-capable sensor); a known static load parts them only where no "
        "cubic spring shifts along with it",
    ),
    LookAlikes(
        frozenset({"dual_chamber", "maxwell_branch"}),
        "repeat at a third and at three times the level: an orifice slows the relaxation down as the flow "
        "rises, a Maxwell branch knows no level",
    ),
    LookAlikes(
        frozenset({"fractional_damping", "maxwell_branch", "dual_chamber"}),
        "widen the band to more than a decade: rubber follows one power of frequency, a relaxation has one "
        "time constant",
        needed="fractional_damping",
    ),
    LookAlikes(
        frozenset({"second_mode", "added_mass"}),
        "extend the band upwards: a second mode ends in a notch, while a mass goes on with the square of the "
        "frequency",
    ),
    LookAlikes(
        frozenset({"ac_coupling", "input_delay"}),
        "extend the band downwards: the lead of an AC coupling grows there, the phase of a delay vanishes",
    ),
    LookAlikes(
        frozenset({"clipping", "end_stop"}),
        "repeat the top level with the next larger range of the response channel: a stop stays, a clipped "
        "top does not",
    ),
)
"""Which test parts which effects; further classes go here."""


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
    advice = [
        alike.test
        for alike in CLASSES
        if len(together & alike.names) > 1 and (not alike.needed or alike.needed in together)
    ]
    if not advice:
        names = ", ".join(CATALOGUE[name].words for name in (effect, *others))
        advice.append(
            f"add one level a factor of three lower and one higher; {names} scale differently with level"
        )
    words = "; ".join(advice)
    return words[0].upper() + words[1:] + "."
