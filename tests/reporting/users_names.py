"""Names that a user may give, and what a reader must see of them."""

import unicodedata

from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st

_SPECIAL = "$^_{}[]<>&|`\\\"'*#~!%=+-.:;/ \n\r\t\x1b\x7f\u200e\u200f\u202a\u202d\u202e\u2066\u2069\u2028"
NAMES = st.text(
    st.one_of(st.sampled_from(_SPECIAL), st.sampled_from("abc1é")), min_size=1, max_size=12
).filter(lambda name: bool(name.strip()))
"""Names of letters that every font has, and of all that means something to some language."""

WORST = (
    "_$^_{}[]<>&|`\n\u202e\u2066x$ a_b <b>&amp; ![x](y) [red] :x: | 1. `` \\frac{a}{b} $\\alpha$ \x1b[31m",
    "- <script>alert(1)</script>",
    "```\n# $x",
    "1. $\\frac$",
)


def drawn(count):
    """Settings of a test of so many draws, always the same."""
    return settings(
        max_examples=count,
        deadline=None,
        derandomize=True,
        database=None,
        phases=(Phase.explicit, Phase.generate),
        suppress_health_check=[HealthCheck.function_scoped_fixture],
    )


def seen(name):
    """What is seen of a name, any run of blanks as one: what cannot be seen is written as Python does."""
    hidden = ("Cc", "Cf", "Zl", "Zp")
    shown = (
        one.encode("unicode_escape").decode() if unicodedata.category(one) in hidden else one for one in name
    )
    return " ".join("".join(shown).split())
