/* Factors of a sparse matrix in single precision by MUMPS. */

#include <smumps_c.h>
#include <stdint.h>
#include <stdlib.h>

static void call(SMUMPS_STRUC_C *mumps, int job)
{
  mumps->job = job;
  smumps_c(mumps);
}

/* Begins with a matrix of n rows, of which every rank gives some entries; their rows and columns count
   from 1, and stay in place. Of a symmetric matrix the entries of mirrored places are added up. */
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
  mumps->icntl[17] = 3;               /* entries where they are */
  mumps->n = n;
  mumps->nnz_loc = count;
  mumps->irn_loc = rows;
  mumps->jcn_loc = columns;
  mumps->a_loc = entries;
  call(mumps, 1);
  return mumps;
}

/* Factorises the entries as they are now; returns a negative number if it fails. */
int factorise(void *mumps)
{
  call(mumps, 2);
  return ((SMUMPS_STRUC_C *)mumps)->infog[0];
}

/* Replaces right-hand sides, one after the other on the first rank, by the solutions. */
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
