"""A stalk is bent; its force has a maximum."""

import ramiefenics as rf

result = rf.simulate("table3")
print(result)
figure = result.plot()
