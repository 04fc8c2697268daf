"""What every command keeps: help with an example, texts and limits of its options, and one sentence for what it refuses."""

import json
from pathlib import Path

import pytest

from compare.cli import PANELS, load_command
from compare.cli.command import read_help
from tests.compare.cli.calls import is_one_sentence, nlp_gait, one_sentence, process
from tests.compare.records import DSP_X

COMMANDS = {name: load_command(name) for commands in PANELS.values() for name in commands}
each_command = pytest.mark.parametrize("name", COMMANDS)

POINT = "0.31,-0.002,0.0034,0.008,0.0025,0.0243,-0.0256,0.015,4"
BENCH = "bench --out {new} --instances walk12-w015"
PARETO = "pareto nao-ssp --set intervals=4 --points 5 --out {new}"
# A command line, and the words of the sentence, separated by "|".
REFUSED = {
    "evaluate nao-spp --x 1": "unknown problem 'nao-spp'|nao-ssp",
    "evaluate nao-ssp --x 0.31,2": "must have 9 values",
    f"evaluate nao-ssp --x nan{POINT[4:]}": "x must be a finite number|nan",
    "evaluate nao-ssp --x a,b": "must be a finite number|'a'",
    "evaluate nao-ssp": "give a point with --x, or a motion with --motion",
    "evaluate nao-dsp --motion {new}/none.csv": "cannot be read",
    "solve nao-ssp --set swing_hight_m=0.02": "unknown parameter|swing_height_m",
    "solve nao-ssp --robot nao-v7": "unknown robot 'nao-v7'|nao-v",
    "solve nao-ssp --set hip_height_m.lower=0.5": "inverted|hip_height_m",
    "solve nao-ssp --set swing_height_m=0.5": "cannot be fixed at 0.5|0.015, 0.03",
    "solve nao-ssp --set torque_change_limit_Nm": "NAME=VALUE",
    "solve walk12 --limit FrictionCone": "walk12 takes no limits|leave out --limit",
    "solve walk12 --solver simplex": "unknown NLP solver 'simplex'",
    "plan --steps 2 --limit Friction": "unknown limit 'Friction'|FrictionCone",
    "list pso --robot nao-v5": "--robot takes a problem",
    "compare nao-ssp --out /proc/nowhere": "cannot write|--out",
    "compare nao-ssp --algorithms psso --out {new}": "unknown algorithm 'psso'|pso",
    "compare nao-ssp --handling penalty --out {new}": "penalty=WEIGHT",
    "compare gb2:absent:3 --out {new}": "unknown family of GaitBench 2",
    "report {new}": "contains no records",
    "reproduce walk1 --out {new}": "unknown reproduction 'walk1'; did you mean 'walk12'?",
    "reproduce walk12 --effort {new}/bad.toml --out {new}": "runs must be a whole number, got 'many'",
    "sweep nao-ssp --over intervals=10:20:2": "is an option of nao-ssp|--set intervals=",
    "tune walk12 --out {new}": "'walk12' cannot be simulated",
    "sweep nao-dsp --over hip_height_m=low:high:3 --out {new}": "--over takes",
    f"{PARETO} --against dbm_z": "unknown objective next to power 'dbm_z'|dbm_y_mean",
    f"{PARETO} --search NSGA2=10": "at least the population of 100|[10]",
    f"{BENCH} --algorithm psoo": "unknown algorithm 'psoo'",
    "bench --families ssp --seeds 5:3 --out {new}": "--seeds takes FIRST:END",
    "export {gait} --to webot": "unknown kind 'webot'|webots",
    "export nao-ssp --to objective": "name their folder by --out DIR",
    "export walk12-w15 --to objective --out {new}": "did you mean 'walk12-w015'",
    "simulate {gait} --drive fast": "unknown drive 'fast'|feed-forward",
    "simulate {gait} --push 1": "--push takes X,Y or X,Y,S, got '1'",
    "import walk12 {new}/none.csv --as ga": "cannot be read",
    "verify {new}/missing.zip": "missing.zip' cannot be read: No such file",
    "prices nao-spp --out {new}": "unknown problem 'nao-spp'",
    "tune nao-cycle --algorithms psso --out {new}": "unknown algorithm 'psso'",
    "certainty nao-spp --out {new}": "unknown problem 'nao-spp'",
}


@each_command
def test_help_has_an_example_and_the_text_and_limits_of_each_option(name: str) -> None:
    """Click shows the limits of a range in the help; the seed alone has no largest value."""
    assert f"nlp-gait {name}" in nlp_gait(name, "--help", COLUMNS="200").stdout
    options = COMMANDS[name].params
    assert [option.name for option in options if not (option.help or option.metavar)] == []
    for option in options:
        kind = option.type_descriptor.annotation
        assert kind not in (int, float) or option.min is not None, option.name
        assert kind is not float or option.max is not None, option.name


def test_each_text_of_the_help_has_its_option() -> None:
    places = {place.split(":")[1]: name for commands in PANELS.values() for name, (place, _) in commands.items()}
    for function, texts in read_help().items():
        commands = COMMANDS.values() if function == "shared" else [COMMANDS[places[function]]]
        assert texts.keys() <= {option.name for command in commands for option in command.params}, function


@each_command
def test_options_of_a_problem_are_the_same_in_all_commands(name: str) -> None:
    shared = {parameter.opts[0]: parameter.help for parameter in COMMANDS["solve"].params}
    options = {parameter.opts[0]: parameter.help for parameter in COMMANDS[name].params}
    if name not in ("list", "plan"):  # robots alone, and the options of its own problem
        assert all(options[option] == shared[option] for option in options.keys() & {"--robot", "--set"})


@each_command
def test_an_unknown_option_is_named_and_a_refusal_is_below(name: str) -> None:
    assert "--no-such-option" in nlp_gait(name, "--no-such-option", status=2).stderr
    assert any(line.split()[0] == name for line in REFUSED)


@pytest.mark.parametrize("line", REFUSED)
def test_a_command_refuses_in_one_sentence(line: str, tmp_path: Path) -> None:
    if line.startswith("simulate"):
        pytest.importorskip("mujoco")
    gait = tmp_path / "gait.json"
    gait.write_text(json.dumps({"problem": "nao-dsp", "x": DSP_X}))
    (tmp_path / "bad.toml").write_text('{"runs": "many"}')
    error = one_sentence(*line.format(new=tmp_path, gait=gait).split())
    assert all(word in error for word in REFUSED[line].split("|")), error
    assert list(tmp_path.rglob("*.json")) == [gait]


def test_a_process_that_refuses_ends_with_status_1_and_one_sentence() -> None:
    done = process("solve", "nao-ssp", "--set", "swing_hight_m=0.02")
    assert done.returncode == 1 and done.stdout == ""
    assert is_one_sentence(done.stderr) and "swing_height_m" in done.stderr
