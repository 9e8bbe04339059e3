"""Numbers and sentences of every report.

In: findings, fits, data health, an unexplained remainder. Out: strings, typeset with unit and error, and
plain dictionaries for result.json. Read `isojax/_quantities.py` (one number), `_sentences.py` (the verdict),
then the words on other laws that would do, on data health and on the remainder.
"""

from ..._quantities import DRIVE_UNITS as DRIVE_UNITS
from ..._quantities import INPUT_WORDS as INPUT_WORDS
from ..._quantities import finite_or_none as finite_or_none
from ..._quantities import typeset_goodness as typeset_goodness
from ..._quantities import typeset_number as typeset_number
from ..._quantities import typeset_p_value as typeset_p_value
from ..._quantities import typeset_share as typeset_share
from ..._quantities import typeset_unit as typeset_unit
from ..._quantities import typeset_with_error as typeset_with_error
from ._alternative_words import alternative_words as alternative_words
from ._alternative_words import alternatives_list as alternatives_list
from ._check_first_words import check_first_dicts as check_first_dicts
from ._check_first_words import check_first_words as check_first_words
from ._glossary import GLOSSARY as GLOSSARY
from ._health_words import budget_rows as budget_rows
from ._health_words import budget_words as budget_words
from ._health_words import dwell_words as dwell_words
from ._health_words import health_dict as health_dict
from ._health_words import mains_words as mains_words
from ._remainder_words import law_dict as law_dict
from ._remainder_words import law_rows as law_rows
from ._remainder_words import remainder_dict as remainder_dict
from ._remainder_words import remainder_summary as remainder_summary
from ._remainder_words import selected_laws_words as selected_laws_words
from ._sentences import caveats as caveats
from ._sentences import effect_words as effect_words
from ._sentences import finding_words as finding_words
from ._sentences import health_words as health_words
from ._sentences import verdict_sentence as verdict_sentence
