"""Modules in the process of the system: every answer is there at once, and the same input gives the same answers."""

from pipelines.online.messages import CameraFrame, Notice, Result
from pipelines.online.modules.analysers import open_analyser
from pipelines.online.modules.jobs import Job, ModuleSettings, Told


class InlineModules:
    """Runs modules one after the other. One that raises loses the image in hand, and goes on with the next.

    Attributes:
        settings: The modules.
    """

    def __init__(self, settings: tuple[ModuleSettings, ...]) -> None:
        """Opens all modules.

        Raises:
            ValueError: A model cannot be used.
        """
        self.settings = settings
        self._analysers = {one.name: open_analyser(one) for one in settings}
        self._results: list[Result] = []
        self._notices: list[Notice] = []

    def is_up(self, name: str) -> bool:
        """Always."""
        return True

    def submit(self, frame: CameraFrame, jobs: dict[str, Job]) -> None:
        """Asks modules about an image, and has them answer."""
        for name, job in jobs.items():
            try:
                self._results += self._analysers[name].analyse(frame.depth, job)
            except Exception as error:
                self._notices.append(
                    Notice(f"module {name} failed", f"module {name} failed: {type(error).__name__}: {error}")
                )

    def collect(self, timeout_s: float = 0.0) -> Told:
        """What was answered since it was asked last."""
        told = Told(tuple(self._results), tuple(self._notices))
        self._results, self._notices = [], []
        return told

    def is_busy(self) -> bool:
        """Never."""
        return False

    def close(self) -> None:
        """Does nothing."""
