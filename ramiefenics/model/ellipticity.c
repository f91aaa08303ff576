/* Principal stretches, and the search for the least eigenvalue of the acoustic tensor.

   Symmetric tensors are xx, yy, zz, xy, xz, yz. */

#include <math.h>
#include <stdint.h>

#define MOST 512 /* directions of a search */

static const int FIRST[6] = {0, 1, 2, 0, 0, 1}, SECOND[6] = {0, 1, 2, 1, 2, 2};

/* Smallest eigenvalue in closed form (Smith 1961, Communications of the ACM 4, p. 168). */
static inline double smallest(double xx, double yy, double zz, double xy, double xz, double yz)
{
  const double mean = (xx + yy + zz) / 3, a = xx - mean, b = yy - mean, c = zz - mean;
  const double off = xy * xy + xz * xz + yz * yz;
  const double size = sqrt((a * a + b * b + c * c + 2 * off) / 6);
  const double half =
    (a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz)) / 2;
  const double least = size > 1e-12 ? size : 1e-12, ratio = half / (least * least * least);
  const double cosine = ratio > 1 ? 1 : ratio < -1 ? -1 : ratio;
  return mean + 2 * size * cos(acos(cosine) / 3 + 2.0943951023931953);
}

/* Returns determinant and least principal stretch, negative where the former is, of gradients. */
void stretches(int64_t count, const double *gradients, double *ratios, double *least)
{
  for (int64_t n = 0; n < count; ++n) {
    const double *F = gradients + 9 * n;
    double C[6];
    for (int p = 0; p < 6; ++p)
      C[p] = F[FIRST[p]] * F[SECOND[p]] + F[3 + FIRST[p]] * F[3 + SECOND[p]] +
             F[6 + FIRST[p]] * F[6 + SECOND[p]];
    const double squared = smallest(C[0], C[1], C[2], C[3], C[4], C[5]);
    const double J = F[0] * (F[4] * F[8] - F[5] * F[7]) - F[1] * (F[3] * F[8] - F[5] * F[6]) +
                     F[2] * (F[3] * F[7] - F[4] * F[6]);
    ratios[n] = J;
    least[n] = copysign(sqrt(squared > 0 ? squared : 0), J);
  }
}

/* Products of a vector's components, those off the diagonal twice. */
static void dyad(const double *v, double *d)
{
  for (int p = 0; p < 6; ++p)
    d[p] = (p < 3 ? 1 : 2) * v[FIRST[p]] * v[SECOND[p]];
}

/* Finds the eigenvector of the smallest eigenvalue; returns what belongs to the vector found. */
static double lowest_vector(const double *q, double *v)
{
  const double value = smallest(q[0], q[1], q[2], q[3], q[4], q[5]);
  const double row[3][3] = {
    {q[0] - value, q[3], q[4]}, {q[3], q[1] - value, q[5]}, {q[4], q[5], q[2] - value}};
  double length = 0, longest = 0, d[6];
  const double *direction = row[0];
  for (int r = 0; r < 3; ++r) {
    const double *a = row[r], *b = row[(r + 1) % 3];
    const double w[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                         a[0] * b[1] - a[1] * b[0]};
    const double of_w = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
    const double of_a = a[0] * a[0] + a[1] * a[1] + a[2] * a[2];
    if (of_w > length) {
      length = of_w;
      for (int i = 0; i < 3; ++i)
        v[i] = w[i];
    }
    if (of_a > longest) {
      longest = of_a;
      direction = a;
    }
  }
  if (length <= 1e-24 * longest * longest) { /* it is double: any vector across the third one's */
    const int i = fabs(direction[0]) < fabs(direction[1]) ? 0 : 1;
    v[i] = 0;
    v[1 - i] = -direction[2];
    v[2] = direction[1 - i];
    length = v[1 - i] * v[1 - i] + v[2] * v[2];
    if (length == 0) /* or threefold */
      v[i] = length = 1;
  }
  for (int i = 0; i < 3; ++i)
    v[i] /= sqrt(length);
  dyad(v, d);
  double sum = 0;
  for (int p = 0; p < 6; ++p)
    sum += q[p] * d[p];
  return sum;
}

/* Lowers values of some points to the least that is found from given directions.

   Parameters: number and places of the points; tangents dP/dF of all, by i, J, k, L; number of the
   directions, and their components; how often the best of them is improved; values of all points. */
void search(int64_t count, const int64_t *points, const double *tangents, int directions,
            const double *starts, int sweeps, double *values)
{
  double dyads[6][MOST];
  for (int n = 0; n < directions; ++n) {
    double d[6];
    dyad(starts + 3 * n, d);
    for (int p = 0; p < 6; ++p)
      dyads[p][n] = d[p];
  }
  for (int64_t at = 0; at < count; ++at) {
    const double *A = tangents + 81 * points[at];
    double form[6][6], found[MOST]; /* by ik and JL */
    for (int p = 0; p < 6; ++p)
      for (int r = 0; r < 6; ++r) {
        const int i = FIRST[p], k = SECOND[p], J = FIRST[r], L = SECOND[r];
        form[p][r] = (A[27 * i + 9 * J + 3 * k + L] + A[27 * k + 9 * J + 3 * i + L] +
                      A[27 * i + 9 * L + 3 * k + J] + A[27 * k + 9 * L + 3 * i + J]) / 4;
      }
    for (int n = 0; n < directions; ++n) {
      double q[6];
      for (int p = 0; p < 6; ++p) {
        q[p] = 0;
        for (int r = 0; r < 6; ++r)
          q[p] += form[p][r] * dyads[r][n];
      }
      found[n] = smallest(q[0], q[1], q[2], q[3], q[4], q[5]);
    }
    int best = 0;
    for (int n = 1; n < directions; ++n)
      best = found[n] < found[best] ? n : best;
    double value = found[best], vector[3], d[6], q[6];
    for (int i = 0; i < 3; ++i)
      vector[i] = starts[3 * best + i];
    for (int sweep = 0; sweep < sweeps; ++sweep) {
      const double before = value;
      for (int turn = 0; turn < 2; ++turn) { /* for m, and with it for N */
        dyad(vector, d);
        for (int p = 0; p < 6; ++p) {
          q[p] = 0;
          for (int r = 0; r < 6; ++r)
            q[p] += (turn ? form[r][p] : form[p][r]) * d[r];
        }
        value = lowest_vector(q, vector);
      }
      if (before - value <= 1e-9 * fabs(value))
        break;
    }
    if (!(value >= values[points[at]]))
      values[points[at]] = value;
  }
}
