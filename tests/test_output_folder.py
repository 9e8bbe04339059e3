"""The folder that a run fills: one run at a time, files of one run at a time, and no result lost."""

import os
import signal
import subprocess
import sys
import time

import pytest

from isojax import _output_folder
from isojax._output_folder import KeptElsewhereError, kept_file, output_folder, publish

HOLD = """
import importlib.util, sys, time
spec = importlib.util.spec_from_file_location("output_folder", sys.argv[1])
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
with module.output_folder(sys.argv[2]):
    print("held", flush=True)
    time.sleep(60)
"""


def visible(folder):
    return sorted(entry.name for entry in folder.iterdir() if not entry.name.startswith("."))


def test_a_folder_is_refused_while_another_run_holds_it_and_free_once_that_was_killed(tmp_path):
    out = tmp_path / "out"
    other = subprocess.Popen(
        [sys.executable, "-c", HOLD, _output_folder.__file__, str(out)], stdout=subprocess.PIPE, text=True
    )
    try:
        assert other.stdout is not None
        assert other.stdout.readline() == "held\n"
        with pytest.raises(ValueError, match="in use by another run"), output_folder(out):
            pass
    finally:
        other.send_signal(signal.SIGKILL)
        other.communicate()
    with output_folder(out):
        publish(out, {"model.json": "of the second run"})
    assert visible(out) == ["model.json"]


def test_a_run_that_leaves_nothing_leaves_no_folder(tmp_path):
    with pytest.raises(RuntimeError), output_folder(tmp_path / "a" / "b"):
        raise RuntimeError
    assert not list(tmp_path.iterdir())
    (tmp_path / "mine").mkdir()
    with output_folder(tmp_path / "mine"):
        pass
    assert not list((tmp_path / "mine").iterdir())


def test_what_an_unfinished_run_keeps_stays(tmp_path):
    with output_folder(tmp_path / "out") as folder:
        kept_file(folder).write_text("answers")
    assert kept_file(tmp_path / "out").read_text() == "answers"


def test_a_folder_that_cannot_be_written_to_is_refused_at_once(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: path != tmp_path)
    with pytest.raises(ValueError, match="cannot be written to"), output_folder(tmp_path / "out"):
        pass
    assert not list(tmp_path.iterdir())


def test_a_full_disk_is_seen_before_the_work(tmp_path, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("tempfile.TemporaryFile", full)
    with pytest.raises(ValueError, match="No space left"), output_folder(tmp_path / "out"):
        pass
    assert not list(tmp_path.iterdir())


def test_files_of_an_earlier_run_go_and_those_of_others_stay(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "report.html").write_text("mine, too")
    publish(tmp_path, {"model.json": "1", "fit.txt": "1"}, ("report.html", "fit.txt", "model.json"))
    assert visible(tmp_path) == ["fit.txt", "model.json", "notes.txt", "report.html"]
    publish(tmp_path, {"model.json": None, "report.html": "2"}, ("report.html", "fit.txt", "model.json"))
    assert visible(tmp_path) == ["notes.txt", "report.html"]
    assert (tmp_path / "report.html").read_text() == "2"
    publish(tmp_path, {"map.npz": b"3"}, ("folds.png",))
    assert visible(tmp_path) == ["map.npz", "notes.txt", "report.html"]


def test_at_no_moment_files_of_two_runs_stand_together(tmp_path, monkeypatch):
    names = ("model.json", "report.html", "result.json")
    publish(tmp_path, dict.fromkeys(names, "old"), names)
    seen = []

    def watch(work):
        def watched(*args, **options):
            seen.append({(tmp_path / name).read_text() for name in visible(tmp_path)})
            return work(*args, **options)

        return watched

    monkeypatch.setattr(os, "replace", watch(os.replace))
    monkeypatch.setattr("pathlib.Path.unlink", watch(_output_folder.Path.unlink))
    publish(tmp_path, dict.fromkeys(names, "new"), names)
    assert len(seen) == 6
    assert all(len(contents) <= 1 for contents in seen)
    assert {(tmp_path / name).read_text() for name in names} == {"new"}


def test_a_disk_that_fills_up_keeps_the_result_elsewhere_and_says_where(tmp_path, monkeypatch):
    out, other = tmp_path / "out", tmp_path / "other"
    other.mkdir()
    publish(out, {"result.json": "old"})
    write = _output_folder._write

    def full(path, content):
        if out in path.parents:
            raise OSError(28, "No space left on device")
        write(path, content)

    monkeypatch.setattr(_output_folder, "_write", full)
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(other))
    with pytest.raises(KeptElsewhereError, match="No space left") as failed:
        publish(out, {"result.json": "new", "model.json": "new"})
    (kept,) = other.iterdir()
    assert str(kept) in str(failed.value)
    assert visible(kept) == ["model.json", "result.json"]
    assert visible(out) == ["result.json"]
    assert (out / "result.json").read_text() == "old"


INTERRUPTED = """
import importlib.util, signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where a shell runs the tests beside others
from concurrent.futures import ThreadPoolExecutor
spec = importlib.util.spec_from_file_location("interrupt", sys.argv[1])
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
module._PATIENCE = 0.2
with module.prompt_interrupt(lambda: "interrupted; nothing is written"), ThreadPoolExecutor(1) as pool:
    pool.submit(time.sleep, 60)
    print("running", flush=True)
    time.sleep(60)
"""


def test_ctrl_c_ends_a_run_whose_threads_cannot_be_stopped():
    from isojax import _interrupt

    run = subprocess.Popen(
        [sys.executable, "-c", INTERRUPTED, _interrupt.__file__],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert run.stdout is not None
    try:
        assert run.stdout.readline() == "running\n"
        begin = time.perf_counter()
        run.send_signal(signal.SIGINT)
        _, said = run.communicate(timeout=30)
    finally:
        run.kill()
    assert time.perf_counter() - begin < 20.0
    assert run.returncode == _interrupt.INTERRUPTED
    assert said == "\nisojax: interrupted; nothing is written\n"
