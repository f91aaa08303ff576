"""Fast integrals over cells and facets, by C code that is generated from UFL expressions.

From the expression to the program: `lowering` expands the tensors of UFL into scalar operations,
whose graph `scalars` stores and differentiates. `material` takes energy, stress, tangent and
internal variables from it, and `source` writes them as C functions that treat all quadrature points
of a cell. `element.c` calls these functions for every cell and sums up forces and stiffness, which
`scatter.c` adds to a matrix. `library` compiles the program once, `element` calls it, and `term`
makes it a term of the equations. `facet` and `facet.c` do the same for a traction on the surface,
that of contact. `assembled` is what the two have in common.
"""
