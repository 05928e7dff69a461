"""The sizes that keep the packages readable: files, functions, folders, and chains of imports."""

import ast
import functools
from collections import Counter, defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("storage", "synth", "forests", "nets", "pipelines")
MAX_FILE_LINES, MAX_FUNCTION_LINES, MAX_KERNEL_LINES = 350, 50, 80
MAX_MODULES_PER_FOLDER = 15
MAX_CHAIN = 15


def sources():
    return sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))


@functools.cache
def tree_of(path):
    return ast.parse(path.read_text(encoding="utf-8"))


def module_of(path):
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def test_no_file_is_too_long():
    lines = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in sources()}
    assert {str(path): n for path, n in lines.items() if n > MAX_FILE_LINES} == {}


def is_kernel(function):
    return any("njit" in ast.dump(decorator) for decorator in function.decorator_list)


def test_no_function_is_too_long():
    too_long = {}
    for path in sources():
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.FunctionDef):
                n = node.end_lineno - node.lineno + 1
                if n > (MAX_KERNEL_LINES if is_kernel(node) else MAX_FUNCTION_LINES):
                    too_long[f"{path.relative_to(ROOT)}:{node.name}"] = n
    assert too_long == {}


def test_no_folder_has_too_many_modules():
    counts = Counter(path.parent for path in sources() if path.name != "__init__.py")
    assert {str(folder): n for folder, n in counts.items() if n > MAX_MODULES_PER_FOLDER} == {}


def imports_of_pipelines():
    """Module to the modules of pipelines that it imports; what is imported for types alone does not count."""
    modules = {module_of(path): path for path in sources() if path.is_relative_to(ROOT / "pipelines")}
    graph = defaultdict(set)
    for module, path in modules.items():
        tree = tree_of(path)
        for_types = {
            inner
            for node in ast.walk(tree)
            if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)
            for inner in ast.walk(node)
        }
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module and node not in for_types:
                names = (f"{node.module}.{alias.name}" for alias in node.names)
                found = {name if name in modules else node.module for name in names}
                graph[module] |= (found & set(modules)) - {module}
    return graph


def test_no_chain_of_imports_is_too_long():
    graph = imports_of_pipelines()

    @functools.cache
    def chain(module):
        below = max((chain(other) for other in graph[module]), key=len, default=())
        return (module, *below)

    longest = max((chain(module) for module in list(graph)), key=len)
    assert len(longest) > 5, "the graph of imports was not read"
    assert len(longest) <= MAX_CHAIN, longest


def test_commands_are_imported_by_nothing():
    importers = {
        module for module, others in imports_of_pipelines().items() if any(".commands." in o for o in others)
    }
    assert importers == set()


def imported_by(node):
    """Names of the modules that an import statement names."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    return [node.module] if isinstance(node, ast.ImportFrom) and node.module else []


NETS_WITHOUT_TORCH = {"nets.views", "nets.graph", "nets.values"} | {
    f"nets.orientation.{name}" for name in ("angles", "config", "decode", "frames", "model")
}
"""What programs without torch may import when they start."""


def test_only_nets_import_torch():
    users = {
        path.relative_to(ROOT).parts[0]
        for path in sources()
        for node in ast.walk(tree_of(path))
        if any(name.split(".")[0] in ("torch", "onnx", "onnxruntime") for name in imported_by(node))
        if path != ROOT / "pipelines" / "corpus" / "torch_dataset.py"
    }
    assert users == {"nets"}


def test_nothing_outside_nets_needs_torch_to_be_imported():
    wrong = {
        (module_of(path), name)
        for path in sources()
        if not path.is_relative_to(ROOT / "nets")
        for node in tree_of(path).body
        for name in imported_by(node)
        if name.split(".")[0] == "nets" and name not in NETS_WITHOUT_TORCH
    }
    assert wrong == set()
