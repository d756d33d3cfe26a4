/* In Octave or MATLAB: joint() is the result of the self-test; joint(raw), with a column for each tick, is a row each of
   values, error bars and faults. */
#include "mex.h"

#include "joint.h"
#include "rows.h"

void mexFunction(int results, mxArray *result[], int arguments, const mxArray *argument[]) {
  static joint_state state;
  const double *row;
  double *out;
  size_t tick, ticks;
  (void)results;
  if (arguments == 0) {
    result[0] = mxCreateDoubleScalar((double)joint_self_test());
    return;
  }
  if (!mxIsDouble(argument[0]) || mxGetM(argument[0]) != INPUT_COUNT)
    mexErrMsgTxt("expected: doubles, one row for each raw input and one column for each tick");
  ticks = mxGetN(argument[0]);
  row = mxGetPr(argument[0]);
  result[0] = mxCreateDoubleMatrix(3, ticks, mxREAL);
  out = mxGetPr(result[0]);
  joint_reset(&state);
  SET_ZEROS
  for (tick = 0; tick < ticks; ++tick, row += INPUT_COUNT, out += 3) {
    const joint_estimate estimate = joint_step(&state, FROM_ROW(row));
    out[0] = (double)estimate.value;
    out[1] = (double)estimate.std_dev;
    out[2] = (double)estimate.fault;
  }
}
