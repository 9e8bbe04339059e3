"""The isolator models that the paper identified, ready to use.

Source: "Data-driven modeling and analysis of nonlinear isolated mechanical system", eqs. (13), (18), (23),
(28), (36). The paper prints |y| y' and y^3 in the damping of eqs. (30) and (33); eqs. (18) and (28) make them
|v| v and v^3.
"""

from typing import Literal

from .elements import (
    AbsQuadraticDamping,
    AbsQuadraticStiffness,
    AbstractElement,
    CubicDamping,
    CubicStiffness,
    LinearDamping,
    LinearStiffness,
)
from .models import Isolator


def y_direction(mass: float = 800.0, damping: Literal["eq18", "eq36"] = "eq18") -> Isolator:
    """Give the horizontal model.

    Args:
        mass: moving mass [kg]; the paper prints 800 kg for the base.
        damping: "eq18", the identified law, or "eq36", the modified one as printed (c2 = -3.688e3 N s^2/m^2).

    Returns:
        The isolator.

    Raises:
        ValueError: if `damping` is neither.
    """
    laws: dict[str, tuple[AbstractElement, ...]] = {
        "eq18": (LinearDamping(1.027e4), AbsQuadraticDamping(-3.6880e5), CubicDamping(5.3753e6)),
        "eq36": (LinearDamping(1.027e4), AbsQuadraticDamping(-3.6880e3)),
    }
    if damping not in laws:
        raise ValueError(f'Argument `damping` must be "eq18" or "eq36", but is {damping!r}.')
    stiffness = (LinearStiffness(1.0805e6), AbsQuadraticStiffness(-6.974e8), CubicStiffness(2.51667e11))
    return Isolator(mass, (*stiffness, *laws[damping]))


def z_direction(mass: float = 800.0) -> Isolator:
    """Give the vertical model.

    Args:
        mass: moving mass [kg].

    Returns:
        The isolator.
    """
    return Isolator(
        mass,
        (
            LinearStiffness(1.414e5),
            AbsQuadraticStiffness(-4.126e5),
            CubicStiffness(-4.289e6),
            LinearDamping(2638.0),
            AbsQuadraticDamping(-1393.0),
            CubicDamping(745.533),
        ),
    )
