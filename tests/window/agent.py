# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs inside the Blender that is tested: answers what the test asks, and notes when Blender could not answer.

blender ... --python agent.py -- SOCKET FOLDER

A timer fires every few milliseconds for as long as Blender's main thread is free; the longest time between two firings
is the longest that somebody at the window had to wait. What the test sends is one JSON string of Python a line; the
value of `answer`, or of the expression, goes back as JSON. It is for making scenes and for looking: what a user does is
done with mouse and keys.
"""

import json
import socket
import sys
import time
import traceback

import bpy

# Often enough to see a wait of 10 ms, seldom enough to cost nothing.
PERIOD_S = 0.004

socket_path, tests_folder = sys.argv[sys.argv.index("--") + 1 :]
sys.dont_write_bytecode = True
sys.path.append(tests_folder)


class Agent:
    """One connection at a time."""

    def __init__(self):
        self._server = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._server.bind(socket_path)
        self._server.listen(1)
        self._server.setblocking(False)
        self._connection = None
        self._received = b""
        self._names = {"bpy": bpy, "agent": self}
        self._last = time.monotonic()
        self.waits = []
        self.watched = None
        self.watched_since = {}

    def tick(self):
        start = time.monotonic()
        self.waits.append((start, start - self._last - PERIOD_S))
        if self.watched:
            self.watched_since.setdefault(self.watched(), start)
        try:
            self._serve()
        except Exception:  # noqa: BLE001
            traceback.print_exc()
        # The time that an answer took is the test's doing, not the add-on's.
        self._last = time.monotonic()
        return PERIOD_S

    def watch(self, state):
        """From now on note when `state()` first had each value."""
        self.watched, self.watched_since = state, {}

    def longest_wait(self):
        """(when, seconds) since the last call."""
        longest = max(self.waits, key=lambda wait: wait[1], default=(0.0, 0.0))
        self.waits.clear()
        return longest

    def _serve(self):
        if self._connection is None:
            try:
                self._connection, _ = self._server.accept()
            except BlockingIOError:
                return
            self._connection.setblocking(False)
        try:
            data = self._connection.recv(1 << 16)
        except BlockingIOError:
            return
        if not data:
            self._connection.close()
            self._connection = None
            return
        self._received += data
        while b"\n" in self._received:
            line, self._received = self._received.split(b"\n", 1)
            reply = json.dumps(self._answer(json.loads(line)), default=repr) + "\n"
            self._connection.setblocking(True)
            self._connection.sendall(reply.encode())
            self._connection.setblocking(False)

    def _answer(self, code):
        try:
            try:
                return {"answer": eval(code, self._names)}
            except SyntaxError:
                self._names["answer"] = None
                exec(code, self._names)
                return {"answer": self._names["answer"]}
        except Exception:  # noqa: BLE001
            return {"error": traceback.format_exc()}


if "bl_ext.user_default.antumbra" not in bpy.context.preferences.addons:
    bpy.ops.preferences.addon_enable(module="bl_ext.user_default.antumbra")
bpy.app.timers.register(Agent().tick, persistent=True)
