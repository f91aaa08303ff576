"""Stiffness from engineering constants."""

from __future__ import annotations

import numpy as np
import pytest

from ramiefenics import Elastic, SpecificationError, SpecificationWarning


def test_isotropic_constants_give_lame() -> None:
    young, nu = 200.0, 0.3
    shear = young / (2 * (1 + nu))
    stiffness = Elastic.isotropic(young, nu).stiffness()
    lame = young * nu / ((1 + nu) * (1 - 2 * nu))
    assert stiffness[0, 0] == pytest.approx(lame + 2 * shear)
    assert stiffness[0, 2] == pytest.approx(lame)
    assert stiffness[5, 5] == pytest.approx(shear)


def test_uniaxial_stretch_along_fibres_contracts_by_the_major_poisson_number() -> None:
    elastic = Elastic(E_X_MPa=2.27, E_Z_MPa=1919.08, nu_XY=0.29, nu_XZ=0.004, G_XZ_MPa=33.8)
    strain = elastic.compliance() @ np.array([0, 0, 1.0, 0, 0, 0])
    nu_zx = 0.004 * 1919.08 / 2.27  # nu_ij / E_i = nu_ji / E_j
    assert -strain[0] / strain[2] == pytest.approx(nu_zx)


def test_stiffness_is_positive_definite_up_to_the_stated_limit() -> None:
    limit = np.sqrt(7.67 / 320.0 * (1 - 0.32) / 2)
    eigenvalues = np.linalg.eigvalsh(Elastic(7.67, 320.0, 0.32, 0.999 * limit, 69.0).stiffness())
    assert eigenvalues.min() > 0
    with pytest.raises(SpecificationError, match=rf"\|nu_XZ\| must be below {limit:.4g}"):
        Elastic(7.67, 320.0, 0.32, 1.001 * limit, 69.0)


def test_shear_modulus_against_eq_4_warns() -> None:
    with pytest.warns(SpecificationWarning, match="is not isotropic"):
        elastic = Elastic(2.27, 1919.08, 0.29, 0.004, 33.8, G_XY_MPa=3.09)
    assert elastic.stiffness()[5, 5] == pytest.approx(3.09)
