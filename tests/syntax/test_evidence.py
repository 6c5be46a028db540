"""Evidence: facts as columns, databases, includes; and queries."""

from __future__ import annotations

import pytest

from mlnlite.errors import SyntaxMistake
from mlnlite.source import Source
from mlnlite.syntax.evidence import parse_evidence
from mlnlite.syntax.files import read_source
from mlnlite.syntax.parse import parse_atom_query, split_queries
from mlnlite.syntax.tree import Atom, Constant, TypeDeclaration


def read(text):
    return parse_evidence(Source("e.db", text))


def facts(table):
    """Predicate, rows, truth values of a table."""
    return table.predicate, list(zip(*(c.texts() for c in table.columns), strict=True)), table.truth.tolist()


def codes(text):
    with pytest.raises(SyntaxMistake) as caught:
        read(text)
    return [diagnostic.code for diagnostic in caught.value.diagnostics]


def test_facts():
    evidence = read('P(A,B)\n!P( x , 3-2 )\nQ("any text", -1)\n\n// none\nP(A)\nRain\n!Snow\n')
    assert [facts(table) for table in evidence.facts] == [
        ("P", [("A", "B"), ("x", "3-2")], [True, False]),
        ("Q", [("any text", "-1")], [True]),
        ("P", [("A",)], [True]),
        ("Rain", [], [True]),
        ("Snow", [], [False]),
    ]
    assert evidence.facts[0].offset.tolist() == [0, 7]
    assert evidence.facts[3].offset.tolist() == [53]


def test_equal_constants_are_one():
    (table,) = read('P(Anna)\nP(Anna)\n P("Anna")').facts
    assert table.columns[0].names == ["Anna"]


def test_numbers_that_are_truth_values():
    (table,) = read("1.0 P(A)\n0 P(B)\n0.0 !P(C)\n1 !P(D)").facts
    assert table.truth.tolist() == [True, False, True, False]


@pytest.mark.parametrize(
    ("text", "n_databases", "database"),
    [
        ("P(A)\n---\nP(B)", 2, [0, 1]),
        ("P(A)\n---\nP(B)\n---\n\n// end\n", 2, [0, 1]),
        ("P(A)\n---\n---\nP(B)", 3, [0, 2]),
        ("---\nP(A)", 2, [1]),
        ("P(A)\n--- \r\nP(B)\r\n", 2, [0, 1]),
    ],
)
def test_databases(text, n_databases, database):
    evidence = read(text)
    assert evidence.n_databases == n_databases
    assert evidence.facts[0].database.tolist() == database


def test_types():
    evidence = read("person = {Anna,\n  bob, // he\n  C}\nP(x)")
    assert evidence.types == (TypeDeclaration("person", tuple(map(Constant, ("Anna", "bob", "C")))),)


def test_include_belongs_to_the_current_database(tmp_path):
    (tmp_path / "a.db").write_text("P(A)\nP(B)")
    (tmp_path / "b.db").write_text('P(C)\n---\n#include "a.db"\nP(D)')
    outside, inside = parse_evidence(read_source(tmp_path / "b.db")).facts
    assert facts(outside) == ("P", [("C",), ("D",)], [True, True])
    assert facts(inside) == ("P", [("A",), ("B",)], [True, True])
    assert outside.database.tolist() == [0, 1]
    assert inside.database.tolist() == [1, 1]
    assert outside.offset.tolist() == [0, 25]
    assert inside.offset.tolist() == [0, 5]
    assert inside.source.name.endswith("a.db")


def test_every_mistake_is_reported():
    text = "P(A) P(B)\nP(A)\n0.7 P(C)\n?!P(D)\nP(?x)\nP(A).\n----\nP(A) v P(B)\nP(A"
    assert codes(text) == ["E141", "E145", "E146", "E143", "E147", "E142", "E103"]


def test_comments_do_not_hide_facts():
    (table,) = read("P(A) // P(B)\n/* P(C)\nP(D) */ P(E)\n").facts
    assert table.columns[0].texts() == ["A", "E"]
    assert codes("P(A)\n/* P(B)") == ["E113"]


# --- queries


@pytest.mark.parametrize(
    ("text", "items"),
    [
        ("Smokes", ["Smokes"]),
        ("Smokes, Friends(Ann, Bob)", ["Smokes", "Friends(Ann, Bob)"]),
        ("Smokes(Ann) ^ Smokes(Bob),Cancer(x)", ["Smokes(Ann) ^ Smokes(Bob)", "Cancer(x)"]),
        ("EXIST x, y (F(x, y)), P", ["EXIST x, y (F(x, y))", "P"]),
        ('P("a, b"), Q', ['P("a, b")', "Q"]),
    ],
)
def test_split_queries(text, items):
    assert split_queries(text) == items
    assert [parse_atom_query(item, "standard") for item in items]


@pytest.mark.parametrize("text", ["", " ", "P,", ",P", "P,,Q"])
def test_empty_items(text):
    with pytest.raises(SyntaxMistake, match="E150"):
        split_queries(text)


def test_queries():
    assert parse_atom_query(" Smokes ", "standard") == Atom("Smokes", ())
    assert parse_atom_query("grasp(x, to_pour)", "prac").arguments == (Constant("x"), Constant("to_pour"))
    for text in ("", "1 Smokes(Ann)", "Smokes(Ann).", "Smokes(Ann) Smokes(Bob)", "Smokes(Ann"):
        with pytest.raises(SyntaxMistake):
            parse_atom_query(text, "standard")
