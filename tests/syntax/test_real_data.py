"""Files that people wrote for other systems, read whole."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from mlnlite.errors import SyntaxMistake
from mlnlite.source import Source
from mlnlite.syntax.evidence import parse_evidence
from mlnlite.syntax.parse import parse_model, read_source
from mlnlite.syntax.tree import FormulaTable, Quantified
from mlnlite.syntax.write import write_evidence, write_model

DATA = Path(__file__).parents[3] / "shared" / "data"
pytestmark = pytest.mark.skipif(not DATA.exists(), reason="the data sets are not here")

# Files, dialect, number of formulas.
MODELS = [
    (["handover/formulas.mln"], "prac", 1),
    (["handover/learnt.mln"], "prac", 23400),
    (["grasp_affordance/predicate.txt", "grasp_affordance/formula.txt"], "prac", 2),
    (["grasp_affordance/learnt.mln"], "prac", 14430),
    (["mln/rc1000/prog.mln"], "standard", 15),
    (["mln/rc1000/prog-fixed.mln"], "standard", 15),
    (["mln/class/prog.mln"], "standard", 15),
    (["mln/cse/prog.mln"], "standard", 94),
    (["mln/smoke/prog.mln"], "standard", 3),
    (["mln/voting/voting.mln"], "standard", 17),
    (["pracmln/smokers/mlns/smoking.mln"], "standard", 2),
    (["pracmln/smokers/mlns/learnt.bpll.smoking-train-smoking.mln"], "standard", 2),
    (["pracmln/smokers/mlns/wts.pybpll.smoking-train-smoking.mln"], "standard", 2),
    (["pracmln/alarm/mlns/alarm-kreator.mln"], "standard", 5),
    (["pracmln/alarm/mlns/alarm-noisyor.mln"], "standard", 17),
    (["pracmln/meals/mlns/meals_any_for.mln"], "standard", 19591),
]
EVIDENCE = [
    ("handover/dataset.db", 429, 2500),
    ("grasp_affordance/data.txt", 703, 4921),
    ("grasp_affordance/inference_data.txt", 1, 9),
    ("mln/rc1000/evidence.db", 1, 1006),
    ("mln/class/evidence.db", 1, 82684),
    ("mln/cse/evidence.db", 1, 731),
    ("mln/smoke/evidence.db", 1, 8),
    ("mln/voting/voting-train.db", 1, 3230),
    ("mln/voting/voting-test.db", 1, 672),
    ("pracmln/smokers/dbs/smoking-train.db", 1, 22),
    ("pracmln/taxonomies/dbs/training.db", 4, 24),
    ("pracmln/alarm/dbs/query1.db", 1, 6),
    ("pracmln/meals/dbs/query1.db", 1, 7),
]


@pytest.mark.parametrize(("names", "dialect", "n_formulas"), MODELS, ids=lambda value: str(value)[:60])
def test_model(names, dialect, n_formulas):
    program = parse_model([read_source(DATA / name) for name in names])
    kinds = Counter(type(statement).__name__ for statement in program.statements)
    rows = sum(len(s.weights) for s in program.statements if isinstance(s, FormulaTable))
    assert program.dialect == dialect
    assert kinds["FormulaStatement"] + rows == n_formulas
    assert parse_model([Source("again.mln", write_model(program))]) == program


@pytest.mark.parametrize(("name", "n_databases", "n_facts"), EVIDENCE)
def test_evidence(name, n_databases, n_facts):
    evidence = parse_evidence(read_source(DATA / name))
    assert evidence.n_databases == n_databases
    assert sum(len(table.truth) for table in evidence.facts) == n_facts
    assert parse_evidence(Source("again.db", write_evidence(evidence))) == evidence


def test_handover_weights_stay_with_their_constants():
    program = parse_model([read_source(DATA / "handover" / "learnt.mln")])
    (table,) = (s for s in program.statements if isinstance(s, FormulaTable))
    rows = list(zip(*table.columns, strict=True))
    place = rows.index(("sphere", "work_tool", "to_cut", "2", "far", "level_4"))
    assert table.weights[place].value == 1.791759
    assert len(set(rows)) == 23400


def test_quantifiers_without_parentheses():
    program = parse_model([read_source(DATA / "mln" / "cse" / "prog.mln")])
    formulas = [s.formula for s in program.statements if hasattr(s, "formula")]
    assert sum(isinstance(formula, Quantified) for formula in formulas) == 6


@pytest.mark.parametrize("name", ["senses_and_roles", "wts.learned.taxonomy"])
def test_graded_truth_is_refused_by_name(name):
    with pytest.raises(SyntaxMistake, match=r"#fuzzy.*is not supported") as caught:
        parse_model([read_source(DATA / "pracmln" / "taxonomies" / "mlns" / f"{name}.mln")])
    assert len(caught.value.diagnostics) == 1


def test_soft_evidence():
    evidence = parse_evidence(read_source(DATA / "pracmln" / "taxonomies" / "dbs" / "evidence.db"))
    assert any(table.weight is not None and table.weight.any() for table in evidence.facts)
