"""Tables as other programs write them."""

from pathlib import Path

import pytest

from nlp_gait.columns import parse_table, read_table
from nlp_gait.errors import InputError

ROWS = ((1.0, 0.5, -2e-3), (2.0, 1.5, 4.0))
PLAIN = "run,f,x\n1,0.5,-2e-3\n2,1.5,4\n"


@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        PLAIN.replace(",", "\t"),
        PLAIN.replace("\n", "\r\n"),
        "sep=,\n" + PLAIN,
        "sep=|\n" + PLAIN.replace(",", "|"),
        "# PSO of 3 May\n" + PLAIN + "# end\n",
        "# PSO, of, May\n# run, f, x\n1,0.5,-2e-3\n2,1.5,4\n",
        PLAIN.replace("\n", ",,\n"),
        "run,f,x\n1,0.5,-2e-3,\n2,1.5,4,\n",
        ",run,f,x\n0,1,0.5,-2e-3\n1,2,1.5,4\n",
        "Unnamed: 0,run,f,x\n0,1,0.5,-2e-3\n1,2,1.5,4\n",
        '"","run","f","x"\n"1",1,0.5,-2e-3\n"2",2,1.5,4\n',
        PLAIN.replace(",", ";").replace(".", ","),
        'run,f,x\n1,"0,5","-2e-3"\n2,"1,5",4\n',
    ],
)
def test_the_same_numbers_are_read(text: str) -> None:
    table = parse_table(text, "it")
    assert (table.header, table.rows) == (("run", "f", "x"), ROWS)
    assert table.texts == (("1", "0.5", "-2e-3"), ("2", "1.5", "4"))


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("f;x\n0,5;0.5\n", "line 2: the comma in '0,5' may be a decimal comma or separate thousands"),
        ('n,f\n"10,000",1\n', "line 2: the comma in '10,000' may be"),
        ("n,f\n1,0,5\n", "line 2: 3 cells, but 2 columns; do its numbers have decimal commas"),
        (",f\n3,1\n3,1\n", "column 1 has no name"),
        ("f,f\n1,2\n", "two columns have the same name 'f'"),
        ("f,x\n1,two\n", "line 2: expected a number, got 'two'"),
        ("f,x\n1,0.3_1\n", "line 2: expected a number, got '0.3_1'"),
        ("f,x\n1," + "9" * 131_073, "line 2: field larger than field limit"),
        ("# nothing\n", "has no rows"),
    ],
)
def test_what_is_ambiguous_is_refused_with_its_cause(text: str, cause: str) -> None:
    with pytest.raises(InputError, match=cause):
        parse_table(text, "it").check_header(("f",), ("x", "n"))


def test_a_byte_order_mark_is_no_part_of_a_name_and_other_encodings_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "excel.csv"
    path.write_text(PLAIN, encoding="utf-8-sig")
    assert read_table(path, "points").header == ("run", "f", "x")
    path.write_text(PLAIN, encoding="utf-16")
    with pytest.raises(InputError, match="points '.*excel.csv' cannot be read"):
        read_table(path, "points")
