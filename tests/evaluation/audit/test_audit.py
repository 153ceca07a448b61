"""The audit finds what was planted: a policy that obeys, one that does half way, one that ignores its mask."""

import json

import numpy as np
import pytest
import toy_reach  # noqa: F401 - registers the example task

from lerobot_excav.envs.tasks.registry import env_types
from lerobot_excav.errors import ConfigurationError, ExcavError
from lerobot_excav.evaluation.audit import audit as audit_module
from lerobot_excav.evaluation.audit import scene_branches
from lerobot_excav.evaluation.audit.audit import play_audit, read_audit
from lerobot_excav.evaluation.audit.page import audit_text, write_audit
from lerobot_excav.evaluation.audit.settings import MOMENTS, OPERATOR, POLICY, AuditSettings, policy_variants
from lerobot_excav.scripts.main import main

from .planted import SLOPES, Planted

pytestmark = pytest.mark.slow

SMALL = {"observation_height": 32, "observation_width": 48}


@pytest.fixture(autouse=True)
def policies(monkeypatch):
    """Take the name of a checkpoint for that of a planted policy, and note who is loaded."""
    loaded = []

    def load(checkpoint, overrides):
        loaded.append((checkpoint.name, overrides))
        return Planted(SLOPES[checkpoint.name])

    monkeypatch.setattr(scene_branches, "_policy", load)
    monkeypatch.setattr(audit_module, "policy_config", lambda *_: None)
    monkeypatch.setattr(audit_module, "require_same_machine", lambda *_: None)
    monkeypatch.setattr("toy_reach.env.FRAMES_ON_TARGET", 15)  # long enough for a mask that is given after arriving
    monkeypatch.setattr(scene_branches, "LEAD_S", 0.3)  # the disc arrives within a second
    return loaded


def settings_of(path, *, scenes=6, against=None, plans=(), ensemble=None, **settings):
    env = env_types()["toy_reach"].settings.of({**SMALL, "scene_set": "test"})
    variants = policy_variants(path, against=against, plans=plans, ensemble=ensemble)
    values = {"first_scene": 0, "stage": 0, "seed": 0, **settings}
    return AuditSettings(env=env, scenes=scenes, variants=variants, **values)


def audited(tmp_path, name, **settings):
    settings = settings_of(tmp_path / name, **settings)
    play_audit(settings, tmp_path / "scenes", workers=0, show_progress=False)
    return read_audit(settings, tmp_path / "scenes")


@pytest.mark.parametrize(
    ("name", "verdict", "slope"),
    [("obeys", "obeys", 1.0), ("half", "obeys in part", 0.5), ("ignores", "insensitive", 0.0)],
)
def test_planted_obedience_is_measured_and_named(tmp_path, name, verdict, slope):
    audit = audited(tmp_path, name)
    found = audit.obedience[POLICY]
    assert audit.verdicts[POLICY].verdict == verdict
    assert found.slope.estimate == pytest.approx(slope, abs=0.02)
    assert found.slope.low <= slope + 0.02
    assert found.slope.high >= slope - 0.02
    assert (found.scenes, found.branches) == (6, 24)
    assert found.acted.estimate > 0.9  # a place beside the start is no way to go
    assert (found.success.estimate == 1.0) == (name == "obeys")
    assert audit.verdicts[OPERATOR].verdict == "obeys"


def test_a_policy_that_never_acts_is_out_of_support(tmp_path):
    audit = audited(tmp_path, "still", scenes=2)
    assert audit.verdicts[POLICY].verdict == "out of support"
    assert "acts after 0 % of the masks" in audit.verdicts[POLICY].reason
    found = audit.obedience[POLICY]
    assert (found.slope, found.entry_error_m, found.share, found.relative_share) == (None, None, None, None)
    assert audit.separation[POLICY][MOMENTS[1]].scenes == []
    write_audit(audit, tmp_path / "page")


def test_errors_and_shares_are_those_of_the_places(tmp_path):
    found = audited(tmp_path, "obeys", scenes=3).obedience[POLICY]
    assert found.entry_error_m.estimate < 0.06
    assert found.share.estimate == found.relative_share.estimate == 1.0
    half = audited(tmp_path / "b", "half", scenes=3).obedience[POLICY]
    assert half.entry_error_m.estimate > 0.2
    assert half.share.estimate < 0.5


def test_masks_drive_an_obedient_policy_apart_and_leave_another_where_it_was(tmp_path):
    obeys = audited(tmp_path, "obeys", scenes=3).separation[POLICY]
    for moment in MOMENTS:
        assert obeys[moment].tool_m[0] == 0.0  # the same state
        assert obeys[moment].actions[0] > 0.1
        assert max(obeys[moment].tool_m) > 0.4
    ignores = audited(tmp_path / "b", "ignores", scenes=3).separation[POLICY]
    for moment in MOMENTS:
        assert max(ignores[moment].tool_m) == max(ignores[moment].actions) == 0.0
        assert ignores[moment].scenes[0] == 3


def test_later_moments_lie_around_the_beginning_of_the_act(tmp_path):
    audit = audited(tmp_path, "obeys", scenes=2)
    for scene_id in range(2):
        branches = [b for b in audit.branches[POLICY] if b.scene_id == scene_id]
        begun = next(b.began_frame for b in branches if b.moment == "start" and b.target_id == scene_id % 4)
        frames = {b.moment: b.frame for b in branches}
        assert frames == {"start": 0, "before acting": begun - 3, "while acting": begun + 3}
        assert all(len(b.actions) <= 30 for b in branches if b.moment != "start")


def test_an_environment_that_does_not_repeat_itself_is_refused(tmp_path, monkeypatch):
    from toy_reach.table import Table

    tick, rng = Table.tick, np.random.default_rng(0)
    monkeypatch.setattr(Table, "tick", lambda table, action: tick(table, action + rng.normal(0.0, 0.01, 2)))
    with pytest.raises(ExcavError, match=r"scene 0: the state of frame \d+ is not the one .* cannot be audited"):
        audited(tmp_path, "obeys", scenes=1)


def test_an_audit_continues_can_be_made_longer_and_keeps_its_settings(tmp_path, policies):
    first = audited(tmp_path, "half", scenes=2)
    policies.clear()
    assert audited(tmp_path, "half", scenes=2).as_dict() == first.as_dict()
    assert policies == []
    longer = audited(tmp_path, "half", scenes=3)
    assert longer.branches[POLICY][: len(first.branches[POLICY])] == first.branches[POLICY]
    with pytest.raises(ConfigurationError, match="holds scenes of another audit: seed is 0 there, and 1 is asked for"):
        audited(tmp_path, "half", scenes=2, seed=1)


def test_variants_are_the_same_policy_planning_otherwise(tmp_path, policies):
    audit = audited(tmp_path, "obeys", scenes=1, plans=(3,), ensemble=0.01, against=tmp_path / "ignores")
    assert list(audit.obedience) == [
        *("policy", "policy, n_action_steps=3", "policy, temporal ensemble", "against", "operator"),
    ]
    assert policies == [
        ("obeys", ()),
        ("obeys", ("--temporal_ensemble_coeff=null", "--n_action_steps=3")),
        ("obeys", ("--n_action_steps=1", "--temporal_ensemble_coeff=0.01")),
        ("ignores", ()),
    ]
    assert list(audit.separation["against"]) == ["start"]
    assert max(audit.separation["against"]["start"].tool_m) == 0.0


def test_the_command_writes_a_page_with_pictures_and_the_same_as_data(tmp_path, capsys):
    out = tmp_path / "audit"
    options = ["--env.type=toy_reach", "--scenes=5", "--workers=0", f"--out={out}"]
    small = [f"--env.{name}={value}" for name, value in SMALL.items()]
    command = ["audit", str(tmp_path / "half"), *options, *small]
    assert main([*command, f"--against={tmp_path / 'obeys'}", "--n_action_steps=[1,2]", "--ensemble=0.1"]) == 0
    told = capsys.readouterr().out
    assert "Verdict: **obeys in part**; the slope of 0.5" in told
    page = (out / "audit.md").read_text()
    data = json.loads((out / "audit.json").read_text())
    assert page.startswith(told[:200])
    assert data["verdicts"]["against"]["verdict"] == "obeys"
    assert list(data["obedience"]) == [
        *("policy", "policy, n_action_steps=1", "policy, n_action_steps=2", "policy, temporal ensemble"),
        *("against", "operator"),
    ]
    assert data["settings"]["env.scene_set"] == "test"
    for name in ("audit_places.png", "audit_separation.png", "audit_paths.png"):
        assert f"]({name})" in page
        assert (out / name).stat().st_size > 5_000
    assert main([*command, f"--against={tmp_path / 'obeys'}", "--n_action_steps=[1,2]", "--ensemble=0.1"]) == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], "checkpoint is missing"),
        (["{path}"], "--out is missing"),
        (["{path}", "--out={path}", "--n_action_steps=[0]"], "--n_action_steps=[0] is not possible; give a list"),
        (["{path}", "--out={path}", "--n_action_steps=[2,2]"], "--n_action_steps names a number twice"),
        (["{path}", "--out={path}", "--env.task=Clear-v0"], "Clear-v0 cannot be audited"),
        (
            ["{path}", "--out={path}", "--env.type=toy_reach", "--stage=1"],
            "--stage=1 is not possible; allowed for Reach",
        ),
    ],
)
def test_what_cannot_be_audited_is_said_before_anything_is_played(tmp_path, capsys, options, message):
    assert main(["audit", *(option.format(path=tmp_path / "obeys") for option in options)]) == 2
    assert message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_few_scenes_decide_nothing(tmp_path):
    audit = audited(tmp_path, "obeys", scenes=4)
    assert audit.verdicts[POLICY].verdict == "undecided"
    assert "4 scenes with at least two masks to act on are too few" in audit.verdicts[POLICY].reason


def test_a_policy_that_goes_too_far_does_not_obey(tmp_path, monkeypatch):
    monkeypatch.setitem(SLOPES, "too far", 1.6)
    audit = audited(tmp_path, "too far")
    assert audit.obedience[POLICY].slope.estimate > 1.4
    assert audit.verdicts[POLICY].verdict == "undecided"


def test_the_operator_works_in_the_same_manner_under_every_mask(tmp_path, monkeypatch):
    paces = []
    make = type(env_types()["toy_reach"]).make_operator

    def noted(spec, rng):
        paces.append(make(spec, rng))
        return paces[-1]

    monkeypatch.setattr(type(env_types()["toy_reach"]), "make_operator", noted)
    audited(tmp_path, "still", scenes=2)
    of_scenes = [{operator._pace for operator in paces[:4]}, {operator._pace for operator in paces[4:]}]
    assert [len(found) for found in of_scenes] == [1, 1]
    assert of_scenes[0] != of_scenes[1]


def test_another_policy_in_the_same_folder_is_not_mixed_in(tmp_path):
    (tmp_path / "half").mkdir()
    (tmp_path / "half" / "model.safetensors").write_bytes(b"one")
    audited(tmp_path, "half", scenes=1)
    (tmp_path / "half" / "model.safetensors").write_bytes(b"trained on")
    with pytest.raises(ConfigurationError, match="holds scenes of another audit: variants is"):
        audited(tmp_path, "half", scenes=2)


def test_a_command_that_changes_by_itself_has_no_place_in_an_audit(tmp_path, capsys):
    arguments = ["audit", str(tmp_path), f"--out={tmp_path / 'out'}", "--env.type=fr5_grasp"]
    assert main([*arguments, "--env.retarget_frame=25"]) == 2
    assert "--env.retarget_frame=25 has no place in an audit" in capsys.readouterr().err


def test_the_text_is_the_page_without_its_pictures(tmp_path):
    audit = audited(tmp_path, "ignores", scenes=5)
    text = audit_text(audit)
    assert "Verdict: **insensitive**; the slope of" in text
    assert "](audit_" not in text
    played = "with --env.observation_height=32 --env.observation_width=48"
    assert f"5 scenes of the set test, {played}, each" in " ".join(text.split())


def test_the_page_says_what_was_dug_from_which_stage():
    env = env_types()["excavator"].settings.of({"scene_set": "val", "pile": "ridge", "density": "light"})
    audit = AuditSettings(env=env, first_scene=0, scenes=1, stage=3, variants=(), seed=0)
    assert audit.played_words == "with --env.density=light --env.pile=ridge, from stage 3"
