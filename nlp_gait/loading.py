"""Problems and instances of GaitBench by name."""

from nlp_gait.errors import check_name
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.registry import load as load_problem
from nlp_gait.providers import PROBLEMS


def load(name: str, /, **options: str | int | float | bool) -> GaitProblem:
    """Return a problem, see ``find_maker``, or an instance of GaitBench, ``load("ssp-v5")`` or ``load("gb2:ssp:3")``, by name.

    It is built with the given options; the others keep their defaults. A problem of this package with equal options is made
    once, unless they name a file. Raises UnknownNameError, and InputError for a value that the option does not allow, or user
    code that fails.
    """
    check_name("problem", name)
    if name in PROBLEMS:
        return load_problem(name, **options)
    from nlp_gait.gaitbench.generated import resolve_name

    problem, instance = resolve_name(name)
    return load_problem(problem, **{**instance, **options})
