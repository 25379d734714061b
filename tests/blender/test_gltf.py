# SPDX-License-Identifier: GPL-3.0-or-later
"""Exported files as others see them: the Khronos validator, and three.js in a browser without a window."""

import functools
import http.server
import json
import os
import shutil
import subprocess
import threading
from pathlib import Path

import bpy
import numpy as np
import pytest
from extension import module
from scenes import add_area_light, add_cube, add_plane, bake, baked_of, corner_vertices, radiance, world_positions

TOOLS = Path(__file__).resolve().parents[1] / "gltf"
FOLDER = Path(__file__).resolve().parents[2] / "target" / "gltf"

# Pixels and metres of the picture, which the floor is as large as.
PIXELS, METRES = 512, 6.0

BROWSERS = ("chromium", "chromium-browser", "google-chrome")


def program(*names):
    """The first of these that there is; skips the test when there is none."""
    found = next((path for path in map(shutil.which, names) if path), None)
    if found is None:
        pytest.skip(f"missing: {names[0]} (Debian: apt-get install {names[0]})")
    return found


@pytest.fixture(scope="module")
def node():
    """node, with the validator and three.js beside the scripts."""
    if os.environ.get("ANTUMBRA_LONG") != "1":
        pytest.skip("long: fetches the validator and three.js; ANTUMBRA_LONG=1 runs it")
    found, npm = program("node", "nodejs"), program("npm")
    FOLDER.mkdir(parents=True, exist_ok=True)
    for file in TOOLS.iterdir():
        shutil.copy(file, FOLDER)
    subprocess.run([npm, "ci", "--silent", "--no-audit", "--no-fund"], cwd=FOLDER, check=True)
    return found


@pytest.fixture
def glb(tmp_path):
    """A cube over a floor under two lamps of different colour, exported."""
    add_plane("Floor", size=METRES)
    add_cube().location = (0, 0, 1.5)
    for x, colour in ((-1.5, (1.0, 0.5, 0.2)), (1.5, (0.2, 0.5, 1.0))):
        lamp = add_area_light(location=(x, 1, 4), energy=300.0)
        lamp.data.color = colour
    bake(tolerance=0.02)
    path = tmp_path / "scene.glb"
    module("bridge.gltf").export_glb(bpy.context.scene, path)
    return path


def report_of(node, path):
    output = subprocess.run([node, "validate.mjs", str(path)], cwd=FOLDER, check=True, capture_output=True, text=True)
    return json.loads(output.stdout)


def test_the_validator_has_nothing_to_complain_of(node, glb):
    issues = report_of(node, glb)["issues"]
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]


def test_what_is_ready_for_export_is_valid_by_the_exporter_as_a_user_calls_it(node, glb, tmp_path):
    assert bpy.ops.antumbra.make_export_ready() == {"FINISHED"}
    path = tmp_path / "by hand.glb"
    bpy.ops.export_scene.gltf(filepath=str(path), export_extras=True, export_attributes=True, use_renderable=True)
    report = report_of(node, path)
    assert (report["issues"]["numErrors"], report["issues"]["numWarnings"]) == (0, 0), report["issues"]["messages"]
    gltf = gltf_of(path)
    for mesh in gltf["meshes"]:
        (primitive,) = mesh["primitives"]
        assert {"COLOR_0", "_RADIOSITY"} <= set(primitive["attributes"])
    assert "KHR_materials_unlit" in gltf["extensionsUsed"]


def test_the_export_window_is_set_to_what_bakes_need_and_keeps_the_rest(glb, tmp_path):
    bpy.context.scene["glTF2ExportSettings"] = {"export_yup": False, "use_visible": False}
    bpy.ops.antumbra.make_export_ready()
    chosen = bpy.context.scene["glTF2ExportSettings"].to_dict()
    assert not chosen["export_yup"]
    path = tmp_path / "as set.glb"
    bpy.ops.export_scene.gltf(filepath=str(path), **chosen)
    gltf = gltf_of(path)
    # The hidden originals lie where the bakes lie.
    assert sorted(node["name"] for node in gltf["nodes"]) == ["Cube Radiosity", "Floor Radiosity"]
    assert all("antumbra_scale" in node["extras"] for node in gltf["nodes"])
    for mesh in gltf["meshes"]:
        assert {"COLOR_0", "_RADIOSITY"} <= set(mesh["primitives"][0]["attributes"])


def test_three_js_shows_the_light_that_was_baked(node, glb):
    shown = pixels_of(glb)
    expected, inside = expected_pixels(baked_of("Floor"), module("core.colours").srgb_encoded, scale_of(glb))
    assert inside.sum() > 0.5 * PIXELS**2
    off = np.abs(shown[inside].astype(float) - 255.0 * expected[inside])
    assert off.max() <= 1.0


def gltf_of(path):
    content = path.read_bytes()
    return json.loads(content[20 : 20 + int.from_bytes(content[12:16], "little")])


def scale_of(path):
    (scale,) = {node["extras"]["antumbra_scale"] for node in gltf_of(path)["nodes"]}
    return scale


def pixels_of(path):
    """(PIXELS, PIXELS, 3) bytes of the file from above, the row with the least y first."""
    browser = program(*BROWSERS)
    shutil.copy(path, FOLDER / "scene.glb")
    posted = {}
    arrived = threading.Event()

    class Server(http.server.SimpleHTTPRequestHandler):
        def do_POST(self):
            posted[self.path] = self.rfile.read(int(self.headers["Content-Length"]))
            self.send_response(204)
            self.end_headers()
            arrived.set()

        def log_message(self, *_arguments):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Server, directory=FOLDER))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address = f"http://127.0.0.1:{server.server_port}/view.html?pixels={PIXELS}&metres={METRES}"
    command = [
        browser,
        *("--headless", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars"),
        *("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"),
        *(f"--user-data-dir={FOLDER / 'browser'}", "--remote-debugging-port=0", address),
    ]
    with (FOLDER / "browser.log").open("w") as log:
        running = subprocess.Popen(command, stdout=log, stderr=log)
        try:
            assert arrived.wait(120.0), (FOLDER / "browser.log").read_text()[-2000:]
        finally:
            running.terminate()
            running.wait(20)
            server.shutdown()
    assert "/pixels" in posted, posted
    return np.frombuffer(posted["/pixels"], np.uint8).reshape(PIXELS, PIXELS, 4)[:, :, :3]


def expected_pixels(floor, encoded, scale):
    """(PIXELS, PIXELS, 3) of the floor as linear triangles between its corners, and where no edge or cube is near."""
    points = world_positions(floor)[:, :2]
    colours = np.clip(radiance(floor.data) / scale, 0.0, 1.0).reshape(-1, 3, 3)
    triangles = points[corner_vertices(floor.data)].reshape(-1, 3, 2)
    step = METRES / PIXELS
    middles = (np.arange(PIXELS) + 0.5) * step - METRES / 2
    expected = np.zeros((PIXELS, PIXELS, 3))
    inside = np.zeros((PIXELS, PIXELS), dtype=bool)
    for (a, b, c), corners in zip(triangles, colours, strict=True):
        low, high = np.min([a, b, c], axis=0), np.max([a, b, c], axis=0)
        columns = np.flatnonzero((middles > low[0]) & (middles < high[0]))
        rows = np.flatnonzero((middles > low[1]) & (middles < high[1]))
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0.0 or not len(columns) or not len(rows):
            continue
        x, y = np.meshgrid(middles[columns], middles[rows])
        weights = []
        for p, q in ((b, c), (c, a), (a, b)):
            weights.append(((q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])) / area)
        # A pixel further from every edge: whose pixel it is there is the rasteriser's choice.
        edges = [np.linalg.norm(q - p) for p, q in ((b, c), (c, a), (a, b))]
        far = np.min([weight * abs(area) / edge for weight, edge in zip(weights, edges, strict=True)], axis=0) > step
        value = sum(weight[..., None] * corner for weight, corner in zip(weights, corners, strict=True))
        at = np.ix_(rows, columns)
        expected[at] = np.where(far[..., None], value, expected[at])
        inside[at] |= far
    x, y = np.meshgrid(middles, middles)
    inside &= np.maximum(abs(x), abs(y)) > 1.0 + 2 * step
    return encoded(expected), inside
