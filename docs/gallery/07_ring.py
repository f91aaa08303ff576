"""A ring cut from the stalk is crushed between plates."""

import ramiefenics as rf

plates = {"span_mm": 0, "indenter_radius_mm": "inf", "support_radius_mm": "inf"}
result = rf.simulate("table3", fixture=plates, length_mm=20, travel_mm=4)
figure = result.plot("section")
