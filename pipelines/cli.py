"""The command `undergrowth`: picks a subcommand, reads its settings, turns user errors into one line."""

import importlib
import io
import logging
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from pipelines.models.kinds import KINDS


@dataclass(frozen=True)
class Command:
    """One subcommand.

    Attributes:
        module: Where its settings class lives; imported only when the command is asked for.
        settings: Name of that class: a dataclass with `run() -> int`, and `from_toml` if it takes --config.
        summary: One line of help.
        kind: The kind of model that the command is about, if it is one of several alike; `settings` then names a
            function that makes the class for a kind.
    """

    module: str
    settings: str
    summary: str
    kind: str = ""

    def settings_class(self) -> Any:
        """Imports the module and gives the settings class."""
        found = getattr(importlib.import_module(f"pipelines.commands.{self.module}"), self.settings)
        return found(self.kind) if self.kind else found


class Runnable(Protocol):
    """Settings of a command, ready to run."""

    def run(self) -> int:
        """Runs it and returns the exit code."""
        ...


COMMANDS = {
    "demo": Command(
        "demo", "DemoSettings", "run the whole pipeline at a small size: frames, forests, scores, report"
    ),
    "generate": Command("generate", "GenerateSettings", "make a corpus of labelled depth frames"),
    "join": Command("generate", "JoinSettings", "complete a corpus that several jobs have made"),
    "inspect": Command("inspect", "InspectSettings", "draw contact sheets and statistics of a corpus"),
    "verify": Command("verify", "VerifySettings", "check the digests, labels and splits of a corpus"),
    **{
        f"train {kind.name}": Command("train", "settings_of", f"train a {kind.title} on corpora", kind.name)
        for kind in KINDS.values()
    },
    "train orientation": Command(
        "train_orientation", "TrainOrientationSettings", "train a net that tells which way people face"
    ),
    "predict": Command("predict", "PredictSettings", "find the joints in depth images and draw them"),
    "live": Command("live", "LiveSettings", "follow people in depth images, and analyse whom a planner chooses"),
    "view": Command("view", "ViewSettings", "show a corpus, a recording or answers in a browser"),
    "evaluate": Command("evaluate", "EvaluateSettings", "score a model on a corpus"),
    "card": Command("card", "CardSettings", "write what a model learned from, its scores and its limits"),
    "ablate": Command("ablate", "AblateSettings", "train and compare all methods on the same frames"),
    "report": Command("report", "ReportSettings", "write an ablation as one HTML page"),
    "export": Command("export", "ExportSettings", "write a corpus as exr, coco, webdataset or itop"),
    "export-model": Command("export", "ExportModelSettings", "write a trained net as an ONNX graph"),
    "import mocap": Command("importing.mocap", "MocapSettings", "make a library of poses from BVH files"),
    "import depth": Command("importing.depth", "DepthSettings", "make a corpus from recorded depth images"),
    "import meshes": Command("importing.meshes", "MeshSettings", "make a library of objects from meshes"),
}


def usage() -> str:
    """The help text."""
    lines = ["usage: undergrowth COMMAND [OPTIONS]", "", "commands:"]
    lines += [f"  {name:<17} {command.summary}" for name, command in COMMANDS.items()]
    lines += ["", "undergrowth COMMAND --help lists its options."]
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a command line.

    Returns:
        The exit code: 0, 1 for a user error, 2 for a wrong command line, 130 after Ctrl-C.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    _print_any_name()
    if not words or words[0] in ("-h", "--help"):
        print(usage())
        return 0 if words else 2
    n_words = 2 if any(name.startswith(words[0] + " ") for name in COMMANDS) else 1
    name = " ".join(words[:n_words])
    if name not in COMMANDS:
        print(f"undergrowth: error: unknown command {name!r}; known are {', '.join(COMMANDS)}", file=sys.stderr)
        return 2
    _one_thread_for_small_matrices()
    _log_to_stdout()
    return _run(name, words[n_words:])


def _run(name: str, words: list[str]) -> int:
    """Runs a known command; what the user can mend becomes one line."""
    from pipelines.compiling import compiling_announced
    from pipelines.errors import UserError, in_words

    try:
        with compiling_announced():
            return _settings(name, words).run()
    except KeyboardInterrupt:
        print("undergrowth: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        return 1
    except UserError as error:
        return _failed(str(error))
    except OSError as error:
        return _failed(in_words(error))
    except MemoryError:
        return _failed("there is not enough memory; close other programs, or use fewer threads or smaller images")


def _failed(sentence: str) -> int:
    """Prints an error as one line and gives the exit code."""
    print(f"undergrowth: error: {' '.join(sentence.splitlines())}", file=sys.stderr)
    return 1


def _settings(name: str, words: list[str]) -> Runnable:
    """Settings of a command out of its words, over those of a TOML file."""
    import tyro

    from pipelines.errors import UserError

    cls = COMMANDS[name].settings_class()
    path = _config_path(words) if hasattr(cls, "from_toml") else None
    default: dict[str, Any] = {} if path is None else {"default": cls.from_toml(path)}
    try:
        return tyro.cli(cls, args=words, prog=f"undergrowth {name}", **default)
    except (TypeError, ValueError) as error:
        raise UserError(str(error)) from None


def _config_path(words: list[str]) -> Path | None:
    for place, word in enumerate(words):
        if word == "--config" and place + 1 < len(words):
            return Path(words[place + 1])
        if word.startswith("--config="):
            return Path(word.removeprefix("--config="))
    return None


def _print_any_name() -> None:
    """Lets names of files that are no text be printed: what no character stands for appears as its code."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


class _StdoutHandler(logging.StreamHandler):
    """Prints to standard output; where that cannot be written, the command ends."""

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - logging's own name
        """Lets an error of the stream through, with its name."""
        error = sys.exception()
        if isinstance(error, OSError):
            raise OSError(error.errno, error.strerror, "standard output") from error
        super().handleError(record)


def _one_thread_for_small_matrices() -> None:
    """Keeps BLAS to one thread: our matrices are small, and threads would take the cores of the workers."""
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
        os.environ.setdefault(name, "1")


def _log_to_stdout() -> None:
    handler = _StdoutHandler(sys.stdout)
    handler.setFormatter(logging.Formatter("%(message)s"))
    package = logging.getLogger("pipelines")
    package.handlers[:] = [handler]
    package.setLevel(logging.INFO)
    package.propagate = False


if __name__ == "__main__":
    sys.exit(main())
