"""Does work arrive whole where neither the script nor the user's file can be imported?"""

from __future__ import annotations

import inspect
import sys
import textwrap

import pytest

from upright.physics import find
from upright.workers.carriage import carried, unpacked

TEXT = textwrap.dedent("""
    from upright.physics import Coordinate, Plant
    from upright.quantities import quantity

    class Slider(Plant):
        m: float = quantity("kg", "mass", above=0)
        coordinates = (Coordinate("x", "m", "position"),)
        equilibria = {"resting": {}}

        @staticmethod
        def energies(p, q, v):
            return p.m * v[0] ** 2 / 2, 0, 0

        class Inner:
            size = 3

    def halved(slider):
        return slider.replace(m=slider.m / 2)
    """)


@pytest.fixture
def slider(tmp_path):
    """Class of a user's own file, whose module is forgotten afterwards."""
    file = tmp_path / "mine.py"
    file.write_text(TEXT, encoding="utf-8")
    cls = find(f"{file}:Slider")
    yield file, cls
    sys.modules.pop(cls.__module__, None)


def test_a_function_of_a_script_goes_as_it_is():
    offset = 3
    assert unpacked(carried(lambda x: x + offset))(4) == 7


def test_what_a_user_s_file_defines_is_the_same_where_that_is_known(slider):
    _, cls = slider
    assert unpacked(carried(cls)) is cls
    assert unpacked(carried(cls.Inner)) is cls.Inner
    made = cls(m=2.0)
    assert unpacked(carried(made)) == made


def test_a_user_s_file_travels_with_its_text_as_it_was_loaded(slider):
    """Elsewhere there is neither the module nor the file, and the file may have changed since."""
    file, cls = slider
    content = carried((cls, sys.modules[cls.__module__].halved, cls(m=2.0)))
    file.write_text(TEXT.replace('"kg"', '"g"'), encoding="utf-8")
    again = carried(cls)
    del sys.modules[cls.__module__]
    file.unlink()
    there, halved, made = unpacked(content)
    assert there is not cls
    assert (there.__name__, there.__module__) == ("Slider", cls.__module__)
    assert there.quantity("m").unit == "kg"
    assert type(made) is there
    assert halved(made).m == 1.0
    assert unpacked(again) is there  # the same text is read once
    assert "return slider.replace(m=slider.m / 2)" in inspect.getsource(halved)  # as a traceback shows it
    assert carried(there)  # and it goes on from there
    assert unpacked(carried(there.Inner)).size == 3


def test_another_text_of_the_same_name_takes_its_place(slider):
    _, cls = slider
    first = carried(cls)
    vars(sys.modules[cls.__module__])["__text__"] = TEXT + "\n# another\n"
    again = unpacked(first)
    assert again is not cls
    assert sys.modules[cls.__module__].Slider is again
