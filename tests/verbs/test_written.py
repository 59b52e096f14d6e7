"""Does a verb in Python leave files only where it was told to?"""

import pytest

import upright as up

ARM = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=6e-3, b_2=2e-4)
RIG = up.Rig.known(ARM, gain="0.65 N m/V", limit="10 V", period="2 ms", counts=4096, travel="200 deg")
VERBS = {
    "regulate": lambda **out: up.regulate(RIG, draws=2, seconds=0.5, which=1, **out),
    "swing_up": lambda **out: up.swing_up(RIG, seconds=1.0, **out),
}


@pytest.mark.parametrize("verb", VERBS)
def test_no_file_is_left_where_no_folder_is_named(verb, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    answer = VERBS[verb]()
    assert answer.files == ()
    assert not list(tmp_path.iterdir())
    assert not {"report", "files"} & set(answer.numbers)
    assert answer.chapter.steps == ()  # what they propose would read files that are not there
    answer.plot()


@pytest.mark.parametrize("verb", VERBS)
def test_files_are_written_into_the_folder_that_is_named(verb, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    answer = VERBS[verb](out=tmp_path / "here")
    assert [p.name for p in tmp_path.iterdir()] == ["here"]
    assert answer.files
    assert all(f.is_file() for f in answer.files)


def test_a_pdf_needs_a_folder():
    with pytest.raises(up.BadInput, match="none was named"):
        up.swing_up(RIG, pdf=True)


def test_an_export_is_in_memory_where_no_folder_is_named_and_the_same_in_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    law = up.design(RIG, speed="plain").law
    for source, to in ((law, "c"), (law, "python"), (RIG, "mjcf")):
        held = up.export(source, to=to)
        assert not list(tmp_path.iterdir())
        stored = up.export(source, to=to, out=tmp_path.parent / f"stored-{to}")
        assert {f.name: f.read_bytes() for f in stored.files} == held.contents


@pytest.mark.parametrize("verb", ["run", "firmware_build", "firmware_flash"])
def test_what_cannot_be_but_a_file_asks_for_its_folder(verb, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(up.BadInput, match="name a folder for it, such as out="):
        getattr(up, verb)(*(["RIG.toml"] if verb == "run" else []))
    assert not list(tmp_path.iterdir())
