"""What the page may wish for, and how it is granted."""

import base64
import io
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lerobot_excav.console.console import Console
from lerobot_excav.console.recording import Recording
from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.envs.tasks.selection import TargetAbsentError
from lerobot_excav.errors import ConfigurationError, require, require_choice
from lerobot_excav.page.wishes import Wish

LARGEST_PICTURE_PX = 4_000_000
"""Pixels of a painted mask; more is not from our page (kind: guess)."""

COVERED = 0.4
"""Part of a policy's pixel that has to be painted (kind: guess)."""


def grant(console: Console, wish: Wish) -> None:
    """Do what a page wishes.

    Raises:
        ExcavError: It is not possible now; the message says why.
    """
    require(wish.kind in _GRANTS, f"the console does not know {wish.kind!r}")
    _GRANTS[wish.kind](console, wish)


def _point(console: Console, wish: Wish) -> None:
    _require_free(console)
    require(wish.x is not None and wish.y is not None, "a point needs x and y")
    assert wish.x is not None  # or it was refused
    assert wish.y is not None
    console.look(console.env.point_at(wish.x, wish.y))
    console.say("pointed: the red region is commanded")


def _paint(console: Console, wish: Wish) -> None:
    _require_free(console)
    pixels = painted_pixels(wish.picture or "", console.env.settings.observation_size)
    console.look(console.env.point_with(pixels))
    console.say(f"painted: a mask of {int(pixels.sum())} of the policy's pixels is commanded")


def _target(console: Console, wish: Wish) -> None:
    _require_free(console)
    require(wish.number is not None, "a target needs its number")
    assert wish.number is not None
    console.look(console.env.recommand(wish.number))
    console.say(f"target {wish.number + 1} is commanded")


def _start(console: Console, wish: Wish) -> None:
    _require_free(console)
    for name in wish.values:
        require_choice("start", name, ("scene_id", "stage", "target_id"))
    prepare(console, wish.values.get("stage", 0))
    console.start(**wish.values)
    console.say(f"scene {console.env.scene_id}")


def _drive(console: Console, wish: Wish) -> None:
    _require_decided(console)
    console.pilot.drive()
    console.say("you drive: move a stick")


def _work(console: Console, wish: Wish) -> None:
    _require_decided(console)
    once = bool(wish.values.get("once", 0))
    console.pilot.work(once=once)
    until = "this cycle is over" if once else "the task is over"
    console.say(f"the policy works until {until}; a stick takes over, and Stop stops it")


def _stop(console: Console, wish: Wish) -> None:
    console.pilot.rest()
    console.say("stopped: time stands still")


def _record(console: Console, wish: Wish) -> None:
    """Begin the next start of the schedule that offers its target."""
    recorder = console.recorder
    _require_decided(console)
    recording = recorder.require_recording()
    require(not recorder.is_running, "an episode is being recorded; finish it first")
    if recording.left:
        prepare(console, recording.left[0].stage)
    pair = show_next(console, recording)
    if pair is None:
        raise ConfigurationError("every start is recorded; write the dataset")
    recorder.begin(pair)
    console.pilot.drive()
    console.say("recording begins with your first motion")


def _finish(console: Console, wish: Wish) -> None:
    require(console.recorder.is_running, "nothing is recorded now")
    require(console.recorder.has_frames, "there is nothing to finish yet: recording begins with your first motion")
    console.finish_episode()


def _keep(console: Console, wish: Wish) -> None:
    console.recorder.keep()
    left = console.recorder.require_recording().left
    console.say(f"kept; {len(left)} left" if left else "kept; all are recorded: write the dataset")


def _again(console: Console, wish: Wish) -> None:
    console.recorder.forget()
    _record(console, wish)


def _skip(console: Console, wish: Wish) -> None:
    recorder = console.recorder
    recording = recorder.require_recording()
    require(not recorder.has_frames, "an episode is in hand; finish it, and keep it or record it again")
    pair = recorder.pair or next(iter(recording.left), None)
    recorder.forget()
    console.pilot.rest()
    if pair is not None:
        recording.put_off(pair)
    console.say("put off: it comes after all others")


def _complete(console: Console, wish: Wish) -> None:
    _require_free(console)
    recording = console.recorder.require_recording()
    console.pilot.rest()

    def progress(done: int, count: int) -> None:
        console.say(f"writing the dataset: {done} of {count} episodes")
        console.show()

    console.say("writing the dataset; LeRobot is loaded first, which takes a few seconds")
    console.show()
    out = recording.complete(progress)
    console.say(f"written: {out}; check it with lerobot-excav qc {out}")


def show_next(console: Console, recording: Recording) -> Pair | None:
    """Show the next start that offers its target, and return it; None if nothing is left."""
    while left := recording.left:
        try:
            console.start(**left[0].reset_options)
        except TargetAbsentError:  # a late stage may have fewer regions
            recording.leave_out(left[0])
            continue
        return left[0]
    return None


def prepare(console: Console, stage: int) -> None:
    """Tell the page that a start takes long to reach, before it does."""
    if stage:
        console.say(f"a seeded operator digs {stage} cycles first; that takes some seconds each, the first time")
        console.show()


_GRANTS: dict[str, Callable[[Console, Wish], None]] = {
    "point": _point,
    "paint": _paint,
    "target": _target,
    "start": _start,
    "drive": _drive,
    "work": _work,
    "stop": _stop,
    "record": _record,
    "finish": _finish,
    "keep": _keep,
    "again": _again,
    "skip": _skip,
    "complete": _complete,
}


def _require_free(console: Console) -> None:
    """Require that no episode is in hand: its start and its target are those of the schedule."""
    require(
        console.recorder.pair is None,
        "an episode is being recorded, with the target of the schedule; finish it, keep it or skip it first",
    )


def _require_decided(console: Console) -> None:
    require(
        not console.recorder.is_waiting_for_a_verdict, "decide on the last episode first: keep it, or record it again"
    )


def painted_pixels(picture: str, size: tuple[int, int]) -> NDArray[np.bool_]:
    """Return which of a policy's pixels (H, W) a painted mask covers, a picture in base64 of any size.

    Raises:
        ConfigurationError: It is no picture.
    """
    try:
        image = Image.open(io.BytesIO(base64.b64decode(picture, validate=True)), formats=("PNG",))
        require(image.width * image.height <= LARGEST_PICTURE_PX, "the painted mask is too large")
        grey = image.convert("L")
    except (ValueError, OSError, SyntaxError, Image.DecompressionBombError) as error:
        raise ConfigurationError("the painted mask is no picture; reload the page") from error
    height, width = size
    # Of every pixel, the part that is painted: black stays black, whatever the brush's colour.
    binary = grey.point(lambda value: 255 if value > 0 else 0)
    return np.asarray(binary.resize((width, height), Image.Resampling.BOX)) >= 255.0 * COVERED
