/* A C program of somebody else: a model file, one row, one torque. */
#include <stdio.h>

#include <torsio.h>

int main(int argc, char** argv) {
  const double raw[2] = {0.01, 0.0};
  torsio_estimate torque;
  torsio_estimator* joint = argc == 2 ? torsio_load(argv[1], NULL) : NULL;
  if (joint == NULL) {
    fprintf(stderr, "%s\n", torsio_last_error());
    return 1;
  }
  torque = torsio_step(joint, raw, torsio_input_count(joint));
  printf("torsio %s: %.3f, %s\n", torsio_version(), torque.value, torsio_fault_name(torque.fault));
  torsio_free(joint);
  return 0;
}
