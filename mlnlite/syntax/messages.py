"""What can be wrong with a text: the table of stable codes, each with the sentence that its user reads."""

from __future__ import annotations

from mlnlite.errors import Diagnostic
from mlnlite.source import Span

MESSAGES: dict[str, str] = {
    # any statement
    "E101": "found {found}, expected {expected}",
    "E102": "the statement ends too early: expected {expected}",
    "E103": "the line ends while a `{opened}` is open: expected {expected}",
    "E104": "this `{found}` closes nothing",
    "E105": "`{found}` is not an operator here",
    "E106": "a chain of `{operator}` has no agreed reading without parentheses",
    "E107": "a formula that ends in a dot is hard and has no weight",
    "E108": "`{number}` is not separated from what follows it",
    "E109": "a second statement on the same line, starting at {found}",
    "E110": "{construct} is not supported",
    "E111": "unknown directive `{found}`",
    "E112": "`{directive}` {problem}",
    "E113": "the comment that starts here is never closed",
    "E114": "the quote that starts here is not closed on this line",
    "E115": "{found} is not a character of the language",
    "E116": "nested deeper than {limit} levels",
    "E117": "two dialects in one model: variables are written `{marked}` at {place}, but `{bare}` here",
    "E118": "the text is written in the {actual} dialect but is to be read in the {asked} one: `{found}` {meaning}",
    "E119": "the formula has a constant `{name}` and a variable `?{name}`",
    "E120": "`{name}` is a variable here, but {place} declares it as a constant of `{type}`",
    "E121": "the weight `{weight}` has no formula after it",
    "E122": "`{found}` is not a function that a weight can use",
    "E123": "the number `{found}` is too large",
    "E124": "`{found}` is neither a variable nor a constant of the standard dialect",
    "E125": "`+{name}` asks for one weight for each constant, but `{name}` is a constant already",
    "E126": "`{name}()` has empty parentheses",
    "E127": "`{quantifier}` does not say which variables it binds",
    "E128": "{found} is not a quote here",
    "E129": "the probability {found} does not lie between 0 and 1",
    # files
    "E130": "there is no file `{path}`",
    "E131": "`{path}` is a folder, not a file",
    "E132": "`{path}` is not a text file: byte {offset} is zero",
    "E133": "`{path}` is not UTF-8 text: byte 0x{byte:02x} at offset {offset} cannot be read",
    "E134": "`{path}` is empty",
    "E135": "`{path}` has {size} MB; at most {limit} MB can be read at once",
    "E136": "`{path}` cannot be read: {reason}",
    "E137": "the file to include, `{path}`, does not exist",
    "E138": "this file includes itself: {chain}",
    "E139": "files are included more than {limit} deep",
    "E140": "`{path}` does not say which file of the project is meant",
    # evidence
    "E141": "a second fact on the same line, starting at {found}",
    "E142": "a formula where a fact was expected: found {found} after the fact",
    "E143": "a fact does not end with a dot",
    "E144": "{construct} is not written like this, or does not stand here",
    "E145": "a fact cannot be both left open (`?`) and false (`!`)",
    "E146": "`{found}` is a variable, but every argument of a fact is a constant",
    "E147": "databases are separated by exactly three dashes alone on a line, found `{found}`",
    "E148": "{found} is not a truth value",
    # queries
    "E150": "an item of the query is empty",
    # expansions
    "E151": "`...` stands between two whole numbers, rising, at most {limit:,} apart",
    "E152": "the formula stands for more than {limit} formulas",
    "E153": "the macro `{found}` is not defined above",
    "E199": "more than {limit} mistakes; the rest of the file was not read",
}


EXPECTED: dict[str, str] = {
    "E105": "one of ! ^ v => <=>",
    "E106": "parentheses",
    "E108": "a blank",
    "E109": "the end of the line",
    "E111": "one of #unique #fixweight #include #group",
    "E113": "*/",
    "E114": 'a closing "',
    "E119": "different names",
    "E121": "a formula",
    "E122": "one of log logx ln log2 log10 logit exp sqrt",
    "E124": "letters, digits and _",
    "E125": "a variable",
    "E127": "variables",
    "E128": '"',
    "E129": "a number between 0 and 1",
    "E141": "the end of the line",
    "E142": "the end of the line",
    "E143": "the end of the line",
    "E145": "? or !",
    "E146": "a constant",
    "E147": "---",
    "E148": "a number from 0 to 1",
    "E150": "a predicate, an atom or a formula",
    "E151": "two whole numbers",
    "E153": "a macro that is defined above",
}
"""What could stand in the place of a mistake, for codes whose sentence does not say it."""


def mistake(code: str, span: Span | None, hint: str = "", **words: object) -> Diagnostic:
    """The diagnostic of `code` with `words` filled into its sentence."""
    found, expected = str(words.get("found", "")), str(words.get("expected", EXPECTED.get(code, "")))
    return Diagnostic(code, MESSAGES[code].format(**words), span, hint, found=found.strip("`"), expected=expected)
