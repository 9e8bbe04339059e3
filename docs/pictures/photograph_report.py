"""Photograph the first screen of the report that is named, and write it beside this script."""

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

target = Path(__file__).with_name("report.png")
with tempfile.TemporaryDirectory() as profile:
    subprocess.run(
        [
            *"chromium --headless --no-sandbox --disable-gpu --no-first-run --hide-scrollbars".split(),
            "--disable-background-networking",
            f"--user-data-dir={profile}",
            "--window-size=1200,690",
            f"--screenshot={target}",
            Path(sys.argv[1]).resolve().as_uri(),
        ],
        check=True,
    )
Image.open(target).convert("RGB").quantize(128).save(target, optimize=True)
