"""From records to a model that explains them: guess, fit, residual, diagnosis, extension, and the loop.

In: a `Campaign`. Out: a `Loop`, with the fitted models, the findings, the verdict and the next test.
Read the rooms in the order of an analysis: `guess` (start values), `fitting` (coefficients and errors),
`diagnosis` (which effect is missing), `experiment` (the next test) and `remainder`
(what stays unexplained). `_close_loop.py` joins them. `traces` lies below the diagnosis: what absent forces
would leave in the records. `jacobian` lies below all: simulated records and their exact derivatives.
`_rules.py` holds the numbers by which fit and diagnosis decide.
"""

from .._progress import silent as silent
from .._read_campaign import read_campaign as read_campaign
from ._close_loop import Loop as Loop
from ._close_loop import close_loop as close_loop
from ._close_loop import extend as extend
from ._rules import Rules as Rules
from .diagnosis import Candidate as Candidate
from .diagnosis import Extension as Extension
from .diagnosis import Finding as Finding
from .diagnosis import Separation as Separation
from .diagnosis import Verdict as Verdict
from .diagnosis import diagnose as diagnose
from .experiment import NextTest as NextTest
from .experiment import Proposal as Proposal
from .experiment import find_separating_experiment as find_separating_experiment
from .experiment import next_test as next_test
from .fitting import DEFAULT_SOLVER as DEFAULT_SOLVER
from .fitting import OUTPUT_UNITS as OUTPUT_UNITS
from .fitting import Coefficient as Coefficient
from .fitting import Coefficients as Coefficients
from .fitting import DriftBudget as DriftBudget
from .fitting import Errors as Errors
from .fitting import Fit as Fit
from .fitting import Fitted as Fitted
from .fitting import PredictionErrors as PredictionErrors
from .fitting import Residual as Residual
from .fitting import Run as Run
from .fitting import SavedFit as SavedFit
from .fitting import Share as Share
from .fitting import Statistics as Statistics
from .fitting import Uncertainty as Uncertainty
from .fitting import as_fit as as_fit
from .fitting import drift_budget as drift_budget
from .fitting import fit as fit
from .fitting import fit_report as fit_report
from .fitting import load_fit as load_fit
from .fitting import plain_unit as plain_unit
from .fitting import prediction_errors as prediction_errors
from .fitting import residual as residual
from .guess import CircleFit as CircleFit
from .guess import ClassicalGuess as ClassicalGuess
from .guess import HalfPower as HalfPower
from .guess import MeasuredResponse as MeasuredResponse
from .guess import PaperTable as PaperTable
from .guess import base_model as base_model
from .guess import classical_guess as classical_guess
from .guess import equivalent_coefficients as equivalent_coefficients
from .guess import find_half_power as find_half_power
from .guess import fit_circle as fit_circle
from .guess import invert_equivalent as invert_equivalent
from .guess import linear_response as linear_response
from .guess import measured_receptance as measured_receptance
from .guess import normalised_law as normalised_law
from .guess import paper_table as paper_table
from .guess import scales as scales
from .remainder import AlternativeLaw as AlternativeLaw
from .remainder import Alternatives as Alternatives
from .remainder import DwellRemainder as DwellRemainder
from .remainder import ForceMap as ForceMap
from .remainder import Remainder as Remainder
from .remainder import explain_remainder as explain_remainder
from .traces import MatchingPursuit as MatchingPursuit
from .traces import SelectedLaw as SelectedLaw
