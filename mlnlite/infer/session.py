"""Ground once, ask many: facts of a question condition a network, lasting ones reground what they touch."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mlnlite.engines.plan import Engine
from mlnlite.errors import Diagnostic, EvidenceMistake, QueryMistake, did_you_mean
from mlnlite.ground.assemble import atom_range
from mlnlite.ground.condition import condition
from mlnlite.ground.ground import ground
from mlnlite.ground.network import Network
from mlnlite.ground.update import updated
from mlnlite.infer.answer import map_state_for, marginals_for
from mlnlite.infer.query import Question, question_of
from mlnlite.model.change import UNKNOWN, find, status_of, with_status
from mlnlite.model.evidence import Evidence
from mlnlite.model.facts import check_evidence
from mlnlite.model.model import Model
from mlnlite.results import MapState, Marginals
from mlnlite.source import Source
from mlnlite.syntax.evidence import parse_evidence
from mlnlite.syntax.facts import EvidenceProgram
from mlnlite.syntax.tree import Constant, TypeDeclaration

Given: TypeAlias = str | Iterable[tuple[str, ...]]
"""Facts: the text of a `.db` file, or tuples of a predicate and its constants, each a true fact."""


@dataclass(frozen=True, slots=True)
class Session:
    """A network that waits for facts.

    Attributes:
        network: ground with the facts that hold for every question; factors of weight 0 left out.
        question: what is asked each time.
        evidence: the facts that hold for every question, as they were given.
        told: predicates of which every question tells all.
    """

    network: Network
    question: Question
    evidence: Evidence = field(repr=False)
    told: tuple[str, ...]

    def query(self, facts: Given = ()) -> Marginals:
        """Probabilities of what the session asks, given facts.

        Args:
            facts: the text of a `.db` file, or tuples of a predicate and its constants, each a true fact; they hold for
                this question only.

        Raises:
            EvidenceMistake: if a fact does not fit the model or the constants of the session.
            Contradiction: if no world satisfies the facts.
        """
        return marginals_for(self.given(facts), self.question)

    def map_state(self, facts: Given = ()) -> MapState:
        """The most probable world given facts; see `query`."""
        return map_state_for(self.given(facts), self.question)

    def given(self, facts: Given) -> Network:
        """The network with facts known."""
        known = np.where(self._closed(), 0, UNKNOWN).astype(np.int8)
        numbers, truth = self._numbers(facts)
        place, touched = find(self.network.atoms, numbers)
        known[place[touched]] = truth[touched]
        self._verify(numbers[~touched], truth[~touched])
        return condition(self.network, known)

    def updated(self, add: Given = (), withdraw: Given = ()) -> Session:
        """The session in which other facts hold for every question; only what they touch is ground again.

        Args:
            add: facts that hold from now on, as in `query`.
            withdraw: facts that hold no longer, as they were given. To turn a fact round, withdraw it and add its
                opposite.

        Raises:
            EvidenceMistake: if a fact does not fit the model or the constants of the session, is to be withdrawn and
                was never given, or is to be added and its opposite holds.
            Contradiction: if the facts contradict a hard formula.
        """
        old, was = self._numbers(withdraw)
        self._refuse(old[status_of(self.evidence, old) != was], "is no fact of this session, and cannot be withdrawn")
        less = with_status(self.evidence, old, np.full(len(old), UNKNOWN, np.int8))
        new, truth = self._numbers(add)
        self._refuse(new[status_of(less, new) == ~truth], "is the opposite of a fact: withdraw that")
        for name, soft in self.evidence.soft.items():
            uncertain = np.intersect1d(new, self.evidence.atom_number(name, soft.arguments))
            self._refuse(uncertain, "is to be certain, and its evidence has an uncertain one")
        evidence = with_status(less, new, truth.astype(np.int8))
        network = updated(self.network, evidence, np.union1d(old, new), query=self.question.all_atoms)
        return replace(self, network=network, evidence=evidence)

    def _closed(self) -> NDArray[np.bool_]:
        """Which atoms are false unless a fact says otherwise, shape (n_atoms,)."""
        closed = np.zeros(self.network.n_atoms, np.bool_)
        for name in self.told:
            predicate = self.evidence.predicates[name]
            start, stop = np.searchsorted(self.network.atoms, atom_range(predicate, self.evidence))
            closed[start:stop] = predicate.marker != "!"
        return closed

    def _verify(self, numbers: NDArray[np.int64], truth: NDArray[np.bool_]) -> None:
        """Refuses facts against what holds for every question."""
        against = status_of(self.network.evidence, numbers) == ~truth
        closed = [atom_range(p, self.evidence) for p in self.evidence.predicates.values() if p.closed]
        for low, high in closed:
            against |= truth & (numbers >= low) & (numbers < high) & (status_of(self.evidence, numbers) != 1)
        self._refuse(numbers[against], "is known otherwise in this session: change it with `updated`")

    def _refuse(self, numbers: NDArray[np.int64], why: str) -> None:
        if len(numbers):
            atom = self.evidence.atom_text(int(numbers[0]))
            raise EvidenceMistake([Diagnostic("E317", f"a fact about {atom} {why}")])

    def _numbers(self, facts: Given) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Numbers of the atoms of facts, each once, and their truth."""
        if not isinstance(facts, str):
            numbers = sorted({_number(self.evidence, *fact) for fact in facts})
            return np.array(numbers, np.int64), np.ones(len(numbers), np.bool_)
        model = replace(self.network.model, types=self.evidence.types, templates=())
        checked = check_evidence([parse_evidence(Source("<facts>", facts))], model)
        _verify_constants(self.evidence, checked)
        if checked.soft or checked.n_databases != 1:
            message = "the facts of a session are certain, and about one world; soft ones stand in its evidence"
            raise EvidenceMistake([Diagnostic("E317", message)])
        found = [
            (self.evidence.atom_number(name, table.arguments), table.truth)
            for name, table in checked.facts.items()
            if len(table.truth) and self.evidence.predicates[name].comparison is None  # these follow from constants
        ]
        if not found:
            return np.empty(0, np.int64), np.empty(0, np.bool_)
        return np.concatenate([n for n, _ in found]), np.concatenate([t for _, t in found])


def compile(
    model: Model,
    *,
    query: str | Sequence[str],
    evidence: Evidence | None = None,
    evidence_predicates: Iterable[str] = (),
    constants: Mapping[str, Sequence[str]] | None = None,
    engine: Engine | None = None,
) -> Session:
    """Grounds a model once, for many questions that differ in their facts.

    Args:
        model: a model with weights.
        query: what is asked each time, as in `marginal`.
        evidence: facts that hold for every question, until `Session.updated` changes them; by default none.
        evidence_predicates: predicates that the facts of a question tell all about: of these, what is not a fact is
            false. All others stay open where the facts do not mention them.
        constants: by type, constants that the facts will use and the model does not mention. Evidence declares its own.
        engine: what runs the grounding plans; by default chosen by size.

    Raises:
        QueryMistake: if the query does not fit the model.
        EvidenceMistake: if a predicate or type is unknown.
    """
    if evidence is not None and constants:
        raise QueryMistake("the constants of a session with evidence are those of the evidence: declare them there")
    declared = tuple(TypeDeclaration(t, tuple(map(Constant, names))) for t, names in (constants or {}).items())
    evidence = evidence or check_evidence([EvidenceProgram((), declared, 1)], model)
    for name in evidence_predicates:
        if name not in model.predicates:
            hint = did_you_mean(name, list(model.predicates))
            raise EvidenceMistake([Diagnostic("E311", f"there is no predicate {name} to give facts about", hint=hint)])
    question = question_of(query, model, evidence)
    network = ground(_without_zeros(model, evidence), evidence, query=question.all_atoms, engine=engine)
    return Session(network, question, evidence, tuple(evidence_predicates))


def _without_zeros(model: Model, evidence: Evidence) -> Model:
    """The model, its templates expanded, without rows of weight 0, which change no answer."""
    templates = []
    for template in (t.expanded(evidence.types) for t in model.templates):
        assert template.rows is not None
        keep = template.weights != 0
        templates.append(replace(template, rows=template.rows[keep], weights=template.weights[keep], row_spans=()))
    return replace(model, templates=tuple(t for t in templates if len(t.weights)))


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
