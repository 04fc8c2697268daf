"""Videos."""

import numpy as np
from PIL import Image

from nlp_gait.simulation.video import write_video


def frames(count=4):
    for k in range(count):
        frame = np.full((24, 33, 3), 255, dtype=np.uint8)
        frame[:, 8 * k : 8 * k + 8] = (200, 60, 20)
        yield frame


def test_a_gif_keeps_frames_size_pace_and_colours(tmp_path):
    path = tmp_path / "walk.gif"
    write_video(path, frames(), frames_per_s=12.5)
    with Image.open(path) as image:
        assert image.n_frames == 4 and image.size == (33, 24) and image.info["duration"] == 80
        image.seek(2)
        assert np.abs(np.array(image.convert("RGB"))[5, 20].astype(int) - (200, 60, 20)).max() <= 16
    assert [p.name for p in tmp_path.iterdir()] == ["walk.gif"]
