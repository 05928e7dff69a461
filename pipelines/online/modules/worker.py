"""The process of a module: opens its model, says that it is ready, and answers jobs until it is told to end."""

from multiprocessing.connection import Connection
from typing import NamedTuple

from pipelines.online.messages import Result
from pipelines.online.modules.analysers import open_analyser
from pipelines.online.modules.jobs import Job, ModuleSettings
from pipelines.online.modules.ring import Place, Reader


class Work(NamedTuple):
    """A job, and where its image lies."""

    job: Job
    place: Place


class Ready(NamedTuple):
    """The model is open."""


class Answered(NamedTuple):
    """A job is done."""

    results: list[Result]


class Failed(NamedTuple):
    """The process ends since the model could not be opened, or since a job raised."""

    sentence: str


def run(settings: ModuleSettings, connection: Connection) -> None:
    """Runs a module until the other end of the connection is closed or sends None."""
    reader = Reader()
    try:
        analyser = open_analyser(settings)
        connection.send(Ready())
        while True:
            work = connection.recv()
            if work is None:
                break
            connection.send(Answered(analyser.analyse(reader.read(work.place), work.job)))
    except (EOFError, KeyboardInterrupt):
        pass
    except Exception as error:
        connection.send(Failed(f"{type(error).__name__}: {error}"))
