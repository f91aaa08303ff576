"""The whole stalk between its cylinders; `animate` makes a film of it."""

import ramiefenics as rf

result = rf.simulate("table3")
figure = result.plot("deformed")
# result.animate("bend.gif")
