"""Names and docstrings: each class name has one meaning, each docstring says what is returned."""

import ast
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = ('src', 'test', 'tools', 'benchmarks')
FILES = [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob('*.py'))]
VAGUE = ('Give ', 'Gives ', 'Say ', 'Tell ', 'Have ', 'Take ', 'Takes ')


def test_no_two_classes_share_a_name():
    trees = [ast.parse(path.read_text()) for path in FILES]
    names = Counter(
        node.name for tree in trees for node in tree.body if isinstance(node, ast.ClassDef)
    )
    assert len(names) > 100
    assert [name for name, count in names.items() if count > 1] == []


@pytest.mark.parametrize('folder', FOLDERS)
def test_no_docstring_begins_with_a_vague_verb(folder):
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
    vague = [
        f'{path.name}:{node.lineno}'
        for path in FILES
        if path.is_relative_to(ROOT / folder)
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, kinds) and (ast.get_docstring(node) or '').startswith(VAGUE)
    ]
    assert vague == []
