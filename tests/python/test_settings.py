# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings: one table for the panel, the command line and the report."""

import math
from dataclasses import fields

import pytest
from antumbra.core.errors import SettingError
from antumbra.core.settings import SPECS, Settings, parse_assignments


def test_table_and_dataclass_say_the_same():
    assert [field.name for field in fields(Settings)] == list(SPECS)
    assert Settings().as_dict() == {name: spec.default for name, spec in SPECS.items()}


def test_defaults_are_those_of_the_contract():
    assert Settings().as_dict() == {
        "method": "ADM",
        "tolerance": 0.01,
        "element_size": 0.0,
        "max_level": 8,
        "max_blockers": 4,
        "time_limit": 0.0,
        "triangle_budget": 0,
        "verify_points": 1000,
        "transport": "AUTO",
        "receivers": "SELECTED",
        "output": "NEW",
        "quantity": "RADIOSITY",
        "metals": "MATTE",
        "layers": "TOTAL",
        "data_type": "FLOAT_COLOR",
        "domain": "CORNER",
        "colour_steps": 0,
    }
    Settings().validate()


def test_descriptions_name_an_effect():
    for spec in SPECS.values():
        assert len(spec.description) > 10
        assert not spec.description.endswith(".")
        for choice in spec.choices:
            assert choice.description


def test_assignments_are_typed_and_the_last_one_wins():
    given = parse_assignments(["tolerance=0.5", "max_level= 3", "method=uniform", "tolerance=0.25"])
    assert given == {"tolerance": 0.25, "max_level": 3, "method": "UNIFORM"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("tolerance", "not of the form NAME=VALUE"),
        ("tolerence=1", "no setting “tolerence”"),
        ("max_level=2.5", "must be a whole number"),
        ("tolerance=fine", "must be a number"),
    ],
)
def test_assignments_that_cannot_be_read(text, message):
    with pytest.raises(SettingError, match=message):
        parse_assignments([text])


@pytest.mark.parametrize("method", ["ADM", "DM", "AS", "UNIFORM"])
def test_every_method_is_accepted(method):
    Settings(method=method).validate()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"tolerance": 0.0}, "tolerance = 0.0: must be between"),
        ({"tolerance": math.nan}, "tolerance = nan"),
        ({"element_size": -1.0}, "a number of at least 0"),
        ({"element_size": math.inf}, "a number of at least 0"),
        ({"max_level": 17}, "between 0 and 16"),
        ({"quantity": "WATTS"}, "one of RADIOSITY, IRRADIANCE"),
        ({"method": "RAYS"}, "one of ADM, DM, AS, UNIFORM"),
    ],
)
def test_values_out_of_range(changes, message):
    with pytest.raises(SettingError, match=message):
        Settings(**changes).validate()
