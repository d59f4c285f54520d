/* What a Cortex-M4 does between reset and main, for the board mps2-an386 of QEMU. */
#include <stdint.h>

extern uint32_t stack_top;     /* of the linker script */
extern void _start(void);      /* of newlib: clears memory, calls main, exits */

static void stop(void)
{
  for (;;) {
  }
}

static void reset(void)
{
  /* Full access to the floating-point unit: coprocessors 10 and 11. */
  *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20;
  __asm__ volatile("dsb\n\tisb");
  _start();
}

typedef void (*handler)(void);
__attribute__((section(".vectors"), used)) static const handler vectors[16] = {
    (handler)(uintptr_t)&stack_top, reset, stop, stop, stop, stop, stop, 0, 0, 0, 0, stop, stop, 0,
    stop, stop};
