"""What a search says of itself when it ends: one enumeration for the whole package."""

import diffrax


class RESULTS(diffrax.RESULTS):  # pyright: ignore[reportGeneralTypeIssues]
    """Outcome of a search; `successful`, or a message that says what to try."""

    not_converged = (
        "The search stopped before it converged. Try a start nearer to the answer, more steps, or a looser "
        "tolerance in `Integrator`."
    )
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
