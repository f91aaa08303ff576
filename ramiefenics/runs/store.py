"""Results kept in files by the content of the request, so that nothing is computed twice."""

from __future__ import annotations

import functools
import hashlib
import json
import os
import secrets
import warnings
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

from ramiefenics.model.jit import CACHE
from ramiefenics.solve.provenance import libraries, source

RUNS = CACHE.parent / "runs"
"""Folder in which results are kept by default."""


class StoreWarning(UserWarning):
    """Results that cannot be kept, so that they will be computed again."""


class Store:
    """Texts by key; a damaged text counts as missing.

    The first line of a file is a checksum of key and text. A file that does not match it is removed
    with a warning, once per process, so that its content is computed again.

    Parameters
    ----------
    folder
        Folder of the files, `RUNS` by default.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = RUNS if folder is None else folder

    def has(self, key: str) -> bool:
        """Return whether there is a text for a key, damaged or not."""
        return self._path(key).exists()

    def get(self, key: str) -> str | None:
        """Return the text for a key; None if there is none, or if it is damaged."""
        path = self._path(key)
        try:
            content = path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError:
            content = b""
        checksum, _, text = content.partition(b"\n")
        if checksum == _checksum(key, text):
            return text.decode("utf-8")
        _tell_once(f"some results kept in {self._folder} are damaged and will be computed again")
        with suppress(OSError):
            path.unlink()
        return None

    def put(self, keys: Iterable[str], text: str) -> None:
        """Keep a text under each key; warn, once per process, if the file system refuses."""
        for key in keys:
            self._put(key, text.encode("utf-8"))

    def _put(self, key: str, content: bytes) -> None:
        path = self._path(key)
        partial = path.with_name(f".{path.name}.{secrets.token_hex(8)}")
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            with partial.open("xb") as file:
                file.write(_checksum(key, content) + b"\n" + content)
                file.flush()
                os.fsync(file.fileno())
            partial.replace(path)  # so that this name never has half a file
        except OSError as error:
            _tell_once(f"results cannot be kept in {self._folder}: {error.strerror}")
            with suppress(OSError):
                partial.unlink(missing_ok=True)

    def _path(self, key: str) -> Path:
        return self._folder / f"{key}.txt"


def _checksum(key: str, text: bytes) -> bytes:
    """Return a checksum of a text and the key it belongs to."""
    return hashlib.sha256(key.encode() + b"\n" + text).hexdigest().encode()


@functools.cache  # once per process, whatever the warning filters are
def _tell_once(message: str) -> None:
    warnings.warn(message, StoreWarning, stacklevel=3)


def key_of(content: Any, *modules: str) -> str:
    """Return a key for a result, made from all that the result depends on.

    Parameters
    ----------
    content
        Nested content in the types of JSON: the specification, and what else is asked for.
    modules
        Files of modules, besides the solver's, that the result depends on.
    """
    text = json.dumps([_rounded(content), source(*modules), libraries()], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def _rounded(value: Any) -> Any:
    """Return nested content with numbers rounded to twelve digits.

    Specifications that are reached by multiplications in a different order differ in the sixteenth
    digit. A difference in the twelfth has no effect on any result, as Newton's tolerance is far
    coarser.
    """
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    return f"{value:.12g}" if isinstance(value, float) else value
