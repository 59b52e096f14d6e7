"""A law as plain values, as the log of a run keeps it, and back.

The function of a `Rule` comes back from its text, which may be anybody's: before it is made a function again, what is
not arithmetic of its arguments is refused, by a list of what is allowed.
"""

from __future__ import annotations

import ast
import linecache
import math
from collections.abc import Mapping
from dataclasses import MISSING, fields
from hashlib import sha256
from typing import Any

import numpy as np

from upright.errors import BadInput
from upright.laws.linear import FORMER, Law
from upright.laws.rule import KNOWN, Function, Rule

_CALLED = {name: getattr(math, name) for name in sorted(KNOWN)} | {
    made.__name__: made for made in (abs, min, max, float, int, range, len, round, bool)
}
_ALLOWED = (
    ast.Module, ast.FunctionDef, ast.arguments, ast.arg, ast.Return, ast.Assign, ast.AugAssign, ast.AnnAssign, ast.Expr,
    ast.If, ast.For, ast.While, ast.Break, ast.Continue, ast.Pass, ast.BoolOp, ast.BinOp, ast.UnaryOp, ast.IfExp,
    ast.Compare, ast.Call, ast.Constant, ast.Name, ast.Tuple, ast.List, ast.Subscript, ast.Slice, ast.Starred,
    ast.Load, ast.Store, ast.boolop, ast.operator, ast.unaryop, ast.cmpop, ast.ListComp, ast.GeneratorExp,
    ast.comprehension,
)  # fmt: skip
"""No attributes, imports, lambdas or texts with fields: nothing from which more than numbers can be reached."""


def as_values(law: Law | Rule) -> dict[str, Any]:
    """Plain values of a law, for JSON: default values are omitted."""
    out: dict[str, Any] = {"kind": "linear" if isinstance(law, Law) else "rule"}
    for field in fields(law):
        value = getattr(law, field.name)
        if field.name == "function":
            out["text"] = law.compiled_in.text  # type: ignore[union-attr]
        elif field.default is MISSING or isinstance(value, np.ndarray) or value != field.default:
            out[field.name] = value if isinstance(value, str) else np.asarray(value).tolist()
    return out


def of_values(values: Mapping[str, Any]) -> Law | Rule:
    """The law again, to the last bit.

    Raises
    ------
    BadInput
        When the values are no law's.
    """
    stored: dict[str, Any] = {FORMER[n][0] if n in FORMER else n: value for n, value in values.items()}
    kind = stored.pop("kind", None)
    try:
        stored |= {n: tuple(stored[n]) for n in ("measured", "reference_names") if n in stored}
        if kind == "linear":
            if np.shape(stored["C"])[1] == 0:  # rows of no numbers are none in a list
                stored |= {"A": np.zeros((0, 0)), "B": np.zeros((0, np.shape(stored["D"])[1]))}
            stored |= {n: np.asarray(stored[n], dtype=np.float64) for n in (*"ABCD", "begin") if n in stored}
            return Law(**stored)
        if kind == "rule":
            return Rule(function=_function(str(stored.pop("text"))), **stored)
    except (TypeError, ValueError, KeyError, IndexError, RecursionError, MemoryError) as error:
        if isinstance(error, BadInput):
            raise
        raise BadInput(f"the values are no law's ({error}); write them with upright.laws.as_values.") from None
    raise BadInput(f"a law's kind is 'linear' or 'rule', got {kind!r}; write it with upright.laws.as_values.")


def _function(text: str) -> Function:
    """Function of a rule's text, which `text_of` gives back."""
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise BadInput(f"the text of the rule is no Python ({error}).") from None
    made = tree.body[0] if len(tree.body) == 1 else None
    if not isinstance(made, ast.FunctionDef) or made.decorator_list or made.args.defaults or made.args.kw_defaults:
        raise BadInput("the text of the rule is not run: it is not one plain function.")
    if strange := sorted({word for node in ast.walk(tree) if (word := _strange(node))}):
        raise BadInput(f"the text of the rule is not run: it has {', '.join(strange)}, where numbers are enough.")
    file = f"<rule {sha256(text.encode()).hexdigest()[:16]}>"
    linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)  # where `inspect` looks for it
    space: dict[str, Any] = {"__builtins__": {}, **_CALLED}
    exec(compile(tree, file, "exec"), space)
    return space[made.name]


def _strange(node: ast.AST) -> str:
    """What a part of a rule's text has that no arithmetic needs; empty when it has nothing."""
    if not isinstance(node, _ALLOWED):
        return type(node).__name__
    if (isinstance(node, ast.arg) and node.annotation) or (isinstance(node, ast.FunctionDef) and node.returns):
        return "annotations"
    if isinstance(node, ast.Call) and not (isinstance(node.func, ast.Name) and node.func.id in _CALLED):
        return f"a call of {ast.unparse(node.func)[:40]}"
    if isinstance(node, ast.Constant) and isinstance(node.value, str | bytes):
        return "text"
    return "names with __" if isinstance(node, ast.Name) and "__" in node.id else ""
