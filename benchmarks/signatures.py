"""Cost of the force curve's derivatives by eight parameters, compared with one simulation.

    OMP_NUM_THREADS=1 ./run python benchmarks/signatures.py

Takes two minutes. Writes `records/signatures.json`.
"""

from __future__ import annotations

import time

from record import write_record

from ramiefenics import BendingTest, Parameter, override, published_test, sensitivities, simulate

KEYS = {
    "stalk.void_diameter_mm": 7.28,
    "stalk.layers.phloem.outer_diameter_mm": 14.23,
    "stalk.layers.xylem.material.elastic.E_X_MPa": 7.67,
    "stalk.layers.phloem.material.elastic.E_Z_MPa": 1919.08,
    "stalk.layers.phloem.material.elastic.G_XZ_MPa": 33.8,
    "stalk.layers.xylem.material.large_strain.fibre_strength": 0.1,
    "fixture.indenter_radius_mm": 5.0,
    "fixture.friction.dynamic": 0.12,
}


def relative(key: str, middle: float) -> Parameter:
    """Return a parameter that changes a value by a share of its middle."""

    def change(test: BendingTest, amount: float) -> BendingTest:
        return override(test, [f"{key}={middle * (1 + amount)!r}"])

    return Parameter(change, typical=0.1)


def main() -> None:
    """Time a simulation without and with derivatives on two recipes."""
    summary = {}
    for mesh in ("screening", "standard"):
        settings = [f"numerics.mesh={mesh}", "numerics.acoustic_check=false"]
        test = override(published_test("table3"), settings)
        simulate(test)  # compiles
        start = time.process_time()
        simulate(test)
        middle = time.process_time()
        found = sensitivities(test, {k: relative(k, v) for k, v in KEYS.items()})
        summary[mesh] = {
            "one_run_s": middle - start,
            "with_derivatives_s": time.process_time() - middle,
            "parameters": len(KEYS),
            "by_differences": list(found.by_differences),
        }
    write_record("signatures", summary)


if __name__ == "__main__":
    main()
