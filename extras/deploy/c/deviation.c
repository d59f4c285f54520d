/* An angle of at most 3 pi either way, from -pi to pi. */
static inline float policy_wrapped(float angle) {
  if (angle > 3.1415927f) return angle - 6.2831853f;
  if (angle < -3.1415927f) return angle + 6.2831853f;
  return angle;
}

/* d (4): deviation from upright at rest, the angles from -pi to pi. */
static inline void policy_deviation(float q1, float q2, float w1, float w2, float *d) {
  d[0] = atan2f(-sinf(q1), -cosf(q1));
  d[1] = atan2f(sinf(q2), cosf(q2));
  d[2] = w1;
  d[3] = w2;
}
