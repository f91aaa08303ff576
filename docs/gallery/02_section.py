"""The section under the indenter flattens: axial stress in both layers."""

import ramiefenics as rf

figure = rf.simulate("table3").plot("section")
