/* In qemu with -icount shift=0, where an instruction takes 1 ns: the self-test, whose result is the exit code, or the
   instructions of a step over a recording. drive.h has the recording, PARAMETERS of the step, and INPUTS(k) of a tick;
   with CONTROL a control step is measured instead. */
#include <stdint.h>

#include "joint.h"
#ifndef JOINT_SELF_TEST
#include "drive.h"
#endif

void print_text(const char *text);

static void print_number(const char *what, uint32_t number) {
  char text[12];
  int i = 11;
  text[11] = '\0';
  do {
    text[--i] = (char)('0' + number % 10U);
    number /= 10U;
  } while (number > 0U);
  print_text(what);
  print_text(" ");
  print_text(text + i);
  print_text("\n");
}

#ifdef JOINT_SELF_TEST

int main(void) {
  const joint_real apart = joint_self_test();
  print_number("self-test, 1e-9 of the range:", apart < (joint_real)4 ? (uint32_t)(apart * (joint_real)1e9) : 4000000000U);
  return apart < (joint_real)TOLERANCE ? 0 : 1;
}

#else

#define SYSTICK_CONTROL (*(volatile uint32_t *)0xE000E010U)
#define SYSTICK_RELOAD (*(volatile uint32_t *)0xE000E014U)
#define SYSTICK_VALUE (*(volatile uint32_t *)0xE000E018U)
#define INSTRUCTIONS_A_TICK 40U /* SysTick counts at 25 MHz */

#ifdef CONTROL

typedef void (*step_function)(joint_control *, const joint_reference *, const joint_sample *, joint_command *);
#define STEP joint_control_step

static void nothing(joint_control *state, const joint_reference *wanted, const joint_sample *sample, joint_command *out) {
  (void)state;
  (void)wanted;
  (void)sample;
  out->fault = out->inverse_fault = joint_NONE;
}

static joint_control state;
static uint32_t faults;

static void tick(step_function volatile step, uint32_t k) {
  joint_reference wanted = {joint_MODE_IMPEDANCE, 0, 0, 0, 0, 0, 0, 0, 0};
  const joint_sample sample = {sample_0[k], sample_1[k], sample_2[k], current_A[k], 0};
  joint_command out;
  wanted.position_rad = wanted_rad[k];
  wanted.stiffness_Nm_rad = STIFFNESS;
  wanted.damping_Nms_rad = 1;
  step(&state, &wanted, &sample, &out);
  faults += out.fault != joint_NONE || out.inverse_fault != joint_NONE;
}

#else

#define STEP joint_step
typedef joint_estimate (*step_function)(joint_state *, PARAMETERS);

/* What calling costs by itself. */
static joint_estimate nothing(joint_state *state, PARAMETERS) {
  joint_estimate none = {0, 0, 0};
  (void)state;
  UNUSED
  return none;
}

static joint_state state;
static uint32_t faults;

static void tick(step_function volatile step, uint32_t k) { faults += step(&state, INPUTS(k)).fault != joint_NONE; }

#endif

static uint32_t instructions(step_function volatile step, uint32_t from, uint32_t to) {
  uint32_t k, begin;
  begin = SYSTICK_VALUE;
  for (k = from; k < to; ++k) tick(step, k);
  return ((begin - SYSTICK_VALUE) & 0xFFFFFFU) * INSTRUCTIONS_A_TICK;
}

int main(void) {
  uint32_t empty, full;
  SYSTICK_RELOAD = 0xFFFFFFU;
  SYSTICK_VALUE = 0U;
  SYSTICK_CONTROL = 5U;
  (void)SYSTICK_VALUE;
#ifndef CONTROL
  SET_ZEROS
#endif
  (void)instructions(STEP, 0U, WARM_UP);
  faults = 0U;
  empty = instructions(nothing, WARM_UP, TICKS);
  full = instructions(STEP, WARM_UP, TICKS);
  print_number("tenths of an instruction a step:", (full - empty) * 10U / (TICKS - WARM_UP));
  print_number("faults:", faults);
  print_number("state bytes:", (uint32_t)sizeof state);
  return 0;
}

#endif
