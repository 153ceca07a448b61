"""Words in the place of their names in braces: how the texts of an experiment become commands and paths."""

import re
from collections.abc import Mapping
from pathlib import Path

from lerobot_excav.errors import ConfigurationError, require

Words = Mapping[str, str]

_WORD = re.compile(r"(?<!\$)\{(\w+)\}")  # `${NAME}` is bash's
_COMMENT = re.compile(r"(^|\s)#")
_DEEPEST_NESTING = 10


def fill(text: str, words: Words, place: str) -> str:
    """Put words in the place of their names in braces; a word may hold further names.

    Args:
        text: Text with names in braces.
        words: Words by name.
        place: Where the text stands, for messages.

    Raises:
        ConfigurationError: A name is unknown, or words name each other without end.
    """

    def word(match: re.Match[str]) -> str:
        require(
            match[1] in words,
            f"{place}: {{{match[1]}}} is not known; allowed: {', '.join(sorted(words))}",
        )
        return words[match[1]]

    for _ in range(_DEEPEST_NESTING):
        if not _WORD.search(text):
            return text
        text = _WORD.sub(word, text)
    raise ConfigurationError(f"{place}: settings name each other without end: {text}")


def fill_command(text: str, words: Words, place: str) -> str:
    """Make a command of a text with names in braces: one line for bash.

    Raises:
        ConfigurationError: As for `fill`, or there is a comment, which would swallow the rest of the line.
    """
    command = " ".join(fill(text, words, place).split())
    require(
        not _COMMENT.search(command),
        f"{place}: bash would take what follows ' #' for a comment, to the end of the command: {command}; "
        "put comments above the command",
    )
    return command


def fill_path(text: str, words: Words, place: str) -> Path:
    """Make a path of a text with names in braces.

    Raises:
        ConfigurationError: As for `fill`, or the path is empty or has white space, where commands would cut it.
    """
    path = fill(text, words, place)
    require(
        path != "", f"{place}: the path {text!r} is empty; name a folder or a file, or leave the entry out"
    )
    require(
        not re.search(r"\s", path),
        f"{place}: the path {path!r} has white space, which would cut it in commands",
    )
    return Path(path)
