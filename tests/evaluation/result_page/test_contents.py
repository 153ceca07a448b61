import pytest

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.evaluation.result_page.contents import read_contents

ROW = '{ label = "a", about = "x" }'
SECTION = '[[section]]\ntitle = "s"\n'
PAPER = SECTION + 'rows = [{ label = "a", about = "x", paper = %s }]'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("colour = 1", r"rows\.toml: colour is not known; allowed: .*section"),
        (SECTION + 'rows = [{ label = "a" }]', r"rows\.toml: lacks section\[0\]\.rows\[0\]\.about"),
        (f"{SECTION}rows = [{ROW}, {ROW}]", r"\['a'\] stands on the page twice"),
        (f'[[section]]\ntitle = "s"\nreference = "b"\nrows = [{ROW}]', "'b' is not a row; allowed: a"),
        ('[[clips]]\nlabel = "b"\nepisodes = [1]', "'b' is not a row"),
        (f'[[section]]\ntitle = "s"\noperator = "b"\nrows = [{ROW}]', "operator 'b' is not a row; allowed: a"),
        (SECTION + 'rows = [{ label = "a", about = "x", seeds = [1, 1] }]', r"\['a-1'\] stands on the page twice"),
        (SECTION + 'rows = [{ label = "a", about = "x", seeds = [-1] }]', r"seeds\[0\]=-1"),
        (
            SECTION + 'rows = [{ label = "a", about = "x", seeds = [1] }, { label = "a", about = "y", seeds = [2] }]',
            r"\['a'\] stands on the page twice",
        ),
        ("[[curve]]\nlabel = 'a'\nfolder = 'v/c'\n" * 2, r"\['c'\] are the folders of two curves"),
        ('[[clips]]\nlabel = "a"\nepisode = [1]', r"clips\[0\]\.episode is not known; allowed: label, episodes"),
        ("[[", "is not TOML"),
        ("text = 3", "text=3: input should be a valid string"),
        ("section = 3", "section=3: input should be a valid array"),
        ("[section]", r"section=\{\}: input should be a valid array"),
        ('[[section]]\ntitle = "s"\nrows = [3]', r"section\[0\]\.rows\[0\]=3: input should be an object"),
        (SECTION + 'rows = [{ label = "../a", about = "x" }]', r"label: '\.\./a' cannot name a file"),
        (SECTION + 'rows = [{ label = "", about = "x" }]', r"label: '' cannot name a file"),
        (SECTION + 'rows = [{ label = "a", about = "" }]', r"about=''"),
        ("[[curve]]\nlabel = 'a'\nfolder = 'v/..'\n", r"'\.\.' cannot name a file"),
        ("[[curve]]\nlabel = 'a'\nfolder = ''\n", r"folder: '' is not a folder"),
        ('[[clips]]\nlabel = "a"\nepisodes = [-1]', r"clips\[0\]\.episodes\[0\]=-1"),
        ("text = " + "9" * 5000, "is not TOML"),
        ("text = " + "[" * 5000, "is not TOML"),
        (PAPER % "{ success = nan }", r"paper\.success=nan"),
        (PAPER % "{ success = 1e400 }", r"paper\.success=inf"),
        (PAPER % "3", r"rows\[0\]\.paper=3: input should be an object"),
        (PAPER % '{ success = "96" }', r"rows\[0\]\.paper\.success='96': input should be a valid number"),
        (PAPER % "{ success = true }", r"rows\[0\]\.paper\.success=True: input should be a valid number"),
        ('[[clips]]\nlabel = "a"\nepisodes = "abc"', r"clips\[0\]\.episodes='abc': input should be a valid array"),
        ('[[clips]]\nlabel = "a"\nepisodes = [0.5]', r"clips\[0\]\.episodes\[0\]=0.5: input should be a valid integer"),
    ],
)
def test_a_file_that_cannot_be_used_says_why(read_rows, text, message):
    with pytest.raises(ConfigurationError, match=message):
        read_rows(text)


def test_rows_and_figures_are_read_as_their_fields_say(read_rows, tmp_path):
    (row,) = read_rows(PAPER % "{ success = 96 }").rows
    assert row.paper == {"success": 96.0}
    assert (row.names, row.seeds) == (("a",), ())


def test_metrics_lie_in_a_folder_or_a_file_of_their_name_one_for_each_seed(read_rows, tmp_path):
    contents = read_rows(SECTION + 'rows = [{ label = "a", about = "x", seeds = [7, 8, 9] }]')
    for name in ("a-7/metrics.jsonl", "a-8.jsonl", "a-9.jsonl.partial", "a.jsonl"):
        (tmp_path / "test" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "test" / name).touch()
    (row,) = contents.rows
    assert row.names == ("a-7", "a-8", "a-9")
    assert contents.metrics_paths(row) == {
        "a-7": tmp_path / "test" / "a-7" / "metrics.jsonl",
        "a-8": tmp_path / "test" / "a-8.jsonl",
    }


def test_a_file_that_is_not_text_is_named(tmp_path):
    (tmp_path / "rows.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ConfigurationError, match=r"rows\.toml is not TOML"):
        read_contents(tmp_path / "rows.toml")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigurationError, match=r"--rows=.*none\.toml does not exist"):
        read_contents(tmp_path / "none.toml")


def test_with_metrics_elsewhere_curves_lie_where_they_did_seen_from_there(tmp_path):
    path = tmp_path / "rows.toml"
    path.write_text('title = "t"\nmetrics = "a/test"\n[[curve]]\nlabel = "c"\nfolder = "a/val/c"\n')
    other = tmp_path / "other" / "test"
    (curve,) = read_contents(path, metrics=other).curve
    assert curve.folder == str(tmp_path / "other" / "val" / "c")
    (other / "curves" / "c").mkdir(parents=True)  # as a page keeps them
    (curve,) = read_contents(path, metrics=other).curve
    assert curve.folder == str(other / "curves" / "c")
