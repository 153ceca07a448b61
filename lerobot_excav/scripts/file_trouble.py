"""What to do about an error of the file system."""

import errno
import re

_FULL = (
    "free some space there, or write elsewhere. What was finished is kept; "
    "demos and operator continue with --resume=true"
)
_ADVICE = {
    **dict.fromkeys((errno.ENOSPC, errno.EDQUOT, errno.EFBIG), _FULL),
    **dict.fromkeys(
        (errno.EACCES, errno.EPERM, errno.EROFS),
        "choose a place where you may read and write, or ask its owner for the rights",
    ),
    errno.ENOENT: "check the path; a folder or file of it does not exist",
    errno.EEXIST: "choose another name, or move what is there elsewhere",
    errno.ENOTEMPTY: "choose another name, or move what is there elsewhere",
    errno.ENOTDIR: "check the path; a part of it is a file, not a folder",
    errno.EISDIR: "it is a folder; name a file in it",
    errno.ENAMETOOLONG: "choose a shorter name",
    errno.ELOOP: "check the path; a symbolic link in it leads back to itself",
    **dict.fromkeys((errno.EMFILE, errno.ENFILE), "close other programs, or allow more open files: ulimit -n 4096"),
    **dict.fromkeys(
        (errno.EIO, errno.ESTALE, errno.ETIMEDOUT),
        "the disk or the network drive fails; check it, or write to another one",
    ),
}


def in_words(error: OSError) -> str:
    """Return what happened to which file, and what to do."""
    place = f"{error.filename}: " if error.filename is not None else ""
    said = re.search(r"\[errno (\d+)\]", str(error), re.IGNORECASE)  # where a library gives the number in words only
    number = error.errno if error.errno is not None else int(said[1]) if said else None
    advice = f"; {_ADVICE[number]}" if number in _ADVICE else ""
    return f"{place}{error.strerror or error}{advice}"
