"""The model that a campaign declares, before any number is known."""

from operator import attrgetter

from ..._read_campaign import catalogue_names
from ...elements import CATALOGUE, AbstractElement
from ...models import Isolator
from ...records import Campaign
from ._scales import scales


def _is_freed(campaign: Campaign, kind: type[AbstractElement]) -> bool:
    """Say whether a field of campaign.toml, such as `input.gain_free`, puts the effect into the model."""
    return bool(kind.freed_by) and attrgetter(kind.freed_by)(campaign)


def declared_names(campaign: Campaign, *, extra: bool = True) -> tuple[str, ...]:
    """List the catalogue names that a campaign declares.

    Args:
        campaign: the campaign.
        extra: whether the further elements of the campaign count, beside springs, dampers and the
            instruments.

    Returns:
        Springs, dampers, further elements, then what the instruments leave free; each name once.

    Raises:
        ValueError: if a name is not in the catalogue; names the file, the field and the nearest right name.
    """
    declared = list(
        catalogue_names(
            campaign.file, campaign.stiffness, campaign.damping, campaign.elements if extra else ()
        )
    )
    declared.extend(name for name, kind in CATALOGUE.items() if _is_freed(campaign, kind))
    return tuple(dict.fromkeys(declared))


def base_model(campaign: Campaign) -> Isolator:
    """Give the declared structure with every effect absent.

    Args:
        campaign: what was declared: mass [kg], names of springs and dampers, free offsets and gain.

    Returns:
        The isolator: declared mass, every element at zero strength, the excitation that the input quantity
        implies.

    Raises:
        ValueError: if a declared name is not in the catalogue.
    """
    magnitudes = scales(campaign)
    return Isolator(
        campaign.mass,  # pyright: ignore[reportArgumentType]
        tuple(CATALOGUE[name].guess(magnitudes) for name in declared_names(campaign)),
        "base_acceleration" if campaign.input.quantity == "base_acceleration" else "force",
    )
