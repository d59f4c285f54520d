/* A closed loop in plain C: a policy that Upswing exported swings up a pendulum that is simulated here.
 *
 *     ./upswing export POLICY --c policy.h
 *     cc -std=c99 -O2 -I. examples/c/swing_up.c -o swing_up -lm
 *     ./swing_up >trajectory.csv            from hanging, or from: ./swing_up q1 q2 w1 w2
 *
 * 20 seconds; the exit code is 0 if both links are upright throughout the last 10 of them. */
#include <stdio.h>
#include <stdlib.h>

#include "policy.h" /* the export, found by -I */

#include "pendulum.h"

#define STEPS 1000 /* of POLICY_PERIOD, 0.02 s */

int main(int argc, char **argv)
{
  pendulum s = {0.0, 0.0, 0.0, 0.0};
  policy_state state;
  int step, upright_since = -1;

  if (argc != 1 && argc != 5) {
    fprintf(stderr, "usage: swing_up [q1 q2 w1 w2]\n");
    return 2;
  }
  if (argc == 5) {
    s.q1 = atof(argv[1]);
    s.q2 = atof(argv[2]);
    s.w1 = atof(argv[3]);
    s.w2 = atof(argv[4]);
  }
  if (policy_selftest() != POLICY_OK) {
    fprintf(stderr, "swing_up: the policy is damaged\n");
    return 1;
  }

  policy_init(&state);
  printf("t,q1,q2,w1,w2,torque\n");
  for (step = 0; step < STEPS; step++) {
    float torque;
    if (policy_control(&state, (float)s.q1, (float)s.q2, (float)s.w1, (float)s.w2, &torque) !=
        POLICY_OK) {
      fprintf(stderr, "swing_up: the state is no longer finite\n");
      return 1;
    }
    printf("%.2f,%.17g,%.17g,%.17g,%.17g,%.9g\n", step * (double)POLICY_PERIOD, s.q1, s.q2, s.w1,
           s.w2, (double)torque);
    pendulum_advance(&s, (double)torque, (double)POLICY_PERIOD);
    if (!pendulum_is_inverted(&s)) {
      upright_since = -1;
    } else if (upright_since < 0) {
      upright_since = step + 1;
    }
  }

  if (upright_since < 0 || upright_since > STEPS / 2) {
    fprintf(stderr, "not upright for the last 10 s\n");
    return 1;
  }
  fprintf(stderr, "upright from %.2f s to the end\n", upright_since * (double)POLICY_PERIOD);
  return 0;
}
