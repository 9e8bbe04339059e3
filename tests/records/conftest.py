"""A tiny campaign on disk, of which each test changes one thing."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tiny_campaign import TINY, tiny_channels, write_csv


@pytest.fixture
def channels() -> dict[str, np.ndarray]:
    """The channels of the tiny campaign, for a test to spoil."""
    return tiny_channels()


@pytest.fixture
def tiny(tmp_path: Path) -> Callable[..., Path]:
    """Writes the tiny campaign with a regular expression of its .toml replaced; returns its folder."""

    def write(*changes: tuple[str, str], channels: dict[str, np.ndarray] | None = None) -> Path:
        text = TINY
        for pattern, replacement in changes:
            text, count = re.subn(pattern, replacement, text, count=1, flags=re.M)
            assert count == 1, pattern
        (tmp_path / "campaign.toml").write_text(text, encoding="utf-8")
        if not (tmp_path / "run.csv").exists():
            write_csv(tmp_path / "run.csv", tiny_channels() if channels is None else channels)
        return tmp_path

    return write
