"""Plain English in code and docs: no words of the old dialect, functions named by verbs, and one thing to a class name."""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("nlp_gait", "metaheuristics", "compare")

# What not to write, and what to write instead. See the glossary in CONTRIBUTING.md.
REPLACEMENTS = {
    r"anew": "again, recompute, rerun",
    r"of one's own|one's own": "your own, user-defined",
    r"mend(s|ed|ing)?": "fix",
    r"stands? twice": "is duplicated",
    r"whence|wherein|thereof|whereof": "from which, in which, its",
    r"somebody|nobody|whoever": "the user, the caller, or nothing",
    r"told apart|tells? apart": "distinguish, given different names",
    r"what is known of": "information about",
    r"comes about": "results from",
    r"goes on(?! (line|axis))": "continues",
    r"(?-i:(?<!there )is none)": "there is no, is not a",
    r"has gone(?= (and|so|does))": "ended",
}
WORDS = re.compile(rf"\b({'|'.join(REPLACEMENTS)})\b", re.IGNORECASE)
# A name that is a participle alone says what was done, not what the function does.
PARTICIPLE = re.compile(
    r"_?([a-z]+ed|understood|borne|told|sought|drawn|shown|known|left|kept|held|made|given|taken|seen|found|written|begun|said)"
)
CLASS = re.compile(r"^class (\w+)", re.MULTILINE)
# First words of public functions. Not for commands and problems, which have names of their own, and formulas in `symbolic`.
VERBS = frozenset(
    """
    abbreviate add allow animate apply approximate are assemble assign average bind block bootstrap bound build call catch
    certify challenge change check choose cite clip close cluster collect combine compare compile compute connect convert
    correct count cross decide decode defer define delay derive describe difference differentiate draw encode end escape
    estimate evaluate exit explain export extrapolate fail fill filter find fit fix flush follow forget format generate get
    group guarantee halve has hash hide hold identify ignore import index infer inline interpolate is iterate join judge keep
    kill label lay limit link list load locate lock log make mark maximise measure meets minimize mirror move mutate name pack
    parse pass perform perturb pick place plan plot pose predict prepare price print probe protect raise rank read rebuild record
    reflect register remember remove rename render renew repair repeat replace report require resolve reverse roll rotate round
    run sample save say score search seed select send share shift shorten show simulate solve split spread stack start store sum
    summarise swing tabulate take takes tie title to track train try tune turn unite unpack use verify watch weld with write
    """.split()
)
# Errors for `raise` and fields of data classes; and what files call that certificates are hashed with.
NO_VERBS = {"unknown", "bad_setting", "tunable", "main", "command", "maker", "never"}
NO_VERBS |= {"available_cores", "native_lanes", "lane_flags", "target_cost", "problem"}
NOT_PARTICIPLES = frozenset({"_embed", "_speed", "speed", "seed", "_seed", "_feed", "_need", "embed", "proceed"})


def prose() -> Iterator[Path]:
    """Every file whose words users or readers see."""
    for package in (*PACKAGES, "tests", "benchmarks", "examples"):
        yield from sorted((ROOT / package).rglob("*.py"))
        yield from sorted((ROOT / package).rglob("*.hpp"))
    yield from sorted((ROOT / "docs").glob("*.md"))
    yield from sorted((ROOT / "docs").rglob("*.py"))
    yield from sorted((ROOT / "compare").rglob("*.md"))
    yield from (ROOT / "README.md", ROOT / "CONTRIBUTING.md")


def find_words(text: str) -> list[str]:
    """Lines with a word to replace, as ``12: anew``."""
    return [f"{text.count(chr(10), 0, found.start()) + 1}: {found.group()}" for found in WORDS.finditer(text)]


def find_participles(text: str) -> list[str]:
    """Functions and methods named by a bare participle; properties may be nouns or adjectives."""
    if not re.search(rf"def\s+{PARTICIPLE.pattern}\s*[(\[]", text):  # parsing is slow
        return []
    functions = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef)]
    return [
        f"{node.lineno}: {node.name}"
        for node in functions
        if PARTICIPLE.fullmatch(node.name) and node.name not in NOT_PARTICIPLES and not is_property(node)
    ]


def find_nouns(text: str) -> list[str]:
    """Public functions of a module that do not begin with a verb."""
    return [
        f"{node.lineno}: {node.name}"
        for node in ast.parse(text).body
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_") and node.name not in NO_VERBS
        if node.name.split("_")[0] not in VERBS
        if not {"command", "maker"} & {ast.unparse(decorator) for decorator in node.decorator_list}
    ]


def is_property(node: ast.FunctionDef) -> bool:
    """Whether a function is a property."""
    return any("property" in ast.unparse(decorator) for decorator in node.decorator_list)


def test_no_word_of_the_dialect_is_left() -> None:
    files = {path: find_words(path.read_text(encoding="utf-8")) for path in prose() if path != Path(__file__)}
    assert not {str(path.relative_to(ROOT)): words for path, words in files.items() if words}


@pytest.mark.parametrize("package", PACKAGES)
def test_functions_are_named_by_verbs(package: str) -> None:
    found = {}
    for path in sorted((ROOT / package).rglob("*.py")):
        text, name = path.read_text(encoding="utf-8"), str(path.relative_to(ROOT))
        found[name] = find_participles(text) + (find_nouns(text) if path.parent.name != "symbolic" else [])
    assert not {name: names for name, names in found.items() if names}


def test_no_two_classes_have_one_name() -> None:
    # metaheuristics stands alone and has its own words, such as History.
    paths = [path for package in ("nlp_gait", "compare") for path in (ROOT / package).rglob("*.py")]
    names = Counter(name for path in paths for name in CLASS.findall(path.read_text(encoding="utf-8")))
    assert "GaitProblem" in names and not [name for name, count in names.items() if count > 1]


def test_no_archive_may_hold_objects() -> None:
    """All else that makes code from data is refused by ruff."""
    for package in ("compare", "metaheuristics", "nlp_gait"):
        for path in (ROOT / package).rglob("*.py"):
            assert "allow_pickle=True" not in path.read_text(encoding="utf-8"), path
