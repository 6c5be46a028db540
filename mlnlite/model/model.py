"""A `Model` is a checked program: vocabulary and templates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from mlnlite.errors import Diagnostic
from mlnlite.model.symbols import Predicate, Type
from mlnlite.model.templates import Template
from mlnlite.syntax.tree import Dialect


@dataclass(frozen=True, slots=True)
class Model:
    """A Markov logic network.

    Attributes:
        types: by name, with the constants that the model declares or mentions.
        predicates: by name.
        templates: the weighted formulas.
        dialect: which dialect it was written in.
        warnings: what the check found strange.
    """

    types: Mapping[str, Type]
    predicates: Mapping[str, Predicate]
    templates: tuple[Template, ...]
    dialect: Dialect = "standard"
    warnings: tuple[Diagnostic, ...] = field(default=(), compare=False, repr=False)
