/* Runs the program over the rows of raw inputs in inputs.bin, writes value, error bar and fault of each to outputs.bin,
   and returns 0 where the self-test passes. */
#include <stdio.h>

#include "joint.h"
#include "rows.h"

int main(void) {
  static joint_state state;
  double row[INPUT_COUNT], out[3];
  const double apart = (double)joint_self_test();
  FILE *inputs = fopen("inputs.bin", "rb"), *outputs = fopen("outputs.bin", "wb");
  if (inputs == NULL || outputs == NULL) return 2;
  SET_ZEROS
  while (fread(row, sizeof(double), INPUT_COUNT, inputs) == INPUT_COUNT) {
    const joint_estimate estimate = joint_step(&state, FROM_ROW(row));
    out[0] = (double)estimate.value;
    out[1] = (double)estimate.std_dev;
    out[2] = (double)estimate.fault;
    if (fwrite(out, sizeof(double), 3, outputs) != 3) return 2;
  }
  if (fclose(inputs) != 0 || fclose(outputs) != 0) return 2;
  printf("%.3g %u\n", apart, (unsigned)sizeof state);
  return apart < TOLERANCE ? 0 : 1;
}
