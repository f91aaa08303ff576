"""The curve on a ladder of meshes, and the limit of vanishing cells."""

import ramiefenics as rf

found = rf.converge("table3", order=2, meshes=3)
print(found)
figure = found.plot()
