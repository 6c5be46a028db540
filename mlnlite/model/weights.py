"""Weight expressions to numbers: `2.2`, `logx(0.9)`, `log(0.8/0.2)`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import assert_never

from mlnlite.errors import Diagnostic
from mlnlite.source import Span
from mlnlite.syntax.tree import Arithmetic, Call, Number, NumberOf, Size, WeightExpression

LOG_OF_ZERO = -100.0
"""What `logx(0)` is: probability e^-100. (pracmln's value, kept so that its files mean the same.)"""


def logx(p: float) -> float:
    """Natural logarithm, with `LOG_OF_ZERO` at zero."""
    return LOG_OF_ZERO if p == 0 else log(p)


def log(x: float) -> float:
    """Natural logarithm.

    Raises:
        ValueError: if `x` is not positive.
    """
    if not x > 0:
        raise ValueError(f"log needs a positive number, found {x:g}")
    return math.log(x)


def logit(p: float) -> float:
    """`log(p / (1 - p))`.

    Raises:
        ValueError: if `p` is not between 0 and 1.
    """
    if not 0 < p < 1:
        raise ValueError(f"logit needs a probability between 0 and 1, found {p:g}")
    return math.log(p / (1 - p))


def sqrt(x: float) -> float:
    """Square root.

    Raises:
        ValueError: if `x` is negative.
    """
    if x < 0:
        raise ValueError(f"sqrt needs a number that is not negative, found {x:g}")
    return math.sqrt(x)


FUNCTIONS: Mapping[str, Callable[[float], float]] = {
    "logx": logx,
    "log": log,
    "ln": log,
    "exp": math.exp,
    "sqrt": sqrt,
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
            if len(arguments) != 1:
                raise ValueError(f"{function} takes one number, found {len(arguments)}")
            return FUNCTIONS[function](evaluate(arguments[0]))
        case Size() | NumberOf():
            raise AssertionError("replaced before")
        case _:
            assert_never(weight)


def checked_weight(weight: WeightExpression, span: Span | None, mistakes: list[Diagnostic]) -> float:
    """Value of a weight expression; a mistake is added to `mistakes` and gives 0.

    Args:
        weight: the expression.
        span: of its formula, for an expression that has none of its own.
        mistakes: what is wrong so far.
    """
    span = weight.span or span
    try:
        value = evaluate(weight)
    except ZeroDivisionError:
        mistakes.append(
            Diagnostic("E220", "this weight has no value: it divides by zero", span, expected="a finite number")
        )
        return 0.0
    except (ValueError, OverflowError) as error:
        mistakes.append(Diagnostic("E220", f"this weight has no value: {error}", span, expected="a finite number"))
        return 0.0
    if math.isnan(value) or value == -math.inf:
        hint = "a formula that must never hold is written as its negation with a final dot"
        mistakes.append(Diagnostic("E221", f"a weight cannot be {value}", span, hint, expected="a finite number"))
        return 0.0
    return value
