"""The same bend with inertia, by central differences: forces and energies."""

import ramiefenics as rf

found = rf.simulate_explicitly("table3", travel_mm=2)
figure = found.plot()
