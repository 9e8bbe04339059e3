"""README.md stays short, its links lead somewhere, and its campaign is read; test_examples.py runs it."""

import re
import tomllib
from pathlib import Path

from isojax.records.reading._declaration import read_declaration

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_it_is_read_in_five_minutes():
    assert len(README.split()) < 800


def test_it_shows_one_picture_of_modest_size():
    (picture,) = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", README)
    assert (ROOT / picture).stat().st_size <= 150_000


def test_every_link_leads_somewhere():
    missing = [link for link in re.findall(r"\]\(([^)#]+)[^)]*\)", README) if not (ROOT / link).exists()]
    assert missing == []


def test_the_campaign_is_read_without_complaint(tmp_path):
    (text,) = re.findall(r"^```toml\n(.*?)^```$", README, flags=re.MULTILINE | re.DOTALL)
    assert len(text.splitlines()) <= 15
    (tmp_path / "campaign.toml").write_text(text, encoding="utf-8")
    declared = read_declaration(tmp_path)
    assert {record["role"] for record in declared.records} == {"fit", "holdout"}
    assert set(tomllib.loads(text)) == {"campaign", "input", "output", "sampling", "model", "record"}
