"""Statements and lines: declarations against formulas, continuation, comments, dialects, includes."""

from __future__ import annotations

import pytest

from mlnlite.errors import SyntaxMistake
from mlnlite.source import Source
from mlnlite.syntax.parse import parse_model, read_source
from mlnlite.syntax.tree import (
    Argument,
    Atom,
    Constant,
    FormulaStatement,
    FormulaTable,
    Hole,
    Include,
    Number,
    PredicateDeclaration,
    TypeDeclaration,
    Variable,
)


def read(*texts, dialect=None):
    return parse_model([Source(f"m{i}.mln", text) for i, text in enumerate(texts)], dialect)


def codes(*texts, dialect=None):
    with pytest.raises(SyntaxMistake) as caught:
        read(*texts, dialect=dialect)
    return [diagnostic.code for diagnostic in caught.value.diagnostics]


def kinds(program):
    return [type(statement).__name__ for statement in program.statements]


# --- declarations


def test_declarations():
    program = read("Friends( person, person )\n*Father(person,person!)\nLives(person, place ?)\nRain\n")
    assert program.statements == (
        PredicateDeclaration("Friends", (Argument("person"), Argument("person"))),
        PredicateDeclaration("Father", (Argument("person"), Argument("person", "!")), closed=True),
        PredicateDeclaration("Lives", (Argument("person"), Argument("place", "?"))),
        PredicateDeclaration("Rain", ()),
    )


def test_the_second_bare_atom_is_a_formula_unless_it_is_the_same():
    program = read("P(t)\nP(x)\nP( t )\n")
    assert kinds(program) == ["PredicateDeclaration", "FormulaStatement", "PredicateDeclaration"]
    assert program.statements[1] == FormulaStatement(Atom("P", (Variable("x"),)))


def test_declared_in_an_earlier_file():
    assert kinds(read("P(t)", "P(x)")) == ["PredicateDeclaration", "FormulaStatement"]


def test_a_marker_always_declares():
    assert kinds(read("P(t)\nP(u!)\n*P(w)")) == ["PredicateDeclaration"] * 3


def test_types():
    text = 'person = {Anna, bob,\n  // the third\n  "Carl the Great"}\nempty = {}'
    program = read(text)
    names = tuple(Constant(name) for name in ("Anna", "bob", "Carl the Great"))
    assert program.statements == (TypeDeclaration("person", names), TypeDeclaration("empty", ()))


# --- lines


@pytest.mark.parametrize("text", ["1 P(x) =>\n  Q(x)", "1 (P(x)\n => Q(x))", "1 P(x) => // why\n// because\nQ(x)"])
def test_a_formula_goes_on_after_a_connective_or_in_parentheses(text):
    assert read(text) == read("1 P(x) => Q(x)")


def test_a_formula_goes_on_after_a_quantifier():
    assert read("1 EXIST x\n  (P(x))\n2 Q(x)\n") == read("1 EXIST x (P(x))\n2 Q(x)")


def test_a_variable_v_at_the_end_is_no_connective():
    assert kinds(read("1 x = v\n@2 P(x)")) == ["FormulaStatement", "FormulaStatement"]


def test_comments():
    text = "// first\n1 P(x) /* inside */ ^ Q(x) // end\n/* 2 R(x)\n   3 S(x) */\n" + '4 T("// no comment")'
    assert [s.weight for s in read(text).statements] == [Number(1), Number(4)]


def test_line_ends_and_byte_order_mark(tmp_path):
    path = tmp_path / "m.mln"
    path.write_bytes(b"\xef\xbb\xbfP(t)\r\n1 P(x)\r\n#group\r\n2 P(A)\r\n3 P(B)\r\n#group.\r\n")
    assert kinds(parse_model([read_source(path)])) == ["PredicateDeclaration", "FormulaStatement", "FormulaTable"]
    assert kinds(read("P(t)\r\n1 P(x)\r\n2 P(A)\r\n")) == [
        "PredicateDeclaration",
        "FormulaStatement",
        "FormulaStatement",
    ]


def test_one_mistake_does_not_hide_the_next():
    assert codes("1 (P(x)\n2 Q(x) ->\n3 R(x))\n1 S(x) ^\n\n#nothing\n4 T(x)") == [
        "E103",
        "E105",
        "E104",
        "E102",
        "E111",
    ]


# --- tables


def test_formulas_that_differ_in_constants_become_a_table():
    program = read("0.5 P(x,Anna) => Q(Anna)\n1 R(x)\nlog(2) P(x, Bob) =>  Q(Carl)\n(1+1) P(x, 3-2) => Q(B)")
    table = program.statements[0]
    assert isinstance(table, FormulaTable)
    assert kinds(program) == ["FormulaTable", "FormulaStatement"]
    assert table.columns == (("Anna", "Bob", "3-2"), ("Anna", "Carl", "B"))
    assert table.formula.body.arguments == (Variable("x"), Hole(0))
    assert table.formula.head.arguments == (Hole(1),)
    assert [span.line for span in table.spans] == [1, 3, 4]


@pytest.mark.parametrize(
    "second",
    ["2 P(y, Bob)", "@2 P(x, Bob)", "P(x, Bob).", "#fixweight\n2 P(x, Bob)", "2 P(+x, Bob)", "2 P(x, Bob) v Q"],
)
def test_formulas_that_stay_apart(second):
    assert "FormulaTable" not in kinds(read(f"1 P(x, Anna)\n{second}"))


def test_a_parenthesised_proposition_is_no_constant():
    program = read("1 P(A) ^ (Rain)\n2 P(B) ^ (Rain)\n3 P(B) ^ (Snow)")
    assert kinds(program) == ["FormulaTable", "FormulaStatement"]


def test_constants_in_quotes_and_at_equalities():
    program = read('1 P(x) ^ x = Anna\n2 P(x) ^ x = "Bob B"\n3 P(x) ^ x = Carl')
    assert program.statements[0].columns == (("Anna", "Bob B", "Carl"),)


# --- dialects


@pytest.mark.parametrize(
    ("texts", "dialect"),
    [
        (["P(t)\n1 P(x)"], "standard"),
        (["P(t)\n1 P(?x)"], "prac"),
        (["P(t)", "1 P(?x)"], "prac"),
        (["P(t, u?)\nP(A, B)."], "standard"),
        (['1 P("?x")'], "standard"),
        (["// P(?x)\n1 P(x)"], "standard"),
    ],
)
def test_dialect_is_found_out(texts, dialect):
    assert read(*texts).dialect == dialect


def test_both_dialects_in_one_model():
    assert codes("1 P(?x)\n2 Q(x)") == ["E117"]
    assert codes("1 P(?x)\n2 Q(x)\n3 Q(y)\n4 Q(Anna)") == ["E117"]
    assert codes("1 P(?x)", "2 Q(x)") == ["E117"]
    assert codes("1 P(?x) ^ Q(x)") == ["E119"]
    assert codes("1 P(?x)\n2 Q(a1, a2) ^ R(a2)\n3 Q(a1, a2) ^ R(a2)") == ["E117"]
    assert read('1 P(?x)\n2 Q("x")\n3 Q(far)\n4 R(?x, y)\n5 S(w1, theme) ^ S(w1, s1)\n6 T(w1, s1)').dialect == "prac"
    assert read("1 P(?x)\n2 Q(x)", dialect="prac").statements[1].formula.arguments == (Constant("x"),)


def test_a_dialect_that_the_text_is_not_in():
    assert codes("1 P(?x)\n2 Q(?x)", dialect="standard") == ["E118"]
    assert codes("1 P(x) => Q(x)", dialect="prac") == ["E118"]
    assert read("1 P(anna) => Q(anna)", dialect="prac").statements[0].formula.head.arguments == (Constant("anna"),)


def test_a_declared_constant_as_variable():
    assert codes("t = {a, b}\n1 P(a)") == ["E120"]
    assert codes("1 P(a)", "t = {a, b}") == ["E120"]
    assert read('t = {a, b}\n1 P("a") ^ P(x)').dialect == "standard"


# --- files


def test_include(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "predicates.mln").write_text('P(t)\n#include "more.mln"')
    (tmp_path / "sub" / "more.mln").write_text("Q(t)")
    (tmp_path / "m.mln").write_text('#include "sub/predicates.mln"\n#include <sub/more.mln>\nP(x)\n')
    program = parse_model([read_source(tmp_path / "m.mln")])
    first, second, formula = program.statements
    assert (first.path, second.path) == ("sub/predicates.mln", "sub/more.mln")
    assert isinstance(first.program.statements[1], Include)
    assert formula == FormulaStatement(Atom("P", (Variable("x"),)))
    assert program.dialect == first.program.dialect == "standard"


def test_dialect_from_an_included_file(tmp_path):
    (tmp_path / "rules.mln").write_text("1 P(?x)")
    (tmp_path / "m.mln").write_text('#include "rules.mln"\n1 P(far)\n')
    assert parse_model([read_source(tmp_path / "m.mln")]).dialect == "prac"


@pytest.mark.parametrize(
    ("name", "content", "code"),
    [
        ("none.mln", None, "E130"),
        ("empty.mln", b"\n \n", "E134"),
        ("binary.mln", b"P(x)\0", "E132"),
        ("latin.mln", "P(Müller)".encode("latin-1"), "E133"),
        ("wide.mln", "P(x)".encode("utf-16"), "E133"),
        ("", None, "E131"),
        ("a\0b", None, "E136"),
    ],
)
def test_files_that_cannot_be_read(tmp_path, name, content, code):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(SyntaxMistake) as caught:
        read_source(f"{tmp_path}/{name}")
    assert caught.value.diagnostics[0].code == code


def test_too_large(tmp_path):
    with (tmp_path / "big.mln").open("wb") as file:
        file.truncate(1100 * 2**20)
    with pytest.raises(SyntaxMistake, match="1100 MB"):
        read_source(tmp_path / "big.mln")


def test_chain_of_includes(tmp_path):
    for number in range(60):
        (tmp_path / f"{number}.mln").write_text(f'#include "{number + 1}.mln"\n')
    (tmp_path / "60.mln").write_text("P(t)")
    with pytest.raises(SyntaxMistake) as caught:
        parse_model([read_source(tmp_path / "0.mln")])
    assert [d.code for d in caught.value.diagnostics] == ["E139"]
