/* A network for the double pendulum. */
#include "numbers.c"
#include "network.c"
#include "observe.c"
