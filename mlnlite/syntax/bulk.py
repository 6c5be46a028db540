"""Facts of large texts: text in, columns of words out, by whole arrays. Other lines are left to the parser.

The bytes between words give each line a shape, such as `(, )` for `Friends(Anna, Bob)`. A file has few shapes; one
pattern says where the words of each are, and they are cut out of all lines of the shape at once.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from mlnlite.syntax.coded import LETTERS, Keys, numbered, numbered_words
from mlnlite.syntax.rows import Piece, Progress

CHUNK = 1 << 22
"""Characters that are read at once."""
LONGEST = 8 * LETTERS
"""Bytes of the longest word that is read here."""
FEWEST = 32
"""Lines of one shape that are worth it."""
WIDEST = 64
"""Signs between words that a line has at most."""

Int64 = NDArray[np.int64]
Bool = NDArray[np.bool_]

# What a byte is: of no word, a letter or digit, or a sign that may stand between them.
_NONE, _PLAIN, _JOINS = range(3)
_LETTERS = b"0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_"
_KIND = bytes(_PLAIN if b in _LETTERS else _JOINS if b in b"-.:;/'$~" else _NONE for b in range(256))
_BLANKS = b" \t\r\n\f"
_MASKS = np.array([(1 << (8 * n)) - 1 for n in range(LETTERS + 1)], np.uint64)
_MIX = np.random.default_rng(0).integers(1, 2**63, WIDEST, dtype=np.uint64)


@dataclass(frozen=True, slots=True)
class _Lines:
    """Whole lines of a text.

    Attributes:
        letters: shape (n + padding,), their bytes.
        kinds: the same shape, what each byte is.
        marks: shape (n_marks + 1,), where each byte stands that belongs to no word, after a -1.
        shape: shape (n_marks,), these bytes, 0 for what is not ASCII; the highest bit: whether a word stands before.
        first: shape (n_lines,), number of the first mark of each line.
        width: shape (n_lines,), how many marks.
    """

    letters: NDArray[np.uint8]
    kinds: NDArray[np.uint8]
    marks: Int64
    shape: NDArray[np.uint8]
    first: Int64
    width: Int64


@dataclass(frozen=True, slots=True)
class _Fields:
    """Where the words of a shape stand: each between two of its marks, -1 for the begin of the line.

    Attributes:
        begin: the mark at which the fact begins, and 1 if it begins behind it.
        predicate: its name.
        arguments: constants.
        number: the number in front.
        sign: the sign in front.
    """

    begin: tuple[int, int]
    predicate: tuple[int, int]
    arguments: tuple[tuple[int, int], ...]
    number: tuple[int, int] | None
    sign: str


def read_bulk(text: str, start: int, end: int, progress: Progress) -> Iterator[Piece | tuple[int, int]]:
    """The facts of a stretch of text that stand on lines of their own, piece by piece.

    Args:
        text: facts, without comments.
        start: begin of the stretch.
        end: its end.
        progress: changes as the text is read.

    Yields:
        Facts; or start and end of lines that are left, when `progress` is theirs.
    """
    size = CHUNK
    while start < end:
        stop = min(text.find("\n", start + size) + 1 or len(text), end)
        lines = _lines(text[start:stop].encode())
        after = np.flatnonzero(lines.letters & 0xC0 == 0x80)  # bytes that go on with a character
        known = _separators(lines)
        separators, n_lines = np.flatnonzero(known), len(known)
        database = progress.database + np.cumsum(known, dtype=np.int32)
        for rows, piece in _pieces(lines, database):
            known[rows] = True
            yield replace(piece, offset=start + _characters(piece.offset, after))
        others = np.flatnonzero(~known)
        others = others[~_blank(lines, others)]
        left = _stretches(np.flatnonzero(known), others, n_lines)
        if left and stop < end and left[-1][1] == n_lines:  # it may go on in the next chunk
            if left[-1][0] == 0:
                size *= 2
                continue
            n_lines, _ = left.pop()
            stop = start + int(_characters(_begin(lines, n_lines), after))
        size = CHUNK
        for stretch in left:
            progress.database = int(database[stretch[0]])
            places = start + _characters(_begin(lines, np.array(stretch)), after)
            yield int(places[0]), min(int(places[1]), end)
        progress.database = int(database[-1])
        last = max(
            (int(rows[-1]) for rows in (np.flatnonzero(known), others[others < n_lines]) if len(rows)), default=-1
        )
        if last >= 0:
            progress.separator = last in separators[-1:]
        start = stop


def _lines(data: bytes) -> _Lines:
    data = data if data.endswith(b"\n") else data + b"\n"
    padded = data + bytes(LONGEST + LETTERS)
    letters, kinds = np.frombuffer(padded, np.uint8), np.frombuffer(padded.translate(_KIND), np.uint8)
    marks = np.concatenate([[-1], np.flatnonzero(kinds[: len(data)] == _NONE)])
    signs = letters[marks[1:]]
    shape = np.minimum(signs, 128) % 128 | ((marks[1:] - marks[:-1] > 1).astype(np.uint8) << 7)
    last = np.flatnonzero(signs == ord("\n"))
    first = np.concatenate([[0], last[:-1] + 1])
    return _Lines(letters, kinds, marks, shape, first, last + 1 - first)


def _begin(lines: _Lines, line: int | Int64) -> Int64:
    """The byte at which a line begins; behind the last one for the number of lines."""
    first = np.append(lines.first, len(lines.shape))
    return np.asarray(lines.marks[first[line]] + 1)


def _characters(n_bytes: Int64, after: Int64) -> Int64:
    """How many characters the first bytes are; `after`: the bytes that go on with a character."""
    return n_bytes - np.searchsorted(after, n_bytes) if len(after) else n_bytes


def _separators(lines: _Lines) -> Bool:
    """Which lines are `---`."""
    found = np.zeros(len(lines.first), np.bool_)
    dash = lines.letters == ord("-")
    at = np.flatnonzero(dash[:-2] & dash[1:-1] & dash[2:])
    at = at[(lines.kinds[at - 1] == _NONE) & (lines.kinds[at + 3] == _NONE)]
    rows = _line(lines, at)
    for width in np.unique(lines.width[rows]).tolist():
        mine = rows[lines.width[rows] == width]
        shape = lines.shape[lines.first[mine, None] + np.arange(width)]
        blank = np.isin(shape & 127, list(_BLANKS)).all(axis=1)
        found[mine[blank & ((shape >> 7).sum(axis=1) == 1)]] = True
    return found


def _blank(lines: _Lines, rows: Int64) -> Bool:
    """Which of some lines have nothing but blanks."""
    blank = lines.width[rows] == lines.marks[lines.first[rows] + lines.width[rows]] - lines.marks[lines.first[rows]]
    for i in np.flatnonzero(blank).tolist():
        first = lines.first[rows[i]]
        blank[i] = set(lines.shape[first : first + lines.width[rows[i]]].tolist()) <= set(_BLANKS)
    return np.asarray(blank)


def _line(lines: _Lines, at: Int64) -> Int64:
    """The lines in which bytes stand."""
    return np.asarray(np.searchsorted(lines.marks[lines.first], at) - 1)


def _stretches(known: Int64, others: Int64, n_lines: int) -> list[tuple[int, int]]:
    """Other lines between known ones: from the first one of each stretch to the known line behind it."""
    behind = np.append(known, n_lines)[np.searchsorted(known, others)]
    ends, firsts = np.unique(behind, return_index=True)
    return list(zip(others[firsts].tolist(), ends.tolist(), strict=True))


# --- shapes


def _pieces(lines: _Lines, database: NDArray[np.int32]) -> Iterator[tuple[Int64, Piece]]:
    """Facts about one predicate, with the numbers of their lines."""
    bad = np.zeros(len(lines.first), np.bool_)
    bad[_line(lines, _misplaced(lines))] = True
    for rows in _shapes(lines):
        shape = lines.shape[lines.first[rows[0]] :][: lines.width[rows[0]]]
        fields = _fields(shape.tobytes())
        if fields is not None:
            yield from _of_shape(lines, rows[~bad[rows]], fields, database)


def _misplaced(lines: _Lines) -> Int64:
    """Where a sign such as `-` or `.` stands in a word and must not: see the terminal WORD of the grammars."""
    at = np.flatnonzero(lines.kinds == _JOINS)
    before, here, behind = lines.kinds[at - 1] != _NONE, lines.letters[at], lines.kinds[at + 1] == _PLAIN
    inside = (here == ord("'")) | (here == ord("$")) | (here == ord("~"))
    return np.asarray(at[~np.where(inside, before, behind & (before | (here == ord("-"))))])


def _shapes(lines: _Lines) -> Iterator[Int64]:
    """The lines of each shape, in order, if there are enough of them."""
    width = int(lines.width[0])
    if (lines.width == width).all() and (lines.shape.reshape(-1, width) == lines.shape[:width]).all():
        yield np.arange(len(lines.first))
        return
    number = np.arange(len(lines.shape)) - np.repeat(lines.first, lines.width)
    keys = np.add.reduceat(lines.shape * _MIX[np.minimum(number, WIDEST - 1)], lines.first)
    for rows in groups(numbered(keys)[0]):
        width, first = int(lines.width[rows[0]]), lines.first[rows]
        if len(rows) < FEWEST or width > WIDEST or (lines.width[rows] != width).any():
            continue
        shapes = lines.shape[first[:, None] + np.arange(width)]
        if (shapes == shapes[0]).all():
            yield rows


def groups(numbers: NDArray[np.int32]) -> list[Int64]:
    """The rows of each number, from 0."""
    if not numbers.any():
        return [np.arange(len(numbers))]
    order = np.argsort(numbers, kind="stable")
    return np.split(order, np.cumsum(np.bincount(numbers))[:-1])


_TERM = r'(?:w|"[^"\x00-\x08\n-\x1f]*")'
_SHAPE = re.compile(
    rf"[ \t]*(?:(?P<sign>[!?])|(?P<number>w)[ \t]+|(?P<value>{_TERM})[ \t]*=[ \t]*)?(?P<predicate>w)"
    rf"\((?P<arguments>[ \t]*{_TERM}[ \t]*(?:,[ \t]*{_TERM}[ \t]*)*)\)[ \t\r]*\n"
)


@cache
def _fields(shape: bytes) -> _Fields | None:
    """What a shape says, if it is that of a fact."""
    text = "".join(f"{'w' * (code >> 7)}{chr(code & 127)}" for code in shape)
    match = _SHAPE.fullmatch(text)
    if match is None:
        return None
    mark = np.cumsum([letter != "w" for letter in text]).tolist()  # of each character: how many marks up to it

    def word(start: int, end: int) -> tuple[int, int]:
        quoted = text[start] == '"'
        return (mark[start] - 1, mark[end - 1] - 1) if quoted else (mark[start] - 1, mark[start])

    spans = [t.span() for t in re.compile(_TERM).finditer(text, *match.span("arguments"))]
    spans += [match.span("value")] if match["value"] else []
    begin = next(match.start(name) for name in ("sign", "number", "value", "predicate") if match[name])
    return _Fields(
        (mark[begin] - 1, int(text[begin] == "w")),
        word(*match.span("predicate")),
        tuple(word(*span) for span in spans),
        word(*match.span("number")) if match["number"] else None,
        match["sign"] or "",
    )


# --- words


def _of_shape(
    lines: _Lines, rows: Int64, fields: _Fields, database: NDArray[np.int32]
) -> Iterator[tuple[Int64, Piece]]:
    """Facts of lines of one shape."""
    columns = (fields.predicate, *fields.arguments, *([fields.number] if fields.number else []))
    first = lines.first[rows] + 1
    spans = [(lines.marks[first + i] + 1, lines.marks[first + j]) for i, j in columns]
    longest = np.max([end - start for start, end in spans], axis=0)
    for longer, most in zip((0, 1, 2, 4), (1, 2, 4, 8), strict=True):
        mine = np.flatnonzero((longest > longer * LETTERS if longer else True) & (longest <= most * LETTERS))
        if len(mine):
            predicate, *words = [_keys(lines.letters, start[mine], end[mine], most) for start, end in spans]
            weight = _weights(words.pop()) if fields.number else _zeros(len(mine)) if fields.sign == "?" else None
            begin = lines.marks[first[mine] + fields.begin[0]] + fields.begin[1]
            yield from _of_predicates(predicate, words, weight, (rows[mine], begin, database, fields.sign != "!"))


def _zeros(n: int) -> NDArray[np.float64]:
    return np.zeros(n)


def _keys(letters: NDArray[np.uint8], start: Int64, end: Int64, n_keys: int) -> Keys:
    """Words as keys: shape (n, n_keys)."""
    at: Keys = np.ndarray((len(letters) - LETTERS + 1,), "<u8", letters, strides=(1,))
    keys = np.empty((len(start), n_keys), np.uint64)
    for i in range(n_keys):
        length = np.clip(end - start - i * LETTERS, 0, LETTERS)
        keys[:, i] = at[start + i * LETTERS] & _MASKS[length]
    return keys


_NAME = re.compile(r"[^\W\d]\w*")
_NUMBER = re.compile(r"0\.\d*[1-9]\d*")


def _weights(words: Keys) -> NDArray[np.float64]:
    """Log-odds of the numbers in front of facts; nan for words that are none between 0 and 1."""
    codes, texts = numbered_words(words)
    return np.array([log_odds(float(t)) if _NUMBER.fullmatch(t) else np.nan for t in texts])[codes]


def _of_predicates(
    predicate: Keys,
    words: list[Keys],
    weight: NDArray[np.float64] | None,
    where: tuple[Int64, Int64, NDArray[np.int32], bool],
) -> Iterator[tuple[Int64, Piece]]:
    rows, begin, database, truth = where
    codes, names = numbered_words(predicate)
    for name, mine in zip(names, groups(codes), strict=True):
        if weight is not None:
            mine = mine[~np.isnan(weight[mine])]
        if len(mine) and _NAME.fullmatch(name):
            lines = rows[mine]
            truths, weights = np.full(len(mine), truth), None if weight is None else weight[mine]
            yield lines, Piece(name, tuple(w[mine] for w in words), truths, database[lines], begin[mine], weights)


def log_odds(probability: float) -> float:
    """The weight of soft evidence.

    >>> log_odds(0.5)
    0.0
    """
    return float(np.log(probability) - np.log1p(-probability))
