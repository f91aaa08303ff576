"""The published study: twenty simulations by design, and a response surface."""

import ramiefenics as rf

found = rf.calibrate("table4")
print(found)
figure = found.plot("contours_max_force_N")
