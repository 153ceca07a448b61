"""Inputs that were changed at random: each change is labelled harmful or harmless before anything is tried on it.

A harmful one has to be refused, in words; a harmless one has to be taken; and whatever happens, no traceback comes out
and every file that is not the command's own stays as it is. `make test` tries a few inputs of every kind, `make fuzz` a
thousand and more.
"""

import contextlib
import hashlib
import io
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from lerobot_excav.scripts.main import main


def inputs(few, many=1_000):
    """Return how Hypothesis is to try inputs: a few in the suite, many in `make fuzz`; never the same twice."""
    is_long = settings.get_current_profile_name() == "fuzz"
    return settings(
        max_examples=many if is_long else few, deadline=None, suppress_health_check=list(HealthCheck), database=None
    )


@dataclass(frozen=True)
class Change:
    """A change of an input.

    Attributes:
        words: What it is.
        is_harmful: Whether the input cannot be used any more.
        apply: Does it, to a folder.
    """

    words: str
    is_harmful: bool
    apply: Callable[[Path], Any]

    def __repr__(self):
        return f"<{'harmful' if self.is_harmful else 'harmless'}: {self.words}>"


def harmful(words, apply):
    return Change(words, is_harmful=True, apply=apply)


def harmless(words, apply):
    return Change(words, is_harmful=False, apply=apply)


@dataclass(frozen=True)
class Outcome:
    """What a command did: its exit code, and what it printed."""

    code: int
    text: str


def run(*arguments):
    """Run `lerobot-excav` in this process; what would be a traceback comes out as the exception itself."""
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
        code = main([str(argument) for argument in arguments])
    return Outcome(code, printed.getvalue())


def digests(*places: Path, own: Iterable[str] = ()):
    """Return a digest of every file below some folders, but for a command's own, named by the ends of their paths."""
    files = (file for place in places for file in sorted(place.rglob("*")) if file.is_file())
    return {file: hashlib.sha256(file.read_bytes()).hexdigest() for file in files if not str(file).endswith(tuple(own))}


def require_right(change: Change, outcome: Outcome):
    """Fail unless a command took an input as its label says."""
    assert "Traceback" not in outcome.text, outcome.text
    if change.is_harmful:
        assert outcome.code != 0, f"accepted in silence: {change.words}\n{outcome.text}"
        assert outcome.text.strip(), f"refused without a word: {change.words}"
    else:
        assert outcome.code == 0, f"refused: {change.words}\n{outcome.text}"


def require_kept(before, after):
    """Fail unless all files of before are there as they were."""
    lost = [str(file) for file, digest in before.items() if after.get(file) != digest]
    assert not lost, f"lost or changed: {lost}"


def truncated(path, share):
    """Return a change that cuts a file off after a share of its bytes."""

    def apply(folder):
        data = (folder / path).read_bytes()
        (folder / path).write_bytes(data[: int(share * len(data))])

    return harmful(f"{path} is cut off at {share:.2f}", apply)


def overwritten(path, data: bytes):
    """Return a change that puts something else into a file."""
    return harmful(f"{path} holds {data[:20]!r}", lambda folder: (folder / path).write_bytes(data))


GARBAGE = st.sampled_from([b"", b"\0" * 64, b"{", b"null", b"\xff\xfe\x00garbage", "Grüße".encode("utf-16"), b"[1, 2"])
"""What is neither a table, nor JSON of an object, nor a picture, nor weights."""
