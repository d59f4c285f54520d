/* Begins every export: the status, and what an IEEE number is. */

typedef enum {
  POLICY_OK = 0,
  POLICY_NOT_FINITE = 1,   /* a number that came in, or that followed from it */
  POLICY_NULL_POINTER = 2, /* in place of an argument */
  POLICY_DAMAGED = 3       /* by the self test */
} policy_status;

/* This needs numbers of 32 bits, as IEEE 754 has them. */
typedef char policy_float_has_32_bits[sizeof(float) == 4 ? 1 : -1];

static inline uint32_t policy_bits(float x) {
  const unsigned char *from = (const unsigned char *)&x;
  uint32_t bits = 0;
  unsigned char *to = (unsigned char *)&bits;
  int i;
  for (i = 0; i < 4; i++) to[i] = from[i];
  return bits;
}

/* By its bits, which also holds where a compiler is told that there is no NaN (-ffast-math). */
static inline int policy_is_finite(float x) {
  return (policy_bits(x) & 0x7f800000u) != 0x7f800000u;
}

static inline int policy_all_finite(const float *x, int size) {
  int i;
  for (i = 0; i < size; i++) {
    if (!policy_is_finite(x[i])) return 0;
  }
  return 1;
}

/* Continues a checksum (FNV-1a over words) with the bits of some numbers. */
static inline uint32_t policy_checksum(uint32_t sum, const float *values, long count) {
  long i;
  for (i = 0; i < count; i++) sum = (sum ^ policy_bits(values[i])) * 16777619u;
  return sum;
}

static inline uint32_t policy_checksum_of_all(void) {
  uint32_t sum = 2166136261u;
  int table;
  for (table = 0; table < POLICY_TABLES; table++) {
    sum = policy_checksum(sum, policy_tables[table].values, policy_tables[table].count);
  }
  return sum;
}
