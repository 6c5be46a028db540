"""Compiled: facts on lines of their own, from bytes to numbers of words."""

# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: ANN001, ANN201, ANN202

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mlnlite.compiled import compiled, compiled_part
from mlnlite.syntax.letters import PADDING
from mlnlite.syntax.pieces import ARITY, BEGIN, CERTAIN, CHANCE, FIRST, IN_DATABASE, NUMBER, TRUTH, UNKNOWN, WIDEST

LONGEST = PADDING // 2
"""Bytes of the longest word that is read here."""
END, FULL, LEFT = range(3)
"""Why reading stops: all is read; no room for more facts; lines are left that are no such facts."""
POSITION, SKIPPED, DATABASE, SEPARATOR, FIRST_LEFT, N_FACTS, N_WORDS, N_STATE = range(8)
"""The state: the next byte; how many bytes before it go on with a character; the database; whether `---` was read last;
the character from which on lines are left, or -1; how many facts there are, and how many words these have."""


class Text(NamedTuple):
    """A text as bytes.

    Attributes:
        letters: shape (n,), with `PADDING`.
        blocks: shape (n - 7,), the eight bytes from each one on as a number.
    """

    letters: NDArray[np.uint8]
    blocks: NDArray[np.uint64]


class Found(NamedTuple):
    """Facts in order, and their words.

    Attributes:
        rows: shape (n, N_COLUMNS).
        keys: of each word the first eight bytes, or a mixture of all.
        begins: of each word.
        lengths: of each word, in bytes; or if it is one of the words before it, its distance to that, negative.
    """

    rows: NDArray[np.int64]
    keys: NDArray[np.uint64]
    begins: NDArray[np.int64]
    lengths: NDArray[np.int32]


class Words(NamedTuple):
    """All words so far, each once.

    Attributes:
        letters: the bytes of all of them, a newline behind each.
        begins: shape (n,), where each begins, and where the next one will.
        table: shape (2 n, 2), n a power of 2, an open hash table: keys, and lengths and numbers, 0 where it is free.
    """

    letters: NDArray[np.uint8]
    begins: NDArray[np.int64]
    table: NDArray[np.int64]


# What a byte is: a letter or digit, a sign that may stand in a word, one that a letter must follow, or of no word.
_PLAIN, _INSIDE, _JOINS, _OUTSIDE = range(4)
_KIND = np.full(256, _OUTSIDE, np.uint8)
_KIND[list(b"0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_")] = _PLAIN
_KIND[list(b"'$~")], _KIND[list(b"-.:;/")] = _INSIDE, _JOINS
_NEWLINE, _TAB, _BLANK, _QUOTE, _BACKSLASH, _SLASH, _DELETE = b'\n\t "\\/\x7f'
_DASH, _DOT, _ZERO, _NINE, _NOT, _QUESTION, _EQUAL, _COMMA, _OPENS, _CLOSES = b"-.09!?=,()"
_SPREAD, _HIGH = np.uint64(0x9E3779B97F4A7C15), np.uint64(29)
_MASKS = np.array([(1 << (8 * n)) - 1 for n in range(9)], np.uint64)
_BITS = 32  # of a number in the table of words; the length stands above them
_NUMBER = (1 << _BITS) - 1


@compiled
def read_lines(text, found, state):
    """Reads facts until there is a reason to stop, which it returns: see `END`.

    Args:
        text: whole lines.
        found: the facts, which become more.
        state: shape (N_STATE,), where reading is, brought up to date.
    """
    letters, rows, room, end = text.letters, found.rows, len(found.keys) - WIDEST, len(text.letters) - PADDING
    at, n_facts, n_words = state[POSITION], state[N_FACTS], state[N_WORDS]
    reason, back = END, n_words + 1
    while at < end and reason == END:
        if n_facts == len(rows) or n_words > room:
            reason = FULL
            break
        row = rows[n_facts]
        behind = _read_fact(text, _behind_blanks(letters, at), found, row, n_words, back)
        if behind < 0:
            at = _pass_line(letters, at, state)
        elif state[FIRST_LEFT] >= 0:
            reason = LEFT
        else:
            row[BEGIN], row[IN_DATABASE] = row[BEGIN] - state[SKIPPED], state[DATABASE]
            back = row[ARITY] + 1 + (row[CHANCE] == NUMBER)
            n_words += back
            n_facts += 1
            state[SEPARATOR], at = 0, behind
    state[POSITION], state[N_FACTS], state[N_WORDS] = at, n_facts, n_words
    return LEFT if reason == END and state[FIRST_LEFT] >= 0 else reason


@compiled
def number_words(text, found, done, numbers, words, n_known):
    """Gives words their numbers: that of a word known before, or the next one.

    Args:
        text: where the words stand.
        found: the words.
        done: how many of these have numbers.
        numbers: shape (n,), of the first n of these words, written here.
        words: all words, which become more.
        n_known: how many these are.

    Returns:
        How many have numbers now, fewer than n if there is no room for new words, and how many words are known.
    """
    letters, keys, begins, lengths = text.letters, found.keys, found.begins, found.lengths
    table, last, shift = words.table, len(words.table) - 1, _shift(words.table)
    for i in range(done, len(numbers)):
        key, begin, length = keys[i], begins[i], lengths[i]
        if length < 0:
            numbers[i] = numbers[i + length]
            continue
        slot, number = np.int64((key * _SPREAD) >> shift), -1
        while number < 0 and table[slot, 1]:
            if np.uint64(table[slot, 0]) == key and table[slot, 1] >> _BITS == length:
                number = (table[slot, 1] & _NUMBER) - 1
                if length > 8 and not _is(letters, begin, length, words, number):
                    number = -1
            slot = (slot + 1) & last
        if number < 0:
            number, at = n_known, words.begins[n_known]
            if n_known + 1 == len(words.begins) or at + length >= len(words.letters):
                return i, n_known
            table[slot, 0], table[slot, 1] = np.int64(key), (length << _BITS) + number + 1
            for k in range(length):
                words.letters[at + k] = letters[begin + k]
            words.letters[at + length] = _NEWLINE
            words.begins[number + 1] = at + length + 1
            n_known += 1
        numbers[i] = number
    return len(numbers), n_known


@compiled
def enter(old, table):
    """Enters what one table of words holds into another, empty one."""
    shift = _shift(table)
    for i in range(len(old)):
        if old[i, 1]:
            slot = np.int64((np.uint64(old[i, 0]) * _SPREAD) >> shift)
            while table[slot, 1]:
                slot = (slot + 1) & (len(table) - 1)
            table[slot] = old[i]


# --- lines


@compiled_part
def _read_fact(text, at, found, row, first, back):
    """Reads the fact that begins at a byte, if its line is one; returns the begin of the next line, or -1."""
    letters = text.letters
    begin, chance, front_end, is_value = at, CERTAIN, at, False
    if letters[at] == _NOT or letters[at] == _QUESTION:
        chance = UNKNOWN if letters[at] == _QUESTION else CERTAIN
        at += 1
    stop = _behind_name(letters, at)
    if letters[stop] != _OPENS and at == begin:
        front_end = _behind_term(letters, at)
        at = _behind_blanks(letters, front_end)
        is_value = front_end > begin and letters[at] == _EQUAL
        if is_value:
            at = _behind_blanks(letters, at + 1)
        elif at > front_end > begin and _is_chance(letters, begin, front_end):
            chance = NUMBER
        else:
            return -1
        stop = _behind_name(letters, at)
    if stop == at or letters[stop] != _OPENS or _ZERO <= letters[at] <= _NINE or stop - at > LONGEST:
        return -1
    _note(text, at, stop, found, first, back)
    at, arity = _read_arguments(text, stop, found, first + 1, back)
    if front_end > begin:
        _note(text, begin, front_end, found, first + 1 + arity, back)
    row[BEGIN], row[FIRST], row[ARITY] = begin, first, arity + is_value
    row[TRUTH], row[CHANCE] = letters[begin] != _NOT, chance
    return at


@compiled_part
def _read_arguments(text, at, found, first, back):
    """Reads the arguments behind a bracket; returns the begin of the next line, or -1, and how many there are."""
    letters, n, sign = text.letters, 0, _COMMA
    while sign == _COMMA and n < WIDEST - 2:
        at = _behind_blanks(letters, at + 1)
        stop = _behind_term(letters, at)
        if stop == at:
            return -1, n
        _note(text, at, stop, found, first + n, back)
        n += 1
        at = _behind_blanks(letters, stop)
        sign = letters[at]
    at = _behind_comment(letters, _behind_blanks(letters, at + 1))
    return at + 1 if sign == _CLOSES and letters[at] == _NEWLINE else -1, n


@compiled_part
def _note(text, at, stop, found, index, back):
    """Notes a word, without its quotes; or that it is the one `back` words before, as it often is in a list."""
    quoted = text.letters[at] == _QUOTE
    at += quoted
    length = stop - quoted - at
    key = text.blocks[at] & _MASKS[min(length, 8)]
    for i in range(8, length, 8):
        key = (key ^ (key >> _HIGH)) * _SPREAD + (text.blocks[at + i] & _MASKS[min(length - i, 8)])
    before = index - back
    if length <= 8 and before >= 0 and found.keys[before] == key and found.lengths[before] <= 8:
        length = -back
    found.keys[index], found.begins[index], found.lengths[index] = key, at, length


@compiled_part
def _pass_line(letters, at, state):
    """Passes over a line that is no such fact: blank, `---`, or one that is left with those that are left already.

    Returns the begin of the next line.
    """
    begin, at = at, _behind_blanks(letters, at)
    dashes = letters[at] == _DASH and letters[at + 1] == _DASH and letters[at + 2] == _DASH
    at = _behind_comment(letters, _behind_blanks(letters, at + 3 * dashes))
    if letters[at] == _NEWLINE:
        if state[FIRST_LEFT] < 0 and dashes:
            state[DATABASE] += 1
            state[SEPARATOR] = 1
        return at + 1
    if state[FIRST_LEFT] < 0:
        state[FIRST_LEFT] = begin - state[SKIPPED]
    while letters[at] != _NEWLINE:
        state[SKIPPED] += (letters[at] & 0xC0) == 0x80
        at += 1
    return at + 1


# --- words: where each ends is where it begins if there is none


@compiled_part
def _behind_blanks(letters, at):
    while letters[at] in (_BLANK, _TAB):
        at += 1
    return at


@compiled_part
def _behind_comment(letters, at):
    """The end of the line, if a comment of plain letters begins here."""
    if letters[at] != _SLASH or letters[at + 1] != _SLASH:
        return at
    begin = at
    while _BLANK <= letters[at] < _DELETE or letters[at] == _TAB:
        at += 1
    return at if letters[at] == _NEWLINE else begin


@compiled_part
def _behind_name(letters, at):
    while _KIND[letters[at]] == _PLAIN:
        at += 1
    return at


@compiled_part
def _behind_term(letters, at):
    """The end of a word or a quoted text without escapes: see the terminals WORD and STRING of the grammars."""
    begin, last = at, at + LONGEST
    if letters[at] == _QUOTE:
        at += 1
        while _BLANK <= letters[at] < _DELETE and letters[at] != _QUOTE and letters[at] != _BACKSLASH:
            at += 1
        return at + 1 if letters[at] == _QUOTE and at < last else begin
    at += letters[at] == _DASH
    if _KIND[letters[at]] != _PLAIN:
        return begin
    at = _behind_name(letters, at)
    while _KIND[letters[at]] != _OUTSIDE and (_KIND[letters[at]] == _INSIDE or _KIND[letters[at + 1]] == _PLAIN):
        at = _behind_name(letters, at + 1)
    return at if at <= last else begin


@compiled_part
def _is_chance(letters, at, stop):
    """Whether a word is a number between 0 and 1: `0.7`."""
    positive = False
    for i in range(at + 2, stop):
        if not _ZERO <= letters[i] <= _NINE:
            return False
        positive = positive or letters[i] != _ZERO
    return positive and letters[at] == _ZERO and letters[at + 1] == _DOT


@compiled_part
def _shift(table):
    """How far to shift so that a number of 64 bits becomes a slot of a table."""
    n, shift = len(table), np.uint64(64)
    while n > 1:
        n >>= 1
        shift -= np.uint64(1)
    return shift


@compiled_part
def _is(letters, at, length, words, number):
    """Whether the bytes from a place on are a word."""
    i = 0
    while i < length and letters[at + i] == words.letters[words.begins[number] + i]:
        i += 1
    return i == length
