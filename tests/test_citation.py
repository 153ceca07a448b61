"""CITATION.cff is valid (Citation File Format 1.2.0), and names the paper."""

from pathlib import Path

import yaml

CITATION = yaml.safe_load((Path(__file__).parents[1] / "CITATION.cff").read_text())
PAPER = ["Zhao", "Pan", "Li", "Tang", "Xi", "Xu", "Li", "Wang"]


def test_the_citation_has_what_its_format_requires_and_names_the_paper():
    assert CITATION["cff-version"] == "1.2.0"
    assert {"message", "title", "authors"} <= CITATION.keys()
    assert CITATION["authors"] == [{"name": "The lerobot_excav contributors"}]
    assert (CITATION["version"], CITATION["license"]) == ("0.2.0", "Apache-2.0")
    (paper,) = CITATION["references"]
    assert {"type", "title", "authors"} <= paper.keys()
    assert paper["title"] == "Vision Guided Target Conditioned Control for Autonomous Excavation"
    assert [author["family-names"] for author in paper["authors"]] == PAPER
