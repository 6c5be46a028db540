"""Files that commands write: whole or not at all."""

from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path

import click

from mlnlite.errors import MlnError


def verify_writable(path: Path) -> None:
    """Complains before any work if `path` cannot be written after it.

    Raises:
        MlnError: with the reason.
    """
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise MlnError(f"{path} cannot be written: it is a folder", "give the name of a file in it")
    if not target.parent.is_dir():
        raise MlnError(f"{path} cannot be written: there is no folder {path.parent}", "make it first")
    exists = target.exists()
    if not os.access(target.parent, os.W_OK) or (exists and not os.access(target, os.W_OK)):
        what = f"{path} is read-only" if exists else f"the folder {path.parent} is read-only"
        raise MlnError(f"{path} cannot be written: {what}", "give another place with -o")


def write_whole(path: Path, text: str) -> None:
    """Writes `text` so that `path` holds either all of it or what it held before.

    Raises:
        MlnError: if the disk or the folder refuses.
    """
    target = os.path.realpath(path)
    try:
        if os.path.exists(target) and not stat.S_ISREG(os.stat(target).st_mode):
            Path(target).write_text(text, encoding="utf-8")  # a pipe or a terminal cannot be replaced
        else:
            _replace(target, text)
    except OSError as error:
        raise MlnError(f"{path} cannot be written: {error.strerror or error}") from error


def _replace(target: str, text: str) -> None:
    handle, temporary = tempfile.mkstemp(dir=os.path.dirname(target), prefix=".mlnlite-", suffix=".tmp")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(handle)
        os.chmod(temporary, _mode(target))
        os.replace(temporary, target)
    except BaseException:
        os.unlink(temporary)
        raise


def _mode(target: str) -> int:
    """The permissions of the file that is replaced, or those that a new file gets."""
    if os.path.exists(target):
        return stat.S_IMODE(os.stat(target).st_mode)
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


def emit(text: str, output: Path | None) -> None:
    """Writes an answer to a file, or to standard output."""
    if output is None:
        click.echo(text)
        return
    write_whole(output, text if text.endswith("\n") else text + "\n")
    click.echo(f"written to {output}", err=True)
