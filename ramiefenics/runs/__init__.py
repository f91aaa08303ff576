"""Many simulations: tasks on any executor, with results in a content-addressed store."""

from ramiefenics.runs.executor import Done, Runs, Task, lasting
from ramiefenics.runs.simulation import KeptRun, SharedRuns, Simulation
from ramiefenics.runs.store import Store, key_of
from ramiefenics.runs.workers import dask_workers, mpi_ranks, workers

__all__ = [
    "Done",
    "KeptRun",
    "Runs",
    "SharedRuns",
    "Simulation",
    "Store",
    "Task",
    "dask_workers",
    "key_of",
    "lasting",
    "mpi_ranks",
    "workers",
]
