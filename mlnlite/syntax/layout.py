"""Text to text: one style for models and evidence, whatever the dialect. Comments and order stay; only blanks change.

Tokens are put apart by the same rules everywhere, so writing a written text again changes nothing.
"""

from __future__ import annotations

import re

from mlnlite.source import Source
from mlnlite.syntax.lines import Code, split_statements, strip_comments

_TOKEN = re.compile(
    r'//[^\n]*|/\*.*?\*/|"(?:[^"\\\n]|\\[^\n])*"|<=>|=>|:-|=/=|!=|<>|<=|>=|:=|\+-|\+\+|\.\.\.|---+|'
    r"[@#$?]?-?\w[\w'$~\\]*(?:[-.:;/](?=\w)[\w'$~\\]*)*|\S",
    re.DOTALL,
)
_AROUND = {"<=>", "=>", ":-", "=/=", "!=", "<>", "<=", ">=", ":=", "+-", "=", "<", ">", "^", "v", "|"}
LONGEST_WEIGHT = 80
"""Words and blanks of a weight that are kept as they are; no one writes longer ones."""
_OPENING = {"(", "[", "!", "*"}


def formatted(text: str) -> str:
    r"""The text in the style of the project: `P(x, y) ^ Q(x) => R(y)`, at most one blank line, no blanks at ends.

    >>> formatted("1.5   P( x,y )^Q(x)=>R(y)  // why\n\n\n")
    '1.5 P(x, y) ^ Q(x) => R(y)  // why\n'
    """
    source = Source("<text>", text.replace("\r\n", "\n").replace("\r", "\n"))
    code, _ = strip_comments(source)
    lines: list[str] = []
    for line in _logical_lines(source.text, code):
        if line or (lines and lines[-1]):
            lines.append(line)
    while lines and not lines[-1]:
        lines.pop()
    return "".join(f"{line}\n" for line in lines)


def _logical_lines(text: str, code: Code) -> list[str]:
    """Lines in the style; those inside a comment as they are."""
    continued = _continued(code)
    found: list[str] = []
    offset, comment = 0, False
    for line in text.split("\n"):
        bare = code.bare[offset : offset + len(line)]
        starts, ends = _comment_state(line, comment)
        if starts or ends or (line.strip() and not bare.strip() and "//" not in line):
            found.append(line.rstrip())
        else:
            indent = "    " if offset in continued and line.strip() else ""
            found.append(indent + _styled(line))
        comment = ends
        offset += len(line) + 1
    return found


def _comment_state(line: str, inside: bool) -> tuple[bool, bool]:
    """Whether a line begins inside a block comment, and whether it ends in one."""
    starts, at = inside, 0
    while True:
        if inside:
            end = line.find("*/", at)
            if end < 0:
                return starts, True
            inside, at = False, end + 2
        match = re.compile(r'"(?:[^"\\]|\\.)*"|//.*|/\*').search(line, at)
        if match is None:
            return starts, False
        inside, at = match[0] == "/*", match.end()


def _continued(code: Code) -> set[int]:
    """Offsets of lines on which a statement goes on."""
    found = set()
    for start, end in split_statements(code):
        at = code.text.find("\n", start, end)
        while at >= 0:
            found.add(at + 1)
            at = code.text.find("\n", at + 1, end)
    return found


def _styled(line: str) -> str:
    words: list[str] = []
    in_weight = True
    for match in _TOKEN.finditer(line):
        token = match[0]
        blank = line[match.start() - 1 : match.start()].isspace() if match.start() else False
        if words:
            in_weight = in_weight and not blank and len(words) < LONGEST_WEIGHT and _is_weight("".join(words))
            words.append("" if in_weight and not token.startswith("//") else _space(words[-1], token, had_blank=blank))
        words.append(token)
    return "".join(words)


def _space(before: str, token: str, *, had_blank: bool) -> str:
    """What stands between two tokens."""
    if token.startswith("//"):
        return "  "
    if before.startswith("/*") or token.startswith("/*") or before == ":":
        return " "
    if before in ("+", "@"):
        return " " if had_blank else ""
    if before in _OPENING or before in ("{", "?", "#") or token in (")", "]", "}", ",", ":"):
        return ""
    if before == "," or token in _AROUND or before in _AROUND:
        return " "
    return " " if had_blank and token != "." else ""


def _is_weight(text: str) -> bool:
    """Whether a line so far is part of a weight or a directive, where signs need no blanks around them."""
    return re.fullmatch(r"@?[-+*/^.\d()eE]*|@?[a-zA-Z]\w*\([-+*/^.\d()eE]*|#.*", text) is not None
