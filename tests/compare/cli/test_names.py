"""Names of commands and options, and what is said of removed ones."""

import pytest

from compare.cli import PANELS, REPLACEMENTS, load_command
from tests.compare.cli.calls import one_sentence

COMMANDS = {name: load_command(name) for commands in PANELS.values() for name in commands}


def test_each_option_has_a_text():
    for name, made in COMMANDS.items():
        assert [option.name for option in made.params if not (option.help or option.metavar)] == [], name


def test_each_number_states_its_limits():
    """Click shows those of a range in the help; the seed alone has no largest value."""
    for name, made in COMMANDS.items():
        for option in made.params:
            kind = option.type_descriptor.annotation
            assert kind not in (int, float) or option.min is not None, (name, option.name)
            assert kind is not float or option.max is not None, (name, option.name)


@pytest.mark.parametrize("name", REPLACEMENTS)
def test_a_removed_name_is_gone(name):
    command, _, option = name.partition("--")
    takers = [COMMANDS[command.strip()]] if command.strip() in COMMANDS else COMMANDS.values()
    known = {flag for made in takers for parameter in made.params for flag in parameter.opts}
    assert name not in COMMANDS and not (option and f"--{option}" in known)


@pytest.mark.parametrize("name", REPLACEMENTS)
def test_a_removed_name_is_answered_by_its_replacement(name):
    command, dashes, option = name.partition("--")
    call = [command.strip() or "compare", dashes + option] if dashes else [name]
    assert REPLACEMENTS[name] in one_sentence(*call, status=2)
