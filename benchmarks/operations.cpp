// Time of one operation on LANES doubles, with as many independent ones under way as the core can take.

static double now() {
  timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

#define REPEATS 2000
#define INPUTS 16

// `operation` on a, b and c; the empty asm keeps the compiler from leaving anything out.
#define MEASURE(name, operation)                                                        \
  extern "C" EXPORT double name(void) {                                                 \
    Lanes in[INPUTS];                                                                   \
    for (int i = 0; i < INPUTS; ++i) in[i] = Lanes(0.3 + 0.04 * i);                     \
    const double started = now();                                                       \
    for (int r = 0; r < REPEATS; ++r) {                                                 \
      _Pragma("GCC unroll 16") for (int i = 0; i < INPUTS; ++i) {                       \
        Lanes a = in[i];                                                                \
        asm volatile("" : "+" REGISTER (a.v));                                           \
        Lanes z = operation;                                                            \
        asm volatile("" : : REGISTER (z.v));                                             \
      }                                                                                 \
    }                                                                                   \
    return (now() - started) / (REPEATS * INPUTS);                                      \
  }

#if defined(__x86_64__)
#define REGISTER "x"
#else
#define REGISTER "w"
#endif
#if defined(__AVX512F__)
#undef REGISTER
#define REGISTER "v"
#endif

MEASURE(time_multiply, a* a)
MEASURE(time_divide, a / Lanes(1.7))
MEASURE(time_sqrt, sqrt(a))
MEASURE(time_sin, sin(a))
MEASURE(time_cos, cos(a))
MEASURE(time_acos, acos(a))
MEASURE(time_atan2, atan2(a, a))
