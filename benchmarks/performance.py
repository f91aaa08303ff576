"""Page on performance, from the records of the other benchmarks.

    ./run python benchmarks/performance.py

Takes seconds. Reads the records of `convergence`, `felupe_front`, `race`, `ranks`, `growth`,
`throughput`, `signatures` and `stalks`, and writes `docs/performance.md` and
`docs/performance.png`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import matplotlib as mpl
from convergence import MESHES
from matplotlib.figure import Figure
from record import DOCS, read_record, table
from stalks import predicted_s

from ramiefenics.results.style import BLUE, GREY, STYLE, VERMILION
from ramiefenics.solve.tangent import DIRECT_UNKNOWNS

FINEST = "ladder_q2_5"


def read(name: str) -> Any:
    """Return the record of a benchmark."""
    return read_record(name)


def front(rows: dict[str, dict[str, Any]], felupe: dict[str, dict[str, Any]]) -> Figure:
    """Draw the error of the maximum force against CPU time."""
    limit = rows[FINEST]["max_force_N"]
    marks = (("First order", VERMILION, "s-"), ("Second order", BLUE, "o-"))

    def line(runs: list[dict[str, Any]], style: str, colour: str, label: str) -> None:
        errors = [100 * (run["max_force_N"] / limit - 1) for run in runs]
        axes.loglog([run["cpu_s"] for run in runs], errors, style, color=colour, label=label)

    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=(5.0, 3.6), layout="constrained")
        axes = drawing.subplots()
        for family, colour, style in marks:
            names = [name for name in MESHES[family] if name != FINEST]
            line([rows[name] for name in names], style, colour, family.lower())
        line(list(felupe.values()), "^--", GREY, "FElupe, first order")
        axes.axhline(1.0, color=GREY, ls=":")
        axes.set(
            xlabel="CPU time of a run to 14 mm (s)", ylabel="Maximum force over the finest mesh (%)"
        )
        axes.legend()
        return drawing


def race(record: dict[str, Any]) -> str:
    """Tabulate the race against other codes."""
    rows = []
    for label, codes in record.items():
        for code, run in codes.items():
            forces = [f"{run[f'force_{at}mm_N']:.2f}" for at in (4, 8, 14)]
            rows.append([label, code, *forces, f"{run['median_s']:.1f}", f"{run['over_ours']:.1f}"])
    head = ["mesh", "code", "F(4 mm) (N)", "F(8 mm)", "F(14 mm)", "user CPU (s)", "ratio"]
    return table(head, rows)


def columns(rows: Iterable[dict[str, Any]], keys: dict[str, tuple[str, str]]) -> str:
    """Tabulate some keys of rows, each with a heading and a format."""
    cells = [[format(row[key], how) for key, (_, how) in keys.items()] for row in rows]
    return table([title for title, _ in keys.values()], cells)


def comparison() -> str:
    """Return the head of the page, and the comparisons with finer meshes and other codes."""
    return f"""# Performance

Made by `./run python benchmarks/performance.py` from the records of the other benchmarks, measured
on shared virtual machines of two cores and 24 GB, not all on the same one; one thread per process.
CPU times are those of the process unless stated otherwise.

## Error against time

![Error of the maximum force against CPU time, both element orders](performance.png)

For the calibration stalk with friction, bent to 14 mm; errors are relative to `{FINEST}`. All
numbers are in [convergence.md](convergence.md). FElupe has the same law, differentiated by
tensortrax, and the meshes of the first-order ladder, with penalty contact, one coefficient of
friction, 0.12, and steps of 0.25 mm, as it does not converge with longer ones
(`benchmarks/peers/front.py`).

## The same problem, other codes

Isotropic neo-Hookean layers between rigid cylinders to 14 mm, first-order hexahedra, meshes
`tube_L1` (10,335 unknowns) and `tube_L2` (36,603). FElupe 11.3 with MKL PARDISO and CalculiX 2.20
with SPOOLES have node-to-surface contact with a penalty of 200 N/mm3 and steps of 1 mm;
ramiefenics has Nitsche's method. The times are user CPU times of the whole process, start-up
included, medians of three runs in alternation (`benchmarks/peers/race.py`); the last column is
their ratio to that of ramiefenics.

{race(read("race"))}
"""


def derivatives() -> str:
    """Tabulate the cost of derivatives."""
    return columns(
        [{"mesh": mesh, **row} for mesh, row in read("signatures").items()],
        {
            "mesh": ("recipe", "s"),
            "one_run_s": ("one run (s)", ".1f"),
            "with_derivatives_s": ("with eight derivatives (s)", ".1f"),
        },
    )


def growth() -> str:
    """Tabulate the cost of large models."""
    return columns(
        read("growth").values(),
        {
            "unknowns": ("unknowns", ",d"),
            "newton_iterations": ("Newton iterations", "d"),
            "linear_iterations": ("linear iterations", "d"),
            "cpu_s": ("CPU (s)", ".0f"),
            "cpu_ms_per_unknown": ("CPU per unknown (ms)", ".2f"),
            "memory_kB_per_unknown": ("peak memory per unknown (kB)", ".1f"),
        },
    )


def stalks() -> str:
    """Return the section on the cost of discoveries, measured and predicted for more cores."""
    record = read("stalks")
    if not record:
        return ""
    sent = record.pop("transport_s")
    rows = [
        [
            label.replace(",", " |"),
            f"{row['curves']:,}",
            f"{row['computed']:,}",
            f"{row['wall_s'] / 60:.1f}",
            *(f"{predicted_s(row, n, sent['Dask']) / 60:.1f}" for n in (1, 16, 256)),
        ]
        for label, row in record.items()
    ]
    head = ["stalks", "suspects", "curves asked for", "simulated", "2 cores (min)"]
    tasks = table([*head, "1 core", "16", "256"], [row[0].split(" | ") + row[1:] for row in rows])
    return f"""## Many stalks

One `discover`, of stalks like the published ones with a compliant machine, without kept simulations
(`benchmarks/stalks.py`). Times are measured on two cores. For other numbers of cores, the measured
simulations are redistributed, round by round, and all other work is assumed to take the measured
time. A task costs \
{1e3 * sent["processes"]:.1f} ms besides its work on processes of one machine, \
{1e3 * sent["Dask"]:.1f} ms by Dask on two workers.

{tasks}
![Wall time and simulations over the number of stalks](stalks.png)

"""


def scaling() -> str:
    """Return the sections on many runs, derivatives, two ranks and large models."""
    ranks, sweep = read("ranks"), read("throughput")
    return f"""## Many runs

{sweep["runs"]} stalks of different geometry and moduli on the screening recipe, on \
{sweep["workers"]} processes: {sweep["runs_per_minute"]:.0f} per minute, \
{sweep["median_cpu_s"]:.1f} s each (`benchmarks/throughput.py`).
Constants and coordinates are data to the compiled forms; nothing is compiled twice.

{stalks()}## Derivatives of the force curve

With respect to eight parameters, of geometry, moduli, large strain, radius and friction, with
`sensitivities` (`benchmarks/signatures.py`). Central differences would cost sixteen runs.

{derivatives()}
## Two ranks

The fine recipe takes {ranks["one_rank_s"]:.0f} s on one rank and {ranks["two_ranks_s"]:.0f} s on \
two, wall time: {ranks["speedup"]:.2f} times faster, and the maximum forces agree to \
{ranks["force_difference"]:.0e} (`benchmarks/ranks.py`).

## Large models

The first millimetre of travel, friction on, first-order meshes, GMRES with algebraic multigrid
(`benchmarks/growth.py`). `linear_solver = "auto"` takes it beyond {DIRECT_UNKNOWNS:,} unknowns.

{growth()}
![Time and memory per unknown](growth.png)
"""


def main() -> None:
    """Write the page and its figure."""
    front(read("convergence"), read("felupe_front")).savefig(DOCS / "performance.png", dpi=200)
    (DOCS / "performance.md").write_text(comparison() + scaling())


if __name__ == "__main__":
    main()
