"""Behaviour on bad input, damaged files, killed commands and extreme specifications.

    ./run python benchmarks/reliability.py [inputs flips kills extremes ranks memory]

All parts take an hour on two cores. Records each part in `records/reliability.json`, and writes
`docs/reliability.md`. Bad inputs are made by `benchmarks/attacks.py`.
"""

from __future__ import annotations

import argparse
import resource
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from attacks import attack, set_a_key, targets
from killing import coarse, desk, kills
from mpi4py import MPI
from record import DOCS, read_record, table, write_record

import ramiefenics as rf
from ramiefenics.model.jit import CACHE
from ramiefenics.model.kernels.library import FOLDER
from ramiefenics.model.seal import is_sound, seal
from ramiefenics.runs import Simulation, Store, resumed
from ramiefenics.runs.executor import compute
from ramiefenics.specification.files import dump_test

SEED, INPUTS, FLIPS, RUNS = 20260, 5000, 1000, 500
SLOW_S = 10.0

EXTREMES = """
stalk.void_diameter_mm=1e-6; stalk.void_diameter_mm=12.8; stalk.void_diameter_mm=0
stalk.layers.phloem.outer_diameter_mm=12.89000001; stalk.layers.phloem.outer_diameter_mm=12.93
stalk.layers.phloem.outer_diameter_mm=90; stalk.length_mm=101; stalk.length_mm=1e4
stalk.layers.phloem.material.large_strain.fibre_damage=0.99
stalk.layers.phloem.material.elastic.nu_XY=-0.95; stalk.layers.phloem.material.elastic.nu_XY=0.99
stalk.layers.xylem.material.elastic.nu_XY=0.9; stalk.layers.phloem.material.elastic.nu_XZ=0.02
stalk.layers.phloem.material.elastic.E_Z_MPa=1e9
stalk.layers.phloem.material.elastic.E_Z_MPa=1e-6
stalk.layers.phloem.material.elastic.E_X_MPa=1e-6; stalk.layers.xylem.material.elastic.E_X_MPa=300
stalk.layers.phloem.material.elastic.G_XZ_MPa=1e-6
stalk.layers.phloem.material.elastic.G_XZ_MPa=1e6
fixture.friction.static=1e6; fixture.friction.dynamic=0; fixture.friction.static=0.12
fixture.indenter_radius_mm=1e-3; fixture.indenter_radius_mm=1e6; fixture.indenter_radius_mm=inf
fixture.support_radius_mm=0.05; fixture.support_radius_mm=40; fixture.span_mm=16
fixture.span_mm=1e5; fixture.span_mm=0; fixture.inner_span_mm=99; fixture.indenter_offset_mm=49
protocol.travel_mm=1e-9; protocol.travel_mm=40; protocol.travel_mm=99; protocol.save_every_mm=3e-3
numerics.stepping.max_step_mm=40; numerics.stepping.relative_tolerance=1e-15
numerics.stepping.relative_tolerance=0.5; numerics.stepping.max_iterations=1
numerics.mesh.contact_size=0.5; numerics.mesh.contact_size=1e-4; numerics.mesh.angular_elements=2
numerics.mesh.angular_elements=90; numerics.domain=full; stalk.rotation_deg=45
stalk.section_height_mm=8; stalk.section_height_mm=30; stalk.void_offset_mm=2.7; stalk.taper=0.03
stalk.curvature_per_m=5; stalk.node_thickness_mm=20; law=neo_hookean; law=crushing
law=fibre_plasticity; law=viscoelasticity; machine.compliance_mm_per_N=10
"""


SAVED = """
import sys
import numpy as np
from mpi4py import MPI
from ramiefenics import simulate
force = simulate("stalk.toml", comm=MPI.COMM_WORLD).curve["force_N"].to_numpy()
if MPI.COMM_WORLD.rank == 0:
    np.save(sys.argv[1], force)
"""
"""Program that saves the forces with all digits; the tables of a result have eight."""


def inputs() -> dict[str, Any]:
    """Give bad input to everything that reads files, and count the outcomes."""
    warnings.simplefilter("ignore")
    attacked, test = targets(), rf.ramie(14.2, 7.3, 0.67)
    rows: dict[str, Counter[str]] = {}
    faults: list[str] = []
    with tempfile.TemporaryDirectory() as name:
        for number in range(INPUTS):
            kind = [*attacked, "one key"][number % (len(attacked) + 1)]
            rng = np.random.default_rng([SEED, number])

            def run(kind: str = kind, rng: np.random.Generator = rng) -> str:
                if kind == "one key":
                    return set_a_key(test, rng)
                return attack(attacked[kind], Path(name) / "in", rng)

            outcome, why = judged(run)
            rows.setdefault(kind, Counter())[outcome] += 1
            if outcome not in ("refused", "taken"):
                faults.append(f"{number}, {kind}: {outcome}, {why}"[:400])
                print(faults[-1], flush=True)
    return {"kinds": rows, "faults": faults}


def judged(run: Callable[[], str]) -> tuple[str, str]:
    """Return how reading an input ended, and why."""

    def late(*_: object) -> None:
        raise TimeoutError

    signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, SLOW_S)
    try:
        nonsense = run()
        return ("nonsense", nonsense) if nonsense else ("taken", "")
    except rf.SpecificationError as error:
        sentence = str(error)
        readable = "\n" not in sentence.strip() and len(sentence) < 2000
        return ("refused", "") if readable else ("no sentence", sentence)
    except TimeoutError:
        return "slow", ""
    except Exception as error:
        return "traceback", f"{type(error).__name__}: {error}"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def flips() -> dict[str, Any]:
    """Flip bits of kept files, and count how often a damaged file is used as if it were sound."""
    warnings.simplefilter("ignore")
    rng = np.random.default_rng(SEED)
    used = {"finished runs": 0, "bends in progress": 0, "compiled code": 0}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "runs"
        task = Simulation(coarse())
        text = compute(task, folder)
        (path,) = folder.iterdir()
        content = path.read_bytes()
        for _ in range(FLIPS):
            path.write_bytes(flipped(content, rng))
            found = Store(folder).get(task.keys()[0])
            used["finished runs"] += found not in (None, text)
        resumed.BENDS = Path(name) / "bends"
        test = coarse(**{"protocol.travel_mm": 0.5})

        def bend() -> pd.DataFrame:
            with resumed.solutions_of(test, MPI.COMM_SELF) as solutions:
                return rf.simulate(test, comm=MPI.COMM_SELF, solutions=solutions).curve

        curve = bend()
        (path,) = resumed.BENDS.iterdir()
        content = path.read_bytes()
        for _ in range(FLIPS):
            path.write_bytes(flipped(content, rng))
            used["bends in progress"] += not bend().equals(curve)
        for path in compiled():
            content = path.read_bytes()
            copy = Path(name) / path.name
            copy.write_bytes(content)
            seal(copy)
            for _ in range(FLIPS // 2):
                copy.write_bytes(flipped(content, rng))
                used["compiled code"] += is_sound(copy)
    return {"flips": FLIPS, "used": used}


def compiled() -> list[Path]:
    """Return the paths of one compiled form and one kernel."""
    return [next(CACHE.glob("*/*.so")), next(FOLDER.glob("*.so"))]


def flipped(content: bytes, rng: np.random.Generator) -> bytes:
    """Return a file with one bit changed."""
    at, bit = int(rng.integers(len(content))), int(rng.integers(8))
    return content[:at] + bytes([content[at] ^ (1 << bit)]) + content[at + 1 :]


def extremes() -> dict[str, Any]:
    """Bend stalks of extreme specifications, and return how each run ends."""
    rows = []
    for change in [part.strip() for part in EXTREMES.replace("\n", ";").split(";") if part.strip()]:
        with tempfile.TemporaryDirectory() as name:
            (Path(name) / "base.toml").write_text(dump_test(coarse()))
            command = [sys.executable, "-m", "ramiefenics", "bend", "base.toml", "--quiet"]
            start = time.perf_counter()
            try:
                done = subprocess.run(
                    [*command, "--set", change], cwd=name, capture_output=True, text=True,
                    timeout=300, check=False,
                )  # fmt: skip
            except subprocess.TimeoutExpired:
                rows.append({"change": change, "status": "hangs", "told": "", "wall_s": 300.0})
                continue
            crashed = done.returncode not in (0, 1, 2) or "Traceback" in done.stderr
            told = [line for line in done.stderr.splitlines() if line.startswith("ramiefenics:")]
            status = "crash" if crashed else ("completed", "ended", "refused")[done.returncode]
            if status == "ended" and not told:
                status = "no reason"
            wall = time.perf_counter() - start
            rows.append(
                {"change": change, "status": status, "told": " ".join(told), "wall_s": wall}
            )
            print(rows[-1], flush=True)
    return {"rows": rows}


def ranks() -> dict[str, float]:
    """Return the largest difference of the force on several ranks from that on one, by number."""
    with desk() as (place, environment):
        rf.write_test(
            coarse(**{"numerics.stepping.relative_tolerance": 1e-9}), place / "stalk.toml"
        )
        forces = {}
        for number in (1, 2, 3, 4):
            start = ["mpirun", "--oversubscribe", "-n", str(number)] if number > 1 else []
            command = [*start, sys.executable, "-c", SAVED, f"{number}.npy"]
            subprocess.run(command, cwd=place, env=environment, check=True, capture_output=True)
            forces[number] = np.load(place / f"{number}.npy")
    peak = forces[1].max()
    return {str(n): float(np.abs(force - forces[1]).max() / peak) for n, force in forces.items()}


def memory() -> dict[str, float]:
    """Simulate many stalks in one process, and return its peak memory early and at the end, MB."""
    warnings.simplefilter("ignore")
    rng, used = np.random.default_rng(SEED), {}
    for number in range(1, RUNS + 1):
        void = float(rng.uniform(6.8, 7.8))
        changes = {"stalk.void_diameter_mm": void, "protocol.travel_mm": 0.5}
        rf.simulate(coarse(**changes), comm=MPI.COMM_SELF)
        if number in (RUNS // 5, RUNS):
            used[f"after {number}"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    return used


PARTS = {
    "inputs": inputs,
    "flips": flips,
    "kills": kills,
    "extremes": extremes,
    "ranks": ranks,
    "memory": memory,
}


def page(record: dict[str, Any]) -> str:
    """Return the page, in Markdown."""
    kinds = record["inputs"]["kinds"]
    outcomes = ("refused", "taken", "nonsense", "traceback", "slow", "no sentence")
    counted = [[kind, *(str(row.get(name, 0)) for name in outcomes)] for kind, row in kinds.items()]
    flipped_rows = [
        [kind, str(record["flips"]["flips"]), str(number)]
        for kind, number in record["flips"]["used"].items()
    ]
    killed = [
        [name, *(str(row[key]) for key in ("kills", "different", "half written"))]
        for name, row in record["kills"].items()
    ]
    ended = [
        [f"`{row['change']}`", row["status"], row["told"].removeprefix("ramiefenics: ")]
        for row in record["extremes"]["rows"]
    ]
    apart = [[number, f"{value:.0e}"] for number, value in record["ranks"].items() if number != "1"]
    (early, before), (late, after) = record["memory"].items()
    return "\n".join(
        [
            "# Reliability",
            "",
            "Made by `./run python benchmarks/reliability.py`.",
            "",
            "## Bad inputs",
            "",
            f"{INPUTS:,} files that a user could have written, each corrupted at random (bytes and",
            "lines changed, numbers replaced by absurd ones or by text), and keys set to random",
            "values (`benchmarks/attacks.py`). An input is either refused in one sentence or",
            "accepted. Accepted ones are checked by independent criteria: diameters in order,",
            "elastic constants that are stable, records that are finite and long enough. Nonsense",
            f"means that an accepted input fails them, slow that reading took over {SLOW_S:.0f} s.",
            "",
            table(["read", *outcomes], counted),
            "## Kept files",
            "",
            "One bit changed at random. Used means that a wrong result was given, or that code",
            "with a changed bit was run (half of these in a form, half in a kernel).",
            "",
            table(["kept", "bits changed", "used"], flipped_rows),
            "## Killed",
            "",
            "Commands killed by SIGKILL at random moments and then run again to the end: how many",
            "tables differ from those of an undisturbed run, and how often the folder held neither",
            "the old result nor the new one. Full disks and two commands on the same folder are",
            "covered by `tests/test_store.py` and `tests/test_draft.py`.",
            "",
            table(["command", "kills", "different tables", "half-written folders"], killed),
            "## Extreme specifications",
            "",
            "The calibration stalk on a coarse mesh to 3 mm, with one value changed.",
            "",
            table(["changed", "status", "message"], ended),
            "## Ranks and memory",
            "",
            "Largest difference between the forces on several ranks and on one, over the peak",
            "force, with a tolerance of 1e-9:",
            "",
            table(["ranks", "difference"], apart),
            f"{RUNS} simulations of different stalks in one process: {before:.0f} MB {early},",
            f"{after:.0f} MB {late} ({100.0 * (after / before - 1.0):+.1f} %).",
            "",
        ]
    )


def main() -> None:
    """Run the parts that are asked for, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []])
    record = read_record("reliability")
    for name in parser.parse_args().parts or PARTS:
        print(f"== {name}", flush=True)
        record[name] = PARTS[name]()
        write_record("reliability", record)
    if set(PARTS) <= set(record):
        (DOCS / "reliability.md").write_text(page(record))


if __name__ == "__main__":
    main()
