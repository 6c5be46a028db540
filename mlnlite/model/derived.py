"""What follows from the constants of evidence: facts of comparisons; and whether constants are what a model needs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import Diagnostic
from mlnlite.model.evidence import Facts
from mlnlite.model.model import Model
from mlnlite.model.numbers import comparison_rows, number_mistakes, number_of
from mlnlite.model.symbols import Type


def compared(model: Model, types: Mapping[str, Type], present: Mapping[str, NDArray[np.bool_]]) -> dict[str, Facts]:
    """The facts of the predicates that stand for comparisons, for each database those about its constants."""
    found = {}
    for predicate in model.predicates.values():
        if predicate.comparison is None:
            continue
        n_databases = len(present[predicate.types[0]])
        rows = []
        for database in range(n_databases):
            ids = [np.flatnonzero(present[t][database]) for t in predicate.types]
            rows.append(comparison_rows(predicate, types, ids))
        number = np.repeat(np.arange(n_databases, dtype=np.int32), [len(r) for r in rows])
        arguments = np.concatenate(rows)
        found[predicate.name] = Facts(number, arguments, np.ones(len(arguments), np.bool_))
    return found


def verify_constants(model: Model, types: Mapping[str, Type]) -> Iterator[Diagnostic]:
    """What is wrong with constants: compared or used as weights without being numbers, or more than were counted."""
    yield from number_mistakes([p for p in model.predicates.values() if p.comparison], types)
    for template in model.templates:
        if template.number is None:
            continue
        name = template.formula.variables[template.keys[template.number]].type
        wrong = [c for c in types[name].constants if number_of(c) is None]
        if wrong:
            message = (
                f"{wrong[0]} is a constant of {name} and no number, but {template.name} takes its weight from them"
            )
            yield Diagnostic("E314", message, template.span, "give the numbers a type of their own")
    for name in sorted(model.sized):
        if len(types[name].constants) > len(model.types[name].constants):
            message = f"a weight depends on domSize({name}), and the evidence adds constants to {name}"
            hint = f"declare all constants of {name} in the model"
            yield Diagnostic("E316", message, hint=hint)
