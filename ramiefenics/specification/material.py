"""Material constants of a layer, and the stiffness that follows from the elastic ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ramiefenics.specification.checks import check_instance, check_number, checked_number
from ramiefenics.specification.errors import SpecificationError, warn

G_PER_CM3 = 1e-9
"""One g/cm3 in tonne/mm3, the solver's unit."""


@dataclass(frozen=True)
class Elastic:
    """Engineering constants of a material isotropic in the X-Y plane (Lekhnitskii 1963).

    Index 3 is Z, along the stalk. Poisson's ratios follow ``nu_ij / E_i = nu_ji / E_j``,
    so `nu_XZ` is the small one.

    Attributes
    ----------
    E_X_MPa
        Young's modulus across the fibres, E_X = E_Y.
    E_Z_MPa
        Young's modulus along the fibres.
    nu_XY
        Poisson's ratio in the cross-section: contraction along Y over extension along X.
    nu_XZ
        Poisson's ratio across and along the fibres, contraction along Z over extension along X. It
        is the small one, as ``nu_XZ / E_X = nu_ZX / E_Z``.
    G_XZ_MPa
        Shear modulus along the fibres, G_XZ = G_YZ.
    G_XY_MPa
        Shear modulus across the fibres. If left out (the default), it is that of an isotropic
        plane, ``E_X / (2 (1 + nu_XY))``. Any other value makes the layer tetragonal: X and Y become
        material axes.
    """

    E_X_MPa: float
    E_Z_MPa: float
    nu_XY: float
    nu_XZ: float
    G_XZ_MPa: float
    G_XY_MPa: float | None = None

    @classmethod
    def isotropic(cls, young_MPa: float, poisson: float) -> Elastic:
        """Return the constants of an isotropic material."""
        shear = young_MPa / (2.0 * (1.0 + poisson))
        return cls(young_MPa, young_MPa, poisson, poisson, shear)

    def __post_init__(self) -> None:
        """Check the constants one by one, then the stiffness as a whole."""
        for name in ("E_X_MPa", "E_Z_MPa", "G_XZ_MPa"):
            check_number(self, name, above=0.0, unit="MPa")
        check_number(self, "nu_XY", above=-1.0, below=1.0)
        check_number(self, "nu_XZ")
        if self.G_XY_MPa is not None:
            check_number(self, "G_XY_MPa", above=0.0, unit="MPa")
        self._check_positive_definite()
        if abs(self.G_XY / self.G_XY_isotropic - 1.0) > 0.01:
            warn(
                f"G_XY_MPa = {self.G_XY:g} is not E_X / (2 (1 + nu_XY)) = "
                f"{self.G_XY_isotropic:.3g} MPa: the layer is not isotropic in its cross-section"
            )

    @property
    def G_XY_isotropic(self) -> float:
        """Shear modulus in the X-Y plane if that is isotropic, MPa."""
        return self.E_X_MPa / (2.0 * (1.0 + self.nu_XY))

    @property
    def G_XY(self) -> float:
        """Shear modulus in the X-Y plane, as used, MPa."""
        return self.G_XY_isotropic if self.G_XY_MPa is None else self.G_XY_MPa

    def compliance(self) -> NDArray[np.float64]:
        """Return the compliance, 1/MPa, shape (6, 6).

        The order is XX, YY, ZZ, YZ, XZ, XY, with engineering shear strains.
        """
        e_x, e_z = self.E_X_MPa, self.E_Z_MPa
        s_xy, s_xz = -self.nu_XY / e_x, -self.nu_XZ / e_x
        compliance = np.zeros((6, 6))
        compliance[:3, :3] = [
            [1 / e_x, s_xy, s_xz],
            [s_xy, 1 / e_x, s_xz],
            [s_xz, s_xz, 1 / e_z],
        ]
        compliance[3:, 3:] = np.diag([1 / self.G_XZ_MPa, 1 / self.G_XZ_MPa, 1 / self.G_XY])
        return compliance

    def stiffness(self) -> NDArray[np.float64]:
        """Return the stiffness, MPa, shape (6, 6), the inverse of `compliance`."""
        return np.asarray(np.linalg.inv(self.compliance()), dtype=np.float64)

    def _check_positive_definite(self) -> None:
        # Scaled to unit diagonal, so that the eigenvalues are pure numbers and the different
        # magnitudes of the six moduli do not hide an indefinite combination.
        compliance = self.compliance()
        scale = 1.0 / np.sqrt(np.diag(compliance))
        values, vectors = np.linalg.eigh(compliance * np.outer(scale, scale))
        if values[0] > 1e-10:
            return
        axes = ("XX", "YY", "ZZ", "YZ", "XZ", "XY")
        mode = " ".join(
            f"{v:+.2f} {a}" for v, a in zip(vectors[:, 0], axes, strict=True) if abs(v) > 0.05
        )
        name = "nu_XZ" if abs(vectors[2, 0]) > 0.05 else "nu_XY"
        limit = np.sqrt(self.E_X_MPa / self.E_Z_MPa * (1.0 - self.nu_XY) / 2.0)
        raise SpecificationError(
            name,
            getattr(self, name),
            "must leave the stiffness positive definite, but eigenvalue 1 of 6 of the compliance "
            f"scaled to unit diagonal is {values[0]:.3g} (mode {mode}); with the other constants "
            f"as given, |nu_XZ| must be below {limit:.4g}",
        )


@dataclass(frozen=True)
class LargeStrain:
    """Constants of the saturating-fibre law at large strain.

    They have not been measured for ramie: quote peak forces with their range over these constants.

    Attributes
    ----------
    fibre_strength
        Axial compressive stress at which fibres give way, s_c / G_XZ. A bundle of perfectly
        aligned fibres kinks at G_XZ (Rosen 1965), one misaligned by the angle phi at
        ``G_XZ / (1 + phi / gamma_Y)`` (Argon 1972; Budiansky and Fleck 1993). With gamma_Y = 0.05,
        a value of 0.2 stands for 0.2 rad, and so does 0.1 together with what the residual tangent
        adds up to a strain of 0.1.
    fibre_residual_tangent
        Axial tangent that remains beyond this stress, h / G_XZ: crushed fibres bear on each other.
    shear_yield_strain
        Axial shear strain gamma_Y beyond which the matrix between the fibres yields.
    shear_residual_tangent
        Shear tangent that remains beyond yield, R, over G_XZ. Where ``s_c + h |e|`` exceeds it,
        sheared fibres may kink: with the defaults, beyond a compressive strain of 0.1.
    densification
        Stiffening of the section when it is crushed: compressed in one direction to the stretch
        lambda, its tangent gains about this multiple of ``(ln lambda)^2``, as in a cellular solid
        whose cells close (Gibson and Ashby 1997).
    bimodularity
        Share of the fibres' axial stiffness that is missing in compression (bimodular materials:
        Ambartsumyan 1986); none by default.
    fibre_damage
        Share of the fibres' stress that is lost at a tensile strain of 0.05, by an energy limiter
        (Volokh 2007); none by default. Unloading recovers the damage, so that it serves monotonic
        loading only, in all laws but ``inelastic`` and ``inelastic_viscoelasticity``.
    """

    fibre_strength: float = 0.1
    fibre_residual_tangent: float = 1.0
    shear_yield_strain: float = 0.05
    shear_residual_tangent: float = 0.2
    densification: float = 12.0
    bimodularity: float = 0.0
    fibre_damage: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        check_number(self, "shear_residual_tangent", above=0.0, at_most=1.0)
        check_number(self, "fibre_strength", above=0.0)
        if self.fibre_strength > self.shear_residual_tangent:
            raise SpecificationError(
                "fibre_strength",
                self.fibre_strength,
                f"must be at most shear_residual_tangent = {self.shear_residual_tangent:g}, or "
                "compressed fibres kink",
            )
        check_number(self, "fibre_residual_tangent", at_least=0.0)
        check_number(self, "shear_yield_strain", above=0.0)
        check_number(self, "densification", at_least=0.0)
        check_number(self, "bimodularity", at_least=0.0, below=1.0)
        check_number(self, "fibre_damage", at_least=0.0, below=1.0)


@dataclass(frozen=True)
class Material:
    """Material of a layer.

    Attributes
    ----------
    elastic
        Constants at small strain.
    large_strain
        Constants at large strain.
    density_g_per_cm3
        Mass density; used in dynamics only.
    law_constants
        Further constants that the law declares, by name; those left out take the law's defaults.
    """

    elastic: Elastic
    large_strain: LargeStrain = field(default_factory=LargeStrain)
    density_g_per_cm3: float = 1.0
    law_constants: dict[str, float] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        """Check the parts and the density; the law checks its own constants."""
        check_instance(self, "elastic", Elastic)
        check_instance(self, "large_strain", LargeStrain)
        check_number(self, "density_g_per_cm3", above=0.0, unit="g/cm3")
        own = self.law_constants
        if not isinstance(own, Mapping):
            raise SpecificationError("law_constants", own, "must be a table of the law's constants")
        try:
            numbers = {name: checked_number(name, value) for name, value in own.items()}
        except SpecificationError as error:
            raise error.inside("law_constants") from error
        object.__setattr__(self, "law_constants", numbers)

    def scaled(self, factor: float) -> Material:
        """Return the material with all moduli multiplied by a factor."""
        names = ("E_X_MPa", "E_Z_MPa", "G_XZ_MPa", "G_XY_MPa")
        values = {name: getattr(self.elastic, name) for name in names}
        changed = {name: value * factor for name, value in values.items() if value is not None}
        return replace(self, elastic=replace(self.elastic, **changed)) if factor != 1.0 else self
