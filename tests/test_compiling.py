"""The flag that makes XLA compile more quickly."""

import os
import subprocess
import sys

import jax
import jax.numpy as jnp
import jaxlib.version
import pytest

import isojax as ij
from isojax._compiling import compiled_code_folder
from isojax._quick_jit import quick_jit

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


@pytest.fixture
def settings():
    """JAX's settings of its cache, put back afterwards."""
    names = ("jax_compilation_cache_dir", "jax_persistent_cache_min_compile_time_secs")
    before = {name: jax.config.values[name] for name in names}
    yield
    for name, value in before.items():
        jax.config.update(name, value)


@pytest.mark.skipif(sys.platform != "linux", reason="asks for the folder that Linux has")
def test_compiled_code_is_kept_in_the_users_cache_folder(settings, monkeypatch, tmp_path):
    monkeypatch.delenv("ISOJAX_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    jax.config.update("jax_compilation_cache_dir", None)
    assert compiled_code_folder() == tmp_path / "cache" / "isojax"
    assert (tmp_path / "cache" / "isojax").is_dir()


def test_a_folder_that_the_user_chose_is_taken_or_none(settings, monkeypatch, tmp_path):
    monkeypatch.setenv("ISOJAX_CACHE", str(tmp_path / "own"))
    assert compiled_code_folder() == tmp_path / "own"
    monkeypatch.setenv("ISOJAX_CACHE", "")
    assert compiled_code_folder() is None
    monkeypatch.delenv("ISOJAX_CACHE")
    jax.config.update("jax_compilation_cache_dir", str(tmp_path / "of JAX"))
    assert compiled_code_folder() == tmp_path / "of JAX"


def test_where_nothing_can_be_written_nothing_is_kept(settings, monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("ISOJAX_CACHE", str(tmp_path / "file" / "below"))
    assert compiled_code_folder() is None


def test_a_function_compiled_quickly_may_be_compiled_mapped_and_differentiated_by_others():
    # An option that the flag of the process does not hold already.
    cube = quick_jit(lambda x: x * x * x, {"xla_cpu_prefer_vector_width": 256})
    ways = {
        "alone": (cube, 8.0),
        "compiled": (jax.jit(cube), 8.0),
        "forwards": (jax.jacfwd(cube), 12.0),
        "backwards": (jax.grad(cube), 12.0),
        "twice": (jax.jacfwd(jax.grad(cube)), 12.0),
        "backwards over forwards": (jax.grad(jax.jacfwd(cube)), 12.0),
        "backwards by the direction": (jax.grad(lambda v: jax.jvp(cube, (2.0,), (v,))[1]), 12.0),
        "compiled derivative": (jax.jit(jax.grad(cube)), 12.0),
        "mapped": (lambda x: jax.vmap(cube)(jnp.stack([x, x]))[1], 8.0),
        "mapped derivative": (lambda x: jax.vmap(jax.grad(cube))(jnp.stack([x, x]))[1], 12.0),
        "in a loop": (lambda x: jax.lax.fori_loop(0, 1, lambda _, y: cube(y), x), 8.0),
    }
    for words, (way, expected) in ways.items():
        assert float(way(jnp.asarray(2.0))) == pytest.approx(expected), words
