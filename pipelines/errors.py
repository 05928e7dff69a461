"""The error that a user is shown as one line."""


class UserError(Exception):
    """Something the user can mend: wrong input, a foreign folder, a full disk.

    The message is one clear sentence; commands print it without a traceback and exit with code 1.
    """


class CorpusError(UserError):
    """A corpus that cannot be read or continued: damaged, unfinished, or of another schema."""
