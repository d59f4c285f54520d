/* How many instructions the calls of a policy take in swing-ups on a Cortex-M4, in QEMU:
 *
 *     ./upswing export POLICY --c policy.h
 *     (docs/howto/export.md has the line that compiles)
 *     qemu-system-arm -M mps2-an386 -icount shift=2 -semihosting -nographic -kernel swing_ups.elf
 *
 * Five swing-ups of 4 s. With -icount every instruction takes the same time, which the board's timer of 32
 * bits measures. */
#include <stdint.h>
#include <stdio.h>

#include "policy.h" /* the export, found by -I */

#include "../pendulum.h"

#ifndef STEPS
#define STEPS 200 /* calls in a swing-up */
#endif

#define TIMER_CONTROL (*(volatile uint32_t *)0x40000000u)
#define TIMER_VALUE (*(volatile uint32_t *)0x40000004u)
#define TIMER_RELOAD (*(volatile uint32_t *)0x40000008u)

/* Ticks of 40960 instructions: 10240 times add, compare, branch and no operation. */
static uint32_t ticks_of_40960(void)
{
  const uint32_t before = TIMER_VALUE;
  uint32_t i = 0;
  __asm__ volatile("1: adds %0, %0, #1\n\tnop\n\tcmp %0, %1\n\tbne 1b"
                   : "+r"(i) : "r"(10240) : "cc");
  return before - TIMER_VALUE;
}

int main(void)
{
  static const double starts[5][4] = {
      {0.0, 0.0, 0.0, 0.0}, {0.1, 0.1, 0.0, 0.0}, {-0.2, 0.1, 0.1, -0.1}, {0.2, 0.2, 0.1, 0.1},
      {1.0, -2.0, 0.5, -1.0}};
  static policy_state state;
  double unit, first = 0.0, worst = 0.0, sum = 0.0;
  int episode, step, upright = 0;

  TIMER_RELOAD = 0xffffffffu;
  TIMER_VALUE = 0xffffffffu;
  TIMER_CONTROL = 1; /* on, by the board's clock */
  unit = (double)ticks_of_40960() / 40960.0;
  for (episode = 0; episode < 5; episode++) {
    pendulum s;
    s.q1 = starts[episode][0];
    s.q2 = starts[episode][1];
    s.w1 = starts[episode][2];
    s.w2 = starts[episode][3];
    policy_init(&state);
    for (step = 0; step < STEPS; step++) {
      float torque;
      const uint32_t before = TIMER_VALUE;
      const policy_status status =
          policy_control(&state, (float)s.q1, (float)s.q2, (float)s.w1, (float)s.w2, &torque);
      const double count = (double)(before - TIMER_VALUE) / unit;
      if (status != POLICY_OK) return 1;
      if (step == 0 && count > first) first = count;
      if (step > 0 && count > worst) worst = count;
      if (step > 0) sum += count;
      pendulum_advance(&s, (double)torque, (double)POLICY_PERIOD);
    }
    upright += pendulum_is_inverted(&s);
  }
  printf("%d of 5 upright; instructions of a call: %.0f in the mean, %.0f at most, %.0f at most in the "
         "first\n", upright, sum / (5 * (STEPS - 1)), worst, first);
  return 0;
}
