"""The coarsest integration steps that the noise allows, by step doubling."""

import dataclasses

import jax.numpy as jnp
import numpy as np

from ...models import Integrator, Isolator
from ..jacobian import readings, whiten
from ._problem import Problem
from ._simulator import Simulator

SEGMENTS_TRIED = 8
"""Segments on which the error of the steps is measured."""

FINEST = 32

SMALL_ERROR = 0.05
"""Integration error over the noise that is small enough: it adds 0.0025 to chi2/dof at most."""


def step_error(problem: Problem, model: Isolator, substeps: int) -> float:
    """Give the rms change of the readings when the steps are halved, over the noise.

    Args:
        problem: the records; a few of their segments are simulated.
        model: the isolator.
        substeps: integration steps a sample before halving.

    Returns:
        Error over noise; infinite where a simulation diverged.
    """
    loudest = max(
        range(len(problem.records)),
        key=lambda place: float(np.std(problem.records[place].output)) / problem.noise[place],
    )
    own = [segment for segment in problem.segments if segment.record == loudest]
    few = tuple(own[:: max(1, len(own) // SEGMENTS_TRIED)][:SEGMENTS_TRIED])
    outcomes = []
    for steps in (substeps, 2 * substeps):
        # The model's own demand must not hide the difference, so that the steps are set for both runs alike.
        integrator = dataclasses.replace(problem.integrator, substeps=max(1, steps))
        simulator = Simulator(problem._replace(segments=few, integrator=integrator))
        prepared = simulator.prepared(model, len(model.elements))
        starts, _ = simulator.starts(model, prepared)
        outcomes.append(readings(model, np.ones(prepared.record.size), starts, prepared))
    weight = prepared.in_lanes(np.asarray(batch.weight).T for batch in prepared.batches).T
    difference = (outcomes[0] - outcomes[1]) * weight
    if not np.all(np.isfinite(difference)):
        return float("inf")
    if prepared.sampling.whitening is not None:
        rows = whiten(jnp.asarray(difference)[:, None], jnp.asarray(weight), prepared.sampling.whitening)
        difference = np.asarray(rows[:, 0])
    return float(np.sqrt(np.sum(difference**2) / np.sum(weight) / problem.share) / problem.noise[loudest])


def find_integrator(problem: Problem, model: Isolator) -> Problem:
    """Find the coarsest steps whose error is a small share of the noise.

    Args:
        problem: the records.
        model: the isolator; a start will do.

    Returns:
        The problem with its integrator (the finest that was tried where none suffices) and its step error.
    """
    substeps = Integrator().record_steps(model)
    error = step_error(problem, model, substeps)
    while substeps < FINEST and error > SMALL_ERROR:
        substeps *= 2
        error = step_error(problem, model, substeps)
    integrator = dataclasses.replace(problem.integrator, substeps=substeps)
    return problem._replace(integrator=integrator, step_error=error)
