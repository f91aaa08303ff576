"""Linear viscoelasticity by a Prony series on any elastic law, in parallel with another law.

With the energy W_0 of fast loading, as a function of the right Cauchy-Green tensor C = F^T F, its
derivatives dW_0 and ddW_0 with respect to C, shares phi_i and relaxation times tau_i, the free
energy is

    W = (1 - sum phi_i) W_0(C) + sum phi_i (W_0(C) - W_0(A_i) - dW_0(A_i) : (C - A_i)),
    dA_i/dt = (C - A_i) / tau_i.

This is Simo's (1987) free energy, ``W_0(C) - sum Q_i : C + X(Q)``, with the stress-like variables
Q_i = phi_i dW_0(A_i), whose equilibrium values are phi_i dW_0(C), and the conjugate X that makes it
vanish at rest. ``(1 - sum phi_i) W_0`` is left after a long time at rest. Where the stress is
linear in C, hence at small strain, each branch relaxes as ``phi_i exp(-t / tau_i)``. A_i is
integrated exactly for a C that is linear in time over a step (Simo and Hughes 1998, Eq. 10.3.12).
So is the rate of dissipation, the sum of ``phi_i / tau_i (C - A_i) : ddW_0(A_i) : (C - A_i)``,
except that ddW_0 is taken at the end of the step; it is positive wherever W_0 is convex in C.

Another law, which may have internal variables, can replace W_0 in the part that does not relax,
``(1 - sum phi_i) W_0(C)``. That part and the branches act in parallel and share nothing but F, as
in the parallel rheological framework (Bergstrom and Boyce 1998; Hurtado, Lapczyk and Govindarajan
2013), so that each dissipates independently.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import ufl

from ramiefenics.model.laws.base import Constant, Expr, Law, Memory, State
from ramiefenics.model.laws.inelastic import INELASTIC
from ramiefenics.model.laws.saturating_fibre import SATURATING_FIBRE
from ramiefenics.specification import Material, SpecificationError


def prony(name: str, elastic: Law, branches: int, lasting: Law | None = None) -> Law:
    """Return a viscoelastic law.

    Its constants are ``relaxing_share_1``, ``relaxation_time_1_s`` and so on.

    Parameters
    ----------
    name
        Name of the law.
    elastic
        Law of fast loading.
    branches
        Number of terms of the Prony series.
    lasting
        Law of the part that does not relax, with the same elastic constants and with all of the
        elastic law's parameters; by default the elastic law itself.
    """
    lasting = elastic if lasting is None else lasting
    series = _PronySeries(elastic, lasting, range(1, branches + 1))
    start = {} if lasting.memory is None else dict(lasting.memory.start)
    units = {} if lasting.memory is None else lasting.memory.units
    rest = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    start |= {"metric": rest} | {f"followed_{i}": rest for i in series.numbers}
    return Law(
        name,
        series.parameters,
        series.energy,
        least_stretch=max(elastic.least_stretch, lasting.least_stretch),
        homogeneous=elastic.homogeneous and lasting.homogeneous,
        constants=lasting.constants + tuple(c for i in series.numbers for c in _constants(i)),
        memory=Memory(start, series.update, series.dissipation, units),
    )


@dataclass(frozen=True)
class _PronySeries:
    """Law of the branches, law of the part that does not relax, and numbers of the branches."""

    elastic: Law
    lasting: Law
    numbers: range

    def parameters(self, material: Material) -> dict[str, float]:
        total = sum(material.law_constants[f"relaxing_share_{i}"] for i in self.numbers)
        if total >= 1.0:
            allowed = "must add up to less than 1, or no stress is left after full relaxation"
            raise SpecificationError("law_constants.relaxing_share", total, allowed)
        return self.lasting.parameters(material)

    def lasting_share(self, p: Mapping[str, Expr]) -> Expr:
        return 1 - sum(p[f"relaxing_share_{i}"] for i in self.numbers)

    def energy(self, F: Expr, p: Mapping[str, Expr], state: State) -> Expr:
        left = self.lasting_share(p)
        whole = left * self.lasting.stored(F, p, state) + (1 - left) * self.elastic.energy(F, p)
        for i in self.numbers:
            followed = ufl.variable(state[f"followed_{i}"])
            there = self._energy_of(followed, p)
            tangent_plane = there + ufl.inner(ufl.diff(there, followed), F.T * F - followed)
            whole -= p[f"relaxing_share_{i}"] * tangent_plane
        return whole

    def update(self, F: Expr, p: Mapping[str, Expr], last: State, duration: Expr) -> State:
        metric = F.T * F
        now = {**self.lasting.state(F, p, last, duration), "metric": metric}
        for i in self.numbers:
            x = duration / p[f"relaxation_time_{i}_s"]
            lag = last["metric"] - last[f"followed_{i}"]
            growth = metric - last["metric"]
            now[f"followed_{i}"] = metric - ufl.exp(-x) * lag - _mean_decay(x) * growth
        return now

    def dissipation(
        self, F: Expr, p: Mapping[str, Expr], last: State, now: State, duration: Expr
    ) -> Expr:
        growth = now["metric"] - last["metric"]
        total = self.lasting_share(p) * self.lasting.dissipated(F, p, last, now, duration)
        for i in self.numbers:
            x = duration / p[f"relaxation_time_{i}_s"]
            lag = last["metric"] - last[f"followed_{i}"]
            followed = ufl.variable(now[f"followed_{i}"])
            gradient = ufl.diff(self._energy_of(followed, p), followed)
            by_lag, by_growth = (
                ufl.diff(ufl.inner(gradient, direction), followed) for direction in (lag, growth)
            )
            total += p[f"relaxing_share_{i}"] * (
                (1 - ufl.exp(-2 * x)) / 2 * ufl.inner(by_lag, lag)
                + x * _mean_decay(x) ** 2 * ufl.inner(by_lag, growth)
                + _mean_square_growth(x) * ufl.inner(by_growth, growth)
            )
        return total

    def _energy_of(self, C: Expr, p: Mapping[str, Expr]) -> Expr:
        return self.elastic.energy(_stretch_of(C), p)


def _constants(i: int) -> tuple[Constant, ...]:
    share = Constant(f"relaxing_share_{i}", "1", default=0.1, at_least=0.0, below=1.0)
    time = Constant(f"relaxation_time_{i}_s", "s", default=10.0**i, above=0.0)
    return share, time


def _stretch_of(C: Expr) -> Expr:
    """Return a deformation gradient that has this C: its upper triangular Cholesky factor."""
    a = ufl.sqrt(C[0, 0])
    b, c = C[0, 1] / a, C[0, 2] / a
    d = ufl.sqrt(C[1, 1] - b**2)
    e = (C[1, 2] - b * c) / d
    f = ufl.sqrt(C[2, 2] - c**2 - e**2)
    return ufl.as_matrix(((a, b, c), (0, d, e), (0, 0, f)))


def _mean_decay(x: Expr) -> Expr:
    """Return the mean of exp(-t) for t from 0 to x.

    At small x, where the quotient would suffer from cancellation, it is computed by a series.
    """
    return ufl.conditional(ufl.gt(x, 1e-4), (1 - ufl.exp(-x)) / x, 1 - x / 2 + x**2 / 6)


def _mean_square_growth(x: Expr) -> Expr:
    """Return the integral of ((1 - exp(-t)) / x)^2 for t from 0 to x, likewise."""
    decay = ufl.exp(-x)
    exact = (x - 2 * (1 - decay) + (1 - decay**2) / 2) / x**2
    return ufl.conditional(ufl.gt(x, 1e-2), exact, x / 3 - x**2 / 4 + 7 * x**3 / 60)


VISCOELASTICITY = prony("viscoelasticity", SATURATING_FIBRE, branches=1)
INELASTIC_VISCOELASTICITY = prony("inelastic_viscoelasticity", SATURATING_FIBRE, 1, INELASTIC)
