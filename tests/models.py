"""Hypothesis strategies for small random models with evidence, as text: what a user could have written."""

from __future__ import annotations

from hypothesis import strategies as st

DECLARATIONS = """P(a)
Q(a)
R(a, b)
F(a, c!)
G(a, c?)
a = {A1, A2}
b = {B1, B2}
c = {C1, C2, C3}
"""

VARIABLES = {"a": ("x", "y"), "b": ("z",), "c": ("u", "w")}
CONSTANTS = {"a": ("A1", "A2"), "b": ("B1", "B2"), "c": ("C1", "C2", "C3")}
PREDICATES = {"P": "a", "Q": "a", "R": "ab", "F": "ac", "G": "ac"}


@st.composite
def atoms(draw, predicates="PQRFG"):
    name = draw(st.sampled_from(predicates))
    terms = [draw(st.sampled_from(VARIABLES[t] * 3 + CONSTANTS[t])) for t in PREDICATES[name]]
    return f"{name}({', '.join(terms)})"


@st.composite
def literals(draw, predicates="PQRFG"):
    return draw(st.sampled_from(["", "!"])) + draw(atoms(predicates))


@st.composite
def formulas(draw, predicates="PQRFG"):
    """A formula with at most four atoms; equalities and quantifiers sometimes."""
    parts = draw(st.lists(literals(predicates), min_size=1, max_size=3))
    kind = draw(st.sampled_from(["or", "and", "implies", "iff", "mixed", "exist", "forall", "equal"]))
    if kind == "or":
        return " v ".join(parts)
    if kind == "and":
        return " ^ ".join(parts)
    if kind == "implies":
        return f"({' ^ '.join(parts)}) => {draw(literals(predicates))}"
    if kind == "iff":
        return f"({' v '.join(parts)}) <=> {draw(literals(predicates))}"
    if kind == "mixed":
        return f"({' ^ '.join(parts)}) v ({draw(literals(predicates))} ^ {draw(literals(predicates))})"
    if kind == "equal":
        sign = draw(st.sampled_from(["=", "!="]))
        return f"(P(x) ^ Q(y) ^ x {sign} y) => {draw(literals(predicates))}"
    body = draw(st.sampled_from(["R(x, z)", "(R(x, z) ^ !P(x))", "(R(x, z) v Q(y))"]))
    return f"({' ^ '.join(parts)}) => {'EXIST' if kind == 'exist' else 'FORALL'} z ({body})"


@st.composite
def model_texts(draw, predicates="PQRFG", hard=True, plus=True):
    lines = [DECLARATIONS]
    for _ in range(draw(st.integers(1, 3))):
        formula = draw(formulas(predicates))
        if plus and draw(st.booleans()):
            formula = _with_plus(formula, draw(st.sampled_from(["x", "u", "z"])))
        if hard and draw(st.integers(0, 4)) == 0:
            lines.append(f"({formula}).")
        else:
            weight = draw(st.sampled_from([-2.0, -1.5, -0.5, 0.25, 0.7, 1.0, 3.0]))
            lines.append(f"{weight} {formula}")
    return "\n".join(lines) + "\n"


def _with_plus(formula, variable):
    """`+x` for the first free occurrence of a variable in an atom, if there is one before any quantifier."""
    head = formula.split("EXIST")[0].split("FORALL")[0]
    for mark in (f"({variable},", f"({variable})", f" {variable})"):
        at = head.find(mark)
        if at >= 0 and not (variable == "z" and head != formula):
            return formula[: at + 1] + "+" + formula[at + 1 :]
    return formula


@st.composite
def evidence_texts(draw, predicates="PQRFG", complete=False):
    """Facts that do not contradict each other; complete: functional predicates `!` have their values."""
    lines = []
    for name in predicates:
        keys = PREDICATES[name]
        if name in "FG":
            for key in CONSTANTS["a"]:
                value = draw(st.sampled_from([*CONSTANTS["c"], *([] if complete and name == "F" else ["", "", ""])]))
                negative = draw(st.sampled_from(["", *CONSTANTS["c"]]))
                if value:
                    lines.append(f"{name}({key}, {value})")
                elif negative and not complete:
                    lines.append(f"!{name}({key}, {negative})")
            continue
        arguments = [()]
        for t in keys:
            arguments = [(*a, c) for a in arguments for c in CONSTANTS[t]]
        for a in arguments:
            sign = draw(st.sampled_from(["", "!", None]))
            if sign is not None:
                lines.append(f"{sign}{name}({', '.join(a)})")
    return "\n".join(lines) + "\n"
