"""Eight stalks with hidden damage of their fibres: what a model without it leaves, and with it."""

import tempfile
from pathlib import Path

import ramiefenics as rf
from ramiefenics.discovery.synthetic import Secret, make_dataset

folder = Path(tempfile.mkdtemp()) / "stalks"
secret = Secret(rf.EFFECTS["fibre_damage"], 0.5)
make_dataset(folder, secret, seed=7, runs=rf.Runs(), mesh=rf.mesh_recipe("screening"))
names = (
    "pith_core",
    "machine_compliance",
    "seating_gap",
    "taper",
    "fibre_damage",
    "stiffness_gradient",
)
found = rf.discover(folder, {name: rf.EFFECTS[name] for name in names})
print(found)
figure = found.plot("residual")
