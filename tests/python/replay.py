# SPDX-License-Identifier: GPL-3.0-or-later
"""Repeats a bake from the file that a failed one left: python tests/python/replay.py antumbra-bug-….npz."""

import sys
from pathlib import Path

import antumbra_native

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "addon"))

from antumbra.core.reproduction import load

native = antumbra_native.Scene()
settings = load(Path(sys.argv[1]), native)
print(antumbra_native.start(native, **settings).result().report)
