/* torsio for C, and for every language that calls C: the torque of a joint from a model file, in its loop.
 *
 *   torsio_estimator* joint = torsio_load("joint.safetensors", NULL);
 *   if (!joint) fprintf(stderr, "%s\n", torsio_last_error());
 *   double raw[2] = {gear_angle_rad, joint_angle_rad};     // in the order of torsio_input_name, in SI
 *   torsio_estimate torque = torsio_step(joint, raw, 2);   // no heap, no lock
 *   if (torque.fault == TORSIO_FAULT_NONE) use(torque.value);
 *
 * An estimator is used by one thread at a time; several estimators may run in parallel. Functions that can
 * fail return NULL, -1 or 0; torsio_last_error then states why, except of those that only name or count
 * something. Pointers to estimators may be NULL everywhere. "No heap" holds for calls that succeed: the first
 * refusal in a thread may allocate the text of torsio_last_error, unless that was called there before.
 * All quantities are in SI units. Documentation: docs/robot/c.md, docs/robot/estimator.md.
 */
#ifndef TORSIO_H
#define TORSIO_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Changes when a program would have to be compiled again; libtorsio.so has the same number. */
#define TORSIO_ABI_VERSION 1

typedef struct torsio_estimator torsio_estimator;

/* Reasons not to use a value (docs/robot/estimator.md). */
enum {
  TORSIO_FAULT_NONE = 0,
  TORSIO_FAULT_INPUT_NOT_FINITE = 1,
  TORSIO_FAULT_INPUT_COUNT_WRONG = 2,
  TORSIO_FAULT_WARMING_UP = 3,
  TORSIO_FAULT_ZERO_NOT_SET = 4,
  TORSIO_FAULT_OUTSIDE_TRAINING_RANGE = 5,
  TORSIO_FAULT_RECOVERING = 6,
  TORSIO_FAULT_WRONG_RATE = 7,
  TORSIO_FAULT_MODEL_NOT_FINITE = 8,
  TORSIO_FAULT_DIVERGED = 9
};

/* The value is finite in every case; use it as the model's only while fault is TORSIO_FAULT_NONE. */
typedef struct torsio_estimate {
  double value;     /* in the unit of torsio_target_name, as a rule Nm */
  double std_dev;   /* one standard deviation, same unit; NaN where there is no evidence */
  double novelty;   /* larger: less like the training data; NaN if unknown */
  int32_t fault;    /* TORSIO_FAULT_... */
  int32_t reserved; /* 0 */
} torsio_estimate;

/* TORSIO_ABI_VERSION of the library, which may be another one than that of this header. */
int torsio_abi_version(void);
/* "0.2.0" */
const char* torsio_version(void);
/* Why the last failed call of this thread failed; "" before the first. Valid until the thread ends; the next
 * failure overwrites it. */
const char* torsio_last_error(void);
/* "outside_training_range"; "unknown" for a number that is no fault. */
const char* torsio_fault_name(int32_t fault);

/* Reads a model file. expected_serial: serial number of the joint, a model of another joint is refused; NULL or
 * "": any. NULL if the file cannot be used. */
torsio_estimator* torsio_load(const char* path, const char* expected_serial);
/* The same for a loop at another rate than that of the training. A model with a hidden state (lstm, gru, narx)
 * runs at its own rate only. */
torsio_estimator* torsio_load_at_rate(const char* path, const char* expected_serial,
                                      double rate_hz);
/* The same from the bytes of a model file, which need not be valid: any bytes are safe. */
torsio_estimator* torsio_load_bytes(const void* bytes, size_t size, const char* expected_serial);
/* A second estimator with the same model, zeros and state. NULL if memory is short. */
torsio_estimator* torsio_clone(const torsio_estimator* estimator);
void torsio_free(torsio_estimator* estimator);

/* The channels that a step takes, in this order: "gear_angle_rad", ... NULL for an index that is too high. */
size_t torsio_input_count(const torsio_estimator* estimator);
const char* torsio_input_name(const torsio_estimator* estimator, size_t index);
/* "torque_Nm": what is estimated, and its unit. */
const char* torsio_target_name(const torsio_estimator* estimator);
/* The rate at which step must be called; 0 for NULL. */
double torsio_sample_rate_hz(const torsio_estimator* estimator);

/* Subtracts a value (SI) from an input from now on. Channels whose zero the training took from each recording
 * need one: torsio_unset_zero names those that still have none, NULL after the last. 0, or -1 for an unknown
 * channel or a value that is not finite. */
int torsio_set_zero(torsio_estimator* estimator, const char* channel, double value);
const char* torsio_unset_zero(const torsio_estimator* estimator, size_t index);
/* Filters and memory start again; zeros are kept. */
void torsio_reset(torsio_estimator* estimator);

/* One tick. raw: torsio_input_count values, NaN for one that was not measured. Another count is the fault
 * TORSIO_FAULT_INPUT_COUNT_WRONG. No heap, no lock, no system call. */
torsio_estimate torsio_step(torsio_estimator* estimator, const double* raw, size_t count);
/* The same for callers that cannot take a structure by value (LabVIEW, MATLAB loadlibrary). 0, or -1 if a
 * pointer is NULL. */
int torsio_step_into(torsio_estimator* estimator, const double* raw, size_t count,
                     torsio_estimate* out);
/* rows ticks; raw is rows x count, row by row; out has rows elements. Returns the rows that were computed: rows,
 * or 0 if a pointer is NULL. */
size_t torsio_run(torsio_estimator* estimator, const double* raw, size_t rows, size_t count,
                  torsio_estimate* out);

/* The state (filters, memory, guards; not the zeros) as bytes, for a copy in time: a branch of a simulation, a
 * reset to a moment. For the same library on the same kind of machine. No heap, no lock. save and load return 0,
 * or -1 without effect: a wrong size, or bytes that are not a state of this model. */
size_t torsio_state_size(const torsio_estimator* estimator);
int torsio_state_save(const torsio_estimator* estimator, void* bytes, size_t size);
int torsio_state_load(torsio_estimator* estimator, const void* bytes, size_t size);

#ifdef __cplusplus
}
#endif

#endif /* TORSIO_H */
