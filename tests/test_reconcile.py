"""Misprinted designs: repaired if the publication determines how, otherwise refused."""

from __future__ import annotations

import dataclasses
import itertools
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from folders import check_folder, check_print
from numpy.typing import NDArray
from scipy import stats

import ramiefenics as rf
from ramiefenics.calibration.terms import Term, model_matrix, model_terms, parse_term
from ramiefenics.cli import main
from ramiefenics.published import Printed
from ramiefenics.reconciliation.least_squares import fit
from ramiefenics.reconciliation.printed_design import PrintedDesign, Publication, table5

Array = NDArray[np.float64]

A = 1.682
REPAIRED = {  # the study's seven rows
    7: (0, -A, 0),
    13: (0, A, 0),
    14: (-1, 1, -1),
    15: (1, 1, -1),
    16: (1, -1, 1),
    17: (0, 0, -A),
    18: (-1, -1, 1),
}


def composite(factors: int, alpha: float, centres: int, rng: np.random.Generator) -> Array:
    corners = list(itertools.product((-1.0, 1.0), repeat=factors))
    axes = [s * alpha * row for row in np.eye(factors) for s in (-1.0, 1.0)]
    points = np.vstack([corners, axes, np.zeros((centres, factors))])
    return np.asarray(points[rng.permutation(len(points))])


def publish(points: Array, responses: Array, terms: tuple[Term, ...]) -> Publication:
    """Return a least-squares fit by the normal equations, printed to two places."""
    matrix = model_matrix(points, terms)
    inverse = np.linalg.inv(matrix.T @ matrix)
    coefficients = inverse @ matrix.T @ responses
    squares: dict[Term | str, float] = {
        term: coefficients[i] ** 2 / inverse[i, i] for i, term in enumerate(terms) if any(term)
    }
    squares["residual"] = float(np.sum((responses - matrix @ coefficients) ** 2))
    squares["total"] = float(np.sum((responses - responses.mean()) ** 2))
    centre = responses[np.all(points == 0.0, axis=1)]
    squares["pure error"] = float(np.sum((centre - centre.mean()) ** 2))
    return Publication(
        terms,
        {t: Printed.read(f"{b:.2f}") for t, b in zip(terms, coefficients, strict=True)},
        {key: Printed.read(f"{value:.2f}") for key, value in squares.items()},
    )


def experiment(
    factors: int, alpha: float, model: str, seed: int
) -> tuple[PrintedDesign, Publication, np.random.Generator]:
    rng = np.random.default_rng(seed)
    points = composite(factors, alpha, 6, rng)
    terms = model_terms(factors, model)
    noise = rng.normal(0.0, 0.15, len(points))
    true = np.round(
        84.0 + model_matrix(points, terms) @ rng.normal(0.0, 0.6, len(terms)) + noise, 1
    )
    design = PrintedDesign(tuple("ABCD"[:factors]), "y", points, true, alpha)
    return design, publish(points, true, terms), rng


def misprint(design: PrintedDesign, rows: int, rng: np.random.Generator) -> PrintedDesign:
    """Give factorial rows a wrong sign, and axial rows a wrong axis, a wrong sign or no level."""
    points = design.points.copy()
    chosen = rng.choice(np.flatnonzero(np.abs(points).sum(axis=1)), rows, replace=False)
    for row in chosen:
        if np.all(np.abs(points[row]) == 1.0):
            points[row, rng.integers(points.shape[1])] *= -1.0
        else:
            points[row] = np.roll(points[row], 1) * rng.choice([-1.0, 0.0, 1.0])
    return dataclasses.replace(design, points=points)


def runs(points: Array, responses: Array) -> list[tuple[float, ...]]:
    """Return an experiment in a form that does not depend on the order of its rows."""
    return sorted(map(tuple, np.column_stack([points, responses]).tolist()))


@pytest.fixture(scope="module")
def table_5() -> rf.Reconciliation:
    return rf.reconcile(*table5())


def test_table_5_gets_the_design_that_was_run(table_5: rf.Reconciliation) -> None:
    changes = table_5.changes.set_index("row")[["X1", "X2", "X3"]]
    assert {row: tuple(levels) for row, levels in changes.iterrows()} == REPAIRED
    assert table_5.unique
    assert table_5.demanded == 7
    assert table_5.p_value <= 0.02
    # all repaired cells are in one column
    printed = table5()[0].points
    assert np.flatnonzero(np.any(table_5.repairs[0] != printed, axis=0)).tolist() == [1]


def test_table_5_repaired_gives_equation_5_and_table_6(table_5: rf.Reconciliation) -> None:
    names = {"constant": 84.51, "X2": 0.431, "X3": 0.760, "X1X2": -0.188, "X2X3": -0.163}
    for name, value in names.items():
        term = parse_term(name, ("X1", "X2", "X3"))
        assert term is not None
        assert table_5.after.coefficients[term] == pytest.approx(value, abs=6e-4)
    squares = table_5.after.sums_of_squares
    assert squares["pure error"] == pytest.approx(0.108, abs=5e-4)
    assert squares["total"] == pytest.approx(11.50, abs=5e-3)
    assert table_5.before.rank < len(table_5.before.terms) == table_5.after.rank
    assert table_5.before.r_squared == pytest.approx(0.70, abs=5e-3)
    assert table_5.after.r_squared == pytest.approx(0.95, abs=5e-3)
    anova = table_5.after.anova(("X1", "X2", "X3")).set_index("source")
    printed = rf.published_table(6).set_index("source")
    # those F and p of Table 6 that follow from its sums of squares
    assert anova.loc["X2", "f_value"] == pytest.approx(printed.loc["X2", "f_value"], abs=0.05)
    assert anova.loc["X1 X2", "f_value"] == pytest.approx(printed.loc["X1X2", "f_value"], abs=5e-3)
    assert anova.loc["model", "f_value"] == pytest.approx(printed.loc["Model", "f_value"], abs=5e-3)
    lack = anova.loc["lack of fit"]
    assert lack["p_value"] == pytest.approx(printed.loc["Lack of fit", "p_value"], abs=5e-3)
    assert anova.loc["X1", "p_value"] > 0.05  # as the text says


def test_no_other_seven_rows_do(table_5: rf.Reconciliation) -> None:
    """Try all 64512 ways to change seven rows without changing their kinds."""
    design, _ = table5()
    points, y = design.points, design.responses
    corner = np.all(np.abs(points) == 1.0, axis=1)
    signs = list(itertools.product((-1.0, 1.0), repeat=3))
    held = [np.flatnonzero(np.all(points == s, axis=1)) for s in signs]
    missing = [s for s, rows in zip(signs, held, strict=True) if not len(rows)]
    factorial = []
    for out in itertools.product(*(rows for rows in held if len(rows))):
        kept = [(points[i], y[i]) for i in np.flatnonzero(corner) if i not in out]
        for order in itertools.permutations(out):
            factorial.append(
                [*kept, *((np.array(s), y[i]) for s, i in zip(missing, order, strict=True))]
            )
    centres = np.flatnonzero(np.all(points == 0.0, axis=1))
    fixed = [(points[i], y[i]) for i in (1, 3, 18)]  # rows 2, 4, 19 are right
    free = [(0.0, -A, 0.0), (0.0, A, 0.0), (0.0, 0.0, -A)]
    axial = []
    for pair in itertools.combinations(centres, 2):
        rest = [(np.zeros(3), y[i]) for i in centres if i not in pair]
        for order in itertools.permutations((*pair, 16)):
            moved = [(np.array(p), y[i]) for p, i in zip(free, order, strict=True)]
            axial.append([*fixed, *moved, *rest])
    assert len(factorial) * len(axial) == 64512

    def sums(part: list[tuple[Array, float]]) -> list[float]:
        x, z = np.array([p for p, _ in part]), np.array([v for _, v in part])
        return [*(x.T @ z), (x[:, 0] * x[:, 1]) @ z, (x[:, 1] * x[:, 2]) @ z]

    left, right = np.array(list(map(sums, factorial))), np.array(list(map(sums, axial)))
    both = left[:, None] + right[None]
    linear = 8.0 + 2.0 * A**2
    ok = np.abs(both[..., 1] / linear - 0.43) <= 0.005
    ok &= np.abs(both[..., 2] / linear - 0.76) <= 0.005
    ok &= np.abs(both[..., 3] / 8.0 + 0.19) <= 0.005
    ok &= np.abs(both[..., 4] / 8.0 + 0.16) <= 0.005
    found = set()
    for i, j in zip(*np.nonzero(ok), strict=True):
        whole = factorial[i] + axial[j]
        found.add(tuple(runs(np.array([p for p, _ in whole]), np.array([v for _, v in whole]))))
    assert found == {tuple(runs(table_5.repairs[0], y))}


def test_sums_of_squares_alone_leave_a_sign_open(table_5: rf.Reconciliation) -> None:
    design, publication = table5()
    found = rf.reconcile(design, dataclasses.replace(publication, coefficients={}))
    assert not found.unique
    told = " ".join(found.findings())
    assert "It is not unique: it is one of 2 repairs that change as few rows" in told
    check_print(found, "7 of 20 rows")
    wanted = runs(table_5.repairs[0], design.responses)
    mirrored = runs(table_5.repairs[0] * [1.0, -1.0, 1.0] + 0.0, design.responses)
    assert sorted(runs(p, design.responses) for p in found.repairs) == sorted([wanted, mirrored])


@pytest.mark.parametrize(
    ("factors", "alpha", "model", "rows", "seed"),
    [
        (2, 1.414, "quadratic", 3, 1),
        (3, 1.682, "interaction", 6, 1),
        (3, 1.682, "interaction", 6, 2),
        (3, 1.0, "quadratic", 4, 1),  # face-centred
        (4, 2.0, "linear", 5, 1),
    ],
)
def test_planted_misprints_are_found(
    factors: int, alpha: float, model: str, rows: int, seed: int
) -> None:
    design, publication, rng = experiment(factors, alpha, model, seed)
    found = rf.reconcile(misprint(design, rows, rng), publication)
    assert found.unique
    assert runs(found.repairs[0], design.responses) == runs(design.points, design.responses)
    assert len(found.rows) <= rows
    assert found.p_value <= 0.05


def test_exchanged_rows_are_found_though_the_design_is_composite() -> None:
    design, publication, _ = experiment(3, A, "interaction", 5)
    corners = np.flatnonzero(np.all(np.abs(design.points) == 1.0, axis=1))[:2]
    assert design.responses[corners[0]] != design.responses[corners[1]]
    points = design.points.copy()
    points[corners] = points[corners[::-1]]
    found = rf.reconcile(dataclasses.replace(design, points=points), publication)
    assert found.demanded == 0
    assert found.rows == (corners + 1).tolist()
    np.testing.assert_allclose(found.repairs[0], design.points)


def test_a_level_that_no_design_has_is_repaired() -> None:
    design, publication, _ = experiment(3, A, "interaction", 7)
    points = design.points.copy()
    row = int(np.flatnonzero(np.all(np.abs(points) == 1.0, axis=1))[0])
    points[row, 0] = 0.0
    found = rf.reconcile(dataclasses.replace(design, points=points), publication)
    assert found.rows == [row + 1]
    np.testing.assert_allclose(found.repairs[0], design.points)


def test_little_published_is_ambiguous() -> None:
    design, publication = table5()
    constant = {term: number for term, number in publication.coefficients.items() if not any(term)}
    found = rf.reconcile(
        design, dataclasses.replace(publication, coefficients=constant, sums_of_squares={})
    )
    assert not found.unique
    assert found.p_value > 0.5


def test_a_consistent_table_is_refused() -> None:
    design, publication, _ = experiment(3, A, "interaction", 3)
    with pytest.raises(rf.SpecificationError, match=r"is consistent: .* nothing to repair\.$"):
        rf.reconcile(design, publication)


@pytest.mark.parametrize("seed", range(4))
def test_nonsense_is_refused(seed: int) -> None:
    design, publication, rng = experiment(3, A, "interaction", seed)
    nonsense = {
        term: Printed(round(rng.normal(0.0, 0.6), 2), 0.005)
        for term in publication.coefficients
        if any(term)
    }
    other = Publication(publication.terms, nonsense, {})
    with pytest.raises(rf.SpecificationError, match=r"beyond repair: no central composite"):
        rf.reconcile(misprint(design, 5, rng), other)


def test_responses_that_are_not_those_published_are_refused() -> None:
    design, publication = table5()
    responses = design.responses + np.linspace(0.0, 1.0, 20)
    with pytest.raises(rf.SpecificationError, match=r"total sum of squares .* 11\.5 is published"):
        rf.reconcile(dataclasses.replace(design, responses=responses), publication)


def test_publications_that_say_too_little_are_refused() -> None:
    design, publication = table5()
    sums = {key: publication.sums_of_squares[key] for key in ("model", "pure error")}
    with pytest.raises(rf.SpecificationError, match="says too little"):
        rf.reconcile(design, Publication(publication.terms, {}, sums))


def test_fit_of_a_line_is_the_textbook_s() -> None:
    rng = np.random.default_rng(0)
    x = np.repeat(np.arange(4.0), 3)
    y = 1.0 + 0.5 * x + rng.normal(0.0, 0.3, 12)
    line = stats.linregress(x, y)
    found = fit(x[:, None], y, ((0,), (1,)))
    assert found.coefficients[(1,)] == pytest.approx(line.slope)
    assert found.r_squared == pytest.approx(line.rvalue**2)
    anova = found.anova(("x",)).set_index("source")
    assert anova.loc["x", "p_value"] == pytest.approx(line.pvalue)
    within = sum(np.var(y[x == level]) * 3 for level in range(4))
    assert anova.loc["pure error", "sum_of_squares"] == pytest.approx(within)
    assert anova["df"].to_dict() == {
        "model": 1,
        "x": 1,
        "residual": 10,
        "lack of fit": 2,
        "pure error": 8,
        "total": 11,
    }


def test_terms_that_a_design_confuses_are_left_open() -> None:
    points = np.array([[-1.0, -1.0], [1.0, 1.0], [0.0, 0.0], [0.0, 0.0]])
    found = fit(points, np.array([1.0, 3.0, 2.1, 1.9]), model_terms(2, "linear"))
    assert found.rank == 2
    assert np.isnan([found.coefficients[1, 0], found.coefficients[0, 1]]).all()
    assert found.coefficients[0, 0] == pytest.approx(2.0)
    assert found.sums_of_squares["model"] == pytest.approx(2.0)


@pytest.mark.parametrize("text", ["A B", "BA", "A*B", "A:B"])
def test_products_are_read_in_all_spellings(text: str) -> None:
    assert parse_term(text, ("A", "B")) == (1, 1)
    assert parse_term(text.replace("B", "A"), ("A", "B")) == (2, 0)
    assert parse_term("A^2", ("A", "B")) == parse_term("A**2", ("A", "B")) == (2, 0)
    assert parse_term("C", ("A", "B")) is None


SETTINGS = """
factors = ["friction", "nu phloem", "nu xylem"]
response = "force"
model = "interaction"

[coefficients]
constant = 84.51
"nu phloem" = 0.43
"nu xylem" = 0.76
"friction * nu phloem" = -0.19
"nu xylem nu phloem" = -0.16

[sums_of_squares]
pure_error = 0.11
total = 11.50
"""


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """Table 5 as a user's own table."""
    names = {"X1": "friction", "X2": "nu phloem", "X3": "nu xylem", "force_N": "force"}
    rf.published_table(5).rename(columns=names).to_csv(tmp_path / "own.csv", index=False)
    (tmp_path / "own.toml").write_text(SETTINGS)
    return tmp_path / "own.csv"


def call(monkeypatch: pytest.MonkeyPatch, *words: str) -> int:
    monkeypatch.setattr("sys.argv", ["ramiefenics", "reconcile", *words])
    with pytest.raises(SystemExit) as ended:
        main()
    return int(ended.value.code or 0)


def test_command_repairs_a_table_of_one_s_own(
    own: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = own.parent / "out"
    assert call(monkeypatch, str(own), "--out", str(out)) == 0
    assert "7 of 20 rows are repaired: 7, 13, 14, 15, 16, 17, 18;" in capsys.readouterr().out
    design = pd.read_csv(out / "design.csv")
    assert design.loc[design["repaired"], "row"].tolist() == list(REPAIRED)
    assert tuple(design.loc[16, ["friction", "nu phloem", "nu xylem"]]) == REPAIRED[17]
    summary, page = check_folder(out)
    assert summary["unique"] is True
    assert page.rows > 20
    assert "| coefficient, nu phloem | 0.43 |" in (out / "report.md").read_text()
    assert not (out / "other_repairs.csv").exists()


DEFECTS = [
    ("-0.19", '"a lot"', r"coefficients\.friction \* nu phloem = 'a lot' must be a number"),
    ("constant =", "nonsense =", r"coefficients = 'nonsense' must be constant, a factor"),
    ('"force"', '"strength"', r"strength.*not among its columns \(number, friction"),
    ('"interaction"', '"cubic"', r"model = 'cubic' must be one of linear, interaction, quad"),
    ('"interaction"', '"linear"', r"lacks a published term"),
    ("model =", "alpha = 0.5\nmodel =", r"alpha = 0\.5 must be at least 1"),
    (
        '["friction", "nu phloem", "nu xylem"]',
        "[]",
        r"factors = \[\] must be a list of two or more",
    ),
    (
        '["friction", "nu phloem", "nu xylem"]',
        '["friction", "friction", "nu xylem"]',
        r"factors = .* must be a list of two or more different columns",
    ),
    (
        'response = "force"',
        'response = "friction"',
        r"response = 'friction' must be .* not a factor",
    ),
    ("model =", "modle =", r"modle = 'interaction' is an unknown key"),
    ("0.76", "0.67", r"beyond repair"),
]


@pytest.mark.parametrize(("old", "new", "told"), DEFECTS)
def test_command_tells_defects_in_one_sentence(
    own: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    old: str,
    new: str,
    told: str,
) -> None:
    settings = own.with_suffix(".toml")
    assert old in SETTINGS
    settings.write_text(SETTINGS.replace(old, new))
    out = own.parent / "out"
    assert call(monkeypatch, str(own), "--out", str(out)) == 2
    error = capsys.readouterr().err
    assert re.search(told, error)
    assert len(error.strip().splitlines()) == 1
    assert not out.exists()


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("\n5,", "\n5,0,", r"own\.csv, row 6, number of cells = 6 must be 5, one for each column"),
        ("\n5,", "\n", r"own\.csv, row 6, number of cells = 4 must be 5, one for each column"),
        ("number,", "force,", r"own\.csv, heading = 'force' must not occur twice"),
        (",84.7", ",8.47e300", r"own\.csv, row \d+, column force = '8\.47e300' must be a number"),
    ],
)
def test_command_tells_defects_of_the_table(
    own: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    old: str,
    new: str,
    told: str,
) -> None:
    assert old in own.read_text()
    own.write_text(own.read_text().replace(old, new, 1))
    out = own.parent / "out"
    assert call(monkeypatch, str(own), "--out", str(out)) == 2
    error = capsys.readouterr().err
    assert re.search(told, error)
    assert len(error.strip().splitlines()) == 1
    assert not out.exists()


def test_a_reduced_model_is_a_list_of_terms(own: Path) -> None:
    settings = own.with_suffix(".toml")
    reduced = '["nu phloem", "nu xylem", "friction nu phloem", "nu phloem nu xylem"]'
    settings.write_text(SETTINGS.replace('"interaction"', reduced))
    _, publication = rf.read_printed_design(own)
    # Eq. 5 has no friction, and no product of friction and the xylem's ratio
    assert set(publication.terms) == {(0, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1)}
