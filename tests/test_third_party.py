"""Does somebody else's installed package add a reader, an export target, a rig and a plant, with upright as it is?"""

import textwrap

import numpy as np
import pytest

import upright as up

HEAD = "Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n"


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """What installs a package of one module, as pip would: the module, and its metadata with its entry points."""

    def install(name, source, **groups):
        site = tmp_path / f"site-{name}"
        about = site / f"{name}-1.0.dist-info"
        about.mkdir(parents=True)
        (site / f"{name}.py").write_text(textwrap.dedent(source), encoding="utf-8")
        (about / "METADATA").write_text(HEAD.format(name=name), encoding="utf-8")
        points = "".join(f"[upright.{group}]\n{entry}\n" for group, entry in groups.items())
        (about / "entry_points.txt").write_text(points, encoding="utf-8")
        monkeypatch.syspath_prepend(site)

    return install


READER = """
    import numpy as np
    from upright.readers.reader import Reader
    from upright.records import Record

    def read(source):
        rows = source.data[8:]
        if len(rows) % 16:
            raise source.bad("expected whole rows of two numbers; log again")
        t, theta = np.frombuffer(rows).reshape(-1, 2).T
        return Record(t=t, signals={"theta": theta}, units={"theta": "rad"}, provenance=source.provenance("its"))

    READER = Reader(
        name="its", files="ITS-LOGs", recognises=lambda source: source.data.startswith(b"ITS-LOG\\0"), read=read
    )
"""
T = np.arange(100) * 0.01
ROWS = np.column_stack([T, 0.1 * np.cos(5 * T)])


def test_a_log_of_its_format_is_read_and_a_damaged_one_refused_in_its_words(installed, tmp_path):
    installed("its_reader", READER, readers="its = its_reader:READER")
    (tmp_path / "a.log").write_bytes(b"ITS-LOG\0" + ROWS.tobytes())
    (tmp_path / "b.log").write_bytes(b"ITS-LOG\0" + ROWS.tobytes()[:-3])
    log = up.read(tmp_path / "a.log")
    np.testing.assert_array_equal(log["theta"], ROWS[:, 1])
    assert log.provenance.reader == "its"
    np.testing.assert_array_equal(up.read(tmp_path / "a.log", reader="its").t, T)
    with pytest.raises(up.BadInput, match=r"b\.log': expected whole rows of two numbers"):
        up.read(tmp_path / "b.log")


def test_formats_of_this_package_are_recognised_as_before(installed, tmp_path):
    installed("its_reader", READER, readers="its = its_reader:READER")
    (tmp_path / "log.csv").write_text("t,theta\n" + "".join(f"{t:.2f},{x:.6f}\n" for t, x in ROWS))
    assert up.read(tmp_path / "log.csv").provenance.reader == "table"


BROKEN = {
    "raises": ("raise RuntimeError('no licence')", "'its' of the package raises does not load .RuntimeError: no lice"),
    "lacks": ("", "'its' of the package lacks does not load .AttributeError"),
    "counts": ("THING = 3", "'its' of the package counts is none: counts:THING is of int"),
}


@pytest.mark.parametrize("how", BROKEN)
def test_a_package_that_does_not_load_is_named_and_the_rest_works(how, installed, tmp_path):
    source, said = BROKEN[how]
    installed(how, source, readers=f"its = {how}:THING")
    (tmp_path / "log.csv").write_text("t,theta\n" + "".join(f"{t:.2f},{x:.6f}\n" for t, x in ROWS))
    with pytest.warns(UserWarning, match=said):
        assert len(up.read(tmp_path / "log.csv")) == 100
    assert len(up.read(tmp_path / "log.csv", reader="table")) == 100
    with pytest.raises(up.BadInput, match=said):
        up.read(tmp_path / "log.csv", reader="its")
    (tmp_path / "its.log").write_text("ITS-LOG")
    with pytest.warns(UserWarning, match=said), pytest.raises(up.BadInput, match=said):
        up.read(tmp_path / "its.log")  # the command line shows no warnings, its sentence has to tell


def test_a_reader_that_stops_while_it_looks_leaves_the_log_to_the_others(installed, tmp_path):
    source = """
        from upright.readers.reader import Reader
        READER = Reader(name="its", files="", recognises=lambda source: 1 / 0, read=lambda source: None)
    """
    installed("hasty", source, readers="its = hasty:READER")
    (tmp_path / "log.csv").write_text("t,theta\n0,1\n1,2\n2,3\n")
    with pytest.warns(UserWarning, match="'its' stops at .*ZeroDivisionError"):
        assert up.read(tmp_path / "log.csv").provenance.reader == "table"


def test_what_this_package_has_keeps_its_name(installed, tmp_path):
    installed("bold", READER.replace('"its"', '"table"'), readers="table = bold:READER")
    (tmp_path / "log.csv").write_text("t,theta\n0,1\n1,2\n2,3\n")
    assert up.read(tmp_path / "log.csv", reader="table")["theta"][2] == 3


FORMS = """
    from upright.exports.targets import LawTarget, RigTarget
    from upright.report.page import Chapter

    def of_law(made, test, single):
        return {"law.txt": f"{made.law.period!r} {made.law.D.tolist()!r}"}

    def of_rig(asked):
        rows = "".join(f"{n}={v!r}\\n" for n, v in asked.rig.plant.parameters().items())
        return {"rig.its": rows.encode()}, Chapter(title="ITS", verdict=f"{asked.called} is written for ITS.")

    LAW = LawTarget(name="its", title="ITS", write=of_law, test="its {folder}", onward="Run it.")
    RIG = RigTarget(name="its-rig", write=of_rig)
"""
PENDULUM = up.Pendulum(m_p=0.2, l_cg=0.15, J_p=0.001)


def test_a_law_and_a_rig_are_exported_in_its_forms(installed, tmp_path):
    installed("its_forms", FORMS, exports="its = its_forms:LAW\nits-rig = its_forms:RIG")
    law = up.Law(*(np.zeros(shape) for shape in ((0, 0), (0, 2), (1, 0))), np.array([[3.0, 0.5]]), period=0.01)
    done = up.export(law, to="its", out=tmp_path)
    assert (tmp_path / "law.txt").read_text() == "0.01 [[3.0, 0.5]]"
    assert done.value == (str(tmp_path / "law.txt"),)
    done = up.export(PENDULUM, to="its-rig", out=tmp_path)
    lines = (tmp_path / "rig.its").read_text().split()
    assert {"m_p=0.2", "l_cg=0.15", "J_p=0.001"} <= set(lines)
    assert done.numbers["to"] == "its-rig"
    with pytest.raises(up.BadInput, match="limit is that of the fit"):
        up.export(PENDULUM, to="its-rig", out=tmp_path, limit=1.0)
    with pytest.raises(up.BadInput, match=r"one of .*its-rig.*did you mean 'its'"):
        up.export(PENDULUM, to="itz", out=tmp_path)


def test_forms_of_this_package_are_written_beside_one_that_does_not_load(installed, tmp_path):
    installed("unfit", "import nowhere_at_all", exports="its = unfit:LAW")
    assert up.export(PENDULUM, to="mjcf", out=tmp_path).value == (str(tmp_path / "rig.xml"),)
    with pytest.raises(up.BadInput, match=r"package unfit does not load .ModuleNotFoundError"):
        up.export(PENDULUM, to="its", out=tmp_path)
