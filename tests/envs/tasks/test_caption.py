import numpy as np
import pytest

from lerobot_excav.envs.tasks.caption import Caption, bar_height_px, captioned

WORDS = ("load 312 kg", "in the box 0 kg", "6.4 s", "mask: mismatched")
SIZES = [(96, 128), (480, 640), (32, 32), (1024, 1024)]


def caption(words=WORDS, outcome=None, *, is_success=False):
    return Caption(words=words, outcome=outcome, is_success=is_success)


def picture(height=480, width=640):
    return np.random.default_rng(0).integers(0, 256, (height, width, 3), dtype=np.uint8)


@pytest.mark.parametrize("size", SIZES)
def test_a_caption_covers_the_lowest_rows_alone_and_leaves_the_picture_as_it_was(size):
    plain = picture(*size)
    kept = plain.copy()
    result = captioned(plain, caption(outcome="success"))
    assert (result.shape, result.dtype) == ((*size, 3), np.uint8)
    bar = bar_height_px(size[0])
    assert np.array_equal(result[:-bar], plain[:-bar])
    assert (result[-bar:] != plain[-bar:]).any()
    assert np.array_equal(plain, kept)
    assert bar < 0.36 * size[0]


@pytest.mark.parametrize("size", SIZES[:2])
def test_each_first_word_and_each_outcome_is_another_picture(size):
    plain = picture(*size)
    changed = [caption(), caption(("load 313 kg", *WORDS[1:])), caption(outcome="success", is_success=True)]
    changed += [caption(outcome="success"), caption(outcome="missed region")]
    assert len({captioned(plain, each).tobytes() for each in changed}) == len(changed)


def test_words_without_room_are_left_out_whole_and_the_outcome_is_kept():
    plain = picture(96, 128)
    few, many = captioned(plain, caption(WORDS[:1])), captioned(plain, caption(WORDS * 3))
    assert not np.array_equal(few, captioned(plain, caption(())))
    last = captioned(plain, caption((WORDS[0], "x" * 60)))
    assert np.array_equal(last, few)
    assert np.array_equal(many[:, :60], captioned(plain, caption(WORDS))[:, :60])
    ended = captioned(plain, caption(WORDS * 3, outcome="success"))
    assert (ended[:, 90:] != many[:, 90:]).any()
