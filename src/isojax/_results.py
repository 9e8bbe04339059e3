"""What a search says of itself when it ends: one enumeration for the whole package."""

from typing import Any

import diffrax
import jax
import numpy as np

from ._show import brief, numbers_of

_Item: Any = type(diffrax.RESULTS.successful)


class RESULTS(diffrax.RESULTS):  # pyright: ignore[reportGeneralTypeIssues]
    """Outcome of a search; `successful`, or a message that says what to try."""

    not_converged = (
        "The search stopped before it converged. Try a start nearer to the answer, more steps, or a looser "
        "tolerance in `Integrator`."
    )
    not_accurate = (
        "The orbit closes, but its multipliers miss the accuracy that was asked for; `error` says by how "
        "much. It grazes a stop or turns where friction all but holds it. Try more steps in `Integrator`, "
        "or a drive a little beside this one."
    )
    gone = (
        "Followed from the known orbit, the branch of this isolator does not reach the drive: it turns back "
        "at a fold before it, or lies too far away. Ask `continue_branch` what is there."
    )
    sticks = (
        "Dry friction holds the mass for the whole period: it may rest anywhere within the friction, so that "
        "no orbit is isolated and there are no multipliers. Raise the drive."
    )
    stiff = (
        "A state of the model follows the motion within less than the shortest step. Use the law that it "
        "tends to, such as dry friction for bristles that bend within a thousandth of the motion, or give "
        "more steps in `Integrator`."
    )
    no_further_orbit = "The cell holds no further orbit; others have more."
    not_finite = (
        "The simulated response left every bound (it is not finite). Try a smaller step, or a start whose "
        "stiffness and damping stay positive over the motion that was measured."
    )
    outdone = (
        "The search was given up: it stood far behind that of another effect and came no nearer. Fit this "
        "effect by itself from a better start if it is the one that is meant."
    )
    not_identifiable = (
        "The data do not determine every free coefficient. Fix one of the coefficients that the report "
        "names, or add records that separate them."
    )
    infeasible = (
        "No coefficients that were found within the bounds keep to all constraints. Loosen a constraint that "
        "is missed, or the bounds."
    )


_NAMES: Any = vars(RESULTS)["_name_to_item"]
"""Every outcome by its name, those that come from diffrax included; equinox lists them nowhere else."""


def is_successful(result: RESULTS) -> bool:
    """Say whether `result` is success.

    Args:
        result: outcome of a search.

    Returns:
        True for `RESULTS.successful`.

    Example:
        >>> ij.is_successful(ij.RESULTS.successful)
        True
    """
    return bool(result == RESULTS.successful)


def name_of_result(result: RESULTS) -> str:
    """Give the name of an outcome, such as "not_converged"."""
    (name,) = names_of_results(result)
    return name


def names_of_results(results: RESULTS) -> list[str]:
    """Give the names of some outcomes, or of one."""
    # In NumPy: to compare two outcomes as such would compile.
    codes = {int(np.asarray(jax.tree.leaves(item)[0])): name for name, item in _NAMES.items()}
    return [codes[int(code)] for code in np.asarray(jax.tree.leaves(results)[0]).ravel()]


def result_named(name: str) -> RESULTS:
    """Give the outcome of a name.

    Args:
        name: as `name_of_result` gives it.

    Returns:
        The outcome.

    Raises:
        KeyError: if there is none.
    """
    return _NAMES[name]


class CellResults(_Item):
    """Outcomes of the searches of a grid: `result[i, j]` is that of one cell, and prints in words.

    It compares with the members of `RESULTS` as any outcome does: `result == RESULTS.not_converged` gives an
    array.
    """

    def __getitem__(self, place: Any) -> "CellResults":
        """Give the outcome of one cell, or of some."""
        return jax.tree.map(lambda codes: codes[place], self)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the grid; () of one cell."""
        return jax.tree.leaves(self)[0].shape

    def __repr__(self) -> str:
        """Give the outcome of a cell in words, or count those of a grid."""
        return brief(self)


def cell_results(result: Any) -> Any:
    """Make the outcomes of a grid readable cell by cell.

    Args:
        result: outcomes of any shape; placeholders that JAX passes through pytrees stay.

    Returns:
        The same outcomes.
    """
    if not isinstance(result, _Item) or isinstance(result, CellResults):
        return result
    (codes,) = jax.tree.leaves(result)
    return jax.tree.map(lambda _: codes, CellResults(np.zeros((), np.int32), RESULTS))


@brief.register(_Item)
def _words(result: Any) -> str:
    """Give an outcome: its message, or how many cells of a grid have each."""
    (codes,) = jax.tree.leaves(result)
    known = numbers_of(codes)
    if known is None or known.dtype.kind not in "iu":
        return "traced"
    messages = {int(code): _message(result, code) for code in np.unique(known).tolist()}
    if known.ndim == 0:
        return messages[int(known)]
    # Of a message the first sentence; the advice after it stands in `result[i, j]`.
    counts = (f"{int(np.sum(known == code))} {words.partition('. ')[0]}" for code, words in messages.items())
    return f"{' × '.join(map(str, known.shape))} outcomes: {'; '.join(counts)}"


def _message(result: Any, code: int) -> str:
    """Give the message of one code; of success, which has none, the name."""
    one = jax.tree.map(lambda _: np.asarray(code), result)
    return RESULTS[one] or "successful"
