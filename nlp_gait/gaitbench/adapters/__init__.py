"""Instances in the form that optimisers' packages take; each package is imported when it is needed."""

from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

from nlp_gait.errors import MissingExtraError, check_name, unknown
from nlp_gait.providers import import_object

# The function that converts an instance, and the packages that it needs.
ADAPTERS: dict[str, tuple[str, tuple[str, ...]]] = {
    "scipy": ("plain:to_scipy", ()),
    "cma": ("plain:to_cma", ("cma",)),
    "ioh": ("plain:to_ioh", ("ioh",)),
    "pygmo": ("plain:to_pygmo", ("pygmo",)),
    "pymoo": ("pymoo:PymooProblem", ("pymoo",)),
}


def find_adapter(name: str) -> Callable[..., Any]:
    """Return the function that converts an instance for a package; raises UnknownNameError and MissingExtraError."""
    check_name("adapter", name)
    if name not in ADAPTERS:
        raise unknown("adapter", name, ADAPTERS)
    address, packages = ADAPTERS[name]
    for package in packages:
        if find_spec(package) is None:
            raise MissingExtraError(
                f"to({name!r}) needs the package {package}, which is not installed: pip install {package}, or all adapters' "
                "packages: pip install 'nlp-gait[algorithms]'"
            )
    adapter: Callable[..., Any] = import_object(f"{__name__}.{address}")
    return adapter
