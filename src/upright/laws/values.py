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
from upright.laws.linear import Law
from upright.laws.rule import KNOWN, Function, Rule

_BUILT_IN = (abs, min, max, float, int, range, len, round, bool)
_ALLOWED = (
    ast.Module, ast.FunctionDef, ast.arguments, ast.arg, ast.Return, ast.Assign, ast.AugAssign, ast.AnnAssign, ast.Expr,
    ast.If, ast.For, ast.While, ast.Break, ast.Continue, ast.Pass, ast.BoolOp, ast.BinOp, ast.UnaryOp, ast.IfExp,
    ast.Compare, ast.Call, ast.Constant, ast.Name, ast.Tuple, ast.List, ast.Subscript, ast.Slice, ast.Starred,
    ast.Load, ast.Store, ast.boolop, ast.operator, ast.unaryop, ast.cmpop, ast.ListComp, ast.GeneratorExp,
    ast.comprehension,
)  # fmt: skip
"""No attributes, imports, lambdas or texts with fields: nothing from which more than numbers can be reached."""


def as_values(law: Law | Rule) -> dict[str, Any]:
    """Plain values of a law, for JSON: what is as it would be without being said is left out."""
    out: dict[str, Any] = {"kind": "linear" if isinstance(law, Law) else "rule"}
    for field in fields(law):
        value = getattr(law, field.name)
        if field.name == "function":
            out["text"] = law.compiled_in.text  # type: ignore[union-attr]
        elif field.name != "_" and (field.default is MISSING or not _same(value, field.default)):
            out[field.name] = np.asarray(value).tolist() if not isinstance(value, str | tuple) else _plain(value)
    return out


def of_values(values: Mapping[str, Any]) -> Law | Rule:
    """The law again, to the last bit.

    Raises
    ------
    BadInput
        When the values are no law's.
    """
    given = dict(values)
    kind = given.pop("kind", None)
    try:
        if kind == "linear":
            z = np.shape(given["C"])[1] if np.ndim(given["C"]) > 1 else 0
            for name, width in (("A", z), ("B", np.shape(given["D"])[1])):
                given[name] = np.asarray(given[name], dtype=np.float64).reshape(-1, width, *np.shape(given[name])[2:])
            if given.get("begin") is not None:
                given["begin"] = np.asarray(given["begin"], dtype=np.float64)
            names = {name: tuple(given[name]) for name in ("measured", "reference_names") if name in given}
            return Law(**{**given, **names})
        if kind == "rule":
            return Rule(function=_function(str(given.pop("text"))), **given)
    except (TypeError, ValueError, KeyError, IndexError) as error:
        if isinstance(error, BadInput):
            raise
        raise BadInput(f"the values are no law's ({error}); write them with upright.laws.as_values.") from None
    raise BadInput(f"a law's kind is 'linear' or 'rule', got {kind!r}; write it with upright.laws.as_values.")


def _same(value: Any, default: Any) -> bool:
    if value is None or default is None or isinstance(default, str | tuple):
        return type(value) is type(default) and value == default
    return np.ndim(value) == 0 and value == default


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _function(text: str) -> Function:
    """Function of a rule's text, which it can be asked for again."""
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise BadInput(f"the text of the rule is no Python ({error}).") from None
    called = {node.func.id for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}
    strange = {type(node).__name__ for node in ast.walk(tree) if not isinstance(node, _ALLOWED)}
    strange |= {f"a call of {name}" for name in called - KNOWN - {f.__name__ for f in _BUILT_IN}}
    strange |= {
        "a call of no name"
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and not isinstance(node.func, ast.Name)
    }
    strange |= {
        "a text" for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str | bytes)
    }
    strange |= {"a name with __" for node in ast.walk(tree) if isinstance(node, ast.Name) and "__" in node.id}
    if len(tree.body) != 1 or not isinstance(tree.body[0], ast.FunctionDef):
        strange.add("something beside one function")
    elif tree.body[0].decorator_list or tree.body[0].args.defaults or tree.body[0].args.kw_defaults:
        strange.add("decorators or defaults")
    if strange:
        raise BadInput(
            f"the text of the rule is not run: it has {', '.join(sorted(strange))}, where numbers are enough."
        )
    file = f"<rule {sha256(text.encode()).hexdigest()[:16]}>"
    linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)  # where `inspect` looks for it
    known = {name: getattr(math, name) for name in KNOWN} | {f.__name__: f for f in _BUILT_IN}
    space: dict[str, Any] = {"__builtins__": {}, **known}
    exec(compile(tree, file, "exec"), space)
    return space[tree.body[0].name]  # type: ignore[union-attr]
