"""Four-point bending: two indenters, 40 mm apart."""

import ramiefenics as rf

result = rf.simulate("table3", inner_span_mm=40, travel_mm=8)
figure = result.plot("deformed")
