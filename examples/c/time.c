/* How long a policy's control takes here:
 *
 *     ./upswing export POLICY --c policy.h
 *     cc -std=c99 -O2 -I. examples/c/time.c -o time_control -lm
 *     ./time_control
 *
 * The least of 400 rounds of 100 calls, processor time. */
#include <stdio.h>
#include <time.h>

#include "policy.h" /* the export, found by -I */

#define ROUNDS 400
#define CALLS 100

int main(void)
{
  policy_state state;
  double least = 1e30;
  float sum = 0.0f;
  int round, call;

  policy_init(&state);
  for (round = 0; round < ROUNDS; round++) {
    const clock_t before = clock();
    double seconds;
    for (call = 0; call < CALLS; call++) {
      const float q1 = 0.01f * (float)call;
      float torque;
      policy_control(&state, q1, 0.1f, -0.3f, 0.2f, &torque);
      sum += torque; /* so that no call can be left out */
    }
    seconds = (double)(clock() - before) / (double)CLOCKS_PER_SEC;
    if (seconds > 0.0 && seconds < least) least = seconds;
  }
  printf("%.0f ns a call (sum of torques %g)\n", 1e9 * least / CALLS, (double)sum);
  return 0;
}
