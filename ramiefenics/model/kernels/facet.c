/* Forces and stiffness of a traction on facets of hexahedra; the traction's own functions come before,
   and `scatter.c` behind.

   All numbers at a facet's quadrature points are in one array, `at`, PADDED_POINTS of each: X, N, the
   displacement, its gradient, and what else the traction depends on, the fields. Those behind the
   last point repeat it, with weight zero. */

#include <string.h>

#define DISPLACEMENT (at + 6 * PADDED_POINTS)
#define GRADIENT (at + 9 * PADDED_POINTS)

/* Evaluates some of the fields at the points of a facet. */
static void evaluate_fields(const struct cells *all, int64_t facet, int first, int behind, double *at)
{
  for (const struct field *field = all->fields + first; field < all->fields + behind; ++field) {
    const int32_t *nodes = field->nodes + facet * field->count;
    const double *shapes = field->shapes + all->faces[facet] * field->count * PADDED_POINTS;
    for (int c = 0; c < field->components; ++c) {
      double *values = at + (field->place + c) * PADDED_POINTS;
      memset(values, 0, PADDED_POINTS * sizeof(double));
      for (int a = 0; a < field->count; ++a) {
        const double value = field->values[(int64_t)nodes[a] * field->components + c];
        for (int q = 0; q < PADDED_POINTS; ++q)
          values[q] += value * shapes[a * PADDED_POINTS + q];
      }
    }
  }
}

/* Evaluates what tells whether there is a traction on a facet, and returns that. */
static int touches(const struct cells *all, int64_t facet, const double *u, double duration, double *at)
{
  const int32_t *nodes = all->nodes + facet * NODES;
  const double *shapes = all->shapes + all->faces[facet] * NODES * PADDED_POINTS;
  memcpy(at, all->geometry + facet * 6 * PADDED_POINTS, 6 * PADDED_POINTS * sizeof(double));
  memset(DISPLACEMENT, 0, 3 * PADDED_POINTS * sizeof(double));
  for (int a = 0; a < NODES; ++a)
    for (int i = 0; i < 3; ++i)
      for (int q = 0; q < PADDED_POINTS; ++q)
        DISPLACEMENT[i * PADDED_POINTS + q] +=
          u[3 * (int64_t)nodes[a] + i] * shapes[a * PADDED_POINTS + q];
  evaluate_fields(all, facet, 0, FIRST_FIELDS, at);
  double apart[PADDED_POINTS];
  traction_apart(at, all->constants, duration, apart);
  for (int q = 0; q < POINTS; ++q)
    if (apart[q] < 0)
      return 1;
  return 0;
}

/* Evaluates the rest. */
static void evaluate(const struct cells *all, int64_t facet, const double *u, double *at)
{
  const int32_t *nodes = all->nodes + facet * NODES;
  const double *slopes = all->slopes + all->faces[facet] * 3 * NODES * PADDED_POINTS;
  const double *inverse = all->inverse + facet * 9 * PADDED_POINTS;
  double H[9 * PADDED_POINTS] = {0};
  for (int k = 0; k < 3; ++k)
    for (int a = 0; a < NODES; ++a)
      for (int i = 0; i < 3; ++i)
        for (int q = 0; q < PADDED_POINTS; ++q)
          H[(3 * i + k) * PADDED_POINTS + q] +=
            u[3 * (int64_t)nodes[a] + i] * slopes[(k * NODES + a) * PADDED_POINTS + q];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int q = 0; q < PADDED_POINTS; ++q) {
        double sum = 0;
        for (int k = 0; k < 3; ++k)
          sum += H[(3 * i + k) * PADDED_POINTS + q] * inverse[(3 * k + j) * PADDED_POINTS + q];
        GRADIENT[(3 * i + j) * PADDED_POINTS + q] = sum;
      }
  evaluate_fields(all, facet, FIRST_FIELDS, FIELDS, at);
}

/* Adds the forces that hold the tractions. */
void add_forces(const struct cells *all, const double *u, double duration, double *forces)
{
  double at[GIVEN * PADDED_POINTS], traction[3 * PADDED_POINTS];
  for (int64_t facet = 0; facet < all->count; ++facet) {
    if (!touches(all, facet, u, duration, at))
      continue;
    evaluate(all, facet, u, at);
    traction_value(at, all->constants, duration, traction);
    const int32_t *nodes = all->nodes + facet * NODES;
    const double *shapes = all->shapes + all->faces[facet] * NODES * PADDED_POINTS;
    const double *weight = all->weight + facet * PADDED_POINTS;
    for (int a = 0; a < NODES; ++a)
      for (int i = 0; i < 3; ++i) {
        double sum = 0;
        for (int q = 0; q < PADDED_POINTS; ++q)
          sum += weight[q] * traction[i * PADDED_POINTS + q] * shapes[a * PADDED_POINTS + q];
        forces[3 * (int64_t)nodes[a] + i] -= sum;
      }
  }
}

/* Finds the derivative of these forces on the nodes of a facet's cell. */
static int cell_stiffness(const struct cells *all, int64_t facet, const double *u, double duration,
                          double *stiffness)
{
  double at[GIVEN * PADDED_POINTS], T[36 * PADDED_POINTS], D[3 * PADDED_POINTS], row[PADDED_POINTS];
  if (!touches(all, facet, u, duration, at))
    return 0;
  evaluate(all, facet, u, at);
  traction_tangent(at, all->constants, duration, T);
  const double *shapes = all->shapes + all->faces[facet] * NODES * PADDED_POINTS;
  const double *slopes = all->slopes + all->faces[facet] * 3 * NODES * PADDED_POINTS;
  const double *inverse = all->inverse + facet * 9 * PADDED_POINTS;
  const double *weight = all->weight + facet * PADDED_POINTS;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const double *by_value = T + (12 * i + j) * PADDED_POINTS;
      for (int l = 0; l < 3; ++l)
        for (int q = 0; q < PADDED_POINTS; ++q) {
          double sum = 0;
          for (int k = 0; k < 3; ++k)
            sum += T[(12 * i + 3 + 3 * j + k) * PADDED_POINTS + q] *
                   inverse[(3 * l + k) * PADDED_POINTS + q];
          D[l * PADDED_POINTS + q] = sum;
        }
      for (int b = 0; b < NODES; ++b) {
        for (int q = 0; q < PADDED_POINTS; ++q) {
          double sum = by_value[q] * shapes[b * PADDED_POINTS + q];
          for (int l = 0; l < 3; ++l)
            sum += D[l * PADDED_POINTS + q] * slopes[(l * NODES + b) * PADDED_POINTS + q];
          row[q] = weight[q] * sum;
        }
        for (int a = 0; a < NODES; ++a) {
          double sum = 0;
          for (int q = 0; q < PADDED_POINTS; ++q)
            sum += row[q] * shapes[a * PADDED_POINTS + q];
          stiffness[((3 * i + j) * PADDED_NODES + a) * PADDED_NODES + b] = -sum;
        }
      }
    }
  return 1;
}
