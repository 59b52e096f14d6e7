"""Can whoever knows an option of the command line call the function, and the other way round?"""

from __future__ import annotations

import math
from inspect import signature, unwrap

import pytest
import typer
from typer.testing import CliRunner

import upright as up
from upright.cli import COMMANDS, app
from upright.verbs.options import shared_parameters

CLI_ONLY = {"as_json", "keys", "strict", "help", "plot"}  # in Python an answer is asked to .plot()


def command(name: str):
    """The command itself, as it answers once it is called."""
    group = typer.main.get_command(app)
    return group.resolve_command(group.make_context("upright", [name]), [name])[1]


def names(verb) -> set[str]:
    """Names by which a verb can be called, those that it shares with others among them."""
    out: set[str] = set()
    verb = unwrap(verb)
    for p in signature(verb).parameters.values():
        out |= shared_parameters(p, verb.__module__)[0].keys() if p.kind is p.VAR_KEYWORD else {p.name}
    return out


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_option_of_a_command_is_one_of_its_verb(name):
    asked = getattr(up, name.replace("-", "_"))
    options = {p.name for p in command(name).params if p.param_type_name == "option"}
    assert options - CLI_ONLY <= names(asked)
    assert "Parameters\n" in (asked.__doc__ or "")


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_argument_and_option_of_a_command_is_explained(name):
    assert [p.name for p in command(name).params if not p.help] == []


VERBS = [name for name in up.__all__ if callable(getattr(up, name)) and not isinstance(getattr(up, name), type)]
MOST = 12
"""Parameters of a verb: about ten, and where there are more, a rig, a record or an options object has the rest."""


@pytest.mark.parametrize("name", VERBS)
def test_a_verb_has_about_ten_parameters_and_what_is_missing_is_none(name):
    about = signature(getattr(up, name)).parameters
    assert len(about) <= MOST
    assert [p.name for p in about.values() if p.default in ("", ())] == []


@pytest.mark.parametrize(
    ("typed", "offered"), [("upright swi", {"swing-up"}), ("upright doctor --r", {"--rig", "--reader"})]
)
def test_the_shell_completes_commands_and_their_options(typed, offered):
    asked = {"_UPRIGHT_COMPLETE": "complete_bash", "COMP_WORDS": typed, "COMP_CWORD": str(len(typed.split()) - 1)}
    assert set(CliRunner().invoke(app, [], env=asked, prog_name="upright").stdout.split()) == offered


def test_completion_can_be_installed():
    listing = CliRunner().invoke(app, ["--help"], terminal_width=200).stdout
    assert "--install-completion" in listing
    assert "--show-completion" in listing


ARM = up.Furuta(m_p=0.1, l_cg=0.2, r=0.2, J_d=5e-3, J_p=1e-3)
RIG = up.Rig.known(ARM, gain="0.65 N m/V", limit="10 V", period="2 ms", counts=4096)
K = [[-1.0, -1.5, 20.0, 2.0]]


@pytest.mark.parametrize("verb", [up.design, up.regulate, up.swing_up, up.chance])
def test_an_option_that_no_verb_has_is_answered_with_the_nearest(verb):
    with pytest.raises(up.BadInput, match=r"no option 'limmit'.*limit"):
        verb(RIG, *([K] if verb is up.chance else []), limmit=3)


def test_numbers_of_a_rig_may_have_any_unit_of_their_kind():
    plain = up.chance(RIG, K, limit=0.5, period=0.004, travel=2.0, start={"theta": math.pi / 18}, draws=4)
    named = up.chance(RIG, K, limit="500 mV", period="4 ms", travel=f"{360 / math.pi!r} deg", start="10 deg", draws=4)
    assert named.words == plain.words
    assert named.run.u == pytest.approx(plain.run.u, abs=1e-9)


def test_a_design_is_tried_as_it_is_with_its_limit_and_only_at_its_period():
    """Its velocities are filtered differences with a = 0.5, which those of gains are as well."""
    designed = up.design(RIG, at="inverted")
    assert designed.chosen.name == "filtered difference, a = 0.5"
    of_gains = up.chance(RIG, designed.K[0], draws=4)
    assert up.chance(RIG, designed, draws=4).run.u == pytest.approx(of_gains.run.u, abs=1e-9)
    bare = up.Rig.known(ARM, gain="0.65 N m/V", period="2 ms", counts=4096)
    limited = up.design(bare, at="inverted", limit="10 V")
    assert up.chance(bare, limited, draws=4).run.u == pytest.approx(of_gains.run.u, abs=1e-9)
    with pytest.raises(up.BadInput, match=r"for a period of 2 ms, and the rig's is 4 ms"):
        up.chance(RIG, designed, period="4 ms")
    with pytest.raises(up.BadInput, match="its own velocities; leave speed out"):
        up.chance(RIG, designed, speed="plain")
    with pytest.raises(up.BadInput, match="this design is for 'hanging'"):
        up.chance(RIG, up.design(RIG, at="hanging"))


def test_a_start_is_of_the_pendulum_unless_it_names_states():
    assert up.design(RIG, start="3 deg").value.request.start == pytest.approx((0, 0, math.pi / 60, 0))
    named = up.design(RIG, start="theta=3 deg, psi_dot=0.5 rad/s").value.request.start
    assert named == pytest.approx((0, 0.5, math.pi / 60, 0))
    with pytest.raises(up.BadInput, match="names states"):
        up.regulate(RIG, start="phi=3 deg")


def test_a_tilt_and_a_push_are_read_for_one_version_more():
    now = up.chance(RIG, K, start={"theta": 0.1, "theta_dot": 0.4}, draws=4)
    with pytest.deprecated_call(match="say start="):
        former = up.chance(RIG, K, tilt=0.1, push=0.4, draws=4)
    assert former.run.u.tolist() == now.run.u.tolist()
    assert (now.value.margins, now.chapter.detail) == (None, "")  # what falls recovers from nothing


@pytest.mark.parametrize(
    "counts", [(20000, 4096), [20000, 4096], "20000, 4096", "psi=20000, theta=4096", {"psi": 20000, "theta": 4096}]
)
def test_counts_of_each_coordinate_are_said_again_as_a_command_reads_them(counts):
    from upright.verbs.options import as_typed, rig_entries

    typed = as_typed({"counts": counts}).removeprefix(' --counts "').removesuffix('"')
    for said in (counts, typed):
        entries = rig_entries(ARM, "V", {"counts": said})
        assert {n: e.value for n, e in entries.items()} == {"counts.psi": 20000, "counts.theta": 4096}


@pytest.mark.parametrize("counts", ["1, 2, 3", (1, 2, 3), "1, 2, theta=4096"])
def test_counts_that_do_not_fit_the_coordinates_are_refused(counts):
    with pytest.raises(up.BadInput, match="one number for all coordinates, one for each of psi, theta"):
        up.design(RIG, poles=[-4 + 2j, -4 - 2j, -17, -3], counts=counts)
