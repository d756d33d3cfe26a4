/* What a page calls: raw inputs of a tick in `row`, then `step`; `estimate` has the value, its error bar and the fault. */
#include "joint.h"
#include "rows.h"

#define EXPORTED(name) __attribute__((export_name(name)))

static joint_state state;
static double row[INPUT_COUNT], estimate[3];
static int is_ready;

EXPORTED("row") double *row_address(void) { return row; }
EXPORTED("estimate") double *estimate_address(void) { return estimate; }
EXPORTED("self_test") double self_test(void) { return (double)joint_self_test(); }
EXPORTED("step") void step(void) {
  joint_estimate own;
  if (!is_ready) {
    SET_ZEROS
  }
  is_ready = 1;
  own = joint_step(&state, FROM_ROW(row));
  estimate[0] = (double)own.value;
  estimate[1] = (double)own.std_dev;
  estimate[2] = (double)own.fault;
}
