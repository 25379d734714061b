# SPDX-License-Identifier: GPL-3.0-or-later
"""A real Blender in a window of its own on a virtual screen, with a hand on mouse and keys and an eye on the picture.

Where a button is, Blender itself tells: with the mouse over one, Ctrl C copies the operator behind it, and
Shift Ctrl Alt C the name of its property.
"""

import json
import os
import shutil
import signal
import socket
import struct
import subprocess
import time
import zlib
from pathlib import Path

import numpy as np

SCREEN = (1600, 1000)

TESTS = Path(__file__).resolve().parents[1]

# Who types faster than Blender draws is asked to wait; twenty looks a second cost nothing.
_LOOK_S = 0.05

# Dialogs take no keys before they are drawn, and nothing tells from outside when that is.
_DIALOG_S = 2.0


def missing():
    """What these tests need and this machine lacks, one sentence each."""
    needs = {"Xvfb": "xvfb", "xdotool": "xdotool"}
    lacking = [
        f"{program} (Debian: apt-get install {package})"
        for program, package in needs.items()
        if not shutil.which(program)
    ]
    if not os.environ.get("ANTUMBRA_BLENDER"):
        lacking.append("a real Blender, named in ANTUMBRA_BLENDER (cargo xtask test --long does)")
    return lacking


class BlenderWindow:
    """Blender on a screen that nobody sees."""

    def __init__(self, folder, blend=None):
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self._log = (folder / "blender.log").open("w")
        self._screen = self._start_screen()
        self._path = folder / "agent"
        self._path.unlink(missing_ok=True)
        command = [
            os.environ["ANTUMBRA_BLENDER"],
            *("--window-geometry", "0", "0", *map(str, SCREEN)),
            *([] if blend is None else [str(blend)]),
            *("--python", str(TESTS / "window" / "agent.py"), "--", str(self._path), str(TESTS / "blender")),
        ]
        self.process = subprocess.Popen(command, env=self._environment, stdout=self._log, stderr=self._log)
        self._connect()
        self._settle()

    # Ask

    def ask(self, code):
        """What Python says inside Blender."""
        self._socket.sendall((json.dumps(code) + "\n").encode())
        line = self._lines.readline()
        if not line:
            raise ConnectionError("Blender is gone; its log:\n" + self.log()[-2000:])
        reply = json.loads(line)
        if "error" in reply:
            raise RuntimeError(reply["error"])
        return reply["answer"]

    def until(self, code, seconds=240.0):
        """Wait until Python inside Blender says something true; return that.

        Without a graphics card, on a busy machine, Blender takes a second to draw after each slice of a bake.
        """
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            answer = self.ask(code)
            if answer:
                return answer
            time.sleep(_LOOK_S)
        self.screenshot("timed out")
        raise TimeoutError(f"{seconds} s went by and this is still not true: {code}\n" + self.log()[-2000:])

    def log(self):
        return (self.folder / "blender.log").read_text(errors="replace")

    # Do

    def move(self, x, y):
        # Two steps: Blender lights a button up when the mouse moves over it.
        self._xdotool("mousemove", x - 2, y - 1)
        time.sleep(_LOOK_S)
        self._xdotool("mousemove", x, y)
        time.sleep(_LOOK_S)

    def click(self, x, y):
        self.move(x, y)
        self._xdotool("click", 1)
        time.sleep(_LOOK_S)

    def click_here(self):
        """Click without moving; returns when."""
        when = time.monotonic()
        self._xdotool("click", 1)
        return when

    def scroll_down(self, steps=12):
        """Turn the wheel over the Properties editor."""
        left, top, width, height = self.region("PROPERTIES")
        self.move(left + width // 2, top + height // 2)
        for _ in range(steps):
            self._xdotool("click", 5)
            time.sleep(_LOOK_S)
        time.sleep(0.5)

    def viewport(self):
        """(height, width, 3) the middle of the 3D view, without its buttons."""
        left, top, width, height = self.region("VIEW_3D")
        picture = self.picture().astype(int)
        return picture[top + height // 4 : top + height - height // 8, left + width // 6 : left + width - width // 8]

    def key(self, *names):
        for name in names:
            self._xdotool("key", name)
            time.sleep(2 * _LOOK_S)

    def in_dialog(self, letter):
        """Press a dialog's button by the letter that is underlined there, once the dialog is drawn."""
        time.sleep(_DIALOG_S)
        self.key(letter)

    def press(self, what, at=0.5):
        """Click the button of an operator, or the field of a property, in the Properties editor."""
        x, y = self.find(what, at)
        self.click(x, y)

    def press_in_status_bar(self, what):
        """Click the button of an operator in the status bar, which is as high as a button, from its right end."""
        y = SCREEN[1] - 11
        for x in range(SCREEN[0] - 8, SCREEN[0] // 2, -9):
            if what in self._under(x, y, what):
                self.click(x, y)
                return
        self.screenshot("not found")
        raise LookupError(f"{what} is not in the status bar")

    def find(self, what, at=0.5):
        """Where on the screen it is, `at` this share of the Properties editor's width."""
        left, top, width, height = self.region("PROPERTIES")
        x = int(left + at * width)
        for y in range(top + 8, top + height - 4, 11):
            if what in self._under(x, y, what):
                return x, y + 3
        self.screenshot("not found")
        raise LookupError(f"{what} is nowhere in the Properties editor")

    def region(self, area, region="WINDOW"):
        """(left, top, width, height) on the screen."""
        found = self.ask(
            "[(r.x, r.y, r.width, r.height) for a in bpy.context.window_manager.windows[0].screen.areas "
            f"if a.type == {area!r} for r in a.regions if r.type == {region!r}]"
        )
        x, y, width, height = found[0]
        return x, SCREEN[1] - y - height, width, height

    def _under(self, x, y, what):
        """What Blender says it is."""
        self.ask("setattr(bpy.context.window_manager, 'clipboard', '')")
        self._xdotool("mousemove", x - 1, y, "mousemove", x, y)
        time.sleep(_LOOK_S)
        self._xdotool("key", "ctrl+c" if what.startswith("bpy.ops.") else "ctrl+shift+alt+c")
        time.sleep(_LOOK_S)
        return self.ask("bpy.context.window_manager.clipboard")

    def over_viewport(self):
        """Put the mouse into the 3D view, where keys mean what they say in the manual."""
        left, top, width, height = self.region("VIEW_3D")
        self.move(left + width // 2, top + height // 2 + 150)

    # See

    def picture(self):
        """(height, width, 3) bytes of the screen."""
        data = (self.folder / "Xvfb_screen0").read_bytes()
        header = struct.unpack(">25I", data[:100])
        head, width, height, row, colours = header[0], header[4], header[5], header[12], header[19]
        rows = np.frombuffer(data, np.uint8, row * height, head + colours * 12).reshape(height, row)
        return rows[:, : width * 4].reshape(height, width, 4)[:, :, 2::-1]

    def screenshot(self, name):
        path = self.folder / f"{name.replace(' ', '-')}.png"
        path.write_bytes(png(self.picture()))
        return path

    def close(self):
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(10)
            except subprocess.TimeoutExpired:
                self.process.kill()
        self._screen.send_signal(signal.SIGTERM)
        self._screen.wait(10)
        self._log.close()

    def _xdotool(self, *arguments):
        subprocess.run(["xdotool", *map(str, arguments)], env=self._environment, check=True)

    def _start_screen(self):
        read, write = os.pipe()
        size = f"{SCREEN[0]}x{SCREEN[1]}x24"
        # It picks a free number and says which.
        screen = subprocess.Popen(
            ["Xvfb", "-displayfd", str(write), "-screen", "0", size, "-fbdir", str(self.folder), "-nolisten", "tcp"],
            pass_fds=[write],
            stdout=self._log,
            stderr=self._log,
        )
        os.close(write)
        with os.fdopen(read) as numbers:
            number = numbers.readline().strip()
        self._environment = {
            **os.environ,
            "DISPLAY": f":{number}",
            "BLENDER_USER_RESOURCES": os.environ["ANTUMBRA_BLENDER_USER"],
            # No graphics card is behind this screen.
            "LIBGL_ALWAYS_SOFTWARE": "1",
        }
        return screen

    def _connect(self):
        end = time.monotonic() + 60.0
        while True:
            try:
                self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
                self._socket.connect(str(self._path))
                break
            except OSError:
                if time.monotonic() > end or self.process.poll() is not None:
                    raise ConnectionError("Blender did not start; its log:\n" + self.log()[-2000:]) from None
                time.sleep(_LOOK_S)
        self._lines = self._socket.makefile("rb")

    def _settle(self):
        """Close the splash, and show Properties › Render and a still viewport."""
        self.until("len(bpy.context.window_manager.windows) > 0")
        time.sleep(1.0)
        self.over_viewport()
        self.key("Escape")
        time.sleep(0.5)


def png(pixels):
    """An RGB picture as a file's bytes."""
    height, width, _ = pixels.shape

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 6)) + chunk(b"IEND", b"")
