"""The model of the error: noise of the output, and a random force that stands for what else disturbs.

Read `_filter` (innovations of records side by side, and their derivatives), `_measured` and `_record_filter`
(a model's filter over the records of a campaign), `_sizes` (of its errors), `_error_fit` (a fit with these),
`_ahead` (errors of predictions), `_fit_errors` (the search), `_fit_measured` (as many integration steps as
the motion needs) and `_effect_products` (what absent effects would add).
"""

from ._ahead import free_squares as free_squares
from ._ahead import squares_ahead as squares_ahead
from ._effect_products import EffectProducts as EffectProducts
from ._effect_products import effect_products as effect_products
from ._error_fit import ErrorFit as ErrorFit
from ._first_states import eliminate as eliminate
from ._fit_errors import first_sizes as first_sizes
from ._fit_errors import fit_errors as fit_errors
from ._fit_measured import fit_measured as fit_measured
from ._fit_measured import refined as refined
from ._measured import Measured as Measured
from ._record_filter import RecordFilter as RecordFilter
from ._sizes import Sizes as Sizes
from ._sizes import Way as Way
