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

    clean: float = 1.02
    """chi2/dof up to which a fit leaves as little as repeats of a test differ."""

    left_over: float = 0.03
    """Share of the first excess that a good fit may leave where the noise is far below every model
    error."""

    most_of_it: float = 0.8
    """Share of the excess that an effect, or all effects together, must explain to be the explanation."""

    smallest_share: float = 0.2
    """Share of the remaining excess that an effect must explain to be named where the fit is not good."""

    smallest_gain: float = 0.0005
    """Gain in chi2/dof below which effects are ties: no test repeats so well that a smaller one means
    anything."""

    most_at_once: int = 2
    """Effects that explain all a campaign lacks. More imitate together a law that the catalogue does not
    have, so that the verdict is "partly explained" at best."""

    # Significance and evidence.

    significance: float = 0.01
    """Family-wise level of the score test; Westfall & Young 1993."""

    significance_factor: float = 0.5
    """Factor on the level after each effect that was added: the levels of all searches sum up to twice the
    first."""

    close_bic: float = 10.0
    """Difference of Schwarz's criterion from which the evidence is clear: very strong in the scale of Kass
    & Raftery 1995, J. Am. Stat. Assoc. 90:773. Two effects within it are indistinguishable."""

    close_likeness: float = 0.95
    """Correlation of the traces of two effects from which they look alike, where only one was refitted."""

    determined: float = 2.0
    """Standard errors that a refitted strength must be away from zero: the 95 % interval."""

    smallest_visibility: float = 0.005
    """Share of an effect's trace that the fitted coefficients must leave; below it the records cannot show
    the effect."""

    # Which candidates are refitted.

    survivors: int = 4
    """Families of effects that are refitted."""

    worth_refit: float = 0.04
    """Squared score, over that of the leading family, below which a family is not refitted. Free shape
    parameters may make up a part of that."""

    score_optimism: float = 5.0
    """Times the gain of its linear step that a refit beside a good fit may reach."""

    far: float = 2.0
    """chi2/dof from which the balance of measured forces proposes a candidate, too, and from which
    correlated candidates are refitted: a score is a derivative at the fit."""

    much_better: float = 0.5
    """Share of the unbalanced force that an effect must undercut to be proposed by the balance."""

    tried: int = 2
    """Partners of an effect that are refitted when two effects are compared with one."""

    room: float = 1.5
    """Times the gain of its linear step that a partner may reach."""

    # When a search ends.

    evaluations: int = 100
    """Simulations with derivatives of a fit, or of a refit, at most: most need ten, a curved valley some
    eighty."""

    partner_evaluations: int = 20
    """The same of a refit with a partner, and of one without an effect that may be superfluous."""

    transfer_evaluations: int = 15
    """The same of a refit on a part of the data, which starts from the fit to all of them."""

    final_evaluations: int = 25
    """The same of the last fit of a finding, which starts from its rough refit."""

    window_evaluations: int = 25
    """The same of a fit to windows of whole records, before longer windows are taken."""

    second_try: float = 0.5
    """Share of its evaluations that a stalled refit gets for a second try, from the measured states."""

    step_shares: tuple[float, ...] = (1.0, 0.3, 0.03)
    """Shares of the score's linear step, from the largest on, at the first of which a refit starts that
    lowers chi2."""

    description_evaluations: int = 12
    """The same of the refit with the laws that describe a remainder."""

    windows: tuple[int, ...] = (16, 4)
    """Windows a record, in the order in which a multiple-shooting start fits them."""

    converged: float = 1e-2
    """Decrease of chi2, per max(chi2/dof, 1), below which a search is over: a hundredth of a standard error
    squared."""

    rough: float = 1.0
    """The same for refits that are only ranked: a tenth of `close_bic`."""

    rough_share: float = 0.1
    """The same as a share of the chi2 that makes a tie, where the samples are so many that this is more."""

    rival_distance: float = 10.0
    """Differences of a tie by which a refit must be behind the best one to be given up."""

    rival_patience: int = 5
    """Evaluations in which a refit that is behind must catch up."""

    rival_share: float = 0.05
    """Share of its distance that it must then have made good."""

    spotless_gain: float = 10.0
    """Smallest gains above chi2/dof = 1 up to which the best refit leaves nothing: others can only equal
    it."""

    spotless_patience: int = 3
    """`rival_patience` beside such a refit."""

    spotless_share: float = 0.2
    """`rival_share` beside such a refit."""

    # Whether an effect is physical and carries over.

    visited_quantile: float = 0.995
    """Quantile of the measured motion up to which a law must be physical: integrals are rough at a record's
    ends."""

    smaller_loop: float = 0.25
    """Share of the largest motion at which the work over a loop is checked once more: a passive law is so
    there, too."""

    energy_tolerance: float = 1e-3
    """Energy that a loop may give, over the elastic energy that it moves, before its law counts as
    active."""

    transfer_visible: float = 0.03
    """Share of its gain that an effect must make at a level for that level to be left out and predicted. An
    end stop that sets in above a level cannot be estimated there."""

    # Scatter of the linear stiffness.

    first_scatter: float = 1e-2
    """Standard deviation of the linear stiffness between records before they show one [relative]: the
    prior."""

    smallest_scatter: float = 1e-5
    """Standard deviation below which it is not estimated [relative]."""

    single_scatter: float = 1e-3
    """The same where no two records can be compared [relative]."""

    scatter_significance: float = 0.01
    """Chance, without scatter within records, of differences as large as those that are taken for it."""

    same_motion: float = 0.1
    """Relative difference of rms from which two dwells are on different branches, or were driven
    differently."""

    same_scatter: float = 0.1
    """Relative difference up to which two scatters within records are one, so that the search is not
    repeated."""

    # Which dwells the classical analysis uses.

    drop_out: float = 1e-3
    """Share of the strongest drive below which a dwell is left out."""

    unsteady: float = 0.05
    """Share of its first harmonic that the harmonics of a steady dwell may leave."""

    unsteady_noise: float = 6.0
    """Times the median of what the dwells of a record leave, which is noise, that a steady dwell may leave,
    too."""

    # Accuracy that the verdict is based on.

    integration_error: float = 0.05
    """Integration error over the noise up to which steps are fine enough: adds 0.0025 to chi2/dof at
    most."""

    # How a remainder is described.

    pursuit_laws: int = 4
    """Laws that a pursuit takes at most."""

    pursuit_significance: float = 0.01
    """Family-wise chance above which a law is not taken."""

    pursuit_share: float = 0.02
    """Share of the excess below which a law is not taken."""

    pursuit_tie: float = 0.03
    """Share of the best law's gain by which a plainer one may fall short and still be taken."""

    def __repr__(self) -> str:
        """Give the numbers that differ from the defaults, as they would be passed."""
        changed = (
            f"{field.name}={getattr(self, field.name)!r}"
            for field in dataclasses.fields(self)
            if getattr(self, field.name) != field.default
        )
        return f"Rules({', '.join(changed)})"
