"""The panel of judges: what is declared, and that a panel can fail. The judges themselves run in `make judge-data`."""

import pyarrow.parquet as pq
import pytest

from lerobot_excav.datasets.check.quality_check import check_dataset
from validation.judges import __main__ as command
from validation.judges.damage import with_stopped_clock
from validation.judges.declarations import Declaration, read_declarations, undeclared, unused
from validation.judges.judge import JUDGES, Finding

from ...datasets.toy import record_toy

WORDS = Finding("robovet", "DATA-103", "Vector width differs from info.json 'shape' for: excav.pair_uid, excav.task")


def test_every_declaration_is_of_a_judge_and_has_a_reason():
    for each in read_declarations():
        assert each.judge in JUDGES
        assert len(each.reason) > 20 or each.reason == "As above."


def test_what_is_declared_covers_whole_findings_of_our_columns_only():
    declared = read_declarations()
    assert undeclared([WORDS], declared) == []
    state = WORDS._replace(text=WORDS.text + ", observation.state")
    assert undeclared([state], declared) == [state]
    other = WORDS._replace(check="DATA-104")
    assert undeclared([other], declared) == [other]
    frozen = Finding(
        "lerobot-doctor", "Action Quality", "action: 45% of episode 0 is consecutive identical actions (frozen)"
    )
    assert undeclared([frozen], declared) == [frozen]


def test_a_declaration_that_covers_nothing_is_named():
    stale = Declaration("robovet", "TIME-201", "clock.*", "It was so once.")
    assert unused([WORDS], [*read_declarations(), stale])[-1] is stale


@pytest.fixture
def datasets(tmp_path):
    record_toy(tmp_path / "toy", scenes=1)
    return {"toy": tmp_path / "toy"}


def test_the_planted_defect_is_one(datasets, tmp_path):
    damaged = with_stopped_clock(datasets["toy"], tmp_path / "damaged")
    (path,) = damaged.glob("data/*/*.parquet")
    assert set(pq.read_table(path)["timestamp"].to_pylist()[:5]) == {0.0}
    assert not check_dataset(damaged, replays=0).has_passed
    assert check_dataset(datasets["toy"], replays=0).has_passed


@pytest.mark.parametrize(
    ("found", "sees_defect", "code"), [([], True, 0), ([Finding("robovet", "X", "bad")], True, 1), ([], False, 1)]
)
def test_the_panel_fails_when_a_judge_finds_something_or_is_blind(
    datasets, tmp_path, monkeypatch, capsys, found, sees_defect, code
):
    def look(programs, dataset):
        return [Finding("robovet", "TIME", "stopped")] if sees_defect and dataset.name == "stopped_clock" else found

    monkeypatch.setattr(command, "JUDGES", {"robovet": look})
    monkeypatch.setattr(command, "record_missing", lambda *_: datasets)
    monkeypatch.setattr(command, "read_declarations", list)
    assert command.main(["--programs=nowhere", f"--out={tmp_path}"]) == code
    assert ("missed the planted defect" in capsys.readouterr().out) == (not sees_defect)
