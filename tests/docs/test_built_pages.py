"""What the documentation is built with: formulas become MathML, and the notebooks of the gallery run under Jupyter."""

from pathlib import Path
from xml.etree import ElementTree

import pytest

from docs.pages.gallery import ORDER, make_notebook, run_notebook
from tests.docs.test_pages import FORMULAS
from tests.extras import need

for package in ("sphinx_gallery", "nbclient", "latex2mathml"):
    need(package)
EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize("name", ORDER)
def test_a_notebook_has_several_cells_with_prose_between_them(name: str) -> None:
    kinds = [cell["cell_type"] for cell in make_notebook(EXAMPLES / name)["cells"]]
    assert kinds[0] == "markdown" and kinds.count("code") >= 3
    assert not any(first == second == "code" for first, second in zip(kinds, kinds[1:], strict=False))


@pytest.mark.parametrize(("name", "printed", "file"), [("first_solve.py", "limited by dbm_y_mean", "gait.png")])
def test_a_notebook_runs_in_an_empty_folder(name: str, printed: str, file: str, tmp_path: Path) -> None:
    text, figures = run_notebook(make_notebook(EXAMPLES / name), tmp_path)
    assert printed in text and figures == 1
    assert (tmp_path / file).stat().st_size > 10_000


@pytest.mark.parametrize("letter", sorted({label[0] for label in FORMULAS}))
def test_formulas_become_mathml(letter: str) -> None:
    from latex2mathml import converter

    for label, tex in FORMULAS.items():
        if label[0] == letter:
            shown = converter.convert(tex, display="block")
            text = "".join(ElementTree.fromstring(shown.replace("&nbsp;", " ")).itertext())
            assert "\\" not in text and "&" not in text, label  # no command is left
