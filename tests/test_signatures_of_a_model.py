"""Derivatives by the amplitudes of effects that a model has."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from formula import Formula

import ramiefenics as rf
from ramiefenics.discovery.factors import factors
from ramiefenics.discovery.linearised import Model
from ramiefenics.discovery.observed import observe
from ramiefenics.discovery.prediction import Predictor
from ramiefenics.discovery.synthetic import make_dataset

pytestmark = pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")


def test_an_effect_that_cannot_be_applied_twice_has_a_derivative(tmp_path: Path) -> None:
    """A void that pith fills cannot be filled again."""
    make_dataset(tmp_path / "data", [], 1, Formula(), specimens=2)
    dataset = rf.read_dataset(tmp_path / "data")
    predictor = Predictor([record.test for record in dataset.records], observe(dataset), Formula())
    pith, used = rf.EFFECTS["pith_core"], factors(dataset.baseline, dataset.layout.fit)
    model = Model(used, np.zeros((2, len(used))), {"pith_core": (pith, 0.1)})
    curves = predictor.linearise(model, {"pith_core": pith})
    assert not curves.refused
    assert np.isfinite(curves.by_effects["pith_core"]).all()
