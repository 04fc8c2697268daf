// The operations of operations.py on lanes (prefix v_) and on single numbers (s_).

#define NEVER_INLINE __attribute__((noinline))

static ALWAYS_INLINE Vector v_number(double s) { return Lanes(s).v; }
static ALWAYS_INLINE double s_number(double s) { return s; }
#define ONE_ARGUMENT(name)                                                      \
  static ALWAYS_INLINE Vector v_##name(Vector a) { return name(Lanes(a)).v; }   \
  static ALWAYS_INLINE double s_##name(double a) { return ::name(a); }
#define TWO_ARGUMENTS(name)                                                                         \
  static ALWAYS_INLINE Vector v_##name(Vector a, Vector b) { return name(Lanes(a), Lanes(b)).v; }   \
  static ALWAYS_INLINE double s_##name(double a, double b) { return ::name(a, b); }
#define COMPARISON(name, operation)                                                                       \
  static ALWAYS_INLINE Vector v_##name(Vector a, Vector b) { return (Lanes(a) operation Lanes(b)).v; }    \
  static ALWAYS_INLINE double s_##name(double a, double b) { return a operation b; }
COMPARISON(less, <)
COMPARISON(at_most, <=)
COMPARISON(equal, ==)
COMPARISON(unequal, !=)
COMPARISON(and, &&)
COMPARISON(or, ||)
static ALWAYS_INLINE Vector v_not(Vector a) { return (!Lanes(a)).v; }
static ALWAYS_INLINE double s_not(double a) { return !a; }
static ALWAYS_INLINE Vector v_sign(Vector a) { return ((Lanes(a) > Lanes(0.0)) - (Lanes(a) < Lanes(0.0))).v; }
static ALWAYS_INLINE double s_sign(double a) { return (a > 0.0) - (a < 0.0); }
static ALWAYS_INLINE Vector v_if_else_zero(Vector a, Vector b) { return if_else_zero(Lanes(a), Lanes(b)).v; }
static ALWAYS_INLINE double s_if_else_zero(double a, double b) { return a != 0.0 ? b : 0.0; }
