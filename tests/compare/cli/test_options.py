"""Texts, flags and limits of options in ``options.toml``."""

import pytest

from compare.cli import app, options, simulation_options
from compare.cli.command import TEXTS, command


def test_each_text_belongs_to_an_option():
    commands = {function.__name__: function for function in (info.callback for info in app.registered_commands)}
    groups = {name: kind for module in (options, simulation_options) for name, kind in vars(module).items()}
    taken = {name for function in commands.values() for name in function.__annotations__}
    for owner, texts in TEXTS.items():
        known = taken if owner == "shared" else (commands.get(owner) or groups[owner]).__annotations__.keys()
        assert texts.keys() <= known, owner


def test_an_option_without_a_text_is_an_error():
    def forgotten(number: int = 0) -> None:
        """Do nothing."""

    with pytest.raises(KeyError, match="no text for 'number' of forgotten"):
        command(forgotten)
