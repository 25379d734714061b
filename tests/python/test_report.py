# SPDX-License-Identifier: GPL-3.0-or-later
"""What is said of a bake that runs."""

from antumbra.core.report import remaining_text, sentence, told_together


def test_the_rest_takes_as_long_as_what_is_done_did_in_proportion():
    assert remaining_text(0.5, 40.0) == "40 s left"
    assert remaining_text(0.25, 60.0) == "3 min left"
    assert remaining_text(0.9, 9.0) == "5 s left"


def test_nothing_is_said_of_a_rest_that_cannot_be_told():
    assert remaining_text(0.01, 100.0) == ""
    assert remaining_text(0.5, 1.0) == ""
    assert remaining_text(1.0, 100.0) == ""


def test_a_message_becomes_a_sentence():
    assert sentence("no light") == "No light"
    assert sentence("") == ""


def test_what_is_said_of_many_things_is_told_once():
    flat = [f"object “{name}” has no face with an area and is left out" for name in ("A", "B", "C")]
    pair = "2 faces of “A”, “B” lie exactly on others"
    assert told_together(["no names", flat[0], pair, flat[1], flat[2]]) == [
        "no names",
        "object “A” has no face with an area and is left out; the same goes for “B”, “C”",
        pair,
    ]
    assert told_together(flat[:1]) == flat[:1]
    assert told_together([]) == []
