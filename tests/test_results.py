"""Results as tables, mappings, JSON and frames."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest

from mlnlite.errors import MissingPart, QueryMistake
from mlnlite.results import MapState, Marginals, Statistics, Violation

NAMES = ("Smokes(Anna)", "Region(Cup, Left)", "Smokes(Bob)", "Region(Cup, Right)", "Smokes(Anna) ^ Smokes(Bob)")


def marginals():
    return Marginals(
        NAMES,
        np.array([0.25, 0.75, 1.0, 0.25, 0.125]),
        ("elimination", "closed form", "evidence", "closed form", "gibbs"),
        np.array([True, True, True, True, False]),
        np.array([0, 0, 0, 0, 0.004]),
        log_z=1.5,
        low=np.array([0.25, 0.75, 1.0, 0.25, 0.117]),
        high=np.array([0.25, 0.75, 1.0, 0.25, 0.133]),
        statistics=Statistics(1234, 5, 2, 8, {"ground": 0.25}),
        block=np.array([-1, 0, -1, 0, -1]),
    )


def state():
    return MapState(
        NAMES[:4], np.array([False, True, True, False]), ("elimination",) * 4, 2.5, 3.0, "feasible",
        (Violation("Smokes(x) => Cancer(x)", 3, 1.5), Violation("Friends(x, y)", 10, -0.7)),
    )  # fmt: skip


def test_marginals_print_as_a_table():
    assert str(marginals()).splitlines() == [
        "atom or formula             probability       method",
        "--------------------------  ----------------  -----------",
        "Smokes(Anna)                0.2500            elimination",
        "Smokes(Bob)                 1.0000            evidence",
        "Smokes(Anna) ^ Smokes(Bob)  0.1250 +- 0.0040  gibbs",
        "Region(Cup, Left)           0.7500            closed form",
        "Region(Cup, Right)          0.2500            closed form",
        "status: exact, log Z = 1.500000",
        "1,234 unknown atoms, 5 factors, 2 components, largest table 8; ground 0.250 s",
    ]
    assert "... 3 more" in marginals().to_text(2)


def test_marginals_are_a_mapping():
    m = marginals()
    assert m["Smokes(Anna)"] == 0.25
    assert m["Region(Cup,Left)"] == m["Region( Cup, Left )"] == 0.75
    assert list(m) == list(NAMES)
    assert len(m) == 5
    assert "Smokes(Bob)" in m
    assert "Smokes(Eve)" not in m
    assert m.get("Smokes(Eve)") is None
    with pytest.raises(QueryMistake, match=r"(?s)holds no Smoke\(Anna\).*did you mean Smokes\(Anna\)") as caught:
        m["Smoke(Anna)"]
    assert isinstance(caught.value, KeyError)


def test_marginals_travel():
    data = json.loads(marginals().to_json())
    assert data["log_z"] == 1.5
    assert data["marginals"][4] == {
        "name": NAMES[4], "probability": 0.125, "method": "gibbs", "exact": False, "error": 0.004,
        "low": 0.117, "high": 0.133,
    }  # fmt: skip
    assert data["statistics"]["seconds"] == {"ground": 0.25}
    empty = Marginals((), np.zeros(0), (), np.zeros(0, bool), np.zeros(0))
    assert json.loads(empty.to_json())["log_z"] is None
    assert "<td>Region(Cup, Left)</td><td>0.7500</td>" in marginals()._repr_html_()


def test_states_print_what_is_true_and_what_it_costs():
    assert str(state()).splitlines() == [
        "true atom          method",
        "-----------------  -----------",
        "Smokes(Bob)        elimination",
        "Region(Cup, Left)  elimination",
        "pays 7 for Friends(x, y) (10 x -0.7)",
        "pays 4.5 for Smokes(x) => Cancer(x) (3 x 1.5)",
        "status: feasible, log-weight 2.500000, bound 3.000000, gap 0.5",
        "0 unknown atoms, 0 factors, 0 components",
    ]
    many = replace(state(), violated=tuple(Violation(f"P{i}(x)", 1, 0.5 + i) for i in range(12)))
    assert "pays 2 for 2 more formulas" in many.to_text()


def test_states_are_mappings_and_travel():
    s = state()
    assert s["Region(Cup,Left)"] is True
    assert s.true_atoms == ("Region(Cup, Left)", "Smokes(Bob)")
    assert s.state == dict(s)
    data = json.loads(s.to_json())
    assert data["gap"] == 0.5
    assert data["violated"][0] == {"formula": "Smokes(x) => Cancer(x)", "n_groundings": 3, "weight": 1.5}
    assert "gap 0.5" in s._repr_html_()


def test_frames_need_pandas(monkeypatch):
    pytest.importorskip("pandas")
    frame = marginals().to_frame()
    assert frame.columns.tolist() == ["name", "probability", "method", "exact", "error", "low", "high"]
    assert frame["probability"].tolist() == [0.25, 0.75, 1.0, 0.25, 0.125]
    assert state().to_frame()["truth"].tolist() == [False, True, True, False]
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MissingPart, match="pip install pandas"):
        marginals().to_frame()
