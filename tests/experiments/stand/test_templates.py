"""Are the files that the owner of a rig begins with files that the program reads?"""

import re
import tomllib

import pytest

from upright.experiments.stand.templates import BLANK, write_templates


@pytest.mark.parametrize("port", ["/dev/ttyACM0", r"C:\dev\COM3", 'a "quoted" port'])
def test_a_blank_rig_names_the_port_whatever_stands_in_it(tmp_path, port):
    rig = tomllib.loads(write_templates(tmp_path, port).read_text(encoding="utf-8"))
    assert (rig["kind"], rig["port"], rig["study"]) == ("serial", port, "study.toml")


def test_what_somebody_wrote_stays(tmp_path):
    (tmp_path / "study.toml").write_text("mine", encoding="utf-8")
    write_templates(tmp_path, "COM3")
    assert (tmp_path / "study.toml").read_text(encoding="utf-8") == "mine"
    assert (tmp_path / "RIG.toml").exists()


@pytest.mark.parametrize("name", ["RIG.toml", "study.toml"])
def test_every_line_that_is_commented_out_can_be_switched_on(name):
    text = (BLANK / name).read_text(encoding="utf-8")
    offered = re.sub(r"^# (?=\[?[\w.]+\]?(?: =|$))", "", text, flags=re.M)
    assert offered.count("\n#") < text.count("\n#")
    assert tomllib.loads(offered).keys() >= tomllib.loads(text).keys()
