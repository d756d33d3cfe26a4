/* A C99 program: rows of standard input through a model file, to compare with the C++ library; then calls that are
 * wrong, each of which must be refused. Prints value and fault, "%.17g %d" a row. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "torsio.h"

#define REQUIRE(condition)                                               \
  do {                                                                   \
    if (!(condition)) {                                                  \
      fprintf(stderr, "smoke.c:%d: %s\n", __LINE__, #condition);         \
      exit(3);                                                           \
    }                                                                    \
  } while (0)

static void refuse_wrong_calls(const char* path, torsio_estimator* joint) {
  char junk[4096];
  double raw[2] = {0.0, 0.0};
  torsio_estimate estimate;
  size_t i;
  for (i = 0; i < sizeof junk; ++i) junk[i] = (char)(i * 7919);

  REQUIRE(torsio_load(NULL, NULL) == NULL);
  REQUIRE(torsio_load("no such file", NULL) == NULL);
  REQUIRE(strstr(torsio_last_error(), "no such file") != NULL);
  REQUIRE(torsio_load_bytes(junk, sizeof junk, NULL) == NULL);
  REQUIRE(torsio_load_bytes(junk, 0, NULL) == NULL);
  REQUIRE(torsio_load_bytes(NULL, 3, NULL) == NULL);
  REQUIRE(torsio_load(path, "knee-1") == NULL);
  REQUIRE(strstr(torsio_last_error(), "knee-1") != NULL);
  REQUIRE(torsio_load_at_rate(path, NULL, -1.0) == NULL);

  REQUIRE(torsio_set_zero(joint, "oil_K", 1.0) == -1);
  REQUIRE(strstr(torsio_last_error(), "oil_K") != NULL);
  REQUIRE(torsio_set_zero(joint, NULL, 1.0) == -1);
  REQUIRE(torsio_set_zero(joint, torsio_input_name(joint, 0), NAN) == -1);

  REQUIRE(torsio_step(joint, raw, 1).fault == TORSIO_FAULT_INPUT_COUNT_WRONG);
  REQUIRE(torsio_step(joint, NULL, 2).fault == TORSIO_FAULT_INPUT_COUNT_WRONG);
  REQUIRE(torsio_step(NULL, raw, 2).fault == TORSIO_FAULT_INPUT_COUNT_WRONG);
  raw[1] = NAN;
  REQUIRE(torsio_step(joint, raw, 2).fault == TORSIO_FAULT_INPUT_NOT_FINITE);
  REQUIRE(torsio_step_into(joint, raw, 2, NULL) == -1);
  REQUIRE(torsio_step_into(NULL, raw, 2, &estimate) == -1);
  REQUIRE(torsio_run(joint, NULL, 1, 2, &estimate) == 0);
  REQUIRE(torsio_run(NULL, raw, 1, 2, &estimate) == 0);

  REQUIRE(torsio_state_load(joint, junk, torsio_state_size(joint)) == -1);
  REQUIRE(torsio_state_load(joint, NULL, torsio_state_size(joint)) == -1);
  REQUIRE(torsio_state_save(joint, junk, 3) == -1);
  REQUIRE(torsio_state_size(NULL) == 0);

  REQUIRE(torsio_input_count(NULL) == 0 && torsio_input_name(joint, 2) == NULL);
  REQUIRE(torsio_target_name(NULL) == NULL && torsio_unset_zero(NULL, 0) == NULL);
  REQUIRE(torsio_clone(NULL) == NULL && torsio_sample_rate_hz(NULL) == 0.0);
  torsio_reset(NULL);
  torsio_free(NULL);
  REQUIRE(strcmp(torsio_fault_name(-1), "unknown") == 0 && strcmp(torsio_fault_name(99), "unknown") == 0);
}

int main(int argc, char** argv) {
  double raw[2];
  char state[65536];
  size_t size;
  torsio_estimator* joint;
  torsio_estimator* copy;
  if (argc != 2) return 2;
  REQUIRE(torsio_abi_version() == TORSIO_ABI_VERSION);
  REQUIRE(torsio_last_error()[0] == '\0');
  joint = torsio_load(argv[1], "elbow-7");
  if (joint == NULL) {
    fprintf(stderr, "%s\n", torsio_last_error());
    return 1;
  }
  REQUIRE(torsio_input_count(joint) == 2);
  REQUIRE(strcmp(torsio_input_name(joint, 0), "gear_angle_rad") == 0);
  REQUIRE(strcmp(torsio_target_name(joint), "torque_Nm") == 0);
  REQUIRE(torsio_sample_rate_hz(joint) == 1000.0);
  REQUIRE(strcmp(torsio_unset_zero(joint, 0), "joint_angle_rad") == 0);
  REQUIRE(torsio_set_zero(joint, "joint_angle_rad", 0.02) == 0);
  REQUIRE(torsio_unset_zero(joint, 0) == NULL);
  size = torsio_state_size(joint);
  REQUIRE(size > 0 && size <= sizeof state);
  while (scanf("%lf %lf", &raw[0], &raw[1]) == 2) {
    torsio_estimate by_value, by_pointer, of_run;
    REQUIRE(torsio_state_save(joint, state, size) == 0);
    copy = torsio_clone(joint);
    by_value = torsio_step(joint, raw, 2);
    REQUIRE(torsio_step_into(copy, raw, 2, &by_pointer) == 0);
    REQUIRE(torsio_state_load(copy, state, size) == 0);
    REQUIRE(torsio_run(copy, raw, 1, 2, &of_run) == 1);
    REQUIRE(memcmp(&by_value, &by_pointer, sizeof by_value) == 0);
    REQUIRE(memcmp(&by_value, &of_run, sizeof by_value) == 0);
    torsio_free(copy);
    printf("%.17g %d\n", by_value.value, (int)by_value.fault);
  }
  refuse_wrong_calls(argv[1], joint);
  torsio_free(joint);
  return 0;
}
