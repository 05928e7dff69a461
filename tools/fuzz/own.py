"""Files that this program writes, and settings: samples, how each is damaged, and how it is read."""

import contextlib
import json
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from pipelines.errors import UserError
from storage.digested import DigestedFormat, read_digested, write_digested
from synth.frame import Frame
from tools.fuzz import samples
from tools.fuzz.mutations import damaged_bytes, damaged_json, damaged_text, damaged_value
from tools.fuzz.workers import Format, digest

Damage = Callable[[bytes, np.random.Generator], bytes]


def _signed(form: DigestedFormat) -> Damage:
    """Damages arrays and metadata under a digest that is right, as another program, or a spiteful one, might."""

    def damage(data: bytes, rng: np.random.Generator) -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "file"
            path.write_bytes(data)
            kind, arrays, metadata = read_digested(path, form)
            for name in sorted(arrays):
                if rng.random() < 1.0 / len(arrays):
                    arrays[name] = _odd_array(arrays[name], rng)
            if rng.random() < 0.1:
                del arrays[sorted(arrays)[int(rng.integers(len(arrays)))]]
            if rng.random() < 0.3:
                metadata = damaged_value(metadata, rng)
            try:
                write_digested(path, form, kind, arrays, metadata)
            except ValueError:
                return data[:-1]
            return path.read_bytes()

    return damage


def _odd_array(values: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """An array of another type or shape, or with odd numbers."""
    way = int(rng.integers(6))
    if way == 0:
        return values.astype(rng.choice(["float64", "int8", "uint16"]))
    if way == 1:
        return values[: len(values) // 2] if values.ndim else values
    if way == 2:
        return values[None]
    if way == 3:
        return np.concatenate([values, values]) if values.ndim else values
    out = values.copy()
    if out.size:
        flat = out.reshape(-1)
        some = rng.integers(out.size, size=min(3, out.size))
        if out.dtype.kind == "f":
            flat[some] = rng.choice([np.nan, np.inf, -1e30, 1e30, 0.0])
        elif out.dtype.kind in "iu":
            info = np.iinfo(out.dtype)
            flat[some] = rng.choice(np.array([info.min, info.max, 0, 1], out.dtype))
    return out


def _model(kind: str, damage: Damage | None = None) -> Callable[[Path], Format]:
    def make(folder: Path) -> Format:
        from forests.modelfile import FORMAT
        from pipelines.models.asking import ask
        from pipelines.models.opening import open_model
        from tests.pipelines.toy_source import ToySource

        frame = ToySource(3, 40).frame(30)

        def read(path: Path) -> object:
            contestant, _ = open_model(path)
            estimate = ask(contestant, frame.depth, frame.camera, None)
            return digest(estimate.joints, estimate.confidence)

        sample = samples.model(folder, kind)
        return Format(f"model {kind}", sample, damage or _signed(FORMAT), read, (UserError,), damage is not None)

    return make


def _poses(damage: Damage | None = None) -> Callable[[Path], Format]:
    def make(folder: Path) -> Format:
        from synth.bodies.poses.library import FORMAT, PoseLibraryError, read_library, write_library
        from tests.pipelines.toy_libraries import poses_of

        write_library(folder / "poses.safetensors", poses_of("train"))
        return Format(
            "pose library", folder / "poses.safetensors", damage or _signed(FORMAT),
            lambda path: read_library(path).digest, (PoseLibraryError,), damage is not None,
        )  # fmt: skip

    return make


def _objects(damage: Damage | None = None) -> Callable[[Path], Format]:
    def make(folder: Path) -> Format:
        from synth.occluders.meshlib import FORMAT, MeshLibraryError, read_library, write_library
        from tests.pipelines.toy_libraries import objects_of

        def read(path: Path) -> object:
            library = read_library(path)
            return library.digest, [len(model.occluder.mesh.faces) for model in library.models]

        write_library(folder / "objects.safetensors", objects_of("train"))
        return Format(
            "object library", folder / "objects.safetensors", damage or _signed(FORMAT), read,
            (MeshLibraryError,), damage is not None,
        )  # fmt: skip

    return make


def _corpus(name: str, damage: Damage, is_checked: bool = True) -> Callable[[Path], Format]:
    """A file of a corpus, which is opened, read and verified."""

    def make(folder: Path) -> Format:
        from pipelines.corpus import Corpus
        from pipelines.corpus.faults import faults
        from pipelines.inspect.statistics import statistics_of

        root = samples.corpus(folder)

        def read(path: Path) -> object:
            corpus = Corpus.open(root, allow_incomplete=True)
            frames: list[Frame] = []
            with contextlib.suppress(UserError):
                frames = [corpus[int(i)] for i in corpus.indices]
                statistics_of(corpus)
            if found := next(faults(corpus), None):
                raise UserError(f"{root}: {found}")
            if len(corpus) < corpus.header.n_frames:
                raise UserError(f"{root} is unfinished")
            return digest(*(value for frame in frames for value in vars(frame).values()))

        return Format(f"corpus {Path(name).name}", root / name, damage, read, (UserError,), is_checked)

    return make


def _signed_header(data: bytes, rng: np.random.Generator) -> bytes:
    from pipelines.corpus.header import digest_of

    document = damaged_value(json.loads(data), rng)
    if isinstance(document, dict):
        document["digest"] = digest_of(document)
    return json.dumps(document).encode()


def _results(damage: Damage) -> Callable[[Path], Format]:
    def make(folder: Path) -> Format:
        from pipelines.metrics import draw_frames
        from pipelines.metrics.document import score_document
        from pipelines.metrics.results import read_results, write_results
        from tests.pipelines.toy_results import results_of, truths_of

        path = folder / "rows.npz"
        write_results(path, [results_of(truths_of(8))], {"key": "k"})

        def read(path: Path) -> object:
            results, context = read_results(path)
            weights = draw_frames(len(results[0].truths), 3, np.random.default_rng(0))
            return [sorted(score_document(item, weights)) for item in results], context

        return Format("results npz", path, damage, read, (UserError,))

    return make


def _npz_header(data: bytes, rng: np.random.Generator) -> bytes:
    """The same archive with a header or an array of another shape."""
    import io

    with np.load(io.BytesIO(data)) as stored:
        arrays = dict(stored)
    if rng.random() < 0.5:
        header = damaged_value(json.loads(str(arrays["header"])), rng)
        arrays["header"] = np.array(json.dumps(header))
    else:
        name = sorted(arrays)[int(rng.integers(len(arrays)))]
        arrays[name] = _odd_array(arrays[name], rng) if name != "header" else np.zeros(3)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    return buffer.getvalue()


def _ablation(folder: Path) -> Format:
    from pipelines.report.source import read_source
    from pipelines.report.write import report_page

    path = samples.ablation(folder) / "ablation.json"
    return Format(
        "ablation.json", path, damaged_json, lambda path: len(report_page(read_source(path.parent))), (UserError,),
        n_divisor=4,
    )  # fmt: skip


# Settings


def _settings(name: str) -> Callable[[Path], Format]:
    def make(folder: Path) -> Format:
        from pipelines.ablate.config import load_config
        from pipelines.commands.generate import GenerateSettings
        from pipelines.commands.train import settings_of
        from pipelines.recordings.layout import read_layout
        from tests.pipelines.toy_recording import write_layout

        readers: dict[str, Callable[[Path], object]] = {
            "generate": GenerateSettings.from_toml,
            "train": settings_of("rwf").from_toml,
            "ablate": lambda path: load_config("demo", path),
            "layout": read_layout,
        }
        if name == "layout":
            path = Path(write_layout(folder))
        else:
            path = folder / f"{name}.toml"
            path.write_text(samples.SETTINGS[name])
        return Format(f"TOML {name}", path, damaged_text, readers[name], (UserError,))

    return make


MAKERS: dict[str, Callable[[Path], Format]] = {
    "model-oarf": _model("oarf", damaged_bytes),
    "model-rwf": _model("rwf", damaged_bytes),
    "model-oarf-signed": _model("oarf"),
    "model-rwf-signed": _model("rwf"),
    "poses": _poses(damaged_bytes),
    "poses-signed": _poses(),
    "objects": _objects(damaged_bytes),
    "objects-signed": _objects(),
    "corpus-header": _corpus("corpus.json", damaged_json),
    "corpus-header-signed": _corpus("corpus.json", _signed_header, is_checked=False),
    "corpus-manifest": _corpus("manifest.jsonl", damaged_json),
    "corpus-records": _corpus("frames/000000.jsonl", damaged_json),
    "corpus-map": _corpus("arrays.zarr/depth/c/0/0/0", damaged_bytes),
    "corpus-array": _corpus("arrays.zarr/joints/c/0/0/0", damaged_bytes),
    "results": _results(damaged_bytes),
    "results-header": _results(_npz_header),
    "ablation": _ablation,
    "toml-generate": _settings("generate"),
    "toml-train": _settings("train"),
    "toml-ablate": _settings("ablate"),
    "toml-layout": _settings("layout"),
}
"""Files of this program, by name; each makes its sample in a folder."""
