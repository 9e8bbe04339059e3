"""The flag that makes XLA compile more quickly."""

import os
import subprocess
import sys

import jaxlib.version
import pytest

import isojax as ij

FLAG = "--xla_cpu_use_fusion_emitters"

SCRIPT = """
import jax
jax.config.update("jax_enable_x64", True)
import isojax as ij
assert ij.compile_quickly()
print(float(jax.jit(lambda x: 2.0 * x)(21.0)))
"""


@pytest.mark.parametrize(
    ("before", "is_set", "after"),
    [
        ("", True, f"{FLAG}=false"),
        ("--xla_cpu_enable_fast_math=false", True, f"--xla_cpu_enable_fast_math=false {FLAG}=false"),
        (f"{FLAG}=true", False, f"{FLAG}=true"),
        (f"{FLAG}=false", True, f"{FLAG}=false"),
    ],
    ids=["none", "others", "chosen", "again"],
)
def test_the_flag_joins_those_that_are_there(monkeypatch, before, is_set, after):
    monkeypatch.setenv("XLA_FLAGS", before)
    assert ij.compile_quickly() is is_set
    assert os.environ["XLA_FLAGS"] == after


def test_a_jaxlib_that_was_not_tried_is_left_alone(monkeypatch):
    monkeypatch.setenv("XLA_FLAGS", "")
    monkeypatch.setattr(jaxlib.version, "__version_info__", (99, 0, 0))
    assert ij.compile_quickly() is False
    assert os.environ["XLA_FLAGS"] == ""


def test_xla_knows_the_flag():
    # XLA reads its flags once, and ends a process that has an unknown one.
    environment = {**os.environ, "XLA_FLAGS": ""}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "42.0"
