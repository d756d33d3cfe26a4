#include <stdint.h>
#include "joint.h"
void put(const char *);
static void number(uint32_t n) { char t[12]; int i = 11; t[11] = 0; do { t[--i] = (char)('0' + n % 10U); n /= 10U; } while (n); put(t + i); }
#define SYST_CSR (*(volatile uint32_t *)0xE000E010U)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014U)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018U)
static joint_state state;
int main(void) {
  const joint_real d = joint_self_test();
  uint32_t k, begin, end; volatile joint_real sink;
  put("self test x1e-9 "); number((uint32_t)((float)d * 1e9f)); put("\n");
  SYST_RVR = 0xFFFFFFU; SYST_CVR = 0U; SYST_CSR = 5U; begin = SYST_CVR;
  for (k = 0; k < 200; ++k) { STEP }
  begin = SYST_CVR;
  for (k = 0; k < 2000; ++k) { STEP }
  end = SYST_CVR;
  put("ticks of 40 instructions in 2000 steps "); number((begin - end) & 0xFFFFFFU); put("\n");
  return d < (joint_real)1e-4 ? 0 : 1;
}
