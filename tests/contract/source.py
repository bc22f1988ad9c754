"""The source as syntax trees, each file parsed once for all tests."""

import ast
from functools import cache
from pathlib import Path


@cache
def tree(file: Path) -> ast.Module:
    """The syntax tree of a Python file. Do not change it."""
    return ast.parse(file.read_text(encoding="utf-8"), str(file))


@cache
def nodes(file: Path) -> tuple[ast.AST, ...]:
    """All of its nodes, in the order of `ast.walk`."""
    return tuple(ast.walk(tree(file)))
