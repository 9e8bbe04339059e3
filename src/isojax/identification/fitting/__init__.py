"""Coefficients, error bars and errors of a model, straight from time histories.

In: a start model and a campaign. Out: a `Fit`; `residual`, `drift_budget`,
`drive_noise` and `unlocked_tone` describe it.
Read `_fit` (the door) and `_search` (how to search), then `_estimate` and `_descent` (the search itself),
then `_problem`, `_simulator`, `_elimination` and `_initial_states` (its equations, without the nuisances).
What follows the search is in `_evaluation`, `_errors`, `_covariance`, `_scatter_mixture`, `_valley`
(do standard errors describe how chi2 rises?) and `_fit_result`; searches among effects run on `_thinned`
records.
"""

from ._as_fit import Fitted as Fitted
from ._as_fit import as_fit as as_fit
from ._build_problem import build_problem as build_problem
from ._coefficients import Coefficient as Coefficient
from ._coefficients import Coefficients as Coefficients
from ._covariance import Uncertainty as Uncertainty
from ._covariance import invert_information as invert_information
from ._drift_budget import DriftBudget as DriftBudget
from ._drift_budget import Share as Share
from ._drift_budget import drift_budget as drift_budget
from ._drive_noise import DriveNoise as DriveNoise
from ._drive_noise import drive_noise as drive_noise
from ._elimination import Nuisances as Nuisances
from ._elimination import Spread as Spread
from ._elimination import step_nuisances as step_nuisances
from ._errors import Errors as Errors
from ._errors import Run as Run
from ._errors import run_freely as run_freely
from ._estimate import Estimate as Estimate
from ._estimate import estimate as estimate
from ._estimate import magnitudes as magnitudes
from ._fit import beside_own_noise as beside_own_noise
from ._fit import beside_random_force as beside_random_force
from ._fit import fit as fit
from ._fit import fit_by_output as fit_by_output
from ._fit import still as still
from ._fit import weighted_by_output as weighted_by_output
from ._fit import weighted_by_residual as weighted_by_residual
from ._fit_of_errors import as_fit_of_errors as as_fit_of_errors
from ._fit_result import Fit as Fit
from ._fit_result import bent_words as bent_words
from ._fit_result import fit_report as fit_report
from ._held_fit import fit_held as fit_held
from ._initial_states import best_nuisances as best_nuisances
from ._lack_of_fit import LackOfFit as LackOfFit
from ._lack_of_fit import lack_of_fit as lack_of_fit
from ._likelihood import Likelihood as Likelihood
from ._multiple_shooting import fit_by_multiple_shooting as fit_by_multiple_shooting
from ._output_units import OUTPUT_UNITS as OUTPUT_UNITS
from ._output_units import plain_unit as plain_unit
from ._prediction_errors import PredictionErrors as PredictionErrors
from ._prediction_errors import prediction_errors as prediction_errors
from ._problem import Point as Point
from ._problem import Problem as Problem
from ._problem import one_hot as one_hot
from ._residual import Residual as Residual
from ._residual import residual as residual
from ._saved_fit import SavedFit as SavedFit
from ._saved_fit import Statistics as Statistics
from ._saved_fit import load_fit as load_fit
from ._scatter_mixture import ScatteredScores as ScatteredScores
from ._scatter_mixture import expect_uncertainty as expect_uncertainty
from ._scatter_mixture import scores_over_scatters as scores_over_scatters
from ._search import DEFAULT_SOLVER as DEFAULT_SOLVER
from ._search import MOST_EVALUATIONS as MOST_EVALUATIONS
from ._search import ROUGH as ROUGH
from ._search import Rival as Rival
from ._search import Search as Search
from ._search import search_of as search_of
from ._simulator import Simulator as Simulator
from ._thinned import chi2_per_dof_of_all as chi2_per_dof_of_all
from ._thinned import on_all_samples as on_all_samples
from ._thinned import thinned as thinned
from ._unlocked_tone import Tone as Tone
from ._unlocked_tone import unlocked_tone as unlocked_tone
from ._weighted_fits import complete as complete
from ._weighted_fits import fit_with_errors as fit_with_errors
