"""Conditions on the columns of a row, such as `mode == 0` or `abs(bx) < 60000`: a tiny language, nothing is executed.

Comparisons, `and`, `or`, `not`, `abs`, sums and products of columns and numbers; texts are compared with == and !=.
A comparison with a cell that is not measured is neither true nor false, and such a row stays.
"""

import ast
import operator
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

_COMPARE: dict[type, Callable] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
_ARITHMETIC: dict[type, Callable] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Mod: operator.mod,
}
_LONGEST = 500
Known = tuple[np.ndarray, np.ndarray]
"""Truth of each row, and whether it is known."""


@dataclass(frozen=True)
class Condition:
    """A condition that a row must meet to count."""

    text: str
    tree: ast.expr
    columns: tuple[str, ...]
    """Columns whose numbers it reads, in their order."""
    texts: frozenset[str]
    """Those of them that it compares with texts."""

    def violated(self, columns: dict[str, np.ndarray]) -> np.ndarray:
        """Whether each row is known not to meet it; numbers [rows] by name, texts as arrays of objects."""
        size = len(next(iter(columns.values())))
        truth, known = _logic(self.tree, columns, size)
        return known & ~truth


def parsed_condition(text: str) -> Condition:
    """Returns the condition of a text; ValueError with what it does not allow."""
    if len(text) > _LONGEST:
        raise ValueError(f"expected at most {_LONGEST} characters")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ValueError(f'{text!r} is no condition; expected one such as "mode == 0" or "abs(bx) < 60000"') from None
    names: list[str] = []
    texts: set[str] = set()
    _check_logic(tree, names, texts)
    if not names:
        raise ValueError(f"{text!r} names no column")
    return Condition(text.strip(), tree, tuple(dict.fromkeys(names)), frozenset(texts))


def _check_logic(node: ast.expr, names: list[str], texts: set[str]) -> None:
    if isinstance(node, ast.BoolOp):
        for value in node.values:
            _check_logic(value, names, texts)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        _check_logic(node.operand, names, texts)
    elif isinstance(node, ast.Compare):
        sides = [node.left, *node.comparators]
        words = any(isinstance(side, ast.Constant) and isinstance(side.value, str) for side in sides)
        for op in node.ops:
            if type(op) not in _COMPARE or (words and not isinstance(op, ast.Eq | ast.NotEq)):
                raise ValueError(
                    f"{ast.unparse(node)!r} is no comparison of columns with numbers, or with texts by ==, !="
                )
        for side in sides:
            if words and isinstance(side, ast.Name):
                names.append(side.id)
                texts.add(side.id)
            elif not (words and isinstance(side, ast.Constant)):
                _check_number(side, names)
    else:
        raise ValueError(f"{ast.unparse(node)!r} is no comparison")


def _check_number(node: ast.expr, names: list[str]) -> None:
    if isinstance(node, ast.Name):
        names.append(node.id)
    elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return
    elif isinstance(node, ast.BinOp) and type(node.op) in _ARITHMETIC:
        _check_number(node.left, names)
        _check_number(node.right, names)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
        _check_number(node.operand, names)
    elif _is_abs(node):
        _check_number(node.args[0], names)  # type: ignore[attr-defined]
    else:
        raise ValueError(f"{ast.unparse(node)!r} is not allowed; only columns, numbers, + - * / %, abs()")


def _is_abs(node: ast.expr) -> bool:
    return (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id == "abs"
        and len(node.args) == 1
        and not node.keywords
    )


def _logic(node: ast.expr, columns: dict[str, np.ndarray], size: int) -> Known:
    """By Kleene's three-valued logic."""
    if isinstance(node, ast.BoolOp):
        parts = [_logic(value, columns, size) for value in node.values]
        holds = isinstance(node.op, ast.And)
        # One known false decides an `and`, one known true an `or`, whatever the others are.
        decided = np.any([known & (truth != holds) for truth, known in parts], axis=0)
        truth = np.where(decided, not holds, holds)
        return truth, decided | np.all([known for _, known in parts], axis=0)
    if isinstance(node, ast.UnaryOp):
        truth, known = _logic(node.operand, columns, size)
        return ~truth, known
    assert isinstance(node, ast.Compare)
    sides = [_value(side, columns, size) for side in (node.left, *node.comparators)]
    truth, known = np.ones(size, dtype=bool), np.ones(size, dtype=bool)
    for op, left, right in zip(node.ops, sides, sides[1:], strict=False):
        truth &= _COMPARE[type(op)](left, right).astype(bool)
    for side in sides:
        known &= (side != "") if side.dtype == object else ~np.isnan(side)
    return truth, known


def _value(node: ast.expr, columns: dict[str, np.ndarray], size: int) -> np.ndarray:
    if isinstance(node, ast.Name):
        return columns[node.id]
    if isinstance(node, ast.Constant):
        kind = object if isinstance(node.value, str) else float
        return np.full(size, node.value, dtype=kind)
    if isinstance(node, ast.BinOp):
        left, right = _value(node.left, columns, size), _value(node.right, columns, size)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            return _ARITHMETIC[type(node.op)](left, right)
    if isinstance(node, ast.UnaryOp):
        value = _value(node.operand, columns, size)
        return -value if isinstance(node.op, ast.USub) else value
    assert isinstance(node, ast.Call)
    return np.abs(_value(node.args[0], columns, size))
