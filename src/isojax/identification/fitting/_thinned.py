"""Searches among effects on fewer samples than were measured, where the motion needs no more.

Records at 1 kHz of a drive of 7 Hz have 143 samples a cycle. Thinned out to 48 they say nearly the same of
every law, since noise and residual lose alike; what differs within 8 degrees of a cycle is blurred.
"""

import equinox as eqx
import numpy as np

from ..._parameters import own_parameters
from ..._results import is_successful
from ...elements import AbstractElement
from ...models import Isolator
from ...records import thin_record, thinned_place, thinned_share
from ...records.spectrum import driven_range
from ..jacobian import Segment
from ._estimate import Estimate, estimate
from ._initial_states import best_nuisances
from ._integration_steps import find_integrator
from ._problem import Problem
from ._search import Search
from ._simulator import Simulator

FEWEST_A_CYCLE = 40
"""Samples in a cycle of the fastest drive that a search among effects keeps: they show ten harmonics."""


def thinning(problem: Problem) -> int:
    """Give how many samples of a problem may become one.

    A drive that is held between samples would be held no more, and the filter that whitens coloured noise is
    that of the rate at which it was found.

    Args:
        problem: the records.

    Returns:
        Samples that become one; 1 where nothing may be left out.
    """
    if problem.hold == "zero_order" or problem.whitening or not problem.integrator.is_locked:
        return 1
    fastest = max(driven_range(record)[1] for record in problem.records)
    factor = int(problem.records[0].rate / (FEWEST_A_CYCLE * fastest)) if fastest > 0.0 else 1
    return max(1, factor)


def thinned(found: Estimate, search: Search) -> tuple[Estimate, Search]:
    """Give an estimate of the same coefficients from thinned records, and the search that goes with it.

    Args:
        found: the estimate.
        search: how to search.

    Returns:
        Both; as they are where nothing may be left out, or the fit to thinned records failed.
    """
    factor = thinning(found.problem)
    if factor == 1:
        return found, search
    slower = factor * search.scales.sample_time
    coarser = search._replace(scales=eqx.tree_at(lambda one: one.sample_time, search.scales, slower))
    search.progress(f"candidates are tried on 1 sample of {factor}")
    simulator = Simulator(find_integrator(_thinned_problem(found.problem, factor), found.model))
    nuisances = found.point.nuisances.afresh()
    thin = estimate(simulator, found.model, found.places, coarser, nuisances)
    return (thin, coarser) if is_successful(thin.result) else (found, search)


def _thinned_problem(problem: Problem, factor: int) -> Problem:
    """Thin out the records; pieces of them stay pieces."""
    records = tuple(thin_record(record, factor) for record in problem.records)

    def place(part: Segment) -> Segment:
        size = records[part.record].output.size
        start, stop, counted = (
            min(thinned_place(at, factor), size) for at in (part.start, part.stop, part.counted)
        )
        return Segment(part.record, start, stop, counted)

    return problem._replace(
        records=records,
        segments=tuple(map(place, problem.segments)),
        noise=tuple(np.array(problem.noise) / np.sqrt(factor)),
        heads=tuple(map(place, problem.heads)),
        # Noise that a filter had limited before fills more of the lower band.
        share=min(factor * problem.share, thinned_share(factor)),
        thinned=factor,
    )


def on_all_samples(found: Estimate, whole: Estimate, coarser: Search, search: Search) -> Estimate:
    """Fit to the end on all samples what was found on thinned records.

    Args:
        found: the estimate from thinned records.
        whole: an estimate from all samples, whose records count.
        coarser: the search that found it.
        search: the search on all samples.

    Returns:
        The estimate, whose `result` says whether it succeeded; `found` itself where nothing was left out.
    """
    if found.problem.thinned == whole.problem.thinned:
        return found
    search.progress("the same on all samples")
    model, known = _with_finer_corners(found.model, coarser, search), found.point.nuisances.afresh()
    settled = best_nuisances(whole.simulator, model, known.spread, known, found.places)
    nuisances = settled.nuisances if settled.is_finite else known
    return estimate(whole.simulator, model, found.places, search, nuisances, anew=True)


def chi2_per_dof_of_all(chi2_per_dof: float, thin: Estimate, whole: Estimate) -> float:
    """Give chi2/dof that a model would have on all samples: thinned records keep what a law takes off chi2.

    Args:
        chi2_per_dof: of the model, on thinned records.
        thin: the estimate that it is compared with, on the same records.
        whole: the same estimate on all samples.

    Returns:
        chi2/dof; as it is where nothing was left out.
    """
    if thin is whole:
        return chi2_per_dof
    return (whole.chi2 + thin.dof * chi2_per_dof - thin.chi2) / whole.dof


def _with_finer_corners(model: Isolator, coarser: Search, finer: Search) -> Isolator:
    """Give a model with those numbers of another search that the time between samples sets.

    Such as the width of a rounded corner.

    Args:
        model: the isolator, found in a search on thinned records.
        coarser: that search.
        finer: the search on all samples.

    Returns:
        The model.
    """

    def refined(element: AbstractElement) -> AbstractElement:
        old, new = (type(element).guess(search.scales) for search in (coarser, finer))
        for name, spec in own_parameters(element):
            given, wanted = (float(getattr(one, name)) for one in (old, new))
            if not spec.fitted and given != wanted and float(getattr(element, name)) == given:
                element = eqx.tree_at(lambda one, n=name: getattr(one, n), element, getattr(new, name))
        return element

    return Isolator(model.mass, tuple(map(refined, model.elements)), model.excitation)
