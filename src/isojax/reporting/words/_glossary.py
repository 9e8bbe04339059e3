"""The words of a report beside those of other schools."""

from typing import NamedTuple


class Term(NamedTuple):
    """A word of the report.

    Attributes:
        here: as the report writes it.
        elsewhere: what other schools call it, or what comes nearest.
        meaning: in a sentence.
    """

    here: str
    elsewhere: str
    meaning: str


GLOSSARY = (
    Term(
        "χ²/dof",
        "reduced chi-square, normalised cost, mean weighted squared residual",
        "Squared residual over squared noise, per degree of freedom; 1 where noise alone remains.",
    ),
    Term(
        "NRMSE",
        "relative rms error, fit percent",
        "RMS error over the rms of the measured signal. Fit percent is 100 % − NRMSE where the mean is zero.",
    ),
    Term(
        "free run",
        "simulation error, infinite-horizon prediction, output error",
        "The model runs over the whole record; measured output is never fed back.",
    ),
    Term(
        "segments restarted",
        "multiple shooting, piecewise simulation",
        "The simulation starts anew at each dwell or window, from a state that is estimated.",
    ),
    Term("held out", "validation data, test data", "Records that neither the fit nor the search has used."),
    Term(
        "dwell", "stepped-sine step, steady-state hold", "Constant drive frequency and amplitude for a time."
    ),
    Term(
        "equivalent stiffness and damping",
        "describing function, first-order harmonic balance, harmonic linearisation; storage and loss modulus",
        "K and C of the linear isolator with the same fundamental of the force at the given amplitude; "
        "ω C / K is the loss factor.",
    ),
    Term(
        "restoring force",
        "restoring force surface, force-state map, acceleration surface",
        "Drive minus inertia, F − m a, over displacement and velocity.",
    ),
    Term(
        "receptance",
        "dynamic compliance; the reciprocal is the dynamic stiffness",
        "Complex displacement over force at the drive frequency. It depends on amplitude here.",
    ),
    Term(
        "backbone",
        "skeleton curve, nonlinear normal mode",
        "Frequency of free, undamped vibration over its amplitude.",
    ),
    Term(
        "fold",
        "saddle-node or tangent bifurcation, limit point, turning point, jump",
        "Drive at which a stable and an unstable motion meet and vanish.",
    ),
    Term(
        "Floquet multiplier μ",
        "characteristic multiplier, eigenvalue of the monodromy matrix or of the Poincaré map, "
        "discrete-time pole",
        "Factor by which a small disturbance grows over one drive period; stable where every |μ| < 1.",
    ),
    Term(
        "score z",
        "score test, Lagrange multiplier test, t-value",
        "Strength of an absent effect that the residual asks for, in its standard deviations.",
    ),
    Term(
        "p, family-wise",
        "corrected for multiple testing, look-elsewhere effect",
        "Chance that noise alone gives any of the candidates such a score.",
    ),
    Term(
        "ΔBIC",
        "Bayesian (Schwarz) information criterion; about −2 ln of the Bayes factor",
        "Evidence lost against the best candidate; above 10 counts as decisive.",
    ),
    Term(
        "cannot be distinguished",
        "not practically identifiable, collinear, confounded",
        "The effects leave the same signal in these records.",
    ),
    Term(
        "likeness",
        "correlation of sensitivities, cosine as in MAC",
        "Correlation of the signals of two effects, net of what a refit absorbs.",
    ),
    Term(
        "residual against the drive",
        "independence test, cross-correlation test",
        "Outside the band, the model misses dynamics that the drive excites.",
    ),
    Term(
        "internal state",
        "hidden or memory variable, hysteretic variable",
        "What an effect remembers besides displacement and velocity.",
    ),
)
"""What a reader of another school may call by another name."""
