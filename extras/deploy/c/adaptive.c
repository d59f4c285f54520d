/* A network for the double pendulum, which identifies the plant while it moves. */
#include "numbers.c"
#include "deviation.c"
#include "equations.c"
#include "identification.c"
#include "network.c"
#include "observe.c"
