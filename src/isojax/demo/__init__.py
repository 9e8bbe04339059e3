"""The demo campaign: a small simulated test whose base model lacks one effect, named in its truth.json.

In: nothing. Out: `campaign_folder`, the path of the folder `campaign`, which `isojax demo` analyses.
Read `campaign/campaign.toml` first, then `campaign/truth.json`, which the analysis never opens.
`isojax.rig.demo_campaign` writes the folder.
"""

from importlib.resources import files
from pathlib import Path


def campaign_folder() -> Path:
    """Folder of the demo campaign."""
    return Path(str(files("isojax.demo"))) / "campaign"
