"""From a path to a `Source`: what can be wrong with a file is found here."""

from __future__ import annotations

import os
import re
from pathlib import Path
from zipfile import BadZipFile, ZipFile

from mlnlite.errors import Diagnostic, SyntaxMistake, did_you_mean
from mlnlite.source import Source, Span
from mlnlite.syntax.messages import mistake

MAX_BYTES = 1024 * 1024 * 1024
_ARCHIVE = re.compile(r"(.+\.pracmln)(?::(.+))?", re.DOTALL)
_BOM = b"\xef\xbb\xbf"
_UTF16 = (b"\xff\xfe", b"\xfe\xff")


def read_source(path: str | os.PathLike[str]) -> Source:
    """The text of a UTF-8 file, under the name that its path has here.

    `project.pracmln` and `project.pracmln:name` are files of a pracmln project.
    A byte-order mark at the start is dropped, and every kind of line end becomes a newline.

    Raises:
        SyntaxMistake: no such file, a folder, not readable, empty, too large, or not UTF-8 text.
    """
    name = os.fspath(path)
    data = _bytes(name)
    if not data or data.isspace():
        raise _refusal(mistake("E134", None, "a model or an evidence file has at least one line", path=name))
    zero = -1 if data.startswith(_UTF16) else data.find(b"\0")
    if zero >= 0:
        raise _refusal(mistake("E132", None, "give a .mln or .db text file", path=name, offset=zero))
    text = _decoded(name, data)
    return Source(name, text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text)


def _member(name: str, archive: str, wanted: str) -> bytes:
    """A file of a pracmln project, which is a zip: the one named after the colon, or its only model."""
    try:
        with ZipFile(archive) as project:
            files = [info for info in project.infolist() if not info.is_dir()]
            found = [f for f in files if f.filename == wanted or Path(f.filename).name == wanted]
            if not wanted:
                found = [f for f in files if f.filename.endswith(".mln")]
            if len(found) != 1:
                names = ", ".join(f.filename for f in files)
                raise _refusal(mistake("E140", None, f"write `{archive}:NAME`; it holds {names}", path=name))
            if found[0].file_size > MAX_BYTES:
                sizes = {"size": found[0].file_size // 2**20, "limit": MAX_BYTES // 2**20}
                raise _refusal(mistake("E135", None, "split it into several files", path=name, **sizes))
            return project.read(found[0])
    except FileNotFoundError:
        raise _refusal(mistake("E130", None, similar_file(Path(archive)), path=archive)) from None
    except (OSError, BadZipFile, RuntimeError, NotImplementedError) as error:
        raise _refusal(mistake("E136", None, path=name, reason=str(error))) from None


def _bytes(name: str) -> bytes:
    archive = _ARCHIVE.fullmatch(name)
    if archive:
        return _member(name, archive[1], archive[2] or "")
    path = Path(name)
    try:
        if path.is_dir():
            raise _refusal(mistake("E131", None, "give the name of a file in it", path=name))
        size = path.stat().st_size
        if size > MAX_BYTES:
            sizes = {"size": size // 2**20, "limit": MAX_BYTES // 2**20}
            raise _refusal(mistake("E135", None, "split it into several files", path=name, **sizes))
        return path.read_bytes()
    except FileNotFoundError:
        raise _refusal(mistake("E130", None, similar_file(path), path=name)) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise _refusal(mistake("E136", None, path=name, reason=reason)) from None


def similar_file(path: Path) -> str:
    """A hint with files of nearly the same name in the same folder."""
    try:
        names = sorted(entry.name for entry in path.parent.iterdir() if entry.is_file())
    except OSError:
        return f"there is no folder `{path.parent}` either"
    return did_you_mean(path.name, names)


def _decoded(name: str, data: bytes) -> str:
    body = data.removeprefix(_BOM)
    try:
        return body.decode("utf-8")
    except UnicodeDecodeError as error:
        before = body[: error.start].decode("utf-8").replace("\r\n", "\n")
        line = body[error.start :].split(b"\n", 1)[0].decode("utf-8", errors="replace")
        span = Span(Source(name, before + line), len(before), len(before) + 1)
        utf16 = data.startswith(_UTF16)
        hint = "it looks like UTF-16: save it as UTF-8" if utf16 else "save it with the encoding UTF-8"
        place = None if utf16 else span
        detail = {"path": name, "byte": body[error.start], "offset": error.start + len(data) - len(body)}
        raise _refusal(mistake("E133", place, hint, **detail)) from None


def _refusal(diagnostic: Diagnostic) -> SyntaxMistake:
    return SyntaxMistake([diagnostic])
