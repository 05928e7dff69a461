"""What an exporter of models refuses."""


class UnexportableError(ValueError):
    """A model that no graph can stand for; the message says why."""
