"""`mlnlite test`: the @test lines of a model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from mlnlite.cli.options import FILE, dialect_option

if TYPE_CHECKING:
    from mlnlite.model.model import Model
    from mlnlite.syntax.tree import AnyDialect, Test


@click.command()
@click.argument("models", type=FILE, nargs=-1, required=True, metavar="MODEL...")
@click.option("-e", "--evidence", type=FILE, multiple=True, metavar="FILE", help="Facts that all tests start from.")
@dialect_option
@click.pass_context
def test(
    ctx: click.Context, models: tuple[Path, ...], evidence: tuple[Path, ...], *, dialect: AnyDialect | None
) -> None:
    """Run the lines `@test given FACTS query FORMULA = 0.44 +- 0.001` of a model. Exits with 1 if one fails."""
    from mlnlite.errors import MlnError
    from mlnlite.model.check import check
    from mlnlite.syntax.convert import rewritten
    from mlnlite.syntax.files import read_source
    from mlnlite.syntax.parse import parse_model
    from mlnlite.syntax.tree import Test

    program = rewritten(parse_model([read_source(path) for path in models], dialect))
    tests = [statement for statement in program.statements if isinstance(statement, Test)]
    if not tests:
        raise MlnError("the model has no tests", "write `@test query Cancer(Ann) = 0.44 +- 0.001`")
    model, n_failed = check(program), 0
    for item in tests:
        found = _probability(model, evidence, item)
        good = abs(found - item.probability) <= item.tolerance
        n_failed += not good
        given = f" given {item.given}" if item.given else ""
        verdict = "ok    " if good else "FAILED"
        expected = f"expected {item.probability:g} +- {item.tolerance:g}"
        click.echo(f"{verdict} {item.query}{given}: {found:.6g}, {expected}")
    click.echo(f"{len(tests) - n_failed} of {len(tests)} tests hold")
    if n_failed:
        ctx.exit(1)


def _probability(model: Model, files: tuple[Path, ...], item: Test) -> float:
    """The probability that a test asks for."""
    import mlnlite as ml
    from mlnlite.model.facts import check_evidence
    from mlnlite.source import Source
    from mlnlite.syntax.evidence import parse_evidence
    from mlnlite.syntax.files import read_source
    from mlnlite.syntax.queries import split_queries

    facts = "\n".join(split_queries(item.given)) if item.given else ""
    sources = [*(read_source(path) for path in files), Source("<test>", facts)]
    programs = [parse_evidence(source) for source in sources]
    evidence = check_evidence(programs, model, together=True)
    answer = ml.marginal(model, evidence, [item.query])
    if len(answer.names) != 1:
        message = f"{item.query} asks for {len(answer.names)} probabilities; a test asks for one"
        raise ml.QueryMistake([ml.Diagnostic("E513", message, item.span, "put constants in place of its variables")])
    return float(answer.probabilities[0])
