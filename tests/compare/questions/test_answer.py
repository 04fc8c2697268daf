"""What every question hands out: a page, tables, data, and what is printed of it."""

import json
import math
from pathlib import Path

from compare.questions.question import Answer, make_record_table

ANSWER = Answer(
    stem="walk-question",
    title="walk: the question",
    headline=("One third is enough.",),
    parts=(
        "A note.",
        make_record_table(
            "walk-numbers",
            [
                {"case": "first", "x": {"a_m": 1.0 / 3.0}, "found": True, "price": None, "notes": ("long",)},
                {"case": "second", "x": None, "found": False, "price": 0.5, "notes": ()},
            ],
            leave_out=["notes"],
        ),
    ),
    data={"a_m": 1.0 / 3.0, "bound": math.inf},
    results={"walk-first": {"problem": "walk"}},
)


def test_an_answer_is_a_page_a_table_with_every_digit_and_plain_data(tmp_path: Path) -> None:
    written = ANSWER.write(tmp_path)
    assert {path.name for path in written} == {path.name for path in tmp_path.iterdir()}
    assert (tmp_path / "walk-numbers.csv").read_text() == (
        "case,x.a_m,found,price\nfirst,0.3333333333333333,true,\nsecond,,false,0.5\n"
    )
    assert json.loads((tmp_path / "walk-question.json").read_text()) == {"a_m": 1.0 / 3.0, "bound": None}
    assert json.loads((tmp_path / "walk-first.json").read_text()) == {"problem": "walk"}
    page = (tmp_path / "walk-question.md").read_text()
    assert page.startswith("**One third is enough.**\n\n# walk: the question") and "0.333333 | yes |" in page
    assert "One third is enough." in (tmp_path / "walk-question.html").read_text()
