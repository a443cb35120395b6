# SPDX-License-Identifier: Apache-2.0
"""Mutants of a module: its tree with one operator, number or statement changed."""

from __future__ import annotations

import ast
import copy
from collections.abc import Callable, Iterator
from typing import Any

SWAPS: dict[type, list[type]] = {
    ast.Lt: [ast.LtE, ast.Gt],
    ast.LtE: [ast.Lt, ast.Gt],
    ast.Gt: [ast.GtE, ast.Lt],
    ast.GtE: [ast.Gt, ast.Lt],
    ast.Eq: [ast.NotEq],
    ast.NotEq: [ast.Eq],
    ast.Is: [ast.IsNot],
    ast.IsNot: [ast.Is],
    ast.In: [ast.NotIn],
    ast.NotIn: [ast.In],
    ast.Add: [ast.Sub],
    ast.Sub: [ast.Add],
    ast.Mult: [ast.Div],
    ast.Div: [ast.Mult],
    ast.Mod: [ast.Mult],
    ast.BitOr: [ast.BitAnd],
    ast.BitAnd: [ast.BitOr],
    ast.And: [ast.Or],
    ast.Or: [ast.And],
}
OPPOSITES = {
    "min": "max", "max": "min", "cos": "sin", "sin": "cos", "floor": "ceil", "ceil": "floor",
    "any": "all", "all": "any",
}  # fmt: skip


Change = Callable[[Any], object]  # breaks one thing in the node that it is given


def mutants(tree: ast.Module) -> Iterator[tuple[int, str, ast.Module]]:
    """Yield (line, what was changed, changed tree), one change each."""
    for index, change in sites(tree):
        yield mutant(tree, index, change)


def sites(tree: ast.Module) -> Iterator[tuple[int, Change]]:
    """Yield the number of a node and a change of it, for each mutant."""
    skipped = {id(node) for root in _annotations(tree) for node in ast.walk(root)}
    for index, node in enumerate(ast.walk(tree)):
        for change in _changes(node) if id(node) not in skipped else ():
            yield index, change


def mutant(tree: ast.Module, index: int, change: Change) -> tuple[int, str, ast.Module]:
    """The line, what was changed and the changed tree of one of the sites."""
    changed = copy.deepcopy(tree)
    target: Any = next(n for i, n in enumerate(ast.walk(changed)) if i == index)
    before = ast.unparse(target).split("\n")[0]
    change(target)
    after = ast.unparse(target).split("\n")[0]
    return target.lineno, f"{before}  ->  {after}", ast.fix_missing_locations(changed)


def _annotations(tree: ast.Module) -> Iterator[ast.AST]:
    """Yield type annotations and decorators: changing them has no effect on values."""
    for node in ast.walk(tree):
        yield from getattr(node, "decorator_list", [])
        for name in ("annotation", "returns"):
            if getattr(node, name, None) is not None:
                yield getattr(node, name)


def _changes(node: ast.AST) -> Iterator[Any]:
    """Yield functions that each break one thing in a node of this shape."""
    if isinstance(node, ast.Compare):
        for index, op in enumerate(node.ops):
            for other in SWAPS[type(op)]:
                yield lambda n, i=index, o=other: n.ops.__setitem__(i, o())
    elif isinstance(node, (ast.BinOp, ast.BoolOp, ast.AugAssign)):
        for other in SWAPS.get(type(node.op), []):
            yield lambda n, o=other: setattr(n, "op", o())
    elif isinstance(node, ast.UnaryOp):
        yield lambda n: _replace(n, n.operand)
    elif isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        if isinstance(node.value, bool):
            yield lambda n: setattr(n, "value", not n.value)
        else:
            yield lambda n: setattr(n, "value", n.value + 1)
            yield lambda n: setattr(n, "value", n.value / 2 if n.value % 2 else n.value // 2 - 1)
    elif isinstance(node, ast.Call):
        name = node.func.attr if isinstance(node.func, ast.Attribute) else ""
        name = node.func.id if isinstance(node.func, ast.Name) else name
        if name in OPPOSITES:
            yield lambda n: _rename(n.func, OPPOSITES[name])
    elif isinstance(node, (ast.If, ast.IfExp, ast.While)):
        yield lambda n: setattr(n, "test", ast.UnaryOp(ast.Not(), n.test))
    elif isinstance(node, (ast.FunctionDef, ast.For, ast.With)):
        for index, line in enumerate(node.body):
            docstring = isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant)
            if isinstance(line, (ast.Assign, ast.AugAssign, ast.Expr)) and not docstring:
                yield lambda n, i=index: _delete(n, i)


def _replace(node: Any, other: ast.AST) -> None:
    node.__class__ = other.__class__
    node.__dict__ = other.__dict__


def _rename(function: Any, name: str) -> None:
    setattr(function, "attr" if isinstance(function, ast.Attribute) else "id", name)


def _delete(node: Any, index: int) -> None:
    node.lineno = node.body[index].lineno
    node.body[index] = ast.Pass()
