"""Names that a package offers without loading what they come from before they are used."""

from collections.abc import Callable, Mapping
from importlib import import_module

Getter = Callable[[str], object]
Lister = Callable[[], list[str]]


def exports(package: str, homes: Mapping[str, tuple[str, ...]]) -> tuple[Getter, Lister]:
    """Makes a package's `__getattr__` and `__dir__` (PEP 562).

    Args:
        package: The package's `__name__`.
        homes: The names that it offers, by the module that defines them.
    """
    home_of = {name: home for home, names in homes.items() for name in names}

    def get(name: str) -> object:
        if name not in home_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}; it offers {', '.join(home_of)}")
        return getattr(import_module(home_of[name]), name)

    return get, lambda: sorted(home_of)
