/* The torque of a joint in a loop, in C99:  cc -std=c99 03_estimate_torque_in_c.c $(pkg-config --cflags --libs torsio) -lm
 *
 *   ./03_estimate_torque_in_c joint.safetensors
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "torsio.h"

/* A program of a real joint reads its sensors here. This one moves both sides of the spring. */
static double read_channel(const char* name, int tick) {
  const double joint_rad = 0.3 * sin(0.002 * tick);
  if (strcmp(name, "joint_angle_rad") == 0) return joint_rad;
  if (strcmp(name, "gear_angle_rad") == 0) return joint_rad + 0.02 * sin(0.006 * tick);
  return NAN; /* not measured: a fault, never a guess */
}

int main(int argc, char** argv) {
  enum { kTicks = 2000, kMostInputs = 16 };
  double raw[kMostInputs];
  size_t inputs, i;
  int tick;
  torsio_estimator* joint;

  if (argc != 2) {
    fprintf(stderr, "usage: %s MODEL\n", argv[0]);
    return 2;
  }
  if (torsio_abi_version() != TORSIO_ABI_VERSION) {
    fprintf(stderr, "libtorsio has ABI %d, this program needs %d\n", torsio_abi_version(), TORSIO_ABI_VERSION);
    return 1;
  }
  joint = torsio_load(argv[1], NULL);
  if (joint == NULL) {
    fprintf(stderr, "%s\n", torsio_last_error());
    return 1;
  }
  inputs = torsio_input_count(joint);
  if (inputs > kMostInputs) return 1;
  while (torsio_unset_zero(joint, 0) != NULL) /* a real joint measures them at rest */
    torsio_set_zero(joint, torsio_unset_zero(joint, 0), 0.0);

  for (tick = 0; tick < kTicks; ++tick) {
    torsio_estimate torque;
    for (i = 0; i < inputs; ++i) raw[i] = read_channel(torsio_input_name(joint, i), tick);
    torque = torsio_step(joint, raw, inputs); /* no heap, no lock */
    if (tick % 250 != 249) continue;
    if (torque.fault == TORSIO_FAULT_NONE)
      printf("t = %.2f s: %6.2f +- %.2f (%s)\n", tick / torsio_sample_rate_hz(joint), torque.value, torque.std_dev,
             torsio_target_name(joint));
    else
      printf("t = %.2f s: fault %s\n", tick / torsio_sample_rate_hz(joint), torsio_fault_name(torque.fault));
  }
  torsio_free(joint);
  return EXIT_SUCCESS;
}
