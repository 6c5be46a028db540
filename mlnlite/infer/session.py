"""Ground once, ask many: new facts condition the network that was ground when the session was made."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from mlnlite.engines.plan import Engine
from mlnlite.errors import Diagnostic, EvidenceMistake, did_you_mean
from mlnlite.ground.assemble import atom_range
from mlnlite.ground.condition import UNKNOWN, condition
from mlnlite.ground.ground import ground
from mlnlite.ground.network import Network
from mlnlite.infer.answer import map_state_for, marginals_for
from mlnlite.infer.query import Question, question_of
from mlnlite.model.evidence import Evidence
from mlnlite.model.facts import check_evidence
from mlnlite.model.model import Model
from mlnlite.results import MapState, Marginals
from mlnlite.source import Source
from mlnlite.syntax.evidence import parse_evidence
from mlnlite.syntax.facts import EvidenceProgram
from mlnlite.syntax.tree import Constant, TypeDeclaration


@dataclass(frozen=True, slots=True)
class Session:
    """A network in which everything is open but what every question closes, waiting for facts.

    Attributes:
        network: ground with no facts; factors of weight 0 left out.
        question: what is asked each time.
        closed: shape (n_atoms,), atoms that are false unless a fact says otherwise.
    """

    network: Network
    question: Question
    closed: NDArray[np.bool_] = field(repr=False)

    def query(self, facts: str | Iterable[tuple[str, ...]]) -> Marginals:
        """Probabilities of what the session asks, given facts.

        Args:
            facts: the text of a `.db` file, or tuples of a predicate and its constants, each a true fact.

        Raises:
            EvidenceMistake: if a fact does not fit the model or the constants of the session.
            Contradiction: if no world satisfies the facts.
        """
        return marginals_for(self.given(facts), self.question)

    def map_state(self, facts: str | Iterable[tuple[str, ...]]) -> MapState:
        """The most probable world given facts; see `query`."""
        return map_state_for(self.given(facts), self.question)

    def given(self, facts: str | Iterable[tuple[str, ...]]) -> Network:
        """The network with facts known."""
        known = np.where(self.closed, 0, UNKNOWN).astype(np.int8)
        numbers, truth = self._numbers(facts)
        index = np.searchsorted(self.network.atoms, numbers)
        inside = np.minimum(index, max(self.network.n_atoms - 1, 0))
        touched = self.network.atoms[inside] == numbers if self.network.n_atoms else np.zeros(len(numbers), bool)
        known[inside[touched]] = truth[touched]
        return condition(self.network, known)

    def _numbers(self, facts: str | Iterable[tuple[str, ...]]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        evidence = self.network.evidence
        if not isinstance(facts, str):
            numbers = [_number(evidence, *fact) for fact in facts]
            return np.array(numbers, np.int64), np.ones(len(numbers), np.bool_)
        source = Source("<facts>", facts)
        model = replace(self.network.model, types=evidence.types, templates=())
        checked = check_evidence([parse_evidence(source)], model)
        _verify_constants(evidence, checked)
        found = [
            (evidence.atom_number(name, table.arguments), table.truth)
            for name, table in checked.facts.items()
            if len(table.truth)
        ]
        if not found:
            return np.empty(0, np.int64), np.empty(0, np.bool_)
        return np.concatenate([n for n, _ in found]), np.concatenate([t for _, t in found])


def compile(
    model: Model,
    *,
    query: str | Sequence[str],
    evidence_predicates: Iterable[str] = (),
    constants: Mapping[str, Sequence[str]] | None = None,
    engine: Engine | None = None,
) -> Session:
    """Grounds a model once, for many questions that differ in their facts.

    Args:
        model: a model with weights.
        query: what is asked each time, as in `marginal`.
        evidence_predicates: predicates that the facts of a question tell all about: of these, what is not a fact is
            false. All others stay open where the facts do not mention them.
        constants: by type, constants that the facts will use and the model does not mention.
        engine: what runs the grounding plans; by default chosen by size.

    Raises:
        QueryMistake: if the query does not fit the model.
        EvidenceMistake: if a predicate or type is unknown.
    """
    declared = tuple(TypeDeclaration(t, tuple(map(Constant, names))) for t, names in (constants or {}).items())
    evidence = check_evidence([EvidenceProgram((), declared, 1)], model)
    for name in evidence_predicates:
        if name not in model.predicates:
            hint = did_you_mean(name, list(model.predicates))
            raise EvidenceMistake([Diagnostic("E311", f"there is no predicate {name} to give facts about", hint=hint)])
    question = question_of(query, model, evidence)
    network = _without_zeros(ground(model, evidence, query=question.all_atoms, engine=engine))
    closed = np.zeros(network.n_atoms, np.bool_)
    for name in evidence_predicates:
        low, high = atom_range(evidence.predicates[name], evidence)
        closed |= (network.atoms >= low) & (network.atoms < high) & (evidence.predicates[name].marker != "!")
    return Session(network, question, closed)


def _without_zeros(network: Network) -> Network:
    """The network without factors of weight 0, which change no answer."""
    clauses = []
    for block in network.clauses:
        keep = network.weights[block.weight] != 0
        clauses.append(
            replace(block, literals=block.literals[keep], weight=block.weight[keep], count=block.count[keep])
        )
    tables = []
    for table in network.tables:
        keep = network.weights[table.weight] != 0
        tables.append(replace(table, atoms=table.atoms[keep], weight=table.weight[keep], count=table.count[keep]))
    counts = []
    for group in network.counts:
        keep = network.weights[group.weight] != 0
        counts.append(replace(group, literals=group.literals[keep], weight=group.weight[keep], count=group.count[keep]))
    return replace(network, clauses=tuple(clauses), tables=tuple(tables), counts=tuple(counts))


def _number(evidence: Evidence, name: str, *constants: str) -> int:
    predicate = evidence.predicates.get(name)
    if predicate is None or predicate.arity != len(constants):
        hint = str(predicate) if predicate else did_you_mean(name, list(evidence.predicates))
        raise EvidenceMistake([Diagnostic("E302", f"there is no predicate {name}/{len(constants)}", hint=hint)])
    ids = []
    for constant, type_name in zip(constants, predicate.types, strict=True):
        index = evidence.types[type_name].index
        if constant not in index:
            raise _unknown_constant(constant, type_name, list(index))
        ids.append(index[constant])
    return int(evidence.atom_number(name, np.array([ids], np.int32).reshape(1, -1))[0])


def _verify_constants(evidence: Evidence, checked: Evidence) -> None:
    for name, t in checked.types.items():
        known = evidence.types[name].constants
        if len(t.constants) > len(known):
            raise _unknown_constant(t.constants[len(known)], name, list(known))


def _unknown_constant(constant: str, type_name: str, known: list[str]) -> EvidenceMistake:
    hint = did_you_mean(constant, known) or f"name it when compiling: constants={{{type_name!r}: [{constant!r}]}}"
    return EvidenceMistake(
        [Diagnostic("E312", f"{constant} is not a constant of the type {type_name} in this session", hint=hint)]
    )
