"""The force curve on three meshes of second order, each finer than the one before."""

import ramiefenics as rf

found = rf.converge("table3", order=2, meshes=3)
print(found)
figure = found.plot()
