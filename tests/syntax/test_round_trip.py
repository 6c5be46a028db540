"""`parse(write(t)) == t`, and the fast way of reading lines finds what the grammar finds."""

from __future__ import annotations

import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from mlnlite.source import Source
from mlnlite.syntax import parse, tree
from mlnlite.syntax.evidence import parse_evidence
from mlnlite.syntax.parse import parse_model
from mlnlite.syntax.queries import parse_atom_query
from mlnlite.syntax.write import write_evidence, write_formula, write_model, write_weight
from tests.strategies import evidence_programs, formulas, programs, weights

DIALECTS = ["standard", "prac"]


def read(text, dialect=None):
    return parse_model([Source("m.mln", text)], dialect)


@pytest.mark.parametrize("dialect", DIALECTS)
@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_program(dialect, data):
    program = data.draw(programs(dialect))
    assert read(write_model(program), dialect) == program


@pytest.mark.parametrize("dialect", DIALECTS)
@settings(max_examples=30, deadline=None)
@given(data=st.data())
def test_program_with_the_dialect_found_out(dialect, data):
    program = data.draw(programs(dialect))
    assert read(write_model(program)).statements == program.statements


@pytest.mark.parametrize("dialect", DIALECTS)
@settings(max_examples=30, deadline=None)
@given(data=st.data())
def test_lines_read_fast_and_lines_parsed_agree(dialect, data):
    text = write_model(data.draw(programs(dialect)))
    fast = read(text, dialect)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(parse, "read_row", lambda *_: False)
        assert read(text, dialect) == fast


@pytest.mark.parametrize("dialect", DIALECTS)
@settings(max_examples=60, deadline=None)
@given(formula=formulas())
def test_formula(dialect, formula):
    assert parse_atom_query(write_formula(formula, dialect), dialect) == formula


@settings(max_examples=60, deadline=None)
@given(formula=formulas(st.sampled_from([tree.Constant("Anna"), tree.Constant("3-2")])))
def test_written_formulas_read_the_same_in_both_dialects(formula):
    text = write_formula(formula, "standard")
    assume("EXIST " not in text and "FORALL " not in text)
    assert parse_atom_query(text, "standard") == parse_atom_query(text, "prac") == formula


@settings(max_examples=60, deadline=None)
@given(weight=weights)
@example(weight=tree.Arithmetic("-", tree.Number(float("inf")), tree.Call("log", (tree.Number(0.0),))))
def test_weight(weight):
    program = read(f"{write_weight(weight)} P(x)")
    assert program.statements == (tree.FormulaStatement(tree.Atom("P", (tree.Variable("x"),)), weight),)


@settings(max_examples=100, deadline=None)
@given(evidence=evidence_programs())
def test_evidence(evidence):
    assert parse_evidence(Source("e.db", write_evidence(evidence))) == evidence
