"""Functions that some problems provide beyond their mathematics, as ``module:function``, imported when first used."""

from collections.abc import Mapping
from typing import Any

from nlp_gait.errors import InputError
from nlp_gait.providers import import_object

_NAO_RECORDED = "nlp_gait.gaits.nao.recorded:make_recorded_gait"
_NAO_FITTED = "nlp_gait.gaits.nao.free_joints:fit_joints"
# Makes a gait from recorded joint angles, by the problem whose limits judge it; the first is the default.
RECORDED_GAITS = {"nao-ssp": _NAO_RECORDED, "nao-dsp": _NAO_RECORDED, "nao-cycle": _NAO_RECORDED}
# Fits free joints to a planned motion, by the problem with free joints.
FITTED_STARTS = {"nao-ssp-free": _NAO_FITTED, "nao-dsp-free": _NAO_FITTED}


def resolve(functions: Mapping[str, str], problem: str) -> Any:
    """Return the function that a problem provides; InputError if it provides none."""
    if problem not in functions:
        raise InputError(f"problem {problem!r} does not provide this; these do: {', '.join(functions)}")
    return import_object(functions[problem])
