"""Make a time lapse of a video: every n-th picture of it, as mp4 or, small enough for a README, as an animated WebP.

python examples/time_lapse.py outputs/demo/film/Clear-v0_test_0_0_0.mp4 docs/images/clearing.webp --every=2 --width=480
"""

import argparse
import sys
from itertools import islice
from pathlib import Path

from PIL import Image

from lerobot_excav.evaluation.video import read_video, write_video


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("video", type=Path, help="mp4 file to read")
    parser.add_argument("out", type=Path, help="file to write: .mp4 or .webp")
    parser.add_argument("--every", type=int, default=10, help="take every n-th picture (default: 10)")
    parser.add_argument("--fps", type=int, default=10, help="pictures per second of the time lapse (default: 10)")
    parser.add_argument("--width", type=int, help="width of a .webp [px] (default: as it is)")
    given = parser.parse_args()
    if min(given.every, given.fps, given.width or 1) < 1:
        parser.error("--every, --fps and --width: allowed are 1 and above")
    if given.out.suffix not in (".mp4", ".webp"):
        parser.error(f"out={given.out}: allowed are .mp4 and .webp")
    if given.width and given.out.suffix == ".mp4":
        parser.error("--width is of use with .webp only")
    pictures = list(islice(read_video(given.video), 0, None, given.every))
    if not pictures:
        parser.error(f"{given.video} holds no pictures")
    if given.out.suffix == ".mp4":
        write_video(given.out, pictures, given.fps, crf=20)
        return 0
    images = [Image.fromarray(picture) for picture in pictures]
    if given.width:
        height = round(images[0].height * given.width / images[0].width)
        images = [image.resize((given.width, height), Image.Resampling.LANCZOS) for image in images]
    first, *rest = images
    options = {"quality": 55, "method": 6, "duration": round(1000 / given.fps), "loop": 0}
    first.save(given.out, save_all=True, append_images=rest, **options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
