/* Forces, stiffness and energy of hexahedra, cell by cell; the material's own functions come before,
   and `scatter.c` behind.

   Arrays by quadrature point have PADDED_POINTS numbers, those behind the last point of weight zero;
   arrays by node PADDED_NODES, those behind the last node zero. Both are whole multiples of WIDTH,
   the numbers that a processor handles at once. */

typedef double vec __attribute__((vector_size(8 * WIDTH), aligned(8), may_alias));
#define POINT_VECTORS (PADDED_POINTS / WIDTH)
#define NODE_VECTORS (PADDED_NODES / WIDTH)
#define ROWS 4 /* of a block of stiffness that is held in registers */

/* Deformation gradient: 9 x PADDED_POINTS. */
static void gradient(const struct cells *all, int64_t cell, const double *u, double *F)
{
  const int32_t *nodes = all->nodes + cell * NODES;
  const double *inverse = all->inverse + cell * 9 * PADDED_POINTS;
  double H[9 * PADDED_POINTS];
  for (int k = 0; k < 3; ++k) {
    vec sum[3][POINT_VECTORS] = {0};
    for (int a = 0; a < NODES; ++a) {
      const double *ua = u + 3 * (int64_t)nodes[a];
      const vec *slope = (const vec *)(all->by_point + (k * NODES + a) * PADDED_POINTS);
      for (int i = 0; i < 3; ++i)
        for (int q = 0; q < POINT_VECTORS; ++q)
          sum[i][q] += ua[i] * slope[q];
    }
    for (int i = 0; i < 3; ++i)
      for (int q = 0; q < POINT_VECTORS; ++q)
        ((vec *)(H + (3 * i + k) * PADDED_POINTS))[q] = sum[i][q];
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int q = 0; q < PADDED_POINTS; ++q) {
        double sum = i == j;
        for (int k = 0; k < 3; ++k)
          sum += H[(3 * i + k) * PADDED_POINTS + q] * inverse[(3 * k + j) * PADDED_POINTS + q];
        F[(3 * i + j) * PADDED_POINTS + q] = sum;
      }
}

/* What a cell's points remember: REMEMBERED x PADDED_POINTS. */
static void recall(const struct cells *all, int64_t cell, double *last)
{
  for (int q = 0; q < PADDED_POINTS; ++q) {
    const int64_t place = all->places[cell * POINTS + (q < POINTS ? q : 0)];
    for (int m = 0; m < REMEMBERED; ++m)
      last[m * PADDED_POINTS + q] = all->memory[place * REMEMBERED + m];
  }
}

#define STATE                                                                                      \
  double F[9 * PADDED_POINTS], last[REMEMBERED * PADDED_POINTS + 1];                               \
  const double *p = all->parameters + cell * PARAMETERS;                                           \
  gradient(all, cell, u, F);                                                                       \
  if (REMEMBERED)                                                                                  \
    recall(all, cell, last);

/* Adds the forces of all cells. */
void add_forces(const struct cells *all, const double *u, double duration, double *forces)
{
  for (int64_t cell = 0; cell < all->count; ++cell) {
    STATE
    double P[9 * PADDED_POINTS], R[9 * PADDED_POINTS];
    law_stress(F, p, last, duration, P);
    const double *inverse = all->inverse + cell * 9 * PADDED_POINTS;
    const double *weight = all->weight + cell * PADDED_POINTS;
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k)
        for (int q = 0; q < PADDED_POINTS; ++q) {
          double sum = 0;
          for (int j = 0; j < 3; ++j)
            sum += P[(3 * i + j) * PADDED_POINTS + q] * inverse[(3 * k + j) * PADDED_POINTS + q];
          R[(3 * i + k) * PADDED_POINTS + q] = weight[q] * sum;
        }
    vec sum[3][NODE_VECTORS] = {0};
    for (int k = 0; k < 3; ++k)
      for (int q = 0; q < POINTS; ++q) {
        const vec *slope = (const vec *)(all->by_node + (k * POINTS + q) * PADDED_NODES);
        for (int i = 0; i < 3; ++i)
          for (int a = 0; a < NODE_VECTORS; ++a)
            sum[i][a] += R[(3 * i + k) * PADDED_POINTS + q] * slope[a];
      }
    const int32_t *nodes = all->nodes + cell * NODES;
    for (int a = 0; a < NODES; ++a)
      for (int i = 0; i < 3; ++i)
        forces[3 * (int64_t)nodes[a] + i] += ((const double *)sum[i])[a];
  }
}

/* Adds B^T A B for one pair of components; D is 9 entries of A at every point, by k and l. */
static void add_products(const struct cells *all, const double *D, double *stiffness)
{
  double S[3 * POINTS * PADDED_NODES];
  for (int k = 0; k < 3; ++k)
    for (int q = 0; q < POINTS; ++q) {
      vec *row = (vec *)(S + (k * POINTS + q) * PADDED_NODES);
      for (int b = 0; b < NODE_VECTORS; ++b) {
        vec sum = {0};
        for (int l = 0; l < 3; ++l)
          sum += D[(3 * k + l) * PADDED_POINTS + q] *
                 ((const vec *)(all->by_node + (l * POINTS + q) * PADDED_NODES))[b];
        row[b] = sum;
      }
    }
  for (int a = 0; a < PADDED_NODES; a += ROWS) {
    vec sum[ROWS][NODE_VECTORS] = {0};
    for (int kq = 0; kq < 3 * POINTS; ++kq) {
      const double *slope = all->by_node + kq * PADDED_NODES + a;
      const vec *row = (const vec *)(S + kq * PADDED_NODES);
      for (int r = 0; r < ROWS; ++r)
        for (int b = 0; b < NODE_VECTORS; ++b)
          sum[r][b] += slope[r] * row[b];
    }
    for (int r = 0; r < ROWS; ++r)
      for (int b = 0; b < NODE_VECTORS; ++b)
        ((vec *)(stiffness + (a + r) * PADDED_NODES))[b] = sum[r][b];
  }
}

/* Finds the stiffness of a cell by component, component, node and node; returns 1, as there is one. */
static int cell_stiffness(const struct cells *all, int64_t cell, const double *u, double duration,
                          double *stiffness)
{
  STATE
  double A[81 * PADDED_POINTS], half[9 * PADDED_POINTS], D[9 * PADDED_POINTS];
  law_tangent(F, p, last, duration, A);
  const double *inverse = all->inverse + cell * 9 * PADDED_POINTS;
  const double *weight = all->weight + cell * PADDED_POINTS;
  for (int i = 0; i < 3; ++i)
    for (int j = SYMMETRIC ? i : 0; j < 3; ++j) {
      for (int m = 0; m < 3; ++m)
        for (int l = 0; l < 3; ++l)
          for (int q = 0; q < PADDED_POINTS; ++q) {
            double sum = 0;
            for (int n = 0; n < 3; ++n)
              sum += A[(27 * i + 9 * m + 3 * j + n) * PADDED_POINTS + q] *
                     inverse[(3 * l + n) * PADDED_POINTS + q];
            half[(3 * m + l) * PADDED_POINTS + q] = weight[q] * sum;
          }
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l)
          for (int q = 0; q < PADDED_POINTS; ++q) {
            double sum = 0;
            for (int m = 0; m < 3; ++m)
              sum += inverse[(3 * k + m) * PADDED_POINTS + q] * half[(3 * m + l) * PADDED_POINTS + q];
            D[(3 * k + l) * PADDED_POINTS + q] = sum;
          }
      double *block = stiffness + (3 * i + j) * PADDED_NODES * PADDED_NODES;
      add_products(all, D, block);
      if (SYMMETRIC && j > i) {
        double *other = stiffness + (3 * j + i) * PADDED_NODES * PADDED_NODES;
        for (int a = 0; a < NODES; ++a)
          for (int b = 0; b < NODES; ++b)
            other[b * PADDED_NODES + a] = block[a * PADDED_NODES + b];
      }
    }
  return 1;
}

/* Sums up energies: stored, and dissipated so far. */
void sum_energies(const struct cells *all, const double *u, double duration, double *sums)
{
  for (int64_t cell = 0; cell < all->count; ++cell) {
    STATE
    double W[2 * PADDED_POINTS];
    law_energies(F, p, last, duration, W);
    const double *weight = all->weight + cell * PADDED_POINTS;
    for (int which = 0; which < 2; ++which)
      for (int q = 0; q < POINTS; ++q)
        sums[which] += weight[q] * W[which * PADDED_POINTS + q];
  }
}

/* Returns what is remembered at the end of the step, in the order of what was before. */
void update(const struct cells *all, const double *u, double duration, double *memory)
{
  for (int64_t cell = 0; cell < all->count; ++cell) {
    STATE
    double now[(REMEMBERED ? REMEMBERED : 1) * PADDED_POINTS];
    law_update(F, p, last, duration, now);
    for (int q = 0; q < POINTS; ++q)
      for (int m = 0; m < REMEMBERED; ++m)
        memory[(int64_t)all->places[cell * POINTS + q] * REMEMBERED + m] = now[m * PADDED_POINTS + q];
  }
}

/* Returns deformation gradients by cell, point and component. */
void list_gradients(const struct cells *all, const double *u, double *gradients)
{
  double F[9 * PADDED_POINTS];
  for (int64_t cell = 0; cell < all->count; ++cell) {
    gradient(all, cell, u, F);
    for (int q = 0; q < POINTS; ++q)
      for (int c = 0; c < 9; ++c)
        *gradients++ = F[c * PADDED_POINTS + q];
  }
}

/* Returns tangents, by cell, point and component. */
void list_tangents(const struct cells *all, const double *u, double duration, double *tangents)
{
  for (int64_t cell = 0; cell < all->count; ++cell) {
    STATE
    double A[81 * PADDED_POINTS];
    law_tangent(F, p, last, duration, A);
    for (int q = 0; q < POINTS; ++q)
      for (int c = 0; c < 81; ++c)
        *tangents++ = A[c * PADDED_POINTS + q];
  }
}
