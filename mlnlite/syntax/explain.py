"""Why a statement does not follow the grammar, in its user's words."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass

from mlnlite.errors import Diagnostic
from mlnlite.source import Span
from mlnlite.syntax.build import Place
from mlnlite.syntax.foreign import CONSTRUCTS, foreign_operator
from mlnlite.syntax.messages import mistake
from mlnlite.syntax.tree import Dialect


@dataclass(frozen=True, slots=True)
class Failure:
    """A statement that the parser gave up on.

    Attributes:
        place: where the statement stands.
        text: the statement.
        at: offset in it of what did not fit.
        expected: names of the terminals that would have fitted.
        dialect: the dialect it was read in.
        rule: the rule it was read by.
    """

    place: Place
    text: str
    at: int
    expected: frozenset[str]
    dialect: Dialect
    rule: str

    def span(self, start: int, end: int) -> Span:
        """Characters `start` to `end` of the statement, in its source."""
        return self.place.span(start, end)

    @property
    def found_text(self) -> str:
        """The word or sign that did not fit; empty at the end."""
        match = _FOUND.match(self.text, self.at)
        return match[0] if match else ""

    @property
    def found(self) -> str:
        """The same as the message says it."""
        return f"`{self.found_text}`" if self.found_text else "the end of the statement"

    @property
    def found_span(self) -> Span:
        """Where it is; the place just behind the statement at the end."""
        return self.span(self.at, self.at + max(1, len(self.found_text)))


_FOUND = re.compile(r'<=>|=>|=/=|!=|---+|->|\?[\w\']+|-?\w[\w\']*(?:[-.:]\w+)*|"(?:[^"\\\n]|\\[^\n])*"|\S')
_FORMULA = {"NAME", "NOT", "QUANTIFIER"}
_TERM = {"WORD", "STRING"}
_WORDS = {
    "LPAR": "`(`",
    "RPAR": "`)`",
    "LBRACE": "`{`",
    "RBRACE": "`}`",
    "COMMA": "`,`",
    "EQUAL": "`=`",
    "QUESTION": "`?`",
    "NOT": "`!`",
    "NUMBER": "a number",
    "AND": "`^`",
    "OR": "`v`",
    "IMPLIES": "`=>`",
    "IFF": "`<=>`",
    "$END": "the end of the statement",
}


def explain(failure: Failure) -> Diagnostic:
    """The diagnostic of a failure: the first rule that recognises it, else what was found and what was expected."""
    for rule in _RULES:
        diagnostic = rule(failure)
        if diagnostic:
            return diagnostic
    return _unexpected(failure)


def expectation(failure: Failure) -> str:
    """What would have fitted: at most four things, the likeliest first.

    Terms, formulas and connectives are named as such.
    """
    left, said = set(failure.expected), []
    if _FORMULA <= left:
        said.append("a formula")
        left = left & {"RPAR", "COMMA"}
    if left & _TERM or left == {"VARIABLE"}:
        said.append(_term_words(failure))
        left -= _TERM | {"VARIABLE", "PLUS"}
    order = ["COMMA", "RPAR", "LPAR", "LBRACE", "RBRACE", "NOT", "QUESTION", "NUMBER", "AND", "OR", "IMPLIES", "IFF", "$END", "EQUAL"]
    if "NAME" in left:
        said.append("a type" if failure.rule == "declaration" and left == {"NAME"} else "a name")
    said += [_WORDS[name] for name in order if name in left]
    return said[0] if len(said) == 1 else f"{', '.join(said[:-1])} or {said[-1]}"


def _term_words(failure: Failure) -> str:
    if failure.rule in ("fact", "type_declaration"):
        return "a constant"
    if failure.expected & _TERM:
        return "a variable or a constant"
    return "a variable such as `?x`" if failure.dialect == "prac" else "a variable"


# --- rules, tried in this order


def _foreign(failure: Failure) -> Diagnostic | None:
    foreign = foreign_operator(failure.text, failure.at)
    if foreign is None:
        return None
    start, end, advice = foreign
    return mistake("E105", failure.span(start, end), advice, found=failure.text[start:end])


def _construct(failure: Failure) -> Diagnostic | None:
    for pattern, name, advice in CONSTRUCTS:
        for match in pattern.finditer(failure.text):
            if match.start() <= failure.at <= match.end():
                return mistake("E110", failure.span(match.start(), match.end()), advice, construct=name)
    return None


def _quote(failure: Failure) -> Diagnostic | None:
    character = failure.text[failure.at : failure.at + 1]
    if character == '"' and not failure.found_text[1:].endswith('"'):
        return mistake("E114", failure.found_span, 'write `"` where the text ends, on the same line')
    if character in "'`‘“" and character:
        return mistake("E115", failure.found_span, 'text with spaces goes in double quotes: "any text"', found=failure.found)
    return None


def _strange(failure: Failure) -> Diagnostic | None:
    character = failure.text[failure.at : failure.at + 1]
    if not character or (character.isascii() and character.isprintable()) or character.isalnum():
        return None
    name = unicodedata.name(character, "no name")
    shown = f"`{character}`" if character.isprintable() and not character.isspace() else "this invisible character"
    hint = "it often comes along when text is copied from a document; delete it or replace it by a plain blank"
    return mistake("E115", failure.found_span, hint, found=f"{shown} (U+{ord(character):04X}, {name.lower()})")


def _variable_mark(failure: Failure) -> Diagnostic | None:
    if not failure.found_text.startswith("?"):
        return None
    if failure.rule == "fact":
        return _unknown_fact(failure)
    if failure.dialect == "standard" and failure.expected & (_TERM | {"NAME"}):
        meaning = "starts with `?`, which is no variable there"
        hint = "choose the dialect `prac`, or write variables in lower case without `?`"
        words = {"actual": "prac", "asked": "standard", "found": failure.found_text, "meaning": meaning}
        return mistake("E118", failure.found_span, hint, **words)
    return None


def _unknown_fact(failure: Failure) -> Diagnostic:
    if "NOT" in failure.expected:
        hint = "leave the fact out: what is not listed is unknown unless its predicate is closed"
        return mistake("E145", failure.found_span, hint, name=failure.found_text[1:])
    return mistake("E146", failure.found_span, "write the name of a constant, without `?`", found=failure.found_text)


def _chain(failure: Failure) -> Diagnostic | None:
    operator = failure.found_text
    if operator not in ("=>", "<=>") or "$END" not in failure.expected | {"RPAR"} & failure.expected and "RPAR" not in failure.expected:
        return None
    hint = f"write `a {operator} (b {operator} c)` or `(a {operator} b) {operator} c`"
    return mistake("E106", failure.found_span, hint, operator=operator)


def _closing(failure: Failure) -> Diagnostic | None:
    if failure.found_text in (")", "}") and "$END" in failure.expected:
        return mistake("E104", failure.found_span, "delete it, or open it further left", found=failure.found_text)
    return None


def _empty_parentheses(failure: Failure) -> Diagnostic | None:
    before = re.search(r"([\w'-]+)\s*\(\s*$", failure.text[: failure.at])
    if failure.found_text != ")" or before is None:
        return None
    span = failure.span(before.start(), failure.at + 1)
    return mistake("E126", span, f"a predicate without arguments is written `{before[1]}`", name=before[1])


def _weight_alone(failure: Failure) -> Diagnostic | None:
    text = failure.text.strip()
    if failure.at < len(failure.text.rstrip()) or not re.fullmatch(r"@?\s*[-+.\d][-+.\deE*/\s]*", text):
        return None
    hint = "write the weight and its formula on one line, with a space between them"
    return mistake("E121", failure.span(0, len(text)), hint, weight=text)


def _unknown_function(failure: Failure) -> Diagnostic | None:
    call = re.match(r"@?\s*([^\W\d]\w*)\s*\(\s*[-+.\d][^()]*\)\s+(?=[!(\w])", failure.text)
    if call is None or call.end() != failure.at or failure.rule == "fact":
        return None
    hint = "weights are numbers or + - * / ^ and log, ln, log2, log10, logx, logit, exp, sqrt of numbers"
    return mistake("E122", failure.span(call.start(1), call.end(1)), hint, found=call[1])


def _final_dot(failure: Failure) -> Diagnostic | None:
    if failure.rule == "fact" and failure.found_text == "." and "$END" in failure.expected:
        return mistake("E143", failure.found_span, "drop the dot: a fact is certain anyway")
    return None


def _second_statement(failure: Failure) -> Diagnostic | None:
    rest = re.match(r"[!*@]?-?[\w.]", failure.text[failure.at :])
    if "$END" not in failure.expected or rest is None:
        return None
    if failure.rule == "fact":
        return mistake("E141", failure.found_span, "write one fact a line", found=failure.found)
    after_dot = failure.text[: failure.at].rstrip().endswith(".")
    if after_dot or re.match(r"[-@.\d]", failure.found_text):
        return mistake("E109", failure.found_span, "write one statement a line", found=failure.found)
    return None


def _not_a_fact(failure: Failure) -> Diagnostic | None:
    if failure.rule == "fact" and "$END" in failure.expected and failure.found_text in ("^", "v", "=>", "<=>", "=", "!="):
        hint = "evidence lists single facts, one a line; formulas belong in the model"
        return mistake("E142", failure.found_span, hint, found=failure.found)
    return None


def _too_early(failure: Failure) -> Diagnostic | None:
    if failure.found_text:
        return None
    opened = _open_parenthesis(failure.text, failure.at)
    if opened is None:
        hint = "a formula goes on in the next line only after a connective or inside parentheses"
        span = failure.span(max(0, len(failure.text.rstrip()) - 1), len(failure.text.rstrip()))
        return mistake("E102", span, hint, expected=expectation(failure))
    return _unclosed(failure, opened)


def _unclosed(failure: Failure, opened: int) -> Diagnostic:
    end = len(failure.text.rstrip())
    hint = f"the statement ends after `{failure.text[:end].split()[-1]}`"
    words = {"found": "the statement ends", "expected": expectation(failure)}
    return mistake("E103", failure.span(opened, opened + 1), hint, **words)


def _unexpected(failure: Failure) -> Diagnostic:
    opened = _open_parenthesis(failure.text, failure.at)
    hint = _hint(failure)
    if not hint and opened is not None and "RPAR" in failure.expected:
        hint = f"the `(` at column {failure.span(opened, opened + 1).column} is still open"
    return mistake("E101", failure.found_span, hint, found=failure.found, expected=expectation(failure))


def _hint(failure: Failure) -> str:
    before = failure.text[: failure.at].rstrip()
    if not before and failure.found_text in ("^", "v", "=>", "<=>", ","):
        return "to go on from the line above, put the connective at its end"
    if failure.found_text == "," and "AND" in failure.expected:
        return "conjunction is written `^`"
    if failure.expected & {"COMMA"} and re.match(r"[\w\"]", failure.found_text):
        return 'separate arguments by commas; a constant with a space in it goes in quotes: "any text"'
    if failure.found_text.startswith("#"):
        return "a comment starts with `//`"
    if failure.dialect == "prac" and failure.expected == {"VARIABLE"} and failure.found_text:
        return f"variables of the prac dialect start with `?`: `?{failure.found_text}`"
    return ""


def _open_parenthesis(text: str, end: int) -> int | None:
    opened = []
    for match in re.finditer(r'"(?:[^"\\\n]|\\[^\n])*"|[()]', text[:end]):
        if match[0] == "(":
            opened.append(match.start())
        elif match[0] == ")" and opened:
            opened.pop()
    return opened[-1] if opened else None


_RULES: tuple[Callable[[Failure], Diagnostic | None], ...] = (
    _construct,
    _foreign,
    _not_a_fact,
    _quote,
    _strange,
    _variable_mark,
    _chain,
    _closing,
    _empty_parentheses,
    _weight_alone,
    _unknown_function,
    _final_dot,
    _second_statement,
    _too_early,
)
