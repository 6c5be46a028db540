"""Evidence from tables is the evidence that the same facts give as text."""

from __future__ import annotations

import sqlite3
from contextlib import closing

import duckdb
import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.model import tabular

MODEL = "Friends(person, person)\nAge(person, years!)\nSmokes(person)\n1 Friends(x, y) => Smokes(x)"
ROWS = [("Anna", "Bob"), ("Bob", "Cid"), ("Anna", 'O\'Neill, "Cy"')]


@pytest.fixture
def model():
    return ml.model_from_text(MODEL)


@pytest.fixture
def frame():
    return pd.DataFrame(ROWS, columns=["from", "to"])


def facts(evidence, name="Friends"):
    types = [evidence.types[t].constants for t in evidence.predicates[name].types]
    table = evidence.facts[name]
    rows = [tuple(t[i] for t, i in zip(types, row, strict=True)) for row in table.arguments.tolist()]
    return dict(zip(rows, table.truth.tolist(), strict=True))


def files(frame, folder):
    frame.to_csv(folder / "f.csv", index=False)
    frame.to_csv(folder / "f.tsv", index=False, sep="\t")
    frame.to_json(folder / "f.jsonl", orient="records", lines=True)
    duckdb.sql("SELECT * FROM frame").write_parquet(str(folder / "f.parquet"))
    with duckdb.connect(folder / "f.duckdb") as database:
        database.execute("CREATE TABLE t AS SELECT * FROM frame")
    with sqlite3.connect(folder / "f.sqlite") as database:
        frame.to_sql("t", database, index=False)
    database.close()


@pytest.mark.parametrize("name", ["f.csv", "f.tsv", "f.jsonl", "f.parquet", "f.duckdb::t", "f.sqlite::t"])
def test_files(model, frame, tmp_path, name):
    files(frame, tmp_path)
    evidence = ml.Evidence.from_tables({"Friends": f"{tmp_path}/{name}"}, model=model)
    assert facts(evidence) == dict.fromkeys(ROWS, True)
    again = ml.read_evidence(f"Friends={tmp_path}/{name}", model=model)
    assert facts(again) == facts(evidence)


def test_frames_and_columns(model, frame):
    columns = frame.to_dict("list")
    arrays = {"from": frame["from"].to_numpy(), "to": frame["to"].to_numpy()}
    polars = pl.DataFrame(columns)
    arrow = pa.table(columns)
    for source in (
        frame,
        columns,
        arrays,
        polars,
        polars.lazy(),
        arrow,
        arrow.to_batches()[0],
        frame.astype("category"),
    ):
        assert facts(ml.Evidence.from_tables({"Friends": source}, model=model)) == dict.fromkeys(ROWS, True)


@pytest.mark.parametrize("kind", [pd.DataFrame, pl.DataFrame, pa.table])
def test_truth_and_null(model, kind):
    source = {
        "from": ["Anna", "Bob", "Cid", None],
        "to": ["Bob", "Cid", "Dan", "Eve"],
        "truth": [True, False, None, True],
    }
    evidence = ml.Evidence.from_tables({"Friends": kind(source)}, model=model)
    assert facts(evidence) == {("Anna", "Bob"): True, ("Bob", "Cid"): False}
    as_text = ml.evidence_from_text("?Friends(Cid, Dan)", model=model).soft["Friends"]
    (row,) = evidence.soft["Friends"].arguments
    assert [evidence.types["person"].constants[i] for i in row] == ["Cid", "Dan"]
    assert evidence.soft["Friends"].weight == as_text.weight == 0
    assert set(evidence.types["person"].constants) == {"Anna", "Bob", "Cid", "Dan", "Eve"}
    assert evidence.present["person"].all()
    assert [w.code for w in evidence.warnings] == ["W312"]


def test_numbers(model):
    table = pd.DataFrame({"person": ["Anna", "Bob"], "years": [30.0, 41.5]})
    evidence = ml.Evidence.from_tables({"Age": table}, model=model)
    assert facts(evidence, "Age") == {("Anna", "30"): True, ("Bob", "41.5"): True}


def test_bins(model):
    table = pd.DataFrame({"person": list("ABCD"), "years": [3, 18, 64.5, 65]})
    evidence = ml.Evidence.from_tables({"Age": ml.Table(table, bins={"years": [18, 65]})}, model=model)
    bins = {"A": "<18", "B": "18..65", "C": "18..65", "D": ">=65"}
    assert facts(evidence, "Age") == {(p, b): True for p, b in bins.items()}
    assert evidence.cuts == {("Age", 1): (18.0, 65.0)}
    even = ml.Evidence.from_tables({"Age": ml.Table(table, bins={"years": 2})}, model=model)
    counts = np.unique(even.facts["Age"].arguments[:, 1], return_counts=True)[1]
    assert sorted(counts.tolist()) in ([2, 2], [1, 3])


def test_probabilities_are_soft_evidence(model):
    table = {"person": ["Anna", "Bob"], "probability": [0.7, 0.2]}
    evidence = ml.Evidence.from_tables({"Smokes": table}, model=model)
    as_text = ml.evidence_from_text("0.7 Smokes(Anna)\n0.2 Smokes(Bob)", model=model)
    for e in (evidence, as_text):
        answer = ml.marginal(model, e, ["Smokes"])
        assert answer["Smokes(Anna)"] == pytest.approx(ml.marginal(model, as_text)["Smokes(Anna)"], abs=1e-12)
    weights = ml.Evidence.from_tables({"Smokes": {"person": ["Anna"], "weight": [1.5]}}, model=model)
    assert weights.soft["Smokes"].weight.tolist() == [1.5]


def test_sqlite_as_text(model, tmp_path):
    with closing(sqlite3.connect(tmp_path / "f.sqlite")) as database:
        database.execute("CREATE TABLE ages (person, years)")
        database.executemany("INSERT INTO ages VALUES (?, ?)", [("Anna", 30), ("Bob", 41.5), ("Cid", None)])
        database.commit()
    evidence = ml.Evidence.from_tables({"Age": f"{tmp_path}/f.sqlite::ages"}, model=model)
    assert facts(evidence, "Age") == {("Anna", "30"): True, ("Bob", "41.5"): True}


def test_mapping(model, frame, tmp_path):
    frame.assign(known=["yes", "no", "yes"]).to_csv(tmp_path / "f.csv", index=False)
    (tmp_path / "people.csv").write_text("name,age\nAnna,30\nBob,12\n")
    mapping = tmp_path / "facts.toml"
    mapping.write_text(
        '[Friends]\nfile = "f.csv"\ncolumns = ["to", "from"]\ntruth = "known"\n'
        '[Age]\nfile = "people.csv"\nbins = { age = [18] }\n'
    )
    evidence = ml.read_evidence(mapping, model=model)
    assert facts(evidence) == {(b, a): i != 1 for i, (a, b) in enumerate(ROWS)}
    assert facts(evidence, "Age") == {("Anna", ">=18"): True, ("Bob", "<18"): True}


def test_together_with_text(model, frame, tmp_path):
    frame.to_csv(tmp_path / "f.csv", index=False)
    (tmp_path / "a.db").write_text("Smokes(Anna)\n")
    both = [tmp_path / "a.db", f"Friends={tmp_path}/f.csv"]
    one = ml.read_evidence(*both, model=model, together=True)
    assert one.n_databases == 1
    assert facts(one, "Smokes") == {("Anna",): True}
    apart = ml.read_evidence(*both, model=model)
    assert apart.n_databases == 2
    assert apart.facts["Friends"].database.tolist() == [1, 1, 1]
    assert len(apart.names) == 2


@pytest.mark.parametrize(
    ("predicate", "source", "code", "words"),
    [
        ("Friends", {"a": ["A"]}, "E334", "has 1 columns"),
        ("Friend", {"a": ["A"], "b": ["B"]}, "E302", "not declared"),
        ("Friends", "nothing.csv", "E332", "no file"),
        ("Friends", ml.Table({"a": ["A"], "b": ["B"]}, columns=["a", "c"]), "E333", "no column c"),
        ("Smokes", {"a": ["A"], "probability": [1.0]}, "E336", "probability 1"),
        ("Smokes", {"a": ["A"], "truth": ["maybe"]}, "E336", "no truth"),
        ("Age", ml.Table({"a": ["A"], "b": ["x"]}, bins={"b": 3}), "E337", "no numbers"),
        ("Age", ml.Table({"a": ["A"], "b": [1]}, bins={"b": [3, 3]}), "E337", "do not rise"),
        ("Age", {"a": ["A", "A"], "b": ["1", "2"]}, "E305", "second value"),
        ("Friends", {"a": ["A", "A"], "b": ["B", "B"], "truth": [True, False]}, "E304", "contradicts"),
    ],
)
def test_mistakes(model, predicate, source, code, words):
    with pytest.raises(ml.EvidenceMistake) as caught:
        ml.Evidence.from_tables({predicate: source}, model=model)
    assert caught.value.diagnostics[0].code == code
    assert words in str(caught.value)


def test_a_missing_header_is_noticed(model, tmp_path):
    (tmp_path / "f.csv").write_text("Anna,Bob\nAnna,Cid\n")
    evidence = ml.read_evidence(f"Friends={tmp_path}/f.csv", model=model)
    assert [w.code for w in evidence.warnings] == ["W311"]


@pytest.mark.parametrize(
    "text",
    ["[Friends]\n", "Friends = 1\n", '[Friends]\nfile = "f.csv"\ncolums = []\n', "[Friends\n", '[F]\nfile="f"\nbins=1'],
)
def test_bad_mapping(model, tmp_path, text):
    (tmp_path / "m.toml").write_text(text)
    with pytest.raises(ml.EvidenceMistake) as caught:
        ml.read_evidence(tmp_path / "m.toml", model=model)
    assert {d.code for d in caught.value.diagnostics} <= {"E330", "E331"}


@given(st.sets(st.one_of(st.integers(0, 2**64 - 1), st.integers(2**64 - 9, 2**64 - 1), st.integers(0, 9)), min_size=1))
def test_places_of_hashes(hashes):
    rising = np.array(sorted(hashes), np.uint64)
    assert tabular._places(rising[::-1], rising).tolist() == list(range(len(rising)))[::-1]


def test_columns_of_one_type_share_constants_and_lack_some():
    model = ml.model_from_text("F(p, q, p)")
    data = {"a": ["X", None, "Z"], "b": ["X", "Y", "X"], "c": ["Y", "W", "X"]}
    evidence = ml.Evidence.from_tables({"F": data}, model=model)
    rows = [
        [evidence.types[t].constants[i] for t, i in zip("pqp", row, strict=True)]
        for row in evidence.facts["F"].arguments
    ]
    assert sorted(rows) == [["X", "X", "Y"], ["Z", "X", "X"]]
    assert set(evidence.types["p"].constants) == {"X", "Y", "Z", "W"}
    assert set(evidence.types["q"].constants) == {"X", "Y"}
