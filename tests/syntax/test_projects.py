"""Project archives of pracmln, and the style of real files."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

import mlnlite as ml
from mlnlite.source import Source
from mlnlite.syntax.layout import formatted
from mlnlite.syntax.parse import parse_model, read_source

DATA = Path(__file__).parents[3] / "shared" / "data"
SMALL = sorted(p for p in DATA.rglob("*.mln") if p.stat().st_size < 50_000 and "taxonomies" not in p.parts)


@pytest.fixture
def project(tmp_path):
    path = tmp_path / "smokers.pracmln"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("mlns/smoking.mln", "Smokes(person)\n1 Smokes(x)\n")
        archive.writestr("dbs/train.db", "Smokes(Ann)\n")
        archive.writestr("query.conf", "{}")
    return path


def test_project(project):
    model = ml.read_model(project)
    assert ml.read_model(f"{project}:smoking.mln").predicates == model.predicates
    evidence = ml.read_evidence(f"{project}:train.db", model=model)
    assert evidence.types["person"].constants == ("Ann",)


@pytest.mark.parametrize(("name", "code"), [(":other.mln", "E140"), ("x", "E130")])
def test_wrong_names(project, name, code):
    with pytest.raises(ml.SyntaxMistake) as caught:
        ml.read_model(f"{project}{name}")
    assert caught.value.diagnostics[0].code == code


def test_no_archive(tmp_path):
    (tmp_path / "a.pracmln").write_text("no zip")
    with pytest.raises(ml.SyntaxMistake, match="E136"):
        ml.read_model(tmp_path / "a.pracmln")


@pytest.mark.parametrize("path", SMALL, ids=lambda path: path.name)
def test_style_of_real_files(path):
    source = read_source(path)
    new = formatted(source.text)
    assert formatted(new) == new
    assert parse_model([Source("new.mln", new)]) == parse_model([source])
