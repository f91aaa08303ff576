"""The published study: twenty simulations by design, a response surface, its optimum."""

import ramiefenics as rf

found = rf.calibrate("table4")
print(found)
figure = found.plot("optimum")
