r"""Markov logic networks: exact where affordable, fast, and clear.

>>> import mlnlite as ml
>>> model = ml.model_from_text("Smokes(person)\nCancer(person)\n1.5 Smokes(x) => Cancer(x)")
>>> evidence = ml.evidence_from_text("Smokes(Anna)", model=model)
>>> print(f"{ml.marginal(model, evidence, query=['Cancer'])['Cancer(Anna)']:.4f}")
0.8176
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import TYPE_CHECKING

from mlnlite.errors import Contradiction as Contradiction
from mlnlite.errors import Diagnostic as Diagnostic
from mlnlite.errors import EvidenceMistake as EvidenceMistake
from mlnlite.errors import LimitReached as LimitReached
from mlnlite.errors import MissingPart as MissingPart
from mlnlite.errors import MlnError as MlnError
from mlnlite.errors import ModelMistake as ModelMistake
from mlnlite.errors import QueryMistake as QueryMistake
from mlnlite.errors import SyntaxMistake as SyntaxMistake
from mlnlite.errors import did_you_mean as did_you_mean
from mlnlite.plugins import Plugin as Plugin

if TYPE_CHECKING:
    from mlnlite.ground.forecast import Limits as Limits
    from mlnlite.ground.ground import ground as ground
    from mlnlite.ground.network import Network as Network
    from mlnlite.infer.alternatives import map_states as map_states
    from mlnlite.infer.answer import map_state as map_state
    from mlnlite.infer.answer import marginal as marginal
    from mlnlite.infer.joint import joint as joint
    from mlnlite.infer.scored import Score as Score
    from mlnlite.infer.scored import score as score
    from mlnlite.infer.session import Session as Session
    from mlnlite.infer.session import compile as compile
    from mlnlite.learn.data.content import with_shared_constants as with_shared_constants
    from mlnlite.learn.evaluation.crossvalidate import CrossValidation as CrossValidation
    from mlnlite.learn.evaluation.crossvalidate import Split as Split
    from mlnlite.learn.evaluation.crossvalidate import Training as Training
    from mlnlite.learn.evaluation.crossvalidate import crossvalidate as crossvalidate
    from mlnlite.learn.evaluation.evaluate import Evaluation as Evaluation
    from mlnlite.learn.evaluation.evaluate import evaluate as evaluate
    from mlnlite.learn.learned import LearnedModel as LearnedModel
    from mlnlite.learn.prior import Cauchy as Cauchy
    from mlnlite.learn.prior import Gaussian as Gaussian
    from mlnlite.learn.prior import Hierarchical as Hierarchical
    from mlnlite.learn.prior import Laplace as Laplace
    from mlnlite.learn.prior import Prior as Prior
    from mlnlite.learn.structure.find import Structure as Structure
    from mlnlite.learn.structure.find import find_rules as find_rules
    from mlnlite.learn.trust.advice import advice as advice
    from mlnlite.learn.trust.effects import effects as effects
    from mlnlite.learn.trust.effects import held_out as held_out
    from mlnlite.learn.trust.path import LaplacePath as LaplacePath
    from mlnlite.learn.trust.path import laplace_path as laplace_path
    from mlnlite.learn.trust.uncertainty import Uncertainty as Uncertainty
    from mlnlite.learn.trust.uncertainty import uncertainty as uncertainty
    from mlnlite.learn.weights import learn as learn
    from mlnlite.model.evidence import Evidence as Evidence
    from mlnlite.model.facts import closed as closed
    from mlnlite.model.facts import no_evidence as no_evidence
    from mlnlite.model.model import Model as Model
    from mlnlite.model.read import evidence_from_text as evidence_from_text
    from mlnlite.model.read import model_from_text as model_from_text
    from mlnlite.model.read import one_database as one_database
    from mlnlite.model.read import read_evidence as read_evidence
    from mlnlite.model.read import read_model as read_model
    from mlnlite.model.table import Table as Table
    from mlnlite.model.unparse import model_text as model_text
    from mlnlite.results import MapState as MapState
    from mlnlite.results import Marginals as Marginals

__version__ = "0.1.0"

_HOMES = {
    "Limits": "mlnlite.ground.forecast",
    "ground": "mlnlite.ground.ground",
    "Network": "mlnlite.ground.network",
    "map_state": "mlnlite.infer.answer",
    "map_states": "mlnlite.infer.alternatives",
    "marginal": "mlnlite.infer.answer",
    "joint": "mlnlite.infer.joint",
    "Score": "mlnlite.infer.scored",
    "score": "mlnlite.infer.scored",
    "Session": "mlnlite.infer.session",
    "compile": "mlnlite.infer.session",
    "advice": "mlnlite.learn.trust.advice",
    "CrossValidation": "mlnlite.learn.evaluation.crossvalidate",
    "Split": "mlnlite.learn.evaluation.crossvalidate",
    "Training": "mlnlite.learn.evaluation.crossvalidate",
    "crossvalidate": "mlnlite.learn.evaluation.crossvalidate",
    "effects": "mlnlite.learn.trust.effects",
    "held_out": "mlnlite.learn.trust.effects",
    "with_shared_constants": "mlnlite.learn.data.content",
    "LaplacePath": "mlnlite.learn.trust.path",
    "laplace_path": "mlnlite.learn.trust.path",
    "Cauchy": "mlnlite.learn.prior",
    "Gaussian": "mlnlite.learn.prior",
    "Hierarchical": "mlnlite.learn.prior",
    "Laplace": "mlnlite.learn.prior",
    "Prior": "mlnlite.learn.prior",
    "Structure": "mlnlite.learn.structure.find",
    "find_rules": "mlnlite.learn.structure.find",
    "Uncertainty": "mlnlite.learn.trust.uncertainty",
    "uncertainty": "mlnlite.learn.trust.uncertainty",
    "Evaluation": "mlnlite.learn.evaluation.evaluate",
    "evaluate": "mlnlite.learn.evaluation.evaluate",
    "LearnedModel": "mlnlite.learn.learned",
    "learn": "mlnlite.learn.weights",
    "Evidence": "mlnlite.model.evidence",
    "closed": "mlnlite.model.facts",
    "no_evidence": "mlnlite.model.facts",
    "Model": "mlnlite.model.model",
    "evidence_from_text": "mlnlite.model.read",
    "model_from_text": "mlnlite.model.read",
    "one_database": "mlnlite.model.read",
    "read_evidence": "mlnlite.model.read",
    "read_model": "mlnlite.model.read",
    "Table": "mlnlite.model.table",
    "model_text": "mlnlite.model.unparse",
    "MapState": "mlnlite.results",
    "Marginals": "mlnlite.results",
}
"""Where the public names live. They are imported when first used, so that `mlnlite --help` does not load NumPy."""


class _Package(ModuleType):
    """This package. `ground` and `learn` are functions of it and also folders; the functions win."""

    def __setattr__(self, name: str, value: object) -> None:
        """Sets an attribute, but not a folder in place of the function of its name."""
        if not (name in _HOMES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __getattr__(name: str) -> object:
    """A public name, imported on first use."""
    if name not in _HOMES:
        raise AttributeError(f"module 'mlnlite' has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """All public names."""
    return sorted({*globals(), *_HOMES})
