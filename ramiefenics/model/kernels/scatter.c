/* Stiffness of cells, or of facets, each with all nodes of its cell, in a matrix. What it is comes
   before: `cell_stiffness` finds it, by component, component, node and node, or returns 0 for none. */

#define ENTRIES (9 * PADDED_NODES * PADDED_NODES)

/* The same, but nothing for components that are held. */
static int free_stiffness(const struct cells *all, int64_t cell, const double *u, double duration,
                          const uint8_t *held, double *stiffness)
{
  if (!cell_stiffness(all, cell, u, duration, stiffness))
    return 0;
  const int32_t *nodes = all->nodes + cell * NODES;
  for (int a = 0; a < NODES; ++a)
    for (int i = 0; i < 3; ++i)
      if (held[3 * (int64_t)nodes[a] + i])
        for (int j = 0; j < 3; ++j)
          for (int b = 0; b < NODES; ++b) {
            stiffness[((3 * i + j) * PADDED_NODES + a) * PADDED_NODES + b] = 0;
            stiffness[((3 * j + i) * PADDED_NODES + b) * PADDED_NODES + a] = 0;
          }
  return 1;
}

/* Finds where in the rows of a matrix of nodes, whose columns are sorted, the nodes of each cell are. */
void find_offsets(const struct cells *all, const int32_t *starts, const int32_t *columns,
                  int32_t *offsets)
{
  for (int64_t cell = 0; cell < all->count; ++cell)
    for (int a = 0; a < NODES; ++a)
      for (int b = 0; b < NODES; ++b) {
        const int32_t *nodes = all->nodes + cell * NODES;
        int32_t low = starts[nodes[a]], high = starts[nodes[a] + 1];
        while (high - low > 1) {
          const int32_t middle = low + (high - low) / 2;
          if (columns[middle] <= nodes[b])
            low = middle;
          else
            high = middle;
        }
        *offsets++ = low - starts[nodes[a]];
      }
}

/* Adds the stiffness of all cells to the values of a matrix with compressed rows, `starts` being
   those of the rows, and `offsets` where in the rows the nodes are. */
void add_stiffness(const struct cells *all, const double *u, double duration, const uint8_t *held,
                   const int32_t *starts, const int32_t *offsets, double *values)
{
  double stiffness[ENTRIES];
  for (int64_t cell = 0; cell < all->count; ++cell) {
    if (!free_stiffness(all, cell, u, duration, held, stiffness))
      continue;
    const int32_t *nodes = all->nodes + cell * NODES;
    for (int a = 0; a < NODES; ++a)
      for (int i = 0; i < 3; ++i) {
        double *row = values + starts[3 * (int64_t)nodes[a] + i];
        const int32_t *columns = offsets + (cell * NODES + a) * NODES;
        for (int b = 0; b < NODES; ++b)
          for (int j = 0; j < 3; ++j)
            row[3 * columns[b] + j] += stiffness[((3 * i + j) * PADDED_NODES + a) * PADDED_NODES + b];
      }
  }
}

/* Returns the stiffness of some cells, by cell, node, component, node and component. */
void list_stiffness(const struct cells *all, const double *u, double duration, const uint8_t *held,
                    int64_t first, int64_t behind, double *matrices)
{
  double stiffness[ENTRIES];
  for (int64_t cell = first; cell < behind; ++cell) {
    const int any = free_stiffness(all, cell, u, duration, held, stiffness);
    for (int a = 0; a < NODES; ++a)
      for (int i = 0; i < 3; ++i)
        for (int b = 0; b < NODES; ++b)
          for (int j = 0; j < 3; ++j)
            *matrices++ = any ? stiffness[((3 * i + j) * PADDED_NODES + a) * PADDED_NODES + b] : 0;
  }
}
