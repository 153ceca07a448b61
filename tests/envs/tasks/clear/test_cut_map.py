import json
from itertools import combinations
from pathlib import Path

import pytest
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from PIL import Image

from lerobot_excav.envs.tasks.clear.cut_map import MOST_PILES, draw_cut_map, draw_cuts
from lerobot_excav.envs.tasks.clear.measures import ClearRecord, clear_sentence
from lerobot_excav.scripts.main import main

METRICS = Path("results", "clear", "operator_val.jsonl")


def piles(count):
    lines = METRICS.read_text().splitlines()[:count]
    return [ClearRecord.model_validate_json(json.dumps(json.loads(line))) for line in lines]


@pytest.mark.slow
def test_every_pile_gets_a_panel_up_to_a_number(tmp_path):
    widths = []
    for count in (1, 2, 6):
        draw_cut_map(piles(count), tmp_path / "map.png")
        widths.append(Image.open(tmp_path / "map.png").width)
    assert widths == [widths[0], 2 * widths[0], MOST_PILES * widths[0]]


def test_a_pile_that_was_never_dug_is_drawn(tmp_path):
    pile = piles(1)[0]
    first = pile.cycles[0].model_copy(update={"onset_w": None, "source_w": None, "target_success": False})
    draw_cut_map([pile.model_copy(update={"cycles": (first,)})], tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 10_000


def test_the_sentence_says_how_much_how_often_and_whether_the_box_was_hit():
    pile = piles(1)[0]
    cycles = tuple(cycle.model_copy(update={"target_success": n > 0}) for n, cycle in enumerate(pile.cycles[:4]))
    told = pile.model_copy(update={"pile_removed": 0.305, "cycles": cycles, "hard_target_contacts": 1})
    assert clear_sentence([told]) == (
        "30 % of the pile was removed in 4 cycles; in 3 of 4 cycles digging began inside the commanded region; the box "
        "was hit hard once."
    )
    assert clear_sentence([told, pile]).startswith("Of 2 piles ")
    assert clear_sentence([pile]).endswith("the box was never hit hard.")
    wrong = pile.model_copy(update={"mask_condition": "zero"})
    assert clear_sentence([wrong]).endswith("the box was never hit hard. The mask: zero.")


def test_a_report_of_piles_says_the_sentence_and_draws_the_map(tmp_path, capsys):
    assert main(["report", f"a b={METRICS}", f"--out={tmp_path}"]) == 0
    assert "Of 50 piles 79 % was removed on average" in capsys.readouterr().out
    assert Image.open(tmp_path / "figure_a_b.png").width > 1000
    assert "![a b](figure_a_b.png)" in (tmp_path / "report.md").read_text()


@pytest.mark.slow
def test_figures_of_one_name_are_kept_apart_and_old_ones_go(tmp_path):
    other = tmp_path / "other.jsonl"
    other.write_text(METRICS.read_text())
    out = tmp_path / "report"
    assert main(["report", f"a b={METRICS}", f"a/b={other}", f"--out={out}"]) == 0
    assert {path.name for path in out.glob("*.png")} == {"figure_a_b.png", "figure_a_b_2.png"}
    assert main(["report", f"c={METRICS}", f"--out={out}"]) == 0
    assert {path.name for path in out.glob("*.png")} == {"figure_c.png"}


def drawn(**changes):
    """Return the title of a pile's cuts, and the outlines of its heights; none where the pile is not known."""
    axes = Figure().subplots()
    draw_cuts(axes, piles(1)[0].model_copy(update=changes))
    heights = [child for child in axes.get_children() if isinstance(child, QuadContourSet)]
    return axes.get_title(), [path.vertices.tolist() for contours in heights for path in contours.get_paths()]


def test_the_heights_of_a_pile_are_those_of_its_soil_and_its_shape_whatever_its_density():
    outlines = [drawn(**changes)[1] for changes in ({}, {"soil": "gravel"}, {"pile": "ridge"})]
    assert all(outlines)
    assert all(one != other for one, other in combinations(outlines, 2))
    assert drawn(density="light")[1] == outlines[0]


@pytest.mark.parametrize("changes", [{"soil": "custom"}, {"simulation_version": 1}, {"stage": 2}])
def test_piles_of_a_soil_of_ones_own_of_an_older_simulation_or_a_later_stage_are_drawn_without_heights(changes):
    assert not drawn(**changes)[1]


def test_the_title_says_what_was_dug_unless_it_is_sand_in_heaps():
    assert drawn()[0].startswith("val scene 0: ")
    assert drawn(density="light", pile="ridge")[0].startswith("val scene 0, light sand, ridge: ")
    assert drawn(stage=2)[0].startswith("val scene 0, stage 2: ")
