"""Tables of results: long ones fold, counts are whole, what is missing is a dash."""

import pandas as pd
import pytest


@pytest.fixture(scope="module")
def rewrite(extension):
    return extension("tables").rewrite


@pytest.mark.parametrize(("rows", "folds"), [(20, False), (21, True)])
def test_a_table_of_more_than_twelve_rows_folds(rewrite, rows, folds):
    page = rewrite(f"<p>before</p>{pd.DataFrame({'m': range(rows)}).to_html()}<p>after</p>")
    assert page.startswith("<p>before</p>") and page.endswith("<p>after</p>")
    assert (f"<summary>A table of {rows} rows</summary>" in page) == folds
    assert page.count("<tr") == rows + 1


def test_counts_are_whole_and_what_was_measured_stays(rewrite):
    names = ["updates", "time (s)", "skate"]
    table = pd.DataFrame([[500000.0, 2.0, 1.5], [3000.0, 3.0, None]], columns=names)
    for page in (rewrite(table.to_html()), rewrite(table.T.to_html())):
        assert "<td>500000</td>" in page and "<td>3000</td>" in page
        assert "<td>2.0</td>" in page and "<td>1.5</td>" in page
        assert "<td>–</td>" in page and "NaN" not in page
    speeds = pd.DataFrame({"m": [1374.0, 12.5]}).to_html()
    assert "<td>1374.0</td>" in rewrite(speeds)


def test_a_small_count_is_whole_and_a_measure_keeps_its_tenth(rewrite):
    table = pd.DataFrame({"falls": [7.0, 0.0], "error (cm)": [3.0, 2.0], "ratio": [1.0, 0.5]})
    for shown in (table, table.T):
        page = rewrite(shown.to_html())
        assert "<td>7</td>" in page and "<td>0</td>" in page
        assert "<td>3.0</td>" in page and "<td>2.0</td>" in page
        assert "<td>1.0</td>" in page


def test_counts_are_found_below_heads_of_two_levels(rewrite):
    heads = pd.MultiIndex.from_tuples([("walk", "falls"), ("walk", "off (cm)")])
    rows = pd.MultiIndex.from_tuples([("plain", "one"), ("plain", "two")])
    table = pd.DataFrame([[1.0, 2.0], [3.0, 4.0]], index=rows, columns=heads)
    page = rewrite(table.to_html())
    assert "<td>1</td>" in page and "<td>3</td>" in page
    assert "<td>2.0</td>" in page and "<td>4.0</td>" in page


def test_the_name_of_rows_stands_in_the_one_row_of_heads(rewrite):
    table = pd.DataFrame({"clips": [3, 4]}, index=pd.Index(["cmu", "accad"], name="source"))
    page = rewrite(table.to_html())
    assert page.count("<tr") == 3 and "<th>source</th>" in page and "<th>clips</th>" in page
    two = table.set_index(pd.Index(["a", "b"], name="style"), append=True)
    assert rewrite(two.to_html()).count("<tr") == 3


def test_what_holds_is_yes(rewrite):
    page = rewrite(pd.DataFrame({"helps": [True, False]}).to_html())
    assert "<td>yes</td>" in page and "<td>no</td>" in page and "True" not in page


def test_numbers_are_written_as_people_write_them(rewrite):
    page = rewrite(pd.DataFrame({"cm": ["1.32e+03", "-0.0", "-0.05", "2e-05"]}).to_html())
    assert all(f"<td>{its}</td>" in page for its in ("1320", "0.0", "-0.05", "2e-05"))


def test_rows_that_matter_stand_out(rewrite):
    table = pd.DataFrame({"cm": [1.5, 2.5]}, index=["plain", "▸ ours"])
    both = pd.concat({"walk": table, "run": table})
    assert rewrite(table.to_html()).count('class="matters"') == 1
    assert rewrite(both.to_html()).count('class="matters"') == 2


def test_other_tables_stay(rewrite):
    other = "<table><tbody>" + "<tr><td>3000.0</td></tr>" * 20 + "</tbody></table>"
    assert rewrite(other) == other
