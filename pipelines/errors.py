"""The error that a user is shown as one line."""

import errno


class UserError(Exception):
    """Something the user can mend: wrong input, a foreign folder, a full disk.

    The message is one clear sentence; commands print it without a traceback and exit with code 1.
    """


class CorpusError(UserError):
    """A corpus that cannot be read or continued: damaged, unfinished, or of another schema."""


FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Codes of the system for a disk, or a share of it, that holds no more."""
_WORDS = {
    errno.ENOENT: "there is no file or folder {path}",
    errno.EACCES: "{path} cannot be used: permission denied",
    errno.EPERM: "{path} cannot be used: operation not permitted",
    errno.EROFS: "{path} cannot be written: the disk is read-only",
    errno.ENOTDIR: "{path} does not exist: a file stands where a folder should be",
    errno.EISDIR: "{path} is a folder, not a file",
}


def in_words(error: OSError, path: object = None) -> str:
    """What the system refused, as a sentence that names the file.

    Args:
        error: What was raised.
        path: The file or folder, if the error does not name it.
    """
    named = error.filename if error.filename is not None else path
    named = "the file" if named is None else named
    if error.errno in FULL:
        return f"the disk that holds {named} is full ({error.strerror}); free space and run the same command again"
    if error.errno in _WORDS:
        return _WORDS[error.errno].format(path=named)
    return f"{named} cannot be used: {error.strerror or error}"
