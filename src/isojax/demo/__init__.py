"""The demo campaign: a small simulated test whose base model lacks one effect, named in its truth.json."""

from importlib.resources import files
from pathlib import Path


def campaign_folder() -> Path:
    """Folder of the demo campaign."""
    return Path(str(files("isojax.demo"))) / "campaign"
