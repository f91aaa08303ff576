"""Effects on the law of fibres and matrix, for bent sections and points, in closed form."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from mpi4py import MPI
from scipy.integrate import quad
from scipy.optimize import brentq
from slender import SPAN, force, slender, with_

import ramiefenics as rf
from ramiefenics.effects.combining import exclusions
from ramiefenics.published.stalks import XYLEM
from ramiefenics.verification.point import Point

HEIGHT = 1.0
E_X, E_Z = 2.0, 2000.0
STRONG = rf.Material(
    rf.Elastic(E_X, E_Z, 0.0, 0.0, G_XZ_MPa=1e5),
    rf.LargeStrain(fibre_residual_tangent=0.0, fibre_strength=0.2, densification=0.0),
)
"""Material whose fibres are linear in compression: they would yield at ten times their modulus."""

WEAK = rf.Material(
    rf.Elastic(E_X, E_Z, 0.0, 0.0, G_XZ_MPa=100.0),
    rf.LargeStrain(fibre_residual_tangent=0.1, densification=0.0),
)
"""Material whose fibres saturate at 10 MPa, and keep a tangent of 10 MPa."""


def rod(material: rf.Material, *changes: str, travel_mm: float = 1.0) -> rf.BendingTest:
    """Return a slender rod of one material, with the default law."""
    fixture = rf.Fixture(span_mm=SPAN, friction=rf.Friction(0.0, 0.0))
    test = slender(0.0, 6.0, fixture, *changes, travel_mm=travel_mm)
    layers = (dataclasses.replace(test.stalk.layers[0], material=material),)
    stalk = dataclasses.replace(test.stalk, layers=layers)
    return dataclasses.replace(test, stalk=stalk, law="saturating_fibre")


def point(test: rf.BendingTest) -> Point:
    return Point(test.law, test.stalk.layers[0].material)


class BentSection:
    """A bent section of unit width, in layers of fibres, that stays plane (Bernoulli).

    Attributes
    ----------
    axial
        Strain at mid-height, such that there is no axial force.
    """

    def __init__(self, test: rf.BendingTest, layers: int = 400) -> None:
        law = point(test)
        self.y = HEIGHT * ((np.arange(layers) + 0.5) / layers - 0.5)
        self.points = [copy.copy(law) for _ in self.y]
        self.axial = 0.0

    def moment(self, curvature: float) -> float:
        """Return the moment, N mm per mm of width, after a step to a curvature, 1/mm."""
        self.axial = brentq(lambda e: self._stresses(e, curvature).sum(), -0.02, 0.02, xtol=1e-12)
        return float(np.mean(self._stresses(self.axial, curvature) * self.y) * HEIGHT)

    def remember(self, curvature: float) -> None:
        for one, strain in zip(self.points, self.axial + curvature * self.y, strict=True):
            one.remember(np.diag([1.0, 1.0, 1.0 + strain]))

    def _stresses(self, axial: float, curvature: float) -> np.ndarray:
        strains = axial + curvature * self.y
        pairs = zip(self.points, strains, strict=True)
        return np.array([one.stress(np.diag([1.0, 1.0, 1.0 + e]))[2, 2] for one, e in pairs])


@pytest.mark.parametrize("amplitude", [0.0, 0.3, 0.75])
def test_a_bimodular_beam_bends_about_another_axis(amplitude: float) -> None:
    """Rectangle: Timoshenko 1955, Strength of Materials, Part II, article 64 (E_r)."""
    bent = BentSection(with_(rod(STRONG), bimodular_fibre=amplitude))
    curvature = 1e-3
    moment = bent.moment(curvature)
    pulled, pressed = E_Z, E_X + (1.0 - amplitude) * (E_Z - E_X)
    roots = np.sqrt(pulled) + np.sqrt(pressed)
    # strains of 5e-4 are small to this tolerance; the layers have an error of 1e-5
    assert moment == pytest.approx(pulled * pressed / 3.0 / roots**2 * curvature, rel=2e-3)
    depth = HEIGHT * np.sqrt(pressed) / roots  # of the part in tension
    assert -bent.axial / curvature == pytest.approx(HEIGHT / 2.0 - depth, abs=1e-3)


@pytest.mark.parametrize("share", [0.95, 0.5])
def test_an_elastic_plastic_beam_follows_its_moment_and_springs_back(share: float) -> None:
    """Rectangle with linear hardening (Lubliner 1990, Plasticity Theory, section 4.4.3)."""
    effect = rf.EFFECTS["fibre_yield"].given(yield_strain=0.004)
    bent = BentSection(effect.apply(rod(STRONG), share))
    stiffness = E_Z / 12.0
    for curvature in (0.006, 0.012, 0.03):
        core = min(0.004 / curvature, 0.5)  # half the height of the elastic core
        perfect = E_Z * 0.004 * (0.25 - core**2 / 3.0) if core < 0.5 else stiffness * curvature
        expected = share * perfect + (1.0 - share) * stiffness * curvature
        # the matrix, 1/1000 of the stiffness, does not yield; its stress is not quite linear
        assert bent.moment(curvature) == pytest.approx(expected, rel=5e-3)
    bent.remember(0.03)
    left = brentq(bent.moment, 0.0, 0.03)
    assert left == pytest.approx(0.03 - expected / stiffness, rel=0.01)
    assert left > 0.2 * 0.03


def test_a_held_beam_relaxes() -> None:
    effect = rf.EFFECTS["viscoelastic"].given(relaxation_time_s=4.0)
    bent = BentSection(effect.apply(rod(STRONG), 0.3), layers=40)
    at_once = bent.moment(1e-4)
    assert at_once == pytest.approx(E_Z / 12.0 * 1e-4, rel=2e-3)  # 40 layers
    bent.remember(1e-4)
    for one in bent.points:
        one.duration_s = 5.0
    assert bent.moment(1e-4) / at_once == pytest.approx(1 - 0.3 * (1 - np.exp(-1.25)), rel=1e-4)


def stress_of_fibres(test: rf.BendingTest) -> Callable[[float], float]:
    """Return the axial stress of the fibres alone; the matrix has mu = E_X / 2 and no lambda."""
    law = point(test)

    def stress(e: float) -> float:
        whole = law.stress(np.diag([1.0, 1.0, 1.0 + e]))[2, 2]
        return float(whole - E_X / 2.0 * (1.0 + e - 1.0 / (1.0 + e)))

    return stress


@pytest.mark.parametrize("amplitude", [-0.6, -0.3, 0.0, 1.0])
def test_strength_is_where_pressed_fibres_give_way(amplitude: float) -> None:
    stress = stress_of_fibres(with_(rod(WEAK), fibre_strength=amplitude))
    for e in (-0.06, -0.1):  # far beyond 0.01, where the plateau begins at twice the strength
        assert stress(e) == pytest.approx(-(1.0 + amplitude) * 10.0 + 10.0 * e, rel=1e-4)
    assert stress(1e-3) == pytest.approx((E_Z - E_X) * 1e-3, rel=1e-9)


def test_strength_stays_below_what_the_matrix_can_hold() -> None:
    with pytest.raises(rf.SpecificationError, match=r"with fibre_strength = 0\.5: .*at most shear"):
        with_(rod(STRONG), fibre_strength=0.5)


def test_irreversible_damage_is_the_elastic_ones_until_it_unloads_along_the_secant() -> None:
    lasting = with_(rod(WEAK), irreversible_damage=0.6)
    stress, elastic = (
        stress_of_fibres(test) for test in (lasting, with_(rod(WEAK), fibre_damage=0.6))
    )
    assert stress(0.05) == pytest.approx(0.4 * (E_Z - E_X) * 0.05, rel=1e-9)
    for e in (-0.04, -0.01, 0.01, 0.03, 0.06):
        assert stress(e) == pytest.approx(elastic(e), rel=1e-12)
    law = point(lasting)
    lost = sum(law.remember(np.diag([1.0, 1.0, 1.0 + e])) for e in (0.02, 0.05))
    area, _ = quad(elastic, 0.0, 0.05)
    assert lost == pytest.approx(area - stress(0.05) * 0.05 / 2.0, rel=1e-9)
    for e in (0.04, 0.01, 0.05):
        F = np.diag([1.0, 1.0, 1.0 + e])
        matrix = E_X / 2.0 * (1.0 + e - 1.0 / (1.0 + e))
        assert law.stress(F)[2, 2] - matrix == pytest.approx(0.4 * (E_Z - E_X) * e, rel=1e-9)
        assert law.remember(F) == pytest.approx(0.0, abs=1e-12)


def test_pressed_fibres_yield_at_the_default_laws_stress_and_stay_shorter() -> None:
    law, elastic = point(with_(rod(WEAK), fibre_yield=0.4)), point(rod(WEAK))
    for e in (-0.008, -0.03, -0.06):
        F = np.diag([1.0, 1.0, 1.0 + e])
        # where the fibres yield, the default law has reached its plateau to 1e-4
        assert law.stress(F)[2, 2] == pytest.approx(elastic.stress(F)[2, 2], rel=1e-3)
        law.remember(F)
    shorter = 0.4 * (0.06 - 0.01)
    assert law.state(np.diag([1.0, 1.0, 0.94]))["plastic_strain"] == pytest.approx(-shorter)
    # the stress vanishes but for the matrix's, 1/1000; the residual tangent h holds some strain
    rest = brentq(lambda e: law.stress(np.diag([1.0, 1.0, 1.0 + e]))[2, 2], -0.05, 0.0)
    assert rest == pytest.approx(-shorter * (1.0 - 10.0 / (E_Z - E_X)), rel=2e-3)


@pytest.mark.parametrize("share", [0.2, 0.7])
def test_crushed_by_a_share_the_rest_hardens(share: float) -> None:
    """The pressure is that of densification plus the hardening of the tissue, (1 - s) / s a C11."""
    law = point(with_(rod(XYLEM), crushing=share))
    c11 = XYLEM.elastic.stiffness()[0, 0]
    lost = 0.0
    for stretch in np.linspace(1.0, 0.7, 601)[1:]:
        F = np.diag([stretch, 1.0, 1.0])
        pressure = -stretch * law.stress(F)[0, 0] / c11
        dissipated = law.remember(F)
        area = np.log(np.linalg.det(law.state(F)["unloading"]))
        if area > 0.0:
            # the estimate from the stiffness at rest is corrected one step later
            expected = 0.05 / (1.0 - area / 0.4) + (1.0 - share) / share * area
            assert pressure == pytest.approx(expected, rel=0.01)
            lost += dissipated
    assert area > 0.1 * share
    assert lost > 0.0


INELASTIC = {"fibre_yield": 0.01, "crushing": 0.01, "irreversible_damage": 0.01}


@pytest.mark.parametrize("name", INELASTIC)
def test_stresses_are_continuous_where_the_law_changes(name: str) -> None:
    """A share of one hundredth changes the stresses by about that, whatever yields."""
    F = np.array([[0.75, 0.02, 0.01], [0.0, 1.03, -0.03], [0.02, 0.0, 1.04]])
    plain = point(rod(XYLEM)).stress(F)
    changed = point(with_(rod(XYLEM), **{name: INELASTIC[name]})).stress(F)
    assert 1e-4 < np.abs(changed - plain).max() / np.abs(plain).max() < 0.02


def test_what_combines_does_so_in_either_order() -> None:
    one = with_(rod(XYLEM), fibre_yield=0.4, crushing=0.3, fibre_damage=0.2, bimodular_fibre=0.3)
    other = with_(rod(XYLEM), bimodular_fibre=0.3, fibre_damage=0.2, crushing=0.3, fibre_yield=0.4)
    assert one == other
    names = [*INELASTIC, "viscoelastic", "fibre_damage", "fibre_strength", "bimodular_fibre"]
    assert not exclusions(rod(XYLEM), {name: rf.EFFECTS[name] for name in names})


def test_a_yielding_beam_relaxes_in_proportion_to_what_yields() -> None:
    """Of two parallel networks the lasting one yields, and the other relaxes completely."""
    slow = with_(rod(STRONG), viscoelastic=0.25, fibre_yield=0.6)
    assert slow.law == "inelastic_viscoelasticity"
    stress, yielding = (point(t) for t in (slow, with_(rod(STRONG), fibre_yield=0.6)))
    F = np.diag([1.0, 1.0, 1.03])
    elastic = point(rod(STRONG)).stress(F)[2, 2]
    left = 0.75 * yielding.stress(F)[2, 2]
    assert stress.stress(F)[2, 2] == pytest.approx(left + 0.25 * elastic, rel=1e-9)
    stress.remember(F)
    stress.duration_s = 1e4
    assert stress.stress(F)[2, 2] == pytest.approx(left, rel=1e-6)


def test_a_law_of_ones_own_is_not_exchanged() -> None:
    other = dataclasses.replace(rod(XYLEM), law="svk")
    with pytest.raises(
        rf.SpecificationError, match="law = 'svk' must be one of saturating_fibre, inelastic"
    ):
        with_(other, crushing=0.4)


def test_companions_are_given_by_name() -> None:
    effect = rf.EFFECTS["fibre_yield"].given(yield_strain=0.02)
    constants = effect.apply(rod(XYLEM), 0.4).stalk.layers[0].material.law_constants
    assert constants == {"yielding_share": 0.4, "yield_strain": 0.02}
    with pytest.raises(rf.SpecificationError, match=r"fibre_yield\.hardening = 0\.1 is not a comp"):
        effect.given(hardening=0.1)
    companions = (rf.Companion("yield_strain", "1", 0.03, 0.5),)
    with pytest.raises(rf.SpecificationError, match=r"companions.*whose default is 0\.03"):
        dataclasses.replace(rf.EFFECTS["fibre_yield"], companions=companions)


RADIUS = 3.0
TISSUE = dataclasses.replace(STRONG, elastic=rf.Elastic(200.0, E_Z, 0.0, 0.0, G_XZ_MPa=1e5))
"""Material stiff enough across that cylinders indent it by less than 1 % of the deflection."""


def of_a_circle(function: Callable[[float], float]) -> float:
    """Integrate a function of the height over the rod's section."""

    def strip(y: float) -> float:
        return 2.0 * np.sqrt(RADIUS**2 - y**2) * function(y)

    return sum(quad(strip, *ends)[0] for ends in ((-RADIUS, 0.0), (0.0, RADIUS)))


def test_a_bimodular_rod_bears_what_its_section_does() -> None:
    loss = 0.6
    pressed = 200.0 + (1.0 - loss) * (E_Z - 200.0)

    def moment_about(axis: float, power: int) -> float:
        """Return a moment of the moduli about an axis, above which fibres are in tension."""
        return of_a_circle(lambda y: (E_Z if y > axis else pressed) * (y - axis) ** power)

    axis = brentq(lambda a: moment_about(a, 1), 0.0, RADIUS)
    share = moment_about(axis, 2) / (E_Z * np.pi / 4.0 * RADIUS**4)
    assert share < 0.7
    found = force(with_(rod(TISSUE), bimodular_fibre=loss)) / force(rod(TISSUE))
    # the neutral axis lies within cells of the mesh; the contacts take 0.3 % each
    assert found == pytest.approx(share, rel=0.01)


@pytest.mark.slow
def test_a_yielding_rod_bears_what_its_moment_curvature_says() -> None:
    share, yields, travel = 0.8, 0.0015, 4.0

    def moment(curvature: float) -> float:
        def stress(y: float) -> float:
            strain = curvature * y
            over = max(abs(strain) - yields, 0.0)
            return E_Z * strain - (E_Z - 200.0) * share * np.sign(strain) * over

        return of_a_circle(lambda y: stress(y) * y)

    curvatures = np.linspace(0.0, 0.004, 200)
    moments = [moment(c) for c in curvatures]

    def deflection(force_N: float) -> float:
        z = np.linspace(0.0, SPAN / 2.0, 400)
        return float(np.trapezoid(np.interp(force_N / 2.0 * z, moments, curvatures) * z, z))

    expected = brentq(lambda f: deflection(f) - travel, 0.0, 4.0)
    effect = rf.EFFECTS["fibre_yield"].given(yield_strain=yields)
    elastic = rod(TISSUE, travel_mm=travel)
    found = force(effect.apply(elastic, share)), force(elastic)
    assert found[0] == pytest.approx(expected, rel=0.02)
    assert found[0] < 0.9 * found[1]


@pytest.mark.slow
def test_a_held_rod_relaxes() -> None:
    effect = rf.EFFECTS["viscoelastic"].given(relaxation_time_s=4.0)
    path = ("protocol.speed_mm_per_s=1000", "protocol.then=[{hold_s=5}]")
    curve = rf.simulate(effect.apply(rod(TISSUE, *path), 0.3), MPI.COMM_SELF).curve
    peak, end = curve["force_N"].max(), curve["force_N"].iloc[-1]
    assert end / peak == pytest.approx(1 - 0.3 * (1 - np.exp(-1.25)), rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("name", [*INELASTIC, "viscoelastic"])
def test_stalks_bear_less_by_about_the_derivative_where_the_law_changes(
    coarse: rf.BendingTest, name: str
) -> None:
    """The derivative comes with one run of the elastic stalk, which also tracks the other law."""
    test = rf.override(coarse, ["numerics.acoustic_check=false"])
    effect, amount = rf.EFFECTS[name], 0.02
    parameter = rf.Parameter(effect.apply, effect.typical)
    found = rf.sensitivities(test, {name: parameter}, MPI.COMM_SELF)
    assert found.by_differences == ()
    slope, elastic = found.curve[name].iloc[-1], found.curve["force_N"].iloc[-1]
    assert slope < 0.0
    # a chord against a tangent, of forces that are solved to 1e-4
    assert force(effect.apply(test, amount)) - elastic == pytest.approx(slope * amount, rel=0.1)


@pytest.mark.slow
def test_only_lasting_damage_shows_in_unloading(coarse: rf.BendingTest) -> None:
    path = ["protocol.travel_mm=6", "protocol.then=[{to_mm=2}]", "numerics.acoustic_check=false"]
    test = rf.override(coarse, path)
    lasting, elastic = (
        rf.simulate(with_(test, **{name: 0.8}), MPI.COMM_SELF).curve
        for name in ("irreversible_damage", "fibre_damage")
    )
    # only few points unload while the indenter moves down
    assert lasting["force_N"].max() == pytest.approx(elastic["force_N"].max(), rel=2e-3)
    assert lasting["force_N"].iloc[-1] < 0.97 * elastic["force_N"].iloc[-1]
    parts = lasting[["stored_energy_Nmm", "friction_work_Nmm", "dissipated_Nmm"]].sum(axis=1)
    work = lasting["indenter_work_Nmm"]
    # the trapezoidal rule, in steps of up to 1 mm
    assert (work - parts).abs().max() < 0.02 * work.max()
    assert lasting["dissipated_Nmm"].diff().min() >= -1e-9 * work.max()
    assert not elastic["dissipated_Nmm"].any()
