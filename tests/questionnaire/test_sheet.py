"""Is a table of answers read as what it is, cell by cell, and refused by the line where it is not?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.errors import BadInput
from upright.questionnaire.sheet import Likert, Means, Ratings, Shares, cells_of, is_number, read_sheet, read_table


def test_three_headings_of_agreement_make_shares():
    table = "statement,Strongly agree,agree,I don’t know,n\nit helped,46 %,54,0%,7\nit was fun,1.5,98.5,0,8\n"
    found = read_table(table, "a.csv")
    assert found == Shares(
        options=("Strongly agree", "agree", "I don’t know"),
        rows=(("it helped", ("46", "54", "0")), ("it was fun", ("1.5", "98.5", "0"))),
    )
    bare = read_table("agree,neutral,disagree\n40,20,40\n50,0,50\n", "a.csv")
    assert isinstance(bare, Shares)
    assert [name for name, _ in bare.rows] == ["row 2", "row 3"]
    with pytest.raises(BadInput, match="line 3: a percentage was needed, got 'few'; write 0 for none"):
        read_table("agree,neutral,disagree\n40,20,40\n50,few,50\n", "a.csv")
    with pytest.raises(BadInput, match="needs columns such as"):
        read_table("statement,agree,disagree\nhelped,40,60\n", "a.csv")


def test_agreement_in_words_is_counted_in_the_order_of_agreement():
    text = (
        "id,helped,fun,remark,empty\na,Agree,Neutral,yes,\nb,disagree,strongly agree,no,-\nc,agree,,,\n"
        "d,I don’t know,agree,,NA\n"
    )
    found = read_table(text, "a.csv")
    assert isinstance(found, Ratings)
    assert found.people == 4
    assert found.items == ()
    assert found.likert == (
        Likert(
            name="helped",
            options=("strongly agree", "agree", "disagree", "strongly disagree", "i don't know"),
            counts=(0, 2, 1, 0, 1),
        ),
        Likert(
            name="fun",
            options=("strongly agree", "agree", "neutral", "disagree", "strongly disagree"),
            counts=(1, 1, 1, 0, 0),
            missing=1,
        ),
    )
    assert found.notes == tuple(
        f"The column '{name}' is neither a rating before or after nor agreement, and is left out."
        for name in ("remark", "empty")
    )  # fmt: skip


@pytest.mark.parametrize("missing", ["", "-", "NA", "n/a", "NaN", "None", "."])
def test_ratings_lie_on_the_scale_and_may_be_missing(missing):
    found = read_table(f"pre,post\n1,4\n{missing},2\n4,1\n", "a.csv")
    assert isinstance(found, Ratings)
    (item,) = found.items
    assert item.name == "rating"
    np.testing.assert_array_equal(item.pre, [1, np.nan, 4])
    np.testing.assert_array_equal(item.post, [4, 2, 1])


@pytest.mark.parametrize(
    ("cell", "scale", "good"),
    [
        ("0", (1, 4), False),
        ("5", (1, 4), False),
        ("5", (1, 5), True),
        ("0", (0, 3), True),
        ("1.0", (1, 4), True),
        ("2.5", (1, 4), True),  # between two of its marks
        ("4.5", (1, 4), False),
        ("62.5", (0, 100), True),
        ("100.5", (0, 100), False),
    ],
)
def test_a_rating_off_the_scale_is_refused_by_line_and_column(cell, scale, good):
    text = f"a pre,a post\n2,2\n2,{cell}\n"
    if good:
        found = read_table(text, "a.csv", scale=scale)
        assert isinstance(found, Ratings)
        assert found.items[0].post[1] == float(cell)
    else:
        with pytest.raises(BadInput, match=rf"line 3, 'a post': a rating from {scale[0]} to {scale[1]}"):
            read_table(text, "a.csv", scale=scale)


@pytest.mark.parametrize(
    ("headings", "name"),
    [
        ("bode plots before,bode plots after", "bode plots"),
        ("Pre-course mean: feedback,Post-course mean: feedback", "feedback"),
        ("feedback_prior,feedback_post", "feedback"),
        ("(pre) PID,(post) PID", "PID"),
    ],
)
def test_a_question_is_called_what_its_two_headings_share(headings, name):
    found = read_table(f"{headings}\n1,3\n2,4\n", "a.csv")
    assert isinstance(found, Ratings)
    assert [item.name for item in found.items] == [name]
    np.testing.assert_array_equal(found.items[0].pre, [1, 2])
    np.testing.assert_array_equal(found.items[0].post, [3, 4])


def test_columns_after_come_first_as_well():
    found = read_table("x after,x before\n4,1\n3,2\n", "a.csv")
    assert isinstance(found, Ratings)
    np.testing.assert_array_equal(found.items[0].pre, [1, 2])


LONG = "phase,student,question,score\nbefore,a,p,1\nafter,b,q,4\nafter,a,p,3\nbefore,b,p,2\n"


def test_one_row_per_answer_is_sorted_by_person_and_question():
    found = read_table(LONG, "a.csv")
    assert isinstance(found, Ratings)
    assert (found.people, found.likert, found.notes) == (2, (), ())
    assert [item.name for item in found.items] == ["p", "q"]
    np.testing.assert_array_equal(found.items[0].pre, [1, 2])
    np.testing.assert_array_equal(found.items[0].post, [3, np.nan])
    np.testing.assert_array_equal(found.items[1].post, [np.nan, 4])
    np.testing.assert_array_equal(found.items[1].pre, [np.nan, np.nan])


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (LONG + "before,b,p,3\n", r"'b' rates 'p' \(pre\) in line 5 and again in line 6; keep one"),
        (LONG + "later,b,q,3\n", "line 6: pre or post was needed for the time, got 'later'"),
        (LONG + "before,b,q,9\n", "line 6: a rating from 1 to 4 was needed, got 9"),
        ("phase,question,score\npre,p,1\n", "'a.csv': one row per answer needs a column that names the person"),
        ("id,a pre,a post\nx,1,2\n,1,2\n,2,2\nx,3,3\n", "'x' answers in line 2 and again in line 5"),
        ("a pre,b post\n1,2\n", "'a' has a column pre but none"),
        ("pre,b pre,b post\n1,2,3\n", "'pre' has a column pre but none"),
        ("name,x\na,1\n", "it has name, x"),
        ("concept,pre,post\nx,2.3,2.4\ny,2.5,high\n", "line 3, 'post': a printed mean was needed, got 'high'"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_place(text, sentence):
    with pytest.raises(BadInput, match=sentence):
        read_table(text, "a.csv")


def test_printed_means_keep_their_digits_and_their_measure():
    text = "concept,knowledge pre,knowledge post,use pre,use post\nloops,2.10,3.00,1.5,2.5\nbode,2.20,3.10,1.6,2.6\n"
    assert read_table(text, "a.csv") == Means(
        rows=(
            ("loops", "knowledge", "2.10", "3.00"),
            ("bode", "knowledge", "2.20", "3.10"),
            ("loops", "use", "1.5", "2.5"),
            ("bode", "use", "1.6", "2.6"),
        )
    )
    assert isinstance(read_table("id,item pre,item post\na,1,2\n", "a.csv"), Ratings)


@pytest.mark.parametrize(
    ("text", "header", "rows"),
    [
        ("a;b\n1,5;x\n\n;\n2;y,z\n", ["a", "b"], [(2, ["1.5", "x"]), (5, ["2", "y,z"])]),
        ("a,b\n1,5\n", ["a", "b"], [(2, ["1", "5"])]),
        ("a\tb,c\td\n1\t2,5\t3\n", ["a", "b,c", "d"], [(2, ["1", "2,5", "3"])]),
        ('"a;x;y;z",b\n1,2\n', ["a;x;y;z", "b"], [(2, ["1", "2"])]),
        ("sep=;\na;b,c,d\n1;2\n", ["a", "b,c,d"], [(3, ["1", "2"])]),
        ('"sep=|"\na|b\n1|2\n', ["a", "b"], [(3, ["1", "2"])]),
        (" a , b \n 1 \n2,3,,\n", ["a", "b"], [(2, ["1", ""]), (3, ["2", "3"])]),
    ],
)
def test_cells_are_told_apart_whoever_wrote_them(text, header, rows):
    assert cells_of(text, "a.csv") == (header, rows)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "has 0 lines"),
        ("a,b\n", "has 1 lines"),
        ("sep=;\na;b\n", "has 2 lines"),
        ("a,b\n,\n", "'a.csv' has headings and no answers"),
        ("sep=,\na,b\n1,2\n1,2,3\n", "'a.csv', line 4: 3 cells under 2 headings"),
    ],
)
def test_a_table_without_rows_or_with_too_many_cells_is_refused(text, sentence):
    with pytest.raises(BadInput, match=sentence):
        cells_of(text, "a.csv")


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("3", True), ("-3.25", True), ("+3,25", True), ("46 %", True), ("3.", False), (".5", False), ("3e2", False),
        ("", False), ("a3", False),
    ],
)  # fmt: skip
def test_a_printed_number_has_digits_on_both_sides_of_its_point(text, number):
    assert is_number(text) is number


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be"])
def test_both_orders_of_utf_16_are_read(tmp_path, encoding):
    path = tmp_path / "a.csv"
    path.write_bytes("\ufeffGröße pre,Größe post\n1,5\n".encode(encoding))
    found = read_sheet(path, scale=(1, 5))
    assert isinstance(found, Ratings)
    assert found.items[0].name == "Größe"
