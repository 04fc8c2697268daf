"""Texts of options."""

from typer.main import get_command

from compare.cli import app


def test_each_option_has_a_text():
    for name, made in get_command(app).commands.items():
        assert [option.name for option in made.params if not (option.help or option.metavar)] == [], name
