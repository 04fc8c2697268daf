"""Texts, flags and limits of options in ``options.toml``."""

import sys

from typer.main import get_command

from compare.cli import app
from compare.cli.command import TEXTS


def test_each_text_belongs_to_an_option():
    commands = {function.__name__: function for function in (info.callback for info in app.registered_commands)}
    modules = [sys.modules[f"compare.cli.{name}"] for name in ("bench", "options", "simulate")]
    groups = {name: kind for module in modules for name, kind in vars(module).items()}
    taken = {name for function in commands.values() for name in function.__annotations__}
    for owner, texts in TEXTS.items():
        known = taken if owner == "shared" else (commands.get(owner) or groups[owner]).__annotations__.keys()
        assert texts.keys() <= known, owner


def test_each_option_has_a_text():
    for name, made in get_command(app).commands.items():
        assert [option.name for option in made.params if not (option.help or option.metavar)] == [], name
