"""Facts of smaller texts: one pattern finds stretches of lines of regular shapes, another one cuts them into words."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from mlnlite.syntax.pieces import (
    ARITY,
    BEGIN,
    CERTAIN,
    CHANCE,
    FIRST,
    IN_DATABASE,
    N_COLUMNS,
    NUMBER,
    TRUTH,
    UNKNOWN,
    Int64,
    Piece,
    pieces_of,
)
from mlnlite.syntax.rows import Progress

# A fact on a line of its own, without escapes in quotes, and what may follow it: a subset of what the grammar accepts.
_WORD = r"-?\w[\w'$~\\]*+(?:[-.:;/](?=\w)[\w'$~\\]*+)*+"
_TERM = rf'[ \t]*+(?:{_WORD}|"[^"\\\n]*+")[ \t]*+'
_FACT = rf"(?:[!?]|0\.\d*[1-9]\d*[ \t]++|{_TERM}=[ \t]*+)?[^\W\d]\w*+\({_TERM}(?:,{_TERM})*+\)"
_END = r"[ \t\r]*+(?:\n|\Z)"
_FACTS = re.compile(rf"^[ \t]*+{_FACT}{_END}(?:^[ \t]*+(?:---|{_FACT})?{_END}){{0,9999}}+", re.MULTILINE)
_TOKEN = re.compile(rf'"[^"\n]*+"|---{_END}|[^\s(),="]++\(?|[=\n]')
_PLAIN, _HEAD, _HEAD_NOT, _HEAD_OPEN, _EQUAL, _NEWLINE, _SEPARATOR, _KINDS = range(8)
"""What a token is: a word; a predicate with its bracket, alone, behind `!` or `?`; `=`; the end of a line; `---`."""
_HEADS = {"!": _HEAD_NOT, "?": _HEAD_OPEN}


class Tokens(dict[str, int]):
    """For each token a number and what it is: `number * _KINDS + kind`.

    Attributes:
        words: the words that facts consist of, and their numbers.
        predicates: the same of predicates.
    """

    def __init__(self) -> None:
        """No token so far."""
        super().__init__({"=": _EQUAL, "\n": _NEWLINE})
        self.words: dict[str, int] = {}
        self.predicates: dict[str, int] = {}

    def __missing__(self, token: str) -> int:
        """A new token."""
        kind, word, numbers = _PLAIN, token.strip('"'), self.words
        if token[-1] == "(":
            kind, word, numbers = _HEADS.get(token[0], _HEAD), token.strip("!?("), self.predicates
        elif token[:3] == "---":
            kind, numbers = _SEPARATOR, {}
        self[token] = code = numbers.setdefault(word, len(numbers)) * _KINDS + kind
        return code


def read_plain(
    text: str, start: int, end: int, progress: Progress, tokens: Tokens
) -> Iterator[Piece | tuple[int, int]]:
    """The facts of a stretch of text that stand on lines of their own, piece by piece.

    Args:
        text: facts, without comments.
        start: begin of the stretch.
        end: its end.
        progress: changes as the text is read.
        tokens: gains the words.

    Yields:
        Facts; or start and end of lines that are left, when `progress` is theirs.
    """
    for match in _FACTS.finditer(text, start, end):
        if match.start() > start:
            yield start, match.start()
        start = match.end()
        yield from _pieces(match[0], match.start(), progress, tokens)
    if start < end:
        yield start, end


def _pieces(text: str, start: int, progress: Progress, tokens: Tokens) -> Iterator[Piece]:
    words = _TOKEN.findall(text)
    words.append("\n")
    numbers, kinds = np.divmod(np.fromiter(map(tokens.__getitem__, words), np.int64, len(words)), _KINDS)
    head, ends = np.flatnonzero((kinds >= _HEAD) & (kinds <= _HEAD_OPEN)), np.flatnonzero(kinds == _NEWLINE)
    end, before = ends[np.searchsorted(ends, head)], kinds[head - 1]
    for i in np.flatnonzero((before == _EQUAL) | (before == _PLAIN)).tolist():  # what stands in front goes to the end
        front = head[i] - 1 - (before[i] == _EQUAL)
        words[end[i]], numbers[end[i]] = words[front], numbers[front]
    separators = progress.database + np.cumsum(kinds == _SEPARATOR)
    facts = np.empty((len(head), N_COLUMNS), np.int64)
    facts[:, BEGIN], facts[:, FIRST], facts[:, IN_DATABASE] = _begins(text), head, separators[head]
    facts[:, ARITY] = end - head - 1 + (before == _EQUAL)
    facts[:, TRUTH] = kinds[head] != _HEAD_NOT
    facts[:, CHANCE] = np.where(kinds[head] == _HEAD_OPEN, UNKNOWN, np.where(before == _PLAIN, NUMBER, CERTAIN))
    progress.database, progress.separator = int(separators[-1]), bool(separators[-1] > separators[head[-1]])
    yield from pieces_of(facts, numbers.astype(np.int32), lambda i: words[i].strip("!?("), start)


def _begins(text: str) -> Int64:
    """Where the facts begin: on each line that is not blank or `---`."""
    letters = np.frombuffer(text.encode("ascii", "replace") + b"\n--", np.uint8)
    begins = np.append(0, np.flatnonzero(letters == ord("\n")) + 1)
    while (blank := np.isin(letters[begins], (ord(" "), ord("\t")))).any():
        begins += blank
    begins = begins[~np.isin(letters[begins], (ord("\r"), ord("\n")))]
    separators = (letters[begins] == ord("-")) & (letters[begins + 1] == ord("-"))
    found: Int64 = begins[~separators]
    return found
