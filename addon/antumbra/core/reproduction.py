# SPDX-License-Identifier: GPL-3.0-or-later
"""A file from which a failed bake can be repeated: every call that handed the scene over, with its arrays.

An .npz of numpy without pickled objects, so that opening one from a stranger runs nothing.
"""

from __future__ import annotations

import json
import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np


class Calls:
    """Takes the part of the native Scene, and remembers what it was told."""

    def __init__(self) -> None:
        self._arrays: dict[str, np.ndarray[Any, Any]] = {}
        self._calls: list[Any] = []

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)

        def remember(*args: Any, **kwargs: Any) -> None:
            self._calls.append(
                [name, [self._plain(arg) for arg in args], {k: self._plain(v) for k, v in kwargs.items()}]
            )

        return remember

    def _plain(self, value: Any) -> Any:
        if isinstance(value, np.ndarray):
            name = f"array_{len(self._arrays)}"
            self._arrays[name] = value
            return {"array": name}
        if isinstance(value, (tuple, list)):
            return [self._plain(each) for each in value]
        return value.item() if isinstance(value, np.generic) else value

    def save(self, settings: dict[str, Any], message: str) -> Path:
        """Write what was remembered to a new file of the temporary folder; raises OSError."""
        handle, name = tempfile.mkstemp(".npz", "antumbra-bug-")
        text = json.dumps({"message": message, "settings": settings, "calls": self._calls})
        try:
            with os.fdopen(handle, "wb") as file:
                np.savez_compressed(file, text=np.array(text), **self._arrays)
        except OSError:
            Path(name).unlink(missing_ok=True)
            raise
        return Path(name)


def load(path: Path, scene: Any) -> dict[str, Any]:
    """Tell a native Scene all of a file; returns the settings."""
    with np.load(path, allow_pickle=False) as file:
        told = json.loads(str(file["text"]))

        def whole(value: Any) -> Any:
            if isinstance(value, dict):
                return file[value["array"]]
            return tuple(whole(each) for each in value) if isinstance(value, list) else value

        for name, args, kwargs in told["calls"]:
            getattr(scene, name)(*map(whole, args), **{key: whole(value) for key, value in kwargs.items()})
    settings: dict[str, Any] = told["settings"]
    return settings
