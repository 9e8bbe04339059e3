"""Answers kept in a file: a loop that was killed at any moment goes on and ends with the same digits."""

import json
import sys
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
import isojax
from isojax._kept import digest, kept_answers, recall
from isojax._progress import Resumed, Stage
from isojax.reporting import result_dict
from kill_and_resume import cut_demo

CANDIDATES = ("coulomb_friction", "dahl_friction", "cubic_damping")
"""Effects that the loop here looks for: one of them is in the demo."""


class Questions:
    """A deterministic task of three questions, which counts what it computes."""

    def __init__(self):
        self.computed = []
        self.said = []

    def ask(self, path, identity="one", times=3):
        keep = kept_answers(path, {"campaign": identity}, self.said.append) if path else nullcontext()
        with keep:
            return [self._answer(place) for place in range(times)]

    def _answer(self, place):
        def compute():
            self.computed.append(place)
            return (np.full((2, 3), 0.1 * place).T, np.array(place))

        return recall("answer", compute, place)


def asked(path, **options):
    task = Questions()
    return task.ask(path, **options), task


def test_what_was_kept_is_given_and_not_computed(tmp_path):
    first, task = asked(tmp_path / "answers")
    assert task.computed == [0, 1, 2]
    again, task = asked(tmp_path / "answers", times=4)
    assert task.computed == [3]
    assert [type(line) for line in task.said] == [Resumed]
    for old, new in zip(first, again[:3], strict=True):
        for one, other in zip(old, new, strict=True):
            np.testing.assert_array_equal(one, other)
            assert one.flags.c_contiguous
            assert (one.strides, one.dtype) == (other.strides, other.dtype)


def test_a_file_cut_off_anywhere_gives_the_whole_answers_before_the_cut(tmp_path):
    whole, _ = asked(tmp_path / "whole")
    content = (tmp_path / "whole").read_bytes()
    cut = tmp_path / "cut"
    known = set()
    for size in range(0, len(content) + 1, 7):
        cut.write_bytes(content[:size])
        answers, task = asked(cut)
        known.add(3 - len(task.computed))
        assert all(np.array_equal(a[0], b[0]) for a, b in zip(answers, whole, strict=True))
        assert cut.read_bytes() == content
    assert known == {0, 1, 2, 3} - ({3} if len(content) % 7 else set())


def test_a_damaged_answer_is_computed_again(tmp_path):
    whole, _ = asked(tmp_path / "answers")
    content = bytearray((tmp_path / "answers").read_bytes())
    content[-60] ^= 1
    (tmp_path / "answers").write_bytes(content)
    answers, task = asked(tmp_path / "answers")
    assert task.computed == [2]
    np.testing.assert_array_equal(answers[2][0], whole[2][0])


def test_answers_of_another_campaign_are_not_used_and_it_is_said(tmp_path):
    asked(tmp_path / "answers")
    _, task = asked(tmp_path / "answers", identity="another")
    assert task.computed == [0, 1, 2]
    assert task.said == ["what was kept belongs to another campaign: beginning anew"]


def test_a_full_disk_ends_the_keeping_and_not_the_work(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("isojax._kept._write_entry", full)
    answers, task = asked(tmp_path / "answers")
    assert [int(one[1]) for one in answers] == [0, 1, 2]
    assert task.said == ["nothing more can be kept (No space left on device): going on without"]


def test_nothing_is_kept_where_nothing_is_asked_for(tmp_path):
    _, task = asked(None)
    assert task.computed == [0, 1, 2]
    assert task.said == []


def test_digest_distinguishes_values_and_not_places_in_memory(tmp_path):
    campaign = isojax.read_campaign(cut_demo(tmp_path / "one", dwells=2))
    moved = isojax.read_campaign(cut_demo(tmp_path / "two", dwells=2))
    assert digest(campaign) == digest(moved)
    other = isojax.read_campaign(cut_demo(tmp_path / "three", dwells=3))
    assert digest(campaign) != digest(other)
    words = {digest(part) for part in (1, 1.0, "1", (1,), [1], None, np.ones(1), np.ones(1, np.float32))}
    assert len(words) == 8


@pytest.mark.slow
def test_a_loop_that_was_cut_off_at_any_moment_ends_with_the_same_digits(tmp_path):
    campaign = isojax.read_campaign(cut_demo(tmp_path / "campaign", dwells=2))
    path = tmp_path / "answers"
    stages = []
    others = tuple(name for name in isojax.CATALOGUE if name not in CANDIDATES)

    def closed(said):
        def hear(line):
            said.append(line)
            if isinstance(line, Stage) and said is stages:
                sizes[line] = path.stat().st_size if path.exists() else 0

        loop = isojax.close_loop(campaign, checkpoint=path, progress=hear, excluded=others).loop
        result = result_dict(loop)
        del result["seconds"]
        return json.dumps(result)

    sizes: dict[str, int] = {}
    expected = closed(stages)
    content = path.read_bytes()
    assert len(sizes) >= 5
    # What kill -9 leaves is the file up to some byte: at the ends of stages, and two moments within one.
    ends = sorted({*sizes.values()} - {0})
    for size in sorted({ends[0], ends[len(ends) // 2], len(content) // 3, len(content) - 1000}):
        path.write_bytes(content[:size])
        said: list[str] = []
        assert closed(said) == expected
        assert path.read_bytes() == content
        assert any(isinstance(line, Resumed) for line in said) == (size < len(content))
