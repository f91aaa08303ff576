"""Which sets of effects are fitted to the end."""

import dataclasses
from types import SimpleNamespace

import pytest

from ramiefenics.discovery.search.fitted_sets import FittedSets, Names, Reached
from ramiefenics.discovery.search.promises import Promises
from ramiefenics.discovery.search.refining import Refiner
from ramiefenics.discovery.search.search import Search
from ramiefenics.specification import SpecificationError


def reached(names: Names, score: float, finished: bool = False) -> Reached:
    fit = SimpleNamespace(chosen=names, amplitudes={})
    return Reached(SimpleNamespace(fit=fit), score, finished)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("best", "finished"),
    [
        ((), {("gap",)}),
        (("friction",), {("gap",), ("gap", "taper")}),
    ],
)
def test_sets_close_to_the_best_are_fitted_to_the_end(
    monkeypatch: pytest.MonkeyPatch, best: Names, finished: set[Names]
) -> None:
    """Unless they add to an effect, which the best set contains, and explain no more than it."""
    fitter = SimpleNamespace(without_simulations=lambda effects: [])
    search = Search(fitter, None, {})  # type: ignore[arg-type]
    scores = {(): 12.0, ("gap",): 19.5, ("gap", "taper"): 15.5, ("friction", "taper"): 19.0}
    scores["taper",] = 14.0  # too far
    if not best:
        del scores["friction", "taper"]
    search.sets.update({n: reached(n, score, not n) for n, score in scores.items()})
    search.sets[best] = reached(best, 20.0, True)
    said = []

    def finish(one: Reached) -> Reached:
        said.append(one.names)
        return dataclasses.replace(one, finished=True)

    monkeypatch.setattr(search._refiner, "finished", finish)
    monkeypatch.setattr(
        search._refiner, "closest", lambda one: dataclasses.replace(one, closest=True)
    )
    search._finish()
    assert set(said) == finished


@pytest.mark.parametrize(
    ("scores", "kept"),
    [([9.0, 8.0, 12.0], 9.0), ([9.0, 11.0, 12.0], 12.0), ([9.0, None], 9.0)],
)
def test_moves_that_fit_worse_are_left_out_but_for_the_first(
    monkeypatch: pytest.MonkeyPatch, scores: list[float | None], kept: float
) -> None:
    """None stands for parameters that cannot be simulated."""
    refiner = Refiner(None, None, {}, FittedSets())  # type: ignore[arg-type]
    left = iter(scores)

    def at(score: float) -> Reached:
        return Reached(SimpleNamespace(steady=score == 12.0), score)  # type: ignore[arg-type]

    def move(names: Names, fitted: object) -> Reached:
        score = next(left)
        if score is None:
            raise SpecificationError("gap", 1.0, "must be smaller")
        return at(score)

    monkeypatch.setattr(refiner, "moved", move)
    assert refiner.settled(("gap",), at(10.0)).score == kept


@pytest.mark.parametrize(
    ("distances", "kept"),
    [([0.3], 0.3), ([0.7, 0.9], 0.7), ([1.8, 0.5], 0.5), ([3.0], 0.9), ([0.7, None], 0.7)],
)
def test_a_rival_is_linearised_as_close_to_its_fit_as_possible(
    monkeypatch: pytest.MonkeyPatch, distances: list[float | None], kept: float
) -> None:
    """None stands for parameters that cannot be simulated; no more than two moves are made."""
    fitter = SimpleNamespace(confirm=lambda curves, tolerance: curves)
    refiner = Refiner(fitter, None, {}, FittedSets())  # type: ignore[arg-type]
    left = iter(distances)

    def at(distance: float) -> Reached:
        fit = SimpleNamespace(chosen=("gap",), amplitudes={})
        curves = SimpleNamespace(force=[0.0] * 8)
        fitted = SimpleNamespace(fit=fit, curves=curves, distance=distance)
        return Reached(fitted, 0.0)  # type: ignore[arg-type]

    def move(names: Names, fitted: object, within: float) -> Reached:
        distance = next(left)
        if distance is None:
            raise SpecificationError("gap", 1.0, "must be smaller")
        refiner.judged = lambda names, curves: at(distance)  # type: ignore[method-assign]
        return at(distance)

    monkeypatch.setattr(refiner, "moved", move)
    closest = refiner.closest(at(0.9))
    assert closest.fitted.distance == kept
    assert closest.closest
    assert next(left, "none left") == "none left"


@pytest.mark.parametrize(("lead", "best"), [(1.5, ("gap",)), (2.5, ("gap", "taper"))])
def test_a_set_that_hardly_leads_a_part_of_it_is_not_simulated_to_the_end(
    lead: float, best: Names
) -> None:
    sets = FittedSets()
    for names, score, finished in (
        ((), 12.0, True),
        (("gap",), 20.0, True),
        (("gap", "taper"), 20.0 + lead, False),
    ):
        sets[names] = reached(names, score, finished)
    assert sets.best.names == best
    sets["gap", "taper"] = reached(("gap", "taper"), 20.5, True)
    assert sets.best.names == ("gap", "taper")


@pytest.mark.parametrize(
    ("probability", "refused", "expected"),
    [(0.4, {}, ("gap",)), (0.04, {}, None), (0.4, {("gap",): "jumps"}, None)],
)
def test_a_probable_set_is_fitted_before_it_enters_the_result(
    monkeypatch: pytest.MonkeyPatch,
    probability: float,
    refused: dict[Names, str],
    expected: Names | None,
) -> None:
    """The derivatives had not promised enough of it where other sets fit."""
    fitter = SimpleNamespace(without_simulations=lambda effects: [])
    search = Search(fitter, None, {})  # type: ignore[arg-type]
    search.sets.update({n: reached(n, 20.0, True) for n in ((), ("friction",))})
    search.refused = refused
    posterior = SimpleNamespace(probable=lambda: {("friction",): 0.5, ("gap",): probability})
    monkeypatch.setattr(search, "_compared", lambda best: posterior)
    monkeypatch.setattr(search, "_with_own", lambda found: found)
    assert search._probable() == expected


def test_a_promise_is_not_reduced_by_errors_of_promises_made_elsewhere() -> None:
    """Derivatives where one effect fits may be right though those at the baseline were not."""
    sets = FittedSets({(): reached((), 20.0, True)})
    promises = Promises(sets, ())
    for names, promised in {("damage",): 20.0, ("gap", "damage"): 10.0, ("gap",): 6.0}.items():
        promises._promise(names, sets[()], promised)
    for names, score in {("damage",): 15.0, ("gap",): 26.0}.items():
        sets[names] = reached(names, score, True)
        promises.learn(sets[()], sets[names])
    assert promises.excess(["damage"], 0) == 25.0
    assert promises.best(()) is None
    promises._promise(("gap", "damage"), sets["gap",], 4.0)
    assert promises.best(()) == ("gap", "damage")
