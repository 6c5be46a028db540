"""Syntax formula to typed formula: finds the type of each variable, the id of each constant, and every mistake."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias, assert_never

from mlnlite.errors import Diagnostic, did_you_mean
from mlnlite.model import formulas as typed
from mlnlite.model.formulas import Argument
from mlnlite.model.numbers import comparison_constants, comparison_predicate, holds, number_of
from mlnlite.model.symbols import Predicate
from mlnlite.source import Span
from mlnlite.syntax import tree
from mlnlite.syntax.walk import comparison_variables

_Build: TypeAlias = Callable[[], typed.Expression]


@dataclass(slots=True)
class Constants:
    """Constants of each type in order of appearance: name -> id."""

    ids: dict[str, dict[str, int]] = field(default_factory=dict)

    def id(self, type_name: str, constant: str) -> int:
        """Id of a constant, a new one if it was not there."""
        of_type = self.ids.setdefault(type_name, {})
        return of_type.setdefault(constant, len(of_type))


@dataclass(slots=True)
class _Variable:
    name: str
    type: str | None = None
    bound: bool = False
    plus: bool = False
    span: Span | None = None


@dataclass(slots=True)
class FormulaTyper:
    """Types one formula. `mistakes` collects what is wrong; the result is only good if nothing was added to it.

    Free variables come in order of appearance; a hole is a free variable, its number in `holes`. A comparison of
    numbers becomes an atom of a predicate of its own, which is added to `comparisons`.
    """

    predicates: Mapping[str, Predicate]
    constants: Constants
    mistakes: list[Diagnostic]
    variables: list[_Variable] = field(default_factory=list)
    comparisons: dict[str, Predicate] = field(default_factory=dict)
    holes: dict[int, int] = field(default_factory=dict)
    atoms: dict[typed.AtomSchema, int] = field(default_factory=dict)
    _scopes: list[dict[str, int]] = field(default_factory=lambda: [{}])
    _equalities: list[tuple[tree.Equality, Argument | str, Argument | str]] = field(default_factory=list)

    def typed(self, formula: tree.Formula) -> typed.Formula | None:
        """The typed formula, or None if there was a mistake."""
        before = len(self.mistakes)
        build = self._formula(formula)
        self._spread_types()
        for variable in self.variables:
            if variable.type is None:
                self._untyped(variable)
        if len(self.mistakes) > before:
            return None
        body = build()
        variables = tuple(typed.TypedVariable(v.name, v.type or "", v.bound) for v in self.variables)
        return typed.Formula(variables, tuple(self.atoms), body)

    def keys(self) -> tuple[int, ...]:
        """Indices of the `+` variables."""
        return tuple(i for i, v in enumerate(self.variables) if v.plus)

    # --- the walk: finds variables and types, returns what builds the expression once all types are known

    def _formula(self, formula: tree.Formula) -> _Build:
        match formula:
            case tree.Atom():
                return self._atom(formula)
            case tree.Equality():
                return self._equality(formula)
            case tree.Not(operand):
                inside = self._formula(operand)
                return lambda: typed.Not(inside())
            case tree.And(operands):
                parts = [self._formula(f) for f in operands]
                return lambda: typed.All(tuple(p() for p in parts))
            case tree.Or(operands):
                parts = [self._formula(f) for f in operands]
                return lambda: typed.Any(tuple(p() for p in parts))
            case tree.Implies(body, head):
                left, right = self._formula(body), self._formula(head)
                return lambda: typed.Any((typed.Not(left()), right()))
            case tree.Iff(left_formula, right_formula):
                left, right = self._formula(left_formula), self._formula(right_formula)
                return lambda: typed.Iff(left(), right())
            case tree.Quantified():
                return self._quantifier(formula)
            case tree.Comparison():
                return self._comparison(formula)
            case tree.Count():
                return self._count(formula)
            case _:
                assert_never(formula)

    def _comparison(self, formula: tree.Comparison) -> _Build:
        for constant in comparison_constants(formula):
            if number_of(constant.name) is None:
                hint = "constants are compared as numbers; `=` compares any"
                self._mistake("E210", f"{constant.name} is no number", constant.span or formula.span, hint, "a number")
        indices = tuple(dict.fromkeys(self._variable(v) for v in comparison_variables(formula)))
        if not indices:
            return lambda: typed.All(()) if bool(holds(formula, ())) else typed.Any(())

        def build() -> typed.Expression:
            place = {self.variables[i].name: n for n, i in enumerate(indices)}
            types = tuple(self.variables[i].type or "" for i in indices)
            predicate = comparison_predicate(formula, place, types)
            self.comparisons.setdefault(predicate.name, predicate)
            schema = typed.AtomSchema(predicate.name, tuple(map(typed.Var, indices)))
            return typed.AtomRef(self.atoms.setdefault(schema, len(self.atoms)))

        return build

    def _count(self, formula: tree.Count) -> _Build:
        own = {name: self._new(_Variable(name, bound=True, span=formula.span)) for name in formula.variables}
        self._scopes.append(own)
        inside = self._formula(formula.body)
        self._scopes.pop()
        indices, number = tuple(own.values()), formula.number
        bounds = {"<=": (0, number), "<": (0, number - 1), ">=": (number, None), ">": (number + 1, None)}
        low, high = bounds.get(formula.operator, (number, number))
        if formula.operator == "!=":
            return lambda: typed.Not(typed.Count(indices, inside(), low, high))
        return lambda: typed.Count(indices, inside(), low, high)

    def _quantifier(self, formula: tree.Quantified) -> _Build:
        own = {name: self._new(_Variable(name, bound=True, span=formula.span)) for name in formula.variables}
        self._scopes.append(own)
        inside = self._formula(formula.body)
        self._scopes.pop()
        indices = tuple(own.values())
        if formula.quantifier == "exist":
            return lambda: typed.Exists(indices, inside())
        return lambda: typed.Not(typed.Exists(indices, typed.Not(inside())))

    def _atom(self, atom: tree.Atom) -> _Build:
        predicate = self.predicates.get(atom.predicate)
        if predicate is None:
            hint = did_you_mean(atom.predicate, list(self.predicates)) or (
                f"declare it: {atom.predicate}"
                + (f"({', '.join('type' for _ in atom.arguments)})" * bool(atom.arguments))
            )
            self._mistake("E202", f"the predicate {atom.predicate} is not declared", atom.span, hint, "a predicate")
        elif len(atom.arguments) != predicate.arity:
            found = f"{len(atom.arguments)} argument{'s' * (len(atom.arguments) != 1)}"
            message = f"{predicate.name} takes {predicate.arity}, found {found}"
            self._mistake("E203", message, atom.span, f"it is declared as {predicate}", str(predicate))
            predicate = None
        if predicate is None:
            for term in atom.arguments:
                self._unchecked(term)
            return lambda: typed.All(())
        pairs = zip(atom.arguments, predicate.types, strict=True)
        schema = typed.AtomSchema(predicate.name, tuple(self._term(t, type_name) for t, type_name in pairs))
        index = self.atoms.setdefault(schema, len(self.atoms))
        return lambda: typed.AtomRef(index)

    def _equality(self, formula: tree.Equality) -> _Build:
        left, right = (self._side(t) for t in (formula.left, formula.right))
        self._equalities.append((formula, left, right))
        if isinstance(left, str) and isinstance(right, str):
            return lambda: typed.All(()) if left == right else typed.Any(())

        def build() -> typed.Expression:
            return typed.Equal(self._resolved(left, right), self._resolved(right, left))

        return build

    def _side(self, term: tree.Term) -> Argument | str:
        return term.name if isinstance(term, tree.Constant) else typed.Var(self._variable(term))

    def _resolved(self, side: Argument | str, other: Argument | str) -> Argument:
        if not isinstance(side, str):
            return side
        assert isinstance(other, typed.Var)
        return typed.Const(self.constants.id(self.variables[other.index].type or "", side))

    # --- terms

    def _term(self, term: tree.Term, type_name: str) -> Argument:
        if isinstance(term, tree.Constant):
            return typed.Const(self.constants.id(type_name, term.name))
        index = self._variable(term)
        self._set_type(index, type_name, term.span)
        return typed.Var(index)

    def _unchecked(self, term: tree.Term) -> None:
        """Notes a variable of an atom that is wrong, with a type that stops further messages about it."""
        if not isinstance(term, tree.Constant):
            variable = self.variables[self._variable(term)]
            variable.type = variable.type or "?"

    def _variable(self, term: tree.Variable | tree.Hole) -> int:
        if isinstance(term, tree.Hole):
            index = self._new(_Variable(f"{term.index}", plus=True, span=term.span))
            self.holes[term.index] = index
            return index
        for scope in reversed(self._scopes):
            if term.name in scope:
                index = scope[term.name]
                if term.plus and scope is not self._scopes[0]:
                    self._mistake(
                        "E208", f"+{term.name} is bound by a quantifier", term.span, "remove the plus sign", term.name
                    )
                self.variables[index].plus |= term.plus and scope is self._scopes[0]
                return index
        index = self._scopes[0][term.name] = self._new(_Variable(term.name, plus=term.plus, span=term.span))
        return index

    def _new(self, variable: _Variable) -> int:
        self.variables.append(variable)
        return len(self.variables) - 1

    def _set_type(self, index: int, type_name: str, span: Span | None) -> None:
        variable = self.variables[index]
        if variable.type in (None, "?"):
            variable.type = type_name
        elif variable.type != type_name:
            message = (
                f"the variable {variable.name} is a {variable.type} elsewhere in this formula and a {type_name} here"
            )
            self._mistake("E204", message, span, "a variable has one type; use two variables", f"a {type_name}")

    def _spread_types(self) -> None:
        """Gives variables that stand only in equalities the type of the other side."""
        changed = True
        while changed:
            changed = False
            for formula, left, right in self._equalities:
                for a, b in ((left, right), (right, left)):
                    if isinstance(a, typed.Var) and isinstance(b, typed.Var) and self.variables[a.index].type:
                        changed |= self.variables[b.index].type is None
                        self._set_type(b.index, self.variables[a.index].type or "", formula.span)

    def _untyped(self, variable: _Variable) -> None:
        if variable.bound:
            message = f"the quantified variable {variable.name} stands in no atom of its scope"
        else:
            message = f"the variable {variable.name} stands in no atom, so its type is unknown"
        self._mistake("E205", message, variable.span, "use it in an atom, or remove it")

    def _mistake(self, code: str, message: str, span: Span | None, hint: str = "", expected: str = "") -> None:
        diagnostic = Diagnostic(code, message, span, hint, expected=expected)
        if diagnostic not in self.mistakes:
            self.mistakes.append(diagnostic)


def atoms_of(formula: tree.Formula) -> Iterator[tree.Atom]:
    """All atoms of a syntax formula, from left to right."""
    match formula:
        case tree.Atom():
            yield formula
        case tree.Equality() | tree.Comparison():
            return
        case tree.Not(operand):
            yield from atoms_of(operand)
        case tree.And(operands) | tree.Or(operands):
            for operand in operands:
                yield from atoms_of(operand)
        case tree.Implies(left, right) | tree.Iff(left, right):
            yield from atoms_of(left)
            yield from atoms_of(right)
        case tree.Quantified() | tree.Count():
            yield from atoms_of(formula.body)
        case _:
            assert_never(formula)
