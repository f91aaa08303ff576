"""Fast integrals over cells and facets, in C that is generated from statements in UFL.

From the statement to the program: `lowering` takes the tensors of UFL apart into numbers, a graph
of which `scalars` holds and differentiates; `material` asks it for energy, stress, tangent and the
internal variables, and `source` writes them as C functions of all quadrature points of a cell.
`element.c` calls these for every cell and sums up forces and stiffness, which `scatter.c` adds to a
matrix; `library` compiles it once, `element` calls it, and `term` brings it into the equations.
`facet` and `facet.c` do the same for a traction on the surface, that of contact; `assembled` is
what the two have in common.
"""
