# SPDX-License-Identifier: GPL-3.0-or-later
"""The report as a page and as CSV, of real bakes and of hostile texts."""

import csv
import io
import re
import xml.etree.ElementTree as ElementTree

import pytest
from antumbra.bridge import solver
from antumbra.core.bake import Bake
from antumbra.core.plots import Axis, Line, Mark, plot, scatter
from antumbra.core.report import error_text
from antumbra.core.report_page import curve_csv, page
from antumbra.core.settings import Settings
from test_bake import lit_quad


@pytest.fixture(scope="module", params=[1000, 0])
def report(request):
    host = lit_quad()
    host.scene.warnings.append("<script>alert('&')</script>")
    bake = Bake(host, solver.start, Settings(tolerance=0.05, verify_points=request.param))
    bake.begin()
    return bake.finish()


def test_the_page_needs_nothing_else(report):
    html = page(report)
    assert "<script" not in html
    assert not re.search(r"(src|href)\s*=|url\(|@import", html)


def test_the_page_is_well_formed_and_names_the_error(report):
    html = page(report).removeprefix("<!doctype html>\n").replace('<meta charset="utf-8">', "")
    root = ElementTree.fromstring(html)
    verified = report["result"]["verification"] is not None
    assert len(list(root.iter("figure"))) == 3 + 3 * verified
    text = "".join(root.itertext())
    assert ("verified error" in text) == verified
    assert "<script>alert('&')</script>" in text


def test_the_course_has_a_line_for_each_iteration(report):
    rows = list(csv.DictReader(io.StringIO(curve_csv(report))))
    assert len(rows) == len(report["timeline"])
    for row, step in zip(rows, report["timeline"], strict=True):
        assert float(row["time_s"]) == step["time_s"]
        assert int(row["elements"]) == step["elements"]
        assert row["error"] == ("" if step["error"] is None else str(step["error"][0]))


def test_the_solvers_own_estimate_stands_beside_the_verified_error(report):
    assert 0.0 < report["result"]["estimated_error"] < 0.05
    assert "estimated" in error_text(report)
    assert "as the solver estimates it" in page(report) or report["result"]["verification"] is None
    last = list(csv.DictReader(io.StringIO(curve_csv(report))))[-1]
    assert float(last["estimated"]) == report["result"]["estimated_error"]


def test_the_solver_tells_the_memory_that_it_took(report):
    # Far more than the quad, far less than a gigabyte
    assert 10_000 < report["memory"]["peak_bytes"] < 1e9
    assert "MB at most" in page(report)


SECONDS, SHARE = Axis("s", lambda x: f"{x:g}"), Axis("share", lambda y: f"{y:g}")


def test_a_plot_keeps_its_values_in_order_and_inside():
    line = Line("error", [0.0, 1.0, 2.0], [0.5, 0.02, 0.0], [(0.4, 0.6), (0.01, 0.03), (0.0, 0.004)])
    root = ElementTree.fromstring(plot([line], SECONDS, SHARE))
    places = [(float(circle.get("cx")), float(circle.get("cy"))) for circle in root.iter("circle")]
    assert [x for x, _ in places] == sorted(x for x, _ in places)
    assert [y for _, y in places] == sorted(y for _, y in places)
    _, _, width, height = map(float, root.get("viewBox").split())
    band = root.find("polygon").get("points").split()
    for x, y in [*places, *(tuple(map(float, point.split(","))) for point in band)]:
        assert 0.0 <= x <= width
        assert 0.0 <= y <= height


@pytest.mark.parametrize(
    ("ys", "labels"), [([1.0, 1.0], ["1", "2"]), ([3e-7, 4e3], ["1e-06", "1000"]), ([0.5, 0.0], ["0.5", "0"])]
)
def test_a_plots_axis_holds_round_values(ys, labels):
    root = ElementTree.fromstring(plot([Line("flat", [0.0, 1.0], ys)], SECONDS, SHARE))
    texts = [text.text for text in root.iter("text")]
    assert set(labels) <= set(texts)


def test_marks_lie_as_their_places_do_and_tell_signs_and_sizes():
    root = ElementTree.fromstring(scatter([Mark(0.0, 0.0, 0.1), Mark(2.0, 1.0, -0.4), Mark(1.0, 0.0, 0.0)], "x", "y"))
    small, middle, large = [{name: c.get(name) for name in ("cx", "cy", "r", "fill")} for c in root.iter("circle")]
    assert float(middle["cx"]) < float(small["cx"]) < float(large["cx"])
    assert float(large["cy"]) < float(middle["cy"])
    assert float(large["r"]) == pytest.approx(2.0 * float(middle["r"]), rel=0.02)
    assert large["fill"] != middle["fill"]


def test_marks_have_a_frame_that_tells_where_they_are():
    root = ElementTree.fromstring(scatter([Mark(-2.7801, -4e-16, 0.1), Mark(2.7801, 1.5, -0.4)], "x, m", "y, m"))
    assert [text.text for text in root.iter("text")] == ["-2.78", "x, m", "2.78", "0", "y, m", "1.5"]
    frame = {name: float(root.find("rect").get(name)) for name in ("x", "y", "width", "height")}
    for circle in root.iter("circle"):
        x, y, r = (float(circle.get(name)) for name in ("cx", "cy", "r"))
        assert frame["x"] <= x - r + 0.1
        assert x + r - 0.1 <= frame["x"] + frame["width"]
        assert frame["y"] <= y - r + 0.1
        assert y + r - 0.1 <= frame["y"] + frame["height"]


def test_nothing_is_said_where_there_is_nothing_to_plot():
    assert "Nothing" in plot([Line("dark", [0.0, 1.0], [0.0, 0.0])], SECONDS, SHARE)
    assert "Nothing" in plot([], SECONDS, SHARE)
