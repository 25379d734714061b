# SPDX-License-Identifier: GPL-3.0-or-later
"""How much memory is free. The solver cannot give back what the system does not have: it would take Blender with it."""

from __future__ import annotations

import ctypes
import re
import sys
from pathlib import Path


def free_bytes() -> int | None:
    """Memory that may still be used without swapping; None where the system does not tell."""
    if sys.platform == "win32":
        return _free_on_windows()
    amounts = [_available(Path("/proc/meminfo")), _left_in_group(Path("/sys/fs/cgroup"))]
    return min((amount for amount in amounts if amount is not None), default=None)


def _available(meminfo: Path) -> int | None:
    try:
        found = re.search(r"^MemAvailable:\s+(\d+) kB", meminfo.read_text(encoding="ascii"), re.MULTILINE)
    except OSError:
        return None
    return int(found[1]) * 1024 if found else None


def _left_in_group(group: Path) -> int | None:
    """What a container's limit leaves (cgroup version 2); file caches in it are given back when asked for."""
    try:
        most = (group / "memory.max").read_text(encoding="ascii").strip()
        used = int((group / "memory.current").read_text(encoding="ascii"))
        cached = re.search(r"^inactive_file (\d+)", (group / "memory.stat").read_text(encoding="ascii"), re.MULTILINE)
    except (OSError, ValueError):
        return None
    return None if most == "max" else int(most) - used + (int(cached[1]) if cached else 0)


class _MemoryStatus(ctypes.Structure):
    """MEMORYSTATUSEX of the Windows API."""

    _fields_ = [
        ("length", ctypes.c_ulong),
        ("load", ctypes.c_ulong),
        *((name, ctypes.c_ulonglong) for name in ("physical", "available", "page", "free_page", "virtual")),
        ("free_virtual", ctypes.c_ulonglong),
        ("extended", ctypes.c_ulonglong),
    ]


def _free_on_windows() -> int | None:
    status = _MemoryStatus(length=ctypes.sizeof(_MemoryStatus))
    kernel = ctypes.windll.kernel32  # type: ignore[attr-defined,unused-ignore]
    return int(status.available) if kernel.GlobalMemoryStatusEx(ctypes.byref(status)) else None
