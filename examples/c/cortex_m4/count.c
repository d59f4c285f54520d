/* How many instructions a policy's control takes on a Cortex-M4, in QEMU:
 *
 *     ./upswing export POLICY --c policy.h
 *     arm-none-eabi-gcc -std=c99 -O2 -mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 -I. \
 *         --specs=rdimon.specs -nostartfiles ... (docs/howto/export.md has the whole line)
 *     qemu-system-arm -M mps2-an386 -icount shift=8 -semihosting -nographic -kernel count.elf
 *
 * With -icount every instruction takes the same time, which the timer SysTick measures. */
#include <stdint.h>
#include <stdio.h>

#include "policy.h" /* the export, found by -I */

#define SYSTICK_CONTROL (*(volatile uint32_t *)0xE000E010u)
#define SYSTICK_RELOAD (*(volatile uint32_t *)0xE000E014u)
#define SYSTICK_VALUE (*(volatile uint32_t *)0xE000E018u)

/* Ticks since `before`, of a counter of 24 bits that runs down. */
static uint32_t since(uint32_t before)
{
  return (before - SYSTICK_VALUE) & 0xffffffu;
}

/* Ticks of 4096 instructions: 1024 times add, compare, branch and no operation. */
static uint32_t ticks_of_4096(void)
{
  const uint32_t before = SYSTICK_VALUE;
  uint32_t i = 0;
  __asm__ volatile("1: adds %0, %0, #1\n\tnop\n\tcmp %0, #1024\n\tbne 1b" : "+l"(i) : : "cc");
  return since(before);
}

int main(void)
{
  static const float states[4][4] = {{0.1f, 0.2f, 0.3f, 0.4f},
                                     {3.0f, 0.1f, -0.5f, 0.5f},
                                     {-2.0f, 1.0f, 5.0f, -9.0f},
                                     {7.0f, -3.0f, -2.0f, 1.0f}};
  policy_state state;
  uint32_t unit;
  int i;

  SYSTICK_RELOAD = 0xffffffu;
  SYSTICK_VALUE = 0;
  SYSTICK_CONTROL = 5; /* on, by the processor's clock, without interrupts */
  unit = ticks_of_4096();
  if (policy_selftest() != POLICY_OK) {
    printf("damaged\n");
    return 1;
  }
  policy_init(&state);
  for (i = 0; i < 4; i++) {
    float torque;
    const uint32_t before = SYSTICK_VALUE;
    const policy_status status =
        policy_control(&state, states[i][0], states[i][1], states[i][2], states[i][3], &torque);
    const uint32_t ticks = since(before);
    printf("status %d, torque %.9g, %.0f instructions\n", (int)status, (double)torque,
           (double)ticks * 4096.0 / (double)unit);
  }
  return 0;
}
