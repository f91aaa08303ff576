"""Central differences on linear structures whose frequencies a dense eigensolver provides."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI
from numpy.typing import NDArray

from ramiefenics.solve.central_differences import RITZ_TOLERANCE, CentralDifferences

Array = NDArray[np.float64]

LAMBDA_MPA, MU_MPA, DENSITY = 30.0, 20.0, 1e-9


class Elastic:
    """An elastic box of hexahedra, by default held at X = 0, and its exact modes.

    Attributes
    ----------
    frequencies, modes
        Angular frequencies, 1/s, ascending; mass-normalised mode shapes as columns over all
        components, zero in held ones.
    """

    def __init__(self, cells: tuple[int, int, int], held: bool = True) -> None:
        corners = [[0.0, 0.0, 0.0], [3.0, 2.0, 1.0]]
        kind = dmesh.CellType.hexahedron
        mesh = dmesh.create_box(MPI.COMM_SELF, corners, list(cells), kind)
        space = fem.functionspace(mesh, ("Lagrange", 1, (3,)))
        self.u = fem.Function(space)
        v, du = ufl.TestFunction(space), ufl.TrialFunction(space)
        strain = ufl.sym(ufl.grad(self.u))
        stored = LAMBDA_MPA / 2 * ufl.tr(strain) ** 2 + MU_MPA * ufl.inner(strain, strain)
        self.energy = fem.form(stored * ufl.dx)
        residual = ufl.derivative(stored * ufl.dx, self.u, v)
        self._residual = fem.form(residual)
        self.mass = fem.assemble_vector(fem.form(DENSITY * sum(v) * ufl.dx)).array
        dofs = fem.locate_dofs_geometrical(space, lambda x: np.isclose(x[0], 0.0))
        self.bcs = [fem.dirichletbc(np.zeros(3), dofs, space)] if held else []
        stiffness = fem.assemble_matrix(fem.form(ufl.derivative(residual, self.u, du))).to_dense()
        free = np.setdiff1d(np.arange(len(self.mass)), self.bcs[0].dof_indices()[0] if held else [])
        squares, vectors = scipy.linalg.eigh(
            stiffness[np.ix_(free, free)], np.diag(self.mass[free])
        )
        self.frequencies = np.sqrt(np.abs(squares))
        self.modes = np.zeros((len(self.mass), len(free)))
        self.modes[free] = vectors
        self.load, self.spring = np.zeros_like(self.mass), np.zeros_like(self.mass)

    def residual(self) -> Array:
        return fem.assemble_vector(self._residual).array - self.load + self.spring * self.u.x.array

    def motion(
        self, viscosity: float = 0.0, drag: float = 0.0, smoothing: float = 1.0
    ) -> CentralDifferences:
        return CentralDifferences(
            self.u, self.mass, self.bcs, self.residual, viscosity, drag, smoothing
        )

    def size(self) -> float:
        return float(np.abs(self.u.x.array).max())


@pytest.fixture(scope="module")
def box() -> Elastic:
    return Elastic((4, 3, 2))


@pytest.fixture(autouse=True)
def _at_rest(box: Elastic) -> None:
    box.u.x.array[:] = 0.0
    box.load[:] = 0.0


def test_highest_frequency_is_that_of_the_dense_eigensolver(box: Elastic) -> None:
    exact = box.frequencies[-1]
    estimate = box.motion().highest_frequency()
    # the residual is added: the square is at most RITZ_TOLERANCE too high, and too low only by the
    # rounding of the difference quotient
    assert exact * (1 - 1e-4) <= estimate <= exact * (1 + RITZ_TOLERANCE / 2 + 1e-4)


def test_estimate_follows_another_mode_that_becomes_the_highest() -> None:
    box = Elastic((4, 3, 2))
    motion = box.motion()
    before = motion.highest_frequency()
    free = np.flatnonzero(np.abs(box.modes).max(axis=1) > 0.0)
    quiet = free[np.argmin(np.abs(box.modes[free, -1]))]
    # Rayleigh's quotient of this component alone bounds the highest frequency
    box.spring[quiet] = 4.0 * before**2 * box.mass[quiet]
    assert motion.highest_frequency() > 2.0 * before


@pytest.mark.parametrize("viscosity", [0.0, 0.06, 0.3])
@pytest.mark.parametrize(("share", "stable"), [(0.995, True), (1.005, False)])
def test_longest_step_is_sharp(box: Elastic, viscosity: float, share: float, stable: bool) -> None:
    """Just below 2 / (w sqrt(1 + 2 b)) the motion stays bounded; just above, it blows up."""
    motion = box.motion(viscosity)
    limit = 2.0 / (box.frequencies[-1] * np.sqrt(1.0 + 2.0 * viscosity))
    assert 0.985 * limit < motion.longest_step() < 1.0001 * limit
    motion.velocity = box.modes @ np.ones(len(box.frequencies))
    for _ in range(100):
        motion.step(0.1 * limit)
    usual = box.size()
    for _ in range(1000):
        motion.step(share * limit)
    # near the limit the highest mode grows up to 1 / sqrt(1 - share^2) = 10 times as large
    assert (box.size() < 20.0 * usual) is stable
    assert (box.size() > 1e6 * usual) is not stable


def test_driven_vibration_converges_with_the_square_of_the_step(box: Elastic) -> None:
    """One mode of x'' + w^2 x = w^2 sin(W t), x(0) = 1, x'(0) = 0, against its exact solution."""
    mode, w = box.modes[:, 0], box.frequencies[0]
    drive, end = 0.7 * w, 3.0 / w
    amplitude = w**2 / (w**2 - drive**2)  # of a load w^2 sin(W t)
    exact = np.cos(w * end) + amplitude * (np.sin(drive * end) - drive / w * np.sin(w * end))

    def error(number: int) -> float:
        box.u.x.array[:] = mode
        motion = box.motion()

        def push(time: float) -> None:
            box.load[:] = box.mass * mode * w**2 * np.sin(drive * time)

        for _ in range(number):
            motion.step(end / number, push)
        assert motion.time_s == pytest.approx(end)
        return abs(float(mode @ (box.mass * box.u.x.array)) - exact)

    first = int(np.ceil(end * box.frequencies[-1] / 1.5))
    coarse, fine = error(first), error(2 * first)
    assert coarse < 0.01
    assert coarse / fine == pytest.approx(4.0, rel=0.1)


def test_viscosity_damps_a_mode_as_it_should_and_tells_what_it_takes(box: Elastic) -> None:
    """Amplitudes decay by exp(-b w^2 dt t / 2); the energy lost is the reported damping work."""
    viscosity, number = 0.06, 400
    middle = len(box.frequencies) // 2
    mode, w = box.modes[:, middle], box.frequencies[middle]
    step = 0.3 / box.frequencies[-1]
    box.u.x.array[:] = mode
    start = fem.assemble_scalar(box.energy)
    motion = box.motion(viscosity)
    for _ in range(number):
        motion.step(step)
    share = np.exp(-viscosity * w**2 * step * number * step)  # of the energy
    assert 0.05 < share < 0.95
    left = fem.assemble_scalar(box.energy) + motion.kinetic_energy_Nmm
    # kinetic and stored energy are taken one step apart: an error of first order in w dt
    assert left / start == pytest.approx(share, abs=2.0 * w * step)
    assert motion.damping_work_Nmm / start == pytest.approx(1.0 - share, rel=0.03)


def test_drag_damps_what_is_faster_than_its_mean(box: Elastic) -> None:
    """The slowest mode obeys x'' + a (x' - w) + W^2 x = 0, w' = (x' - w) / T, with small a."""
    mode, w = box.modes[:, 0], box.frequencies[0]
    drag, smoothing = 0.02 * w, 3.0 / w
    box.u.x.array[:] = mode
    start = fem.assemble_scalar(box.energy)
    motion = box.motion(drag=drag, smoothing=smoothing)
    step = 0.3 / box.frequencies[-1]
    number = round(50.0 / w / step)
    for _ in range(number):
        motion.step(step)
    rate = drag * (w * smoothing) ** 2 / (1.0 + (w * smoothing) ** 2)
    share = np.exp(-rate * number * step)
    assert 0.2 < share < 0.6
    left = fem.assemble_scalar(box.energy) + motion.kinetic_energy_Nmm
    # error of second order in a / w, apart from the energy's oscillation within a period
    assert left / start == pytest.approx(share, rel=0.03)
    assert motion.damping_work_Nmm / start == pytest.approx(1.0 - share, rel=0.03)


def test_drag_lets_a_steady_motion_go_on() -> None:
    """A free body that starts at speed V ends at V / (1 + a T): v' = -a (v - w), w' = (v - w)/T."""
    body = Elastic((1, 1, 1), held=False)
    drag, smoothing = 300.0, 1e-3
    motion = body.motion(drag=drag, smoothing=smoothing)
    motion.velocity[:] = 1e3
    for _ in range(10_000):
        motion.step(1e-6)
    # explicit integration: error of first order in the step over the smoothing time
    assert motion.velocity == pytest.approx(1e3 / (1.0 + drag * smoothing), rel=1e-3)


def test_free_body_keeps_its_momentum_with_changing_steps() -> None:
    box = Elastic((3, 2, 2), held=False)
    rng = np.random.default_rng(0)
    motion = box.motion(viscosity=0.06)
    motion.velocity = 1e3 * rng.standard_normal(len(box.mass))
    before = (box.mass * motion.velocity).reshape(-1, 3).sum(axis=0)
    limit = motion.longest_step()
    for share in rng.uniform(0.3, 0.9, 200):
        motion.step(share * limit)
    after = (box.mass * motion.velocity).reshape(-1, 3).sum(axis=0)
    assert after == pytest.approx(before, rel=1e-9)
    assert box.size() > 0.0
