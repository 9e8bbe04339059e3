"""No input hangs, fills the memory, or ends with an exception that is not ours: 200 and more, by kind."""

import json
import re
import select
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hostile_reader import CASES

SECONDS, BYTES = 60.0, 1.5 * 2**30
OURS = re.compile(r"^(/|declaration|run\b|Argument `|Field `)")
FOREIGN = re.compile(r"Traceback|tokenizing|object at 0x|<class|Errno")

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="counts memory as Linux does")


@pytest.fixture(scope="module")
def ask() -> Iterator[Callable[[str], dict]]:
    """Asks a process of its own to read an input; one that does not answer is ended and begun again."""
    held: list[subprocess.Popen] = []

    def answer(name: str) -> dict:
        if not held or held[-1].poll() is not None:
            script = Path(__file__).with_name("hostile_reader.py")
            held.append(
                subprocess.Popen(
                    [sys.executable, str(script)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
                )
            )
        child = held[-1]
        assert child.stdin is not None
        assert child.stdout is not None
        print(json.dumps(name), file=child.stdin, flush=True)
        if not select.select([child.stdout], [], [], SECONDS + 30.0)[0]:
            child.kill()
            child.wait()
            pytest.fail(f"no answer after {SECONDS + 30.0:g} s")
        line = child.stdout.readline()
        assert line, f"the process ended with {child.wait()}"
        return json.loads(line)

    yield answer
    for child in held:
        child.kill()
        child.communicate()


@pytest.mark.parametrize("name", CASES)
def test_a_hostile_input_is_read_or_refused_in_our_words(name: str, ask: Callable[[str], dict]) -> None:
    found, expected = ask(name), CASES[name][1]
    assert found["seconds"] < SECONDS
    assert found["bytes"] < BYTES
    if expected is None:
        assert found["kind"] == "read", found["said"]
        return
    assert found["kind"] == "ValueError", found
    assert re.search(expected, found["said"]), found["said"]
    assert OURS.search(found["said"]), found["said"]
    assert FOREIGN.search(found["said"]) is None, found["said"]
    assert len(found["said"]) < 4000


def test_the_corpus_holds_two_hundred_inputs() -> None:
    assert len(CASES) >= 200
