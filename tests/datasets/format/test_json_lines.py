import pytest

from lerobot_excav.datasets.format.json_lines import read_json_lines
from lerobot_excav.errors import DatasetError


def read(tmp_path, text):
    path = tmp_path / "f.jsonl"
    path.write_text(text)
    return read_json_lines(path, origin="nobody writes it")


def test_objects_come_with_their_place_and_blank_lines_are_left_out(tmp_path):
    lines = read(tmp_path, '{"a": 1}\n\n{"a": 2}\n')
    assert [(line.place.rsplit(":")[-1], line.record) for line in lines] == [("1", {"a": 1}), ("3", {"a": 2})]


@pytest.mark.parametrize(("text", "message"), [("{", "not JSON"), ("[3]", "a JSON object is expected")])
def test_a_damaged_line_is_named(tmp_path, text, message):
    with pytest.raises(DatasetError, match=rf"f\.jsonl:2: {message}"):
        read(tmp_path, "{}\n" + text)


def test_a_missing_file_is_named_with_its_origin(tmp_path):
    with pytest.raises(DatasetError, match=r"f\.jsonl does not exist; nobody writes it"):
        read_json_lines(tmp_path / "f.jsonl", origin="nobody writes it")
