"""A long layered tube compared with Timoshenko's beam."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
import ufl
from dolfinx import fem
from mpi4py import MPI
from scipy.integrate import trapezoid

from ramiefenics.model.jit import compile_form
from ramiefenics.model.solid import Solid
from ramiefenics.model.tube import SURFACES, build_tube
from ramiefenics.published import published_test
from ramiefenics.specification import Stalk, override
from ramiefenics.verification.block import BoundaryValueProblem, hold, on_planes
from ramiefenics.verification.study import Study, at_most

LENGTHS_MM = (200.0, 400.0, 800.0)
"""Wavelengths of the load."""

HOLDS_MM = 400.0
"""Wavelength from which the theory holds: half the wave is then fourteen diameters long."""

AMPLITUDE = 1e-5
"""Approximate ratio of the deflection to the wavelength, which is small."""


@dataclass(frozen=True)
class LayeredTube:
    """Bending and shear stiffness of a layered circular tube.

    Attributes
    ----------
    radii_mm
        Radii of the void and of the layers, ascending, shape (n + 1,).
    E_MPa, G_MPa
        Axial Young's and shear moduli of the layers, shape (n,).
    """

    radii_mm: tuple[float, ...]
    E_MPa: tuple[float, ...]
    G_MPa: tuple[float, ...]

    @classmethod
    def of(cls, stalk: Stalk) -> LayeredTube:
        """Return the layered tube of a stalk."""
        elastic = [layer.material.elastic for layer in stalk.layers]
        return cls(
            tuple(stalk.radii_mm),
            tuple(e.E_Z_MPa for e in elastic),
            tuple(e.G_XZ_MPa for e in elastic),
        )

    @property
    def bending_Nmm2(self) -> float:
        """Bending stiffness EI."""
        fourth = np.diff(np.array(self.radii_mm) ** 4)
        return float(np.pi / 4 * np.dot(self.E_MPa, fourth))

    @property
    def shear_N(self) -> float:
        """Shear stiffness: V^2 over twice the energy of the shear stresses per length.

        The stresses are those of Saint-Venant's flexure without lateral contraction,
        tau = G grad phi with
        div(G grad phi) = -E y V / EI and no shear on the surfaces, hence in every layer
        phi = (A r + B / r - E V r^3 / (8 G EI)) sin(theta); displacement and traction are
        continuous between layers. For one layer this is Cowper's (1966) coefficient with nu = 0.
        """
        r, number = np.array(self.radii_mm), len(self.E_MPa)
        G = np.array(self.G_MPa)
        cubic = -np.array(self.E_MPa) / (8 * G * self.bending_Nmm2)  # V = 1
        rows, right = [], []

        def row(entries: dict[int, tuple[float, float]], value: float) -> None:
            line = np.zeros((number, 2))
            for layer, pair in entries.items():
                line[layer] = pair
            rows.append(line.ravel())
            right.append(value)

        def slope(layer: int, at: float) -> tuple[float, float]:
            return G[layer], -G[layer] / at**2

        def value(at: float, sign: float = 1.0) -> tuple[float, float]:
            return sign * at, sign / at

        row({0: slope(0, r[0])}, -3 * G[0] * cubic[0] * r[0] ** 2)
        row({number - 1: slope(number - 1, r[-1])}, -3 * G[-1] * cubic[-1] * r[-1] ** 2)
        for k in range(number - 1):
            at, after = r[k + 1], slope(k + 1, r[k + 1])
            jump = 3 * (G[k + 1] * cubic[k + 1] - G[k] * cubic[k]) * at**2
            row({k: slope(k, at), k + 1: (-after[0], -after[1])}, jump)
            row({k: value(at), k + 1: value(at, -1.0)}, (cubic[k + 1] - cubic[k]) * at**3)
        solved = np.linalg.solve(np.array(rows), right).reshape(number, 2)
        energy = 0.0
        for k in range(number):
            at = np.linspace(r[k], r[k + 1], 401)
            (A, B), C = solved[k], cubic[k]
            radial, hoop = A - B / at**2 + 3 * C * at**2, A + B / at**2 + C * at**2
            energy += np.pi * G[k] * trapezoid((radial**2 + hoop**2) * at, at)
        return float(1.0 / energy)

    def three_point_stiffness(self, span_mm: float) -> float:
        """Return the ratio of force to deflection at midspan, N/mm (Timoshenko 1921)."""
        bending = span_mm**3 / (48 * self.bending_Nmm2)
        return 1.0 / (bending + span_mm / (4 * self.shear_N))


def deflection(wavelength_mm: float) -> tuple[float, float]:
    """Return the deflection under a load per length of q cos(k z), and that of a beam, mm.

    The deflection is the mean over the section (Cowper 1966). The model is a quarter of a wave:
    symmetric at z = 0, and held laterally but free axially at its other end. The load is
    distributed over the section as the shear stresses take it up, in proportion to the modulus, so
    that it does not deform the section.
    """
    quarter = wavelength_mm / 4
    test = override(
        published_test("table3"),
        [
            f"stalk.length_mm={2 * quarter}",
            f"fixture.span_mm={1.2 * quarter}",
            "numerics.mesh=ladder_q2_2",
            f"numerics.mesh.contact_size={1 / 1.2 / 16}",
            f"numerics.mesh.coarse_size={1 / 1.2 / 16}",
        ],
    )
    tube = build_tube(test, MPI.COMM_SELF)
    stalk = test.stalk
    materials = [layer.material for layer in stalk.layers]
    serendipity = test.numerics.mesh.serendipity
    solid = Solid(tube.mesh, tube.cells, materials, test.law, serendipity)
    end = on_planes(tube.mesh, 2, quarter)
    bcs = [
        solid.symmetry(tube.facets.find(SURFACES["symmetry_x"]), 0),
        solid.symmetry(tube.facets.find(SURFACES["symmetry_z"]), 2),
        hold(solid, end, 0),
        hold(solid, end, 1),
    ]
    beam, k = LayeredTube.of(stalk), 2 * np.pi / wavelength_mm
    unit = 1 / (beam.bending_Nmm2 * k**4) + 1 / (beam.shear_N * k**2)
    q = AMPLITUDE * wavelength_mm / unit
    areas = np.pi * np.diff(np.array(stalk.radii_mm) ** 2)
    share = fem.Function(solid.cellwise)
    for layer, E in enumerate(beam.E_MPa, start=1):
        share.x.array[tube.cells.find(layer)] = E / np.dot(beam.E_MPa, areas)
    x = ufl.SpatialCoordinate(tube.mesh)
    problem = BoundaryValueProblem(
        solid, bcs, lambda v: q * share * ufl.cos(k * x[2]) * v[1] * solid.dx
    )
    problem.solve(1e-9 * q * quarter)
    at_start = ufl.Measure("ds", tube.mesh, subdomain_data=tube.facets)(SURFACES["symmetry_z"])
    area, moved = (
        fem.assemble_scalar(compile_form(part * at_start))
        for part in (fem.Constant(tube.mesh, 1.0), -solid.displacement[1])
    )
    return float(moved / area), q * unit


def beam() -> Study:
    """Compare the deflection under sinusoidal loads of growing wavelength with a beam's."""
    rows = []
    for wavelength in LENGTHS_MM:
        found, expected = deflection(wavelength)
        rows.append({"wavelength (mm)": wavelength, "deflection / beam's": found / expected})
    table = pd.DataFrame(rows)
    stalk = published_test("table3").stalk
    tube = LayeredTube.of(stalk)
    kept = table[table["wavelength (mm)"] >= HOLDS_MM]["deflection / beam's"]
    k = 2 * np.pi / table["wavelength (mm)"]
    table.insert(1, "share of shear", 1 / (1 + tube.shear_N / (tube.bending_Nmm2 * k**2)))
    return Study(
        "Timoshenko's beam",
        "The calibration stalk under a small load that varies along it as a cosine, so that "
        "neither an end nor a local load disturbs it: deflection relative to that of a layered "
        "Timoshenko beam, "
        f"EI = {tube.bending_Nmm2:.4g} N mm2 and shear stiffness {tube.shear_N:.4g} N "
        "(Timoshenko 1921; shear by Saint-Venant's flexure of the layered tube, which for one "
        "layer is Cowper's coefficient of 1966 without lateral contraction).",
        (
            at_most(
                f"largest error at wavelengths from {HOLDS_MM:g} mm on, relative",
                float(np.abs(kept - 1).max()),
                0.01,
                "the theory neglects that sections deform",
            ),
        ),
        table,
    )
