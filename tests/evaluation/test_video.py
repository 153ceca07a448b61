import av
import numpy as np
import pytest

from lerobot_excav.evaluation.video import write_video


def test_a_video_holds_its_pictures_at_its_rate_in_even_sizes(tmp_path):
    path = tmp_path / "new" / "film.mp4"
    write_video(path, (np.full((25, 33, 3), 20 * number, dtype=np.uint8) for number in range(6)), 10, crf=18)
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.average_rate) == ("h264", 10)
        pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
    assert [picture.shape for picture in pictures] == 6 * [(24, 32, 3)]
    assert [picture.mean() for picture in pictures] == pytest.approx([0, 20, 40, 60, 80, 100], abs=4)


def test_a_video_appears_when_it_is_complete(tmp_path):
    def broken():
        yield np.zeros((24, 32, 3), dtype=np.uint8)
        raise RuntimeError("out of pictures")

    with pytest.raises(RuntimeError):
        write_video(tmp_path / "film.mp4", broken(), 10, crf=18)
    assert not (tmp_path / "film.mp4").exists()
