"""Nothing outside the elements branches on an effect by its name: what is asked of one, it declares."""

import ast
from pathlib import Path

import pytest

import isojax
from isojax._parameters import own_parameters
from isojax.elements import CATALOGUE

SOURCE = Path(isojax.__file__).parent
# The simulated bench shares nothing with the elements; paper.py builds the models of the paper.
FILES = [
    path
    for path in sorted(SOURCE.rglob("*.py"))
    if path.relative_to(SOURCE).parts[0] not in ("elements", "rig", "paper.py")
]
NAMES = set(CATALOGUE) | {
    f"{name}.{field}" for name, kind in CATALOGUE.items() for field, _ in own_parameters(kind)
}


def constants(tree: ast.AST) -> set[str]:
    """String constants of a file, those inside formatted strings and match statements included."""
    return {
        node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    }


def test_the_search_sees_a_name():
    assert constants(ast.parse('if element.name == "clipping":\n    pass')) & NAMES
    assert constants(ast.parse('model["linear_stiffness.coefficient"]')) & NAMES
    assert len(FILES) > 150


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(SOURCE)))
def test_no_file_outside_the_elements_names_an_effect(path):
    assert not constants(ast.parse(path.read_text(encoding="utf-8"))) & NAMES
