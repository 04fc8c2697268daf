"""Functions whose options are grouped: an argument annotated with a data class stands for the fields of that class."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any


def find_groups(function: Callable[..., Any]) -> dict[str, Any]:
    """Return the data classes among a function's arguments, by argument."""
    parameters = inspect.signature(inspect.unwrap(function), eval_str=True).parameters
    return {name: p.annotation for name, p in parameters.items() if is_dataclass(p.annotation)}


def list_options(function: Callable[..., Any]) -> dict[str, inspect.Parameter]:
    """Return the options of a function by name: its arguments, and in place of each group the fields of the class."""
    options: dict[str, inspect.Parameter] = {}
    for name, parameter in inspect.signature(function, eval_str=True).parameters.items():
        group = is_dataclass(parameter.annotation)
        options |= list_options(parameter.annotation) if group else {name: parameter}
    return options


def pack_options(groups: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a function's arguments from the values of its options; those of each group are packed into its class."""
    packed = {field.name for group in groups.values() for field in fields(group)}
    arguments = {name: value for name, value in values.items() if name not in packed}
    for name, group in groups.items():
        arguments[name] = group(**{field.name: values[field.name] for field in fields(group)})
    return arguments


def replace_signature(function: Any, options: Sequence[inspect.Parameter]) -> None:
    """Give a function that takes any keywords the signature of these options."""
    function.__signature__ = inspect.Signature(list(options))
    function.__annotations__ = {option.name: option.annotation for option in options}
