"""What in the records does not agree with their declaration, in words."""

from collections.abc import Sequence

from ...records import Suspicion


def check_first_words(found: Sequence[Suspicion]) -> tuple[str, ...]:
    """Give what to check before anything else is believed.

    Args:
        found: what the records say against their declaration.

    Returns:
        Lines for a reader, contradictions first; none where there is nothing.
    """
    return tuple(f"{'Check first' if one.contradicts else 'Have a look'}: {one}" for one in found)


def check_first_dicts(found: Sequence[Suspicion]) -> list[dict[str, object]]:
    """Give the same for result.json.

    Args:
        found: what the records say against their declaration.

    Returns:
        An entry each: "check", "where" (channels or record), "figure", "expected", "likely_cause" and "line",
        the likeliest first, and whether it "contradicts" the declaration or is a doubt.
    """
    return [
        {
            "check": one.check,
            "where": one.where,
            "figure": one.figure,
            "expected": one.expected,
            "likely_cause": [cause.words for cause in one.causes],
            "line": [cause.line for cause in one.causes],
            "contradicts": one.contradicts,
        }
        for one in found
    ]
