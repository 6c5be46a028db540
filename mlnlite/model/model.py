"""A `Model` is a checked program: vocabulary and templates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from mlnlite.errors import Diagnostic
from mlnlite.model.symbols import Predicate, Type
from mlnlite.model.templates import Template
from mlnlite.syntax.tree import Dialect, Origin


@dataclass(frozen=True, slots=True)
class Model:
    """A Markov logic network.

    Attributes:
        types: by name, with the constants that the model declares or mentions.
        predicates: by name.
        templates: the weighted formulas.
        dialect: which dialect it was written in.
        warnings: what the check found strange.
        sized: types whose number of constants some weight depends on (`domSize`): evidence cannot add to them.
        origin: the language that it was read from, and why it was taken for it.
    """

    types: Mapping[str, Type]
    predicates: Mapping[str, Predicate]
    templates: tuple[Template, ...]
    dialect: Dialect = "standard"
    warnings: tuple[Diagnostic, ...] = field(default=(), compare=False, repr=False)
    sized: frozenset[str] = frozenset()
    origin: Origin | None = field(default=None, compare=False, repr=False)
