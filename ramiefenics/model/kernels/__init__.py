"""Fast integrals over a solid's cells, in C that is generated from the law's statement in UFL.

From the statement to the program: `lowering` takes the tensors of UFL apart into numbers, a graph
of which `scalars` holds and differentiates; `material` asks it for energy, stress, tangent and the
internal variables, and `source` writes them as C functions of all quadrature points of a cell.
`element.c` calls these for every cell and sums up forces and stiffness; `library` compiles it once,
`element` calls it, and `term` brings it into the equations.
"""
