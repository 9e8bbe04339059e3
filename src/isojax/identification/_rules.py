"""The numbers by which a fit and a diagnosis decide, in one place."""

import dataclasses


@dataclasses.dataclass(frozen=True, repr=False)
class Rules:
    """The numbers by which a fit is judged and an effect is named.

    chi2/dof is the squared residual over the noise, per degree of freedom: 1 where nothing but noise is left.
    The excess is chi2 - dof. A gain in chi2/dof is a decrease of it. Numbers are dimensionless unless a unit
    is given. A value without a source was set by hand; `benchmarks/rules.py` shows what half and twice of it
    change.

    Readers, noise estimates, start values and the descent keep their own numbers, as named constants beside
    the code that uses them.
    """

    # When a fit is good, and what counts as an explanation.

    good: float = 1.05
    """chi2/dof up to which a fit is good."""

    smallest_share: float = 0.2
    """Share of the excess that matters where a fit is not good: an effect that explains less is not named,
    and all effects together are the explanation once less is left. A law of which another leaves less is one
    of the same kind."""

    smallest_gain: float = 0.0005
    """Gain in chi2/dof below which effects are ties: no test repeats so well that a smaller one means
    anything."""

    smallest_law: float = 0.03
    """Share of the excess from which a force law describes a remainder or stands out beside a good fit; and
    share of the best law's gain by which a plainer one may fall short and still be chosen. See
    `benchmarks/remainder.py`."""

    most_at_once: int = 2
    """Effects that explain all a campaign lacks. More imitate together a law that the catalogue does not
    have, so that the verdict is "partly explained" at best."""

    # Significance and evidence.

    significance: float = 0.01
    """Family-wise level of the score test (Westfall & Young 1993), of laws that describe a remainder or stand
    out beside a good fit, and of the tests for lack of fit, for scatter of the stiffness within records, of
    one strength and of a free run that got worse. The score test takes half of it after each finding, so that
    all its levels of one loop sum up to twice the first."""

    close_bic: float = 10.0
    """Difference of Schwarz's criterion from which the evidence is clear: very strong in the scale of Kass
    & Raftery 1995, J. Am. Stat. Assoc. 90:773. Two effects within it are indistinguishable."""

    smallest_visibility: float = 0.005
    """Share of an effect's trace that the fitted coefficients must leave; below it the records cannot show
    the effect."""

    # Records that a filter follows.

    contradicted: float = 10.0
    """chi2/dof from which the noise that the output shows says nothing of the error: a random force stands
    for the rest."""

    loudest: float = 0.2
    """Noise over the rms of the output from which periods or repeats differ by more than noise: the motion
    itself need not repeat."""

    dispersed: float = 1.5
    """Variance of scores from piece to piece of the records, over that of independent innovations, from which
    it takes the place of that: the error is then the model's."""

    likeness: float = 0.95
    """Likeness of two traces from which the records hardly distinguish their effects: both are refitted."""

    about_as_large: float = 0.8
    """Share of the largest score from which a plainer effect is refitted before it."""

    clear_gain: float = 0.05
    """Gain of -2 log-likelihood a sample from which an effect that leaves noise alone carries over."""

    as_declared: float = 1.5
    """Variance of a random force, over that declared for noise of the drive, up to which it is that."""

    free_run_tie: float = 0.1
    """Larger error of free runs, relative, up to which two models whose error is not noise are as good."""

    followed: float = 0.5
    """Error of the best free run over the rms of the response from which free runs tell no laws apart: motion
    that is irregular."""

    # Which candidates are refitted.

    unbalanced: float = 1.5
    """Measured force left unbalanced, over what the best effect leaves, from which it tells effects apart:
    those that leave more are not refitted."""

    hopeless: float = 0.2
    """Gain that a score promises, over what the best refit's own score did, below which an effect is not
    refitted."""

    survivors: int = 4
    """Families of effects that are refitted."""

    def __repr__(self) -> str:
        """Give the numbers that differ from the defaults, as they would be passed."""
        changed = (
            f"{field.name}={getattr(self, field.name)!r}"
            for field in dataclasses.fields(self)
            if getattr(self, field.name) != field.default
        )
        return f"Rules({', '.join(changed)})"
