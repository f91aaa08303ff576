/* Factors of a sparse matrix in single precision by MUMPS, on one rank. */

#include <smumps_c.h>
#include <stdint.h>
#include <stdlib.h>

static void call(SMUMPS_STRUC_C *mumps, int job)
{
  mumps->job = job;
  smumps_c(mumps);
}

/* Begins with a matrix of n rows; row and column of its entries count from 1, and stay in place. Of a
   symmetric one the entries of mirrored places are added up. */
void *begin(int communicator, int symmetric, int n, int64_t count, int *rows, int *columns,
            float *entries)
{
  SMUMPS_STRUC_C *mumps = calloc(1, sizeof(SMUMPS_STRUC_C));
  mumps->par = 1;
  mumps->sym = symmetric ? 2 : 0;
  mumps->comm_fortran = communicator;
  call(mumps, -1);
  for (int i = 0; i < 4; ++i)
    mumps->icntl[i] = i < 3 ? -1 : 0; /* print nothing */
  mumps->icntl[6] = 5;                /* METIS, where there is */
  mumps->icntl[13] = 50;              /* per cent of memory more than foreseen */
  mumps->n = n;
  mumps->nnz = count;
  mumps->irn = rows;
  mumps->jcn = columns;
  mumps->a = entries;
  call(mumps, 1);
  return mumps;
}

/* Factorises the entries as they are now; returns a negative number if it fails. */
int factorise(void *mumps)
{
  call(mumps, 2);
  return ((SMUMPS_STRUC_C *)mumps)->infog[0];
}

/* Replaces right-hand sides, one after the other, by the solutions. */
void solve(void *mumps, int count, float *x)
{
  SMUMPS_STRUC_C *with = mumps;
  with->nrhs = count;
  with->lrhs = with->n;
  with->rhs = x;
  call(mumps, 3);
}

void end(void *mumps)
{
  call(mumps, -2);
  free(mumps);
}
