"""Every example in README and docs runs, and everything public is documented."""

import ast
import doctest
import re
import shlex
import shutil
import textwrap
from pathlib import Path

import pytest
from click.testing import CliRunner

import mlnlite
from mlnlite.cli import COMMANDS
from mlnlite.cli import mlnlite as command

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "docs" / "examples"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"^( *)```(python|console)\n(.*?)^\1```", re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_examples_run(page, tmp_path, monkeypatch):
    shutil.copytree(EXAMPLES, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    names = {"__name__": page.stem}
    for _, kind, text in BLOCK.findall(page.read_text(encoding="utf-8")):
        if kind == "python":
            run_python(textwrap.dedent(text), names)
        else:
            run_console(textwrap.dedent(text))


def run_python(text, names):
    if ">>>" not in text:
        exec(compile(text, "<example>", "exec"), names)
        return
    test = doctest.DocTestParser().get_doctest(text, names, "example", None, 0)
    report = []
    doctest.DocTestRunner(optionflags=doctest.ELLIPSIS, verbose=False).run(test, out=report.append, clear_globs=False)
    names.update(test.globs)
    assert not report, "".join(report)


def run_console(text):
    for step in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
        line, _, expected = step.partition("\n")
        words = shlex.split(line)
        if words[0] == "mlnlite":
            result = CliRunner().invoke(command, words[1:], prog_name="mlnlite")
            assert result.exit_code == expected_code(expected), result.output
            found = result.output
        elif words[0] == "cat":
            found = Path(words[1]).read_text(encoding="utf-8")
        else:
            continue
        compare(line, expected, found)


def expected_code(expected):
    return 2 if re.search(r"^(\S+: )?error ", expected, re.MULTILINE) else 0


def compare(line, expected, found):
    """Literally, except that `...` stands for anything and blank ends do not count; nothing shown is nothing asked."""
    if not expected.strip():
        return
    expected, found = ("\n".join(part.rstrip() for part in t.strip("\n").split("\n")) + "\n" for t in (expected, found))
    checker = doctest.OutputChecker()
    assert checker.check_output(expected, found, doctest.ELLIPSIS), f"$ {line}\n{found}"


def public_names():
    tree = ast.parse((ROOT / "mlnlite" / "__init__.py").read_text(encoding="utf-8"))
    imports = (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom))
    return sorted({a.asname for node in imports for a in node.names if a.asname and a.asname == a.name})


def reference():
    return "\n".join(page.read_text(encoding="utf-8") for page in (ROOT / "docs" / "reference").rglob("*.md"))


def test_public_names_exist():
    assert {"learn", "marginal", "map_state", "read_model", "Network"} <= set(public_names())
    for name in public_names():
        assert getattr(mlnlite, name) is not None


def test_public_names_are_documented():
    text = reference()
    assert [name for name in public_names() if not re.search(rf"\b{name}\b", text)] == []


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_commands_and_options_are_documented(name):
    text = reference()
    assert f"## mlnlite {name}" in text
    options = [o for p in command.get_command(None, name).params for o in p.opts if o.startswith("--")]
    assert [option for option in options if option not in text] == []
