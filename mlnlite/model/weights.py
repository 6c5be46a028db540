"""Weight expressions to numbers: `2.2`, `logx(0.9)`, `log(0.8/0.2)`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import assert_never

from mlnlite.errors import Diagnostic
from mlnlite.syntax.tree import Arithmetic, Call, Number, WeightExpression

LOG_OF_ZERO = -100.0
"""What `logx(0)` is: probability e^-100. (pracmln's value, kept so that its files mean the same.)"""


def logx(p: float) -> float:
    """Natural logarithm, with `LOG_OF_ZERO` at zero."""
    return LOG_OF_ZERO if p == 0 else math.log(p)


def logit(p: float) -> float:
    """`log(p / (1 - p))`."""
    return math.log(p / (1 - p))


FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "logx": logx,
    "log": math.log,
    "ln": math.log,
    "exp": math.exp,
    "sqrt": math.sqrt,
    "logit": logit,
    "abs": abs,
}

OPERATORS: Mapping[str, Callable[[float, float], float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "^": lambda a, b: a**b,
}


def evaluate(weight: WeightExpression) -> float:
    """Value of a weight expression.

    Raises:
        ValueError: with a sentence for the user, if it has none.
    """
    match weight:
        case Number(value):
            return value
        case Arithmetic(operator, left, right):
            return OPERATORS[operator](0.0 if left is None else evaluate(left), evaluate(right))
        case Call(function, arguments):
            if function not in FUNCTIONS:
                raise ValueError(f"there is no function {function} for weights; there are {', '.join(FUNCTIONS)}")
            return float(FUNCTIONS[function](*map(evaluate, arguments)))
        case _:
            assert_never(weight)


def checked_weight(weight: WeightExpression, mistakes: list[Diagnostic]) -> float:
    """Value of a weight expression; a mistake is added to `mistakes` and gives 0."""
    try:
        value = evaluate(weight)
    except (ValueError, ZeroDivisionError, OverflowError, TypeError) as error:
        mistakes.append(Diagnostic("E220", f"this weight has no value: {error}", weight.span))
        return 0.0
    if math.isnan(value) or value == -math.inf:
        hint = "a formula that must never hold is written as its negation with a final dot"
        mistakes.append(Diagnostic("E221", f"a weight cannot be {value}", weight.span, hint))
        return 0.0
    return value
