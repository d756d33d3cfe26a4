/* Start-up of a Cortex-M in qemu: memory, FPU, then main; what main returns is qemu's exit code, by semihosting. */
#include <stdint.h>

extern uint32_t stack_top, data_load, data_begin, data_end, bss_begin, bss_end;
int main(void);

/* Asks the debugger, which is qemu. */
static void ask(uint32_t operation, const volatile void *block) {
  register uint32_t r0 __asm__("r0") = operation;
  register const volatile void *r1 __asm__("r1") = block;
  __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
}

void print_text(const char *text) { ask(4U, text); }

static void finish(int code) {
  volatile uint32_t block[2];
  block[0] = 0x20026U;
  block[1] = (uint32_t)code;
  for (;;) ask(0x20U, block);
}

static void reset(void) {
  uint32_t *to, *from = &data_load;
  *(volatile uint32_t *)0xE000ED88U |= 0xFU << 20U; /* FPU on */
  for (to = &data_begin; to < &data_end;) *to++ = *from++;
  for (to = &bss_begin; to < &bss_end;) *to++ = 0U;
  finish(main());
}

static void fault(void) { finish(99); }

__attribute__((section(".vectors"), used)) static void *const vectors[16] = {
    &stack_top, (void *)reset, (void *)fault, (void *)fault, (void *)fault, (void *)fault, (void *)fault};
