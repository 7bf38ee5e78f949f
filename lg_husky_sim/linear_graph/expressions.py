# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Text expressions of element values and laws, parsed with a whitelist.

An expression is made of names, numbers, ``+ - * / **``, parentheses, the constant ``pi`` and
the functions of :data:`FUNCTIONS`; nothing else is ever compiled or evaluated.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from functools import lru_cache
import keyword
import math
import operator
import re
from types import CodeType
from typing import Any, TypeGuard

from lg_husky_sim.errors import GraphError

FUNCTIONS: Mapping[str, Any] = {
    'sqrt': math.sqrt, 'sin': math.sin, 'cos': math.cos, 'tan': math.tan, 'atan': math.atan,
    'tanh': math.tanh, 'exp': math.exp, 'abs': abs}
CONSTANTS: Mapping[str, float] = {'pi': math.pi}
GLOBALS: Mapping[str, Any] = {'__builtins__': {}, **FUNCTIONS, **CONSTANTS}
NO_NUMBERS = ('nan', 'inf', 'infinity')
MAX_LENGTH = 500
MAX_DEPTH = 40
MAX_EXPONENT = 16.0

_BINARY: Mapping[type[ast.operator], Callable[[float, float], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
    ast.Div: operator.truediv, ast.Pow: operator.pow}
_UNARY = (ast.UAdd, ast.USub)


def why_no_name(text: object) -> str:
    """Return why the text cannot name a parameter, an input or an element; '' if it can."""
    if not (isinstance(text, str) and text.isascii() and text.isidentifier()
            and not text.startswith('__')):
        return 'must be ASCII letters, digits and underscores, and not start with a digit'
    if keyword.iskeyword(text):
        return 'is a reserved word; choose another name'
    if text in CONSTANTS:
        return 'is a constant of expressions; choose another name'
    if text in FUNCTIONS:
        return 'is a function of expressions; choose another name'
    if text.lower() in NO_NUMBERS:
        return 'is no finite number and no name; write a number or another name'
    return ''


@lru_cache(maxsize=4096)
def parse(text: str) -> ast.expr:
    """
    Parse one expression and refuse whatever is not on the whitelist.

    Parameters
    ----------
    text : str
        For example ``'k_t*GR'`` or ``'1/r_W'``.

    Returns
    -------
    ast.expr
        The checked syntax tree; do not change it, it is shared.

    Raises
    ------
    GraphError
        If the text is no such expression, or a constant in it cannot be evaluated.

    """
    if len(text) > MAX_LENGTH:
        raise GraphError(f'expression of {len(text)} characters is longer than {MAX_LENGTH}')
    shown = repr(text)
    try:
        tree = ast.parse(text.strip(), mode='eval').body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        if words := [word for word in re.findall(r'\w+', text) if keyword.iskeyword(word)]:
            raise GraphError(f'expression {shown} cannot be read: {words[0]!r} is a reserved '
                             'word; choose another name') from error
        raise GraphError(f'expression {shown} cannot be read: it must be made of names, numbers, '
                         f'+ - * / ** and {", ".join(FUNCTIONS)}') from error
    _check(tree, shown, MAX_DEPTH)
    try:
        _constant(tree)
    except (ArithmeticError, ValueError) as error:
        why = 'division by zero' if isinstance(error, ZeroDivisionError) else (
            'too large' if isinstance(error, OverflowError) else 'not real')
        raise GraphError(f'expression {shown} cannot be evaluated: {why}') from error
    return tree


def _constant(node: ast.expr) -> float | None:
    """
    Return the value of a checked expression without names, or None.

    Raises
    ------
    OverflowError, ZeroDivisionError, ValueError
        If such an expression, or one inside it, has no finite real value.

    """
    value: float | complex | None = None
    match node:
        case ast.Constant(value=int() | float() as number):
            value = float(number)
        case ast.Name(id=name):
            value = CONSTANTS.get(name)
        case ast.UnaryOp(op=op, operand=operand):
            value = _constant(operand)
            if value is not None and isinstance(op, ast.USub):
                value = -value
        case ast.Call(func=ast.Name(id=name), args=[argument]):
            inner = _constant(argument)
            value = None if inner is None else FUNCTIONS[name](inner)
        case ast.BinOp(left=left, op=op, right=right):
            one, two = _constant(left), _constant(right)
            if isinstance(op, ast.Div) and two == 0.0:
                raise ZeroDivisionError
            if one is not None and two is not None:
                value = _BINARY[type(op)](one, two)
    if isinstance(value, complex):
        raise ValueError
    if value is not None and not math.isfinite(value):
        raise OverflowError
    return value


def _check(node: ast.expr, shown: str, depth: int) -> None:
    if depth <= 0:
        raise GraphError(f'expression {shown} is nested deeper than {MAX_DEPTH} levels')
    if isinstance(node, ast.BinOp) and isinstance(node.op, tuple(_BINARY)):
        _check(node.left, shown, depth - 1)
        _check(node.right, shown, depth - 1)
        if isinstance(node.op, ast.Pow):
            exponent = number_of(node.right)
            if exponent is None or abs(exponent) > MAX_EXPONENT:
                raise GraphError(f'expression {shown}: an exponent must be a number of at most '
                                 f'{MAX_EXPONENT:g} in size')
        return
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, _UNARY):
        _check(node.operand, shown, depth - 1)
        return
    if isinstance(node, ast.Constant) and is_number(node.value):
        if not abs(node.value) < 1e300:
            raise GraphError(f'expression {shown}: a number in it is too large')
        return
    if isinstance(node, ast.Name):
        if node.id in FUNCTIONS:
            raise GraphError(f'expression {shown}: {node.id} is a function and needs an argument')
        if node.id not in CONSTANTS and (why := why_no_name(node.id)):
            raise GraphError(f'expression {shown}: {node.id!r} {why}')
        return
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        if node.func.id not in FUNCTIONS:
            raise GraphError(f'expression {shown}: unknown function {node.func.id!r}; '
                             f'there are {", ".join(FUNCTIONS)}')
        if len(node.args) != 1 or node.keywords:
            raise GraphError(f'expression {shown}: {node.func.id} takes exactly one argument')
        _check(node.args[0], shown, depth - 1)
        return
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.BitXor):
        raise GraphError(f'expression {shown}: write ** in place of ^ for a power')
    raise GraphError(f'expression {shown}: {type(node).__name__} is not allowed; use names, '
                     f'numbers, + - * / ** and {", ".join(FUNCTIONS)}')


def is_number(value: object) -> TypeGuard[float]:
    """Tell a literal int or float from booleans, complex numbers and text."""
    return type(value) in (int, float)


def number_of(node: ast.expr) -> float | None:
    """Return the value of a literal number with its sign, or None for anything else."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, _UNARY):
        inner = number_of(node.operand)
        if inner is None:
            return None
        return -inner if isinstance(node.op, ast.USub) else inner
    if isinstance(node, ast.Constant) and is_number(node.value):
        return float(node.value)
    return None


def names_in(text: str) -> tuple[str, ...]:
    """Return the parameters of an expression in order of appearance, each once."""
    found: dict[str, None] = {}

    def visit(node: ast.AST) -> None:
        if isinstance(node, ast.Name) and node.id not in FUNCTIONS and node.id not in CONSTANTS:
            found.setdefault(node.id)
        for child in ast.iter_child_nodes(node):
            visit(child)
    visit(parse(text))
    return tuple(found)


def compile_tuple(texts: tuple[str, ...]) -> CodeType:
    """
    Compile several expressions into one code object that evaluates to a tuple.

    Evaluate it with ``eval(code, dict(GLOBALS), values)``.
    """
    elements = [parse(text) for text in texts]
    tree = ast.fix_missing_locations(
        ast.Expression(body=ast.Tuple(elts=elements, ctx=ast.Load())))
    return compile(tree, '<linear graph>', 'eval')


def evaluate(text: str, values: Mapping[str, float]) -> float:
    """
    Evaluate one expression.

    Raises
    ------
    NameError, ZeroDivisionError, ValueError, OverflowError
        As Python's arithmetic raises them.

    """
    # only what parse() has checked is ever compiled
    return float(eval(compile_tuple((text,)), dict(GLOBALS), dict(values))[0])  # noqa: S307


def substituted(text: str, replacements: Mapping[str, str]) -> str:
    """Return the expression with names replaced by other expressions."""
    return _substituted(text, tuple(replacements.items()))


@lru_cache(maxsize=4096)
def _substituted(text: str, pairs: tuple[tuple[str, str], ...]) -> str:
    replacements = dict(pairs)

    class Replace(ast.NodeTransformer):
        def visit_Name(self, node: ast.Name) -> ast.expr:
            return parse(replacements[node.id]) if node.id in replacements else node

        def visit_Call(self, node: ast.Call) -> ast.Call:
            return ast.Call(func=node.func, args=[self.visit(node.args[0])], keywords=[])
    # parse again: a transformer changes its tree, and parsed trees are shared
    tree = ast.parse(ast.unparse(parse(text)), mode='eval').body
    return ast.unparse(Replace().visit(tree))


def linear_coefficients(text: str, variables: tuple[str, ...]) -> dict[str, str] | None:
    """
    Split an expression that is linear and homogeneous in some of its names.

    Parameters
    ----------
    text : str
        The expression.
    variables : tuple of str
        The names in which linearity is asked.

    Returns
    -------
    dict or None
        Coefficient (an expression free of the variables) of each variable that occurs;
        None if the expression is not linear, or has a constant term.

    """
    coefficients = _linear(text, frozenset(variables))
    return None if coefficients is None else dict(coefficients)


@lru_cache(maxsize=4096)
def _linear(text: str, variables: frozenset[str]) -> dict[str, str] | None:
    split = _affine(parse(text), variables)
    return None if split is None or split[0] is not None else split[1]


def _affine(node: ast.expr, variables: frozenset[str],
            ) -> tuple[str | None, dict[str, str]] | None:
    """Return (constant or None, coefficients), or None if not affine."""
    text = ast.unparse(node)
    if not variables & set(names_in(text)):
        return (None if number_of(node) == 0.0 else f'({text})'), {}
    if isinstance(node, ast.Name):
        return None, {node.id: '1'}
    if isinstance(node, ast.UnaryOp):
        inner = _affine(node.operand, variables)
        if inner is None or isinstance(node.op, ast.UAdd):
            return inner
        return _scaled(inner, '-{}')
    if isinstance(node, ast.BinOp):
        left, right = _affine(node.left, variables), _affine(node.right, variables)
        if left is None or right is None:
            return None
        if isinstance(node.op, ast.Add | ast.Sub):
            return _added(left, _scaled(right, '-{}') if isinstance(node.op, ast.Sub) else right)
        if isinstance(node.op, ast.Mult) and not (left[1] and right[1]):
            factor, other = (right[0], left) if left[1] else (left[0], right)
            return (None, {}) if factor is None else _scaled(other, '{}*' + factor)
        if isinstance(node.op, ast.Div) and not right[1]:
            return _scaled(left, '{}/' + (right[0] or '(0)'))
    return None


def _scaled(split: tuple[str | None, dict[str, str]], pattern: str,
            ) -> tuple[str | None, dict[str, str]]:
    constant, coefficients = split
    return (None if constant is None else '(' + pattern.format(constant) + ')',
            {name: '(' + pattern.format(text) + ')' for name, text in coefficients.items()})


def _added(left: tuple[str | None, dict[str, str]], right: tuple[str | None, dict[str, str]],
           ) -> tuple[str | None, dict[str, str]]:
    constant = left[0] if right[0] is None else (
        right[0] if left[0] is None else f'({left[0]}+{right[0]})')
    coefficients = dict(left[1])
    for name, text in right[1].items():
        coefficients[name] = f'({coefficients[name]}+{text})' if name in coefficients else text
    return constant, coefficients
