"""How sure an answer is: the covariance of a fit carried into what is asked of its model.

In: a fit and a function of its model. Out: an `UncertainQuantity`, value, standard error and interval.
Read `_uncertainty.py`.
"""

from ._global_sensitivity import GlobalSensitivity as GlobalSensitivity
from ._global_sensitivity import global_sensitivity as global_sensitivity
from ._posterior import Posterior as Posterior
from ._posterior import posterior as posterior
from ._profile import Profile as Profile
from ._profile import profile as profile
from ._uncertainty import UncertainQuantity as UncertainQuantity
from ._uncertainty import uncertainty as uncertainty
