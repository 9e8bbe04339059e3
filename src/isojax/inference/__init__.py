"""How sure an answer is, and which coefficients meet a target.

In: a fit and a function of its model. Out: an `UncertainQuantity`, value, standard error and interval; or a
`Design`, coefficients that meet a target.
Read `_uncertainty.py` and `_next_record.py`; then `_design.py` (the door), `_constraint.py` (what a design
must keep to), `_design_space.py` (coordinates and derivatives), `_design_search.py` and `_design_scan.py`
(search and check), and `_design_result.py`.
"""

from ._constraint import Constraint as Constraint
from ._constraint import at_least as at_least
from ._constraint import at_most as at_most
from ._design import design as design
from ._design_result import Design as Design
from ._design_result import Outcome as Outcome
from ._design_scan import Scan as Scan
from ._global_sensitivity import GlobalSensitivity as GlobalSensitivity
from ._global_sensitivity import global_sensitivity as global_sensitivity
from ._next_record import NextRecord as NextRecord
from ._next_record import next_record as next_record
from ._posterior import Posterior as Posterior
from ._posterior import posterior as posterior
from ._profile import Profile as Profile
from ._profile import profile as profile
from ._uncertainty import UncertainQuantity as UncertainQuantity
from ._uncertainty import uncertainty as uncertainty
