#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include "joint.h"
#ifndef CALL
#error
#endif
int main(void) {
  static joint_state s;
  FILE *a = fopen("raw.bin", "rb"), *b = fopen("ref.bin", "rb");
  double in[N], ref[3], worst = 0, worst_std = 0; long k = 0, bad = 0, at = -1, nanbad = 0; double lo=1e300,hi=-1e300;
  for (int q = 0; q < 0; ++q) {}
  ZEROS
  while (fread(in, 8, N, a) == N && fread(ref, 8, 3, b) == 3) {
    joint_estimate e = CALL;
    double d = fabs((double)e.value - ref[0]);
    if (d > worst) { worst = d; at = k; }
    if (e.fault != (int)ref[2]) { if (bad < 5) printf("tick %ld: fault %d, ref %d, value %g ref %g\n", k, e.fault, (int)ref[2], (double)e.value, ref[0]); ++bad; }
    if (isnan((double)e.std_dev) != isnan(ref[1])) ++nanbad;
    else if (!isnan(ref[1])) { double r = fabs((double)e.std_dev - ref[1]); if (r > worst_std) worst_std = r; }
    if (ref[0] < lo) lo = ref[0]; if (ref[0] > hi) hi = ref[0];
    ++k;
  }
  printf("%ld ticks: worst %.3g of %.4g = %.2e (tick %ld), std worst %.3g, nan %ld, faults that differ %ld, state %zu bytes\n", k, worst, hi - lo, worst / (hi - lo), at, worst_std, nanbad, bad, sizeof s);
  return 0;
}
