"""The radius of the indenter, varied on all cores; what has been simulated is kept."""

import ramiefenics as rf

swept = rf.sweep("table3", {"fixture.indenter_radius_mm": [2.5, 5.0, 10.0, 20.0]})
print(swept)
figure = swept.plot("curves")
