"""Physical numbers of a model: how they are declared, listed, replaced and mapped to unbounded variables."""

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from ._show import brief, shown
from ._types import Scalar, as_float64, on_device

_Model = TypeVar("_Model", bound=eqx.Module)


class ParameterSpec(NamedTuple):
    """Declaration of one physical number.

    Attributes:
        symbol: letter of the equation.
        unit: SI unit.
        lower: smallest admissible value.
        upper: largest admissible value.
        fitted: whether a fit frees it by default.
    """

    symbol: str
    unit: str
    lower: float
    upper: float
    fitted: bool


@shown
class Parameter(NamedTuple):
    """One physical number of a model.

    Attributes:
        name: `owner.field`, such as `cubic_stiffness.coefficient`; `mass` for the isolator's own.
        spec: its declaration.
        value: its present value.
    """

    name: str
    spec: ParameterSpec
    value: Float[Array, "..."]


def parameter(
    *,
    symbol: str,
    unit: str,
    lower: float = -math.inf,
    upper: float = math.inf,
    fitted: bool = True,
    default: Any = dataclasses.MISSING,
) -> Any:
    """Declare a physical number of an element.

    Args:
        symbol: letter of the equation.
        unit: SI unit.
        lower: smallest admissible value.
        upper: largest admissible value.
        fitted: False for a number that is declared by the user and reported, but fitted only on request.
        default: its value where none is given; it must be given if omitted.

    Returns:
        A dataclass field, float64, that `list_parameters` finds.

    Raises:
        ValueError: if `lower` is not below `upper`.
    """
    if not lower < upper:
        raise ValueError(f"Argument `lower` must be below `upper`, but {lower} is not below {upper}.")
    spec = ParameterSpec(symbol, unit, lower, upper, fitted)
    return eqx.field(converter=as_float64, metadata={"parameter": spec}, default=default)


def own_parameters(module: eqx.Module | type[eqx.Module]) -> tuple[tuple[str, ParameterSpec], ...]:
    """List the parameters that a module declares itself, not those of modules inside it.

    Args:
        module: any equinox module, or its class.

    Returns:
        Pairs of field name and declaration, in the order of the fields.
    """
    return tuple(
        (field.name, field.metadata["parameter"])
        for field in dataclasses.fields(module)
        if "parameter" in field.metadata
    )


def refuse_outside(name: str, value: Any, spec: ParameterSpec) -> None:
    """Refuse a number, or any of several, that its declaration does not admit; a traced one passes unseen.

    NaN passes too: it is what a search that failed leaves.

    Args:
        name: of the number.
        value: what was given.
        spec: its declaration.

    Raises:
        ValueError: if it lies outside.
    """
    bounded = math.isfinite(spec.lower) or math.isfinite(spec.upper)
    if not bounded or not eqx.is_array_like(value) or isinstance(value, Tracer):
        return
    known = np.asarray(value)
    if np.any((known < spec.lower) | (known > spec.upper)):
        unit = "" if spec.unit == "1" else f" {spec.unit}"
        wanted = f"lie from {spec.lower:g} to {spec.upper:g}"
        if math.isinf(spec.upper):
            wanted = f"be at least {spec.lower:g}"
        raise ValueError(f"Argument `{name}` must {wanted}{unit}, but is {value}.")


def refuse_shapes_outside(names: Iterable[str], elements: Iterable[eqx.Module]) -> None:
    """Refuse shapes of elements that their declarations do not admit.

    Strengths pass: one may have either sign where a linear step gave it.

    Args:
        names: of the elements.
        elements: as many.

    Raises:
        ValueError: if a number lies outside.
    """
    for name, element in zip(names, elements, strict=True):
        for field, spec in own_parameters(element):
            if field != getattr(element, "strength", None):
                refuse_outside(f"{name}.{field}", getattr(element, field), spec)


def required_parameters(module: type[eqx.Module]) -> tuple[str, ...]:
    """Name the parameters of a module's class that have no default."""
    return tuple(
        field.name
        for field in dataclasses.fields(module)
        if "parameter" in field.metadata and field.default is dataclasses.MISSING
    )


def element_names(model: eqx.Module) -> tuple[str, ...]:
    """Give each element's name in reports.

    Args:
        model: an isolator; anything else has no elements.

    Returns:
        Catalogue names; a second element of a kind carries `_2`.
    """
    seen: dict[str, int] = {}
    names = []
    for element in getattr(model, "elements", ()):
        seen[element.name] = seen.get(element.name, 0) + 1
        names.append(element.name if seen[element.name] == 1 else f"{element.name}_{seen[element.name]}")
    return tuple(names)


def _owners(model: eqx.Module) -> list[tuple[str, eqx.Module]]:
    """Pair every module of the model with its name in reports."""
    return [("", model), *zip(element_names(model), getattr(model, "elements", ()), strict=True)]


def list_parameters(model: eqx.Module) -> tuple[Parameter, ...]:
    """List the physical numbers of a model in a fixed order.

    Args:
        model: an isolator (own parameters first, then those of its elements) or a single element.

    Returns:
        Name, declaration and value of each.
    """
    return tuple(
        Parameter(f"{owner}.{field}" if owner else field, spec, getattr(module, field))
        for owner, module in _owners(model)
        for field, spec in own_parameters(module)
    )


def _leaves(model: Any) -> list[Any]:
    return [getattr(module, field) for _, module in _owners(model) for field, _ in own_parameters(module)]


def replace_parameters(model: _Model, values: Sequence[Any] | Float[Array, " parameter"]) -> _Model:
    """Give the same model with other numbers.

    Args:
        model: the model.
        values: one value a parameter, in the order of `list_parameters`; plain numbers become float64 arrays.

    Returns:
        A new model.

    Raises:
        ValueError: if the count of values differs from that of the parameters.
    """
    count = len(_leaves(model))
    if len(values) != count:
        raise ValueError(f"Argument `values` must hold {count} numbers, but holds {len(values)}.")
    return eqx.tree_at(_leaves, model, [as_float64(values[index]) for index in range(count)])


def replace_at(model: _Model, places: Sequence[int], values: Iterable[Any]) -> _Model:
    """Give the same model with some numbers replaced, as they are.

    Args:
        model: an isolator or a single element.
        places: places of the numbers in `list_parameters`.
        values: the new value of each; no number that is traced.

    Returns:
        The model.
    """
    numbers = [entry.value for entry in list_parameters(model)]
    for place, value in zip(places, values, strict=True):
        numbers[place] = on_device(np.asarray(value, dtype=float))
    return replace_parameters(model, numbers)


def replace_named(model: _Model, names: Sequence[str], values: Iterable[Any]) -> _Model:
    """Give the same model with some numbers replaced.

    Args:
        model: an isolator or a single element.
        names: names or symbols of the numbers.
        values: the new value of each.

    Returns:
        The model.

    Raises:
        ValueError: if there is no such parameter, it is given twice, or its number is not admissible.
    """
    listed = list_parameters(model)
    numbers = [entry.value for entry in listed]
    for name, value in zip(full_names(model, names), values, strict=True):
        place = find_parameter(model, name)
        numbers[place] = jnp.asarray(value, dtype=float)
        refuse_outside(name, numbers[place], listed[place].spec)
    return replace_parameters(model, numbers)


def find_parameter(model: eqx.Module, name: str, argument: str = "name", *others: str) -> int:
    """Find a parameter by its name in reports, or by its symbol where only one has it.

    Args:
        model: the model.
        name: such as `coulomb_friction.force`, or `k1`.
        argument: of the caller, which messages name.
        *others: names that the argument could hold as well.

    Returns:
        Its place in `list_parameters(model)`.

    Raises:
        ValueError: if the model has no such parameter, or several with the symbol.
    """
    symbols = {entry.name: entry.spec.symbol for entry in list_parameters(model)}
    return list(symbols).index(find_name(symbols, name, argument, *others))


def find_name(symbols: Mapping[str, str], given: str, argument: str, *others: str) -> str:
    """Find the name in reports that a name or a symbol stands for.

    Args:
        symbols: of each parameter, by its name; "" where it has none.
        given: such as `coulomb_friction.force`, or `k1`.
        argument: of the caller, which messages name.
        *others: names that the argument could hold as well.

    Returns:
        The name.

    Raises:
        ValueError: if there is no such parameter, or several have the symbol.
    """
    found = [name for name in symbols if name == given]
    found = found or [name for name, symbol in symbols.items() if symbol and symbol == given]
    if len(found) == 1:
        return found[0]
    if found:
        several = " and ".join(found)
        raise ValueError(f"Argument `{argument}` names {given!r}, the symbol of {several}: name one of them.")
    both = (f"{name} ({symbol})" if symbol else name for name, symbol in symbols.items())
    raise ValueError(f"Argument `{argument}` must be one of {', '.join((*both, *others))}, but is {given!r}.")


def full_names(
    model: eqx.Module, names: Iterable[str] | str, argument: str = "name", *others: str
) -> tuple[str, ...]:
    """Give the names in reports of parameters that a caller named, each once.

    Args:
        model: the model.
        names: names in reports, or symbols; a single one may stand by itself.
        argument: of the caller, which messages name.
        *others: names beside the parameters, which stand for themselves.

    Returns:
        The names, in the order given.

    Raises:
        ValueError: if these are no names, or two of them are of one parameter.
    """
    names = (names,) if isinstance(names, str) else names
    if not isinstance(names, Iterable):
        raise ValueError(f"Argument `{argument}` must list names of parameters, but is {brief(names)}.")
    symbols = {entry.name: entry.spec.symbol for entry in list_parameters(model)}
    found = dict[str, str]()
    for given in names:
        name = given if given in others else find_name(symbols, given, argument, *others)
        if name in found:
            raise ValueError(
                f"Argument `{argument}` must name {name} once, but does so as {found[name]!r} and {given!r}."
            )
        found[name] = given
    return tuple(found)


def to_physical(free: Scalar | float, spec: ParameterSpec, scale: Scalar | float) -> Float[Array, ""]:
    """Map an unbounded variable to a physical number within its bounds.

    No bound: `scale * u`. One bound: softplus from it. Two: logistic between them.

    Args:
        free: the unbounded variable u.
        spec: declaration with the bounds.
        scale: magnitude of the physical number [its unit]; u is of order one.

    Returns:
        The physical number.
    """
    free = jnp.asarray(free, dtype=float)
    has_lower, has_upper = math.isfinite(spec.lower), math.isfinite(spec.upper)
    if has_lower and has_upper:
        return spec.lower + (spec.upper - spec.lower) * jax.nn.sigmoid(free)
    if has_lower:
        return spec.lower + scale * jax.nn.softplus(free)
    if has_upper:
        return spec.upper - scale * jax.nn.softplus(free)
    return scale * free


def to_free(value: Scalar | float, spec: ParameterSpec, scale: Scalar | float) -> float:
    """Map a physical number to its unbounded variable: the inverse of `to_physical`, of known numbers.

    A value on or outside a bound starts a thousandth of its scale (or range) inside it.

    Args:
        value: the physical number.
        spec: declaration with the bounds.
        scale: as in `to_physical`.

    Returns:
        The unbounded variable.
    """
    has_lower, has_upper = math.isfinite(spec.lower), math.isfinite(spec.upper)
    number, size = float(value), float(scale)
    if has_lower and has_upper:
        share = min(max((number - spec.lower) / (spec.upper - spec.lower), 1e-3), 1 - 1e-3)
        return math.log(share) - math.log1p(-share)
    if has_lower or has_upper:
        distance = max((number - spec.lower if has_lower else spec.upper - number) / size, 1e-3)
        return distance + math.log(-math.expm1(-distance))
    return number / size
