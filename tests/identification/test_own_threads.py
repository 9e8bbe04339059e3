"""isojax shares its work among threads itself; BLAS adds none to them, and has its own again afterwards."""

import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from isojax import _cores, rig
from isojax._cores import in_own_threads
from isojax.identification import classical_guess, diagnose, fit


def _threads() -> set[int]:
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


def test_blas_has_one_thread_inside_and_as_many_as_before_afterwards():
    @in_own_threads
    def work(number, *, fails=False):
        if fails:
            raise ArithmeticError(number)
        return number, _threads()

    with threadpool_limits(3, user_api="blas"):
        assert work(2) == (2, {1})
        assert _threads() == {3}
        with pytest.raises(ArithmeticError, match="2"):
            work(2, fails=True)
        assert _threads() == {3}


@pytest.mark.parametrize("given", [None, "4"])
def test_threads_share_what_they_free_unless_the_user_has_set_how(monkeypatch, given):
    asked = []

    class Library:
        def mallopt(self, option, value):
            asked.append((option, value))

    monkeypatch.setattr(_cores, "_glibc", Library)
    monkeypatch.delenv("MALLOC_ARENA_MAX", raising=False)
    if given is not None:
        monkeypatch.setenv("MALLOC_ARENA_MAX", given)
    _cores._share_freed_memory.cache_clear()
    in_own_threads(lambda: None)()
    in_own_threads(lambda: None)()
    # M_ARENA_MAX of malloc.h, once for the process.
    assert asked == ([(-8, 2)] if given is None else [])
    _cores._share_freed_memory.cache_clear()


def test_the_last_of_several_threads_gives_blas_its_threads_back(monkeypatch):
    # Some builds of BLAS hide from one thread what another has set, so that the calls themselves are counted.
    calls: list[str] = []

    class Controller:
        @contextmanager
        def limit(self, **limits):
            calls.append(f"held to {limits}")
            yield
            calls.append("given back")

    monkeypatch.setattr(_cores, "ThreadpoolController", Controller)
    first_is_inside, second_is_inside, first_is_done = (threading.Event() for _ in range(3))

    @in_own_threads
    def first():
        first_is_inside.set()
        assert second_is_inside.wait(60.0)

    @in_own_threads
    def second():
        second_is_inside.set()
        assert first_is_done.wait(60.0)
        return list(calls)

    held = "held to {'limits': 1, 'user_api': 'blas'}"
    with ThreadPoolExecutor(2) as pool:
        begun = pool.submit(first)
        assert first_is_inside.wait(60.0)
        later = pool.submit(second)
        begun.result(60.0)
        first_is_done.set()
        assert later.result(60.0) == [held]
    assert calls == [held, "given back"]


def test_a_fit_and_its_diagnosis_hold_blas_to_one_thread(simulated):
    campaign = simulated(rig.y_plant(), rig.SteppedSine((60.0, 120.0), (4.6, 5.4), 12, ("forward",)), 5)
    seen: list[set[int]] = []

    def progress(line: str) -> None:
        seen.append(_threads())

    with threadpool_limits(2, user_api="blas"):
        fitted = fit(classical_guess(campaign), campaign, progress=progress)
        steps = len(seen)
        diagnose(fitted, progress=progress)
        assert _threads() == {2}
    assert 0 < steps < len(seen)
    assert all(one == {1} for one in seen)
