"""Why a statement does not follow the grammar, in its user's words."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass

from mlnlite.errors import Diagnostic
from mlnlite.source import Span
from mlnlite.syntax.foreign import CONSTRUCTS, OURS, foreign_operator
from mlnlite.syntax.messages import mistake
from mlnlite.syntax.place import Language, Place


@dataclass(frozen=True, slots=True)
class Failure:
    """A statement that the parser gave up on.

    Attributes:
        place: where the statement stands.
        text: the statement.
        at: offset in it of what did not fit.
        expected: names of the terminals that would have fitted.
        language: the language it was read in.
        rule: the rule it was read by.
    """

    place: Place
    text: str
    at: int
    expected: frozenset[str]
    language: Language
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
_CONNECTIVES = {"AND": "`^`", "OR": "`v`", "IMPLIES": "`=>`", "IFF": "`<=>`"}
_WORDS = {
    "NUMBER": "a number",
    "COMMA": "`,`",
    "LPAR": "`(`",
    "RPAR": "`)`",
    "LBRACE": "`{`",
    "RBRACE": "`}`",
    "RBRACKET": "`]`",
    "NOT": "`!`",
    "QUESTION": "`?`",
    "EQUAL": "`=`",
}


def explain(failure: Failure) -> Diagnostic:
    """The diagnostic of a failure: the first rule that recognises it, else what was found and what was expected."""
    for rule in _RULES:
        diagnostic = rule(failure)
        if diagnostic:
            return diagnostic
    return _unexpected(failure)


def expectation(failure: Failure) -> str:
    """What would have fitted, the likeliest first: terms, formulas, connectives by these names, signs as they are."""
    names = failure.expected
    if names >= _FORMULA and failure.language != "evidence":
        names = names & {"RPAR", "COMMA"}
        said = ["a formula"]
    elif names & _TERM or names == {"VARIABLE"}:
        names = names - _TERM - {"PLUS"}
        said = [_term_words(failure)]
    else:
        said = [_name_word(failure)] if "NAME" in names else []
        names = names - {"NOT", "NUMBER", "QUESTION"} if said == ["a fact"] else names
    connectives = [sign for name, sign in _CONNECTIVES.items() if name in names]
    said += [sign for name, sign in _WORDS.items() if name in names and (name != "EQUAL" or not connectives)]
    said += [f"a connective ({', '.join(connectives)})"] if connectives else []
    said += ["the end of the statement"] if "$END" in names else []
    return said[0] if len(said) == 1 else f"{', '.join(said[:-1])} or {said[-1]}"


def _name_word(failure: Failure) -> str:
    if failure.rule == "fact":
        return "a fact" if failure.at == 0 else "a predicate"
    return "a type" if "(" in failure.text[: failure.at] else "a predicate"


def _term_words(failure: Failure) -> str:
    if failure.rule in ("fact", "type_declaration"):
        return "a constant"
    if failure.expected & _TERM:
        return "a variable or a constant"
    return "a variable such as `?x`"


# --- rules, tried in this order


def _quantifier(failure: Failure) -> Diagnostic | None:
    match = re.search(r"\b(exists?|forall)\s*\(\s*[\w']*\s*$", failure.text[: failure.at], re.IGNORECASE)
    if match is None or failure.rule == "fact" or failure.found_text in ("", ",", ")"):
        return None
    variable = "?x" if failure.language == "prac" else "x"
    hint = f"write `{match[1].upper()} {variable} (...)`"
    return mistake("E127", failure.span(match.start(), match.end(1)), hint, quantifier=match[1])


def _foreign(failure: Failure) -> Diagnostic | None:
    foreign = foreign_operator(failure.text, failure.at)
    if foreign is None:
        return None
    start, end, advice = foreign
    return mistake("E105", failure.span(start, end), advice, found=failure.text[start:end])


def _construct(failure: Failure) -> Diagnostic | None:
    for pattern, name, advice in CONSTRUCTS:
        if failure.language == "evidence" and name.endswith("formula"):
            continue
        for match in pattern.finditer(failure.text):
            if not match.start() <= failure.at < match.end():
                continue
            if failure.language in ("standard", "prac") and name in OURS:
                return mistake("E144", failure.span(match.start(), match.end()), OURS[name], construct=name)
            return mistake("E110", failure.span(match.start(), match.end()), advice, construct=name)
    return None


def _quote(failure: Failure) -> Diagnostic | None:
    character = failure.text[failure.at : failure.at + 1]
    if character == '"' and failure.found_text == '"':
        return mistake("E114", failure.found_span, 'write `"` where the text ends, on the same line')
    if character and character in "'`\u2018\u201c":
        hint = 'a constant with a space in it goes in straight double quotes: "any text"'
        return mistake("E128", failure.found_span, hint, found=f"`{character}`")
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
        hint = "write the name of a constant, without `?`"
        return mistake("E146", failure.found_span, hint, found=failure.found_text)
    if failure.found_text == "?":
        return None
    if failure.language == "standard" and failure.expected & (_TERM | {"NAME"}):
        meaning = "starts with `?`, which is no variable there"
        hint = "choose the dialect `prac`, or write variables in lower case without `?`"
        words = {"actual": "prac", "asked": "standard", "found": failure.found_text, "meaning": meaning}
        return mistake("E118", failure.found_span, hint, **words)
    return None


def _chain(failure: Failure) -> Diagnostic | None:
    operator = failure.found_text
    if operator not in ("=>", "<=>") or not failure.expected & {"$END", "RPAR"} or "COMMA" in failure.expected:
        return None
    hint = f"write `a {operator} (b {operator} c)` or `(a {operator} b) {operator} c`"
    return mistake("E106", failure.found_span, hint, operator=operator)


def _closing(failure: Failure) -> Diagnostic | None:
    if failure.found_text in (")", "}") and "$END" in failure.expected:
        return mistake("E104", failure.found_span, "delete it, or open it further left", found=failure.found_text)
    if failure.text.startswith("*/", failure.at):
        hint = "a comment goes from `/*` to the first `*/`"
        return mistake("E104", failure.span(failure.at, failure.at + 2), hint, found="*/")
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


def _no_truth(failure: Failure) -> Diagnostic | None:
    number = re.match(r"[-+]\s*[\d.]+", failure.text)
    if failure.rule != "fact" or number is None or failure.at > 0:
        return None
    hint = "weights belong to the formulas of the model; that a fact is false is written `!`"
    return mistake("E148", failure.span(0, number.end()), hint, found=number[0])


def _separator(failure: Failure) -> Diagnostic | None:
    if failure.rule != "fact" or not failure.found_text.startswith("---"):
        return None
    return mistake("E147", failure.found_span, "put `---` alone on its line", found=failure.text)


def _final_dot(failure: Failure) -> Diagnostic | None:
    if failure.rule == "fact" and failure.found_text == "." and "$END" in failure.expected:
        return mistake("E143", failure.found_span, "drop the dot: a fact is certain anyway")
    return None


def _second_statement(failure: Failure) -> Diagnostic | None:
    rest = re.match(r"[,;]?\s*[!*@]?-?[\w.]", failure.text[failure.at :])
    if "$END" not in failure.expected or rest is None:
        return None
    if failure.rule == "fact":
        hint = "write one fact a line; a comment starts with `//`"
        return mistake("E141", failure.found_span, hint, found=failure.found)
    after_dot = failure.text[: failure.at].rstrip().endswith(".")
    if after_dot or re.match(r"[-@.\d]", failure.found_text):
        return mistake("E109", failure.found_span, "write one statement a line", found=failure.found)
    return None


def _not_a_fact(failure: Failure) -> Diagnostic | None:
    connective = failure.found_text in ("^", "v", "=>", "<=>", "=", "!=")
    quantified = re.match(r"(?i:exists?|forall)\s", failure.text)
    if failure.rule == "fact" and "$END" in failure.expected and (connective or quantified):
        hint = "evidence lists single facts, one a line; formulas belong in the model"
        return mistake("E142", failure.found_span, hint, found=failure.found)
    return None


def _too_early(failure: Failure) -> Diagnostic | None:
    end, opened = len(failure.text[: failure.at].rstrip()), _opened(failure)
    new_line = opened is not None and "\n" in failure.text[end : failure.at]
    if failure.found_text and not new_line:
        return None
    span, expected = failure.span(end - 1, end), expectation(failure)
    if opened is not None:
        hint = f"the `{failure.text[opened]}` {_where(failure, opened)} is not closed"
        return mistake("E103", span, hint, opened=failure.text[opened], expected=expected)
    hint = (
        "it may go on in the next line, if that is neither blank nor starts with a weight"
        if "a formula" in expected
        else ""
    )
    return mistake("E102", span, hint, expected=expected)


def _unexpected(failure: Failure) -> Diagnostic:
    opened = _opened(failure)
    hint = _hint(failure)
    if not hint and opened is not None and failure.expected & {"RPAR", "RBRACE"}:
        hint = f"the `{failure.text[opened]}` {_where(failure, opened)} is still open"
    return mistake("E101", failure.found_span, hint, found=failure.found, expected=expectation(failure))


def _where(failure: Failure, offset: int) -> str:
    """The place of another character of the statement; the line only if it is a different one."""
    span = failure.span(offset, offset + 1)
    line = "" if "\n" not in failure.text[offset : failure.at].rstrip() else f"line {span.line}, "
    return f"at {line}column {span.column}"


def _hint(failure: Failure) -> str:
    found, expected = failure.found_text, failure.expected
    for applies, hint in (
        (found == "," and re.match(r"@?[-+]?\d+,\d", failure.text), "a decimal number is written with a point, as 1.5"),
        (found == "%" and failure.text[: failure.at].isdigit(), "a probability of 50 % is written `p=0.5:`"),
        (found == ";", "a statement ends with its line, without a sign"),
        (failure.at == 0 and found in _SIGNS, "to go on from the line above, end that line with the connective"),
        (found == "?" and failure.language == "prac", "write the name of the variable right after its `?`"),
        (found == "*" and failure.rule == "fact", "`*` belongs to the declaration of the predicate in the model"),
        (found in ("=", "!=", "=/="), "`=` compares terms; that two formulas are equivalent is written `<=>`"),
        (
            found in ("!", "?") and failure.rule == "declaration",
            "an argument has one marker: `!` exactly one, `?` at most one",
        ),
        (found == "," and failure.text.split("=")[0].strip().isidentifier(), "the constants of a type go in braces"),
        (found == "," and "AND" in expected, "conjunction is written `^`"),
        (found.startswith(("#", "%")), "a comment starts with `//`"),
        (expected == {"VARIABLE"}, f"variables of the prac dialect start with `?`: `?{found}`"),
        (expected >= {"COMMA", "RPAR"} and found[:1].isalnum(), _SEPARATE),
        (expected >= {"COMMA", "RBRACE"} and found[:1].isalnum(), _SEPARATE),
        (expected >= {"AND", "$END"} and found[:1].isalpha(), "put a connective between them, or write two lines"),
        (expected >= {"NUMBER"} and found[:1].isalpha(), "a weight is made of numbers; then a space, then the formula"),
    ):
        if applies:
            return hint
    return ""


_SIGNS = ("^", "v", "=>", "<=>", ",")
_SEPARATE = 'separate them by a comma; a constant with a space in it goes in quotes: "any text"'


def _opened(failure: Failure) -> int | None:
    """Offset of the innermost parenthesis or brace that is open where the failure is."""
    opened: list[int] = []
    for match in re.finditer(r'"(?:[^"\\\n]|\\[^\n])*"|[(){}]', failure.text[: failure.at]):
        if match[0] in "({":
            opened.append(match.start())
        elif match[0] in ")}" and opened:
            opened.pop()
    return opened[-1] if opened else None


_RULES: tuple[Callable[[Failure], Diagnostic | None], ...] = (
    _quantifier,
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
    _no_truth,
    _separator,
    _final_dot,
    _second_statement,
    _too_early,
)
