// A number type of LANES doubles, one per candidate, with which CasADi's generated code computes LANES candidates at once.
//
// LANES is 1, 2, 4 or 8. Nothing here depends on the other lanes, so a candidate's result does not depend on its
// neighbours. Comparisons give 0 or 1 per lane. fmin and fmax return their first argument where it is NaN.

#include <math.h>

#ifndef LANES
#error "LANES must be defined as 1, 2, 4 or 8"
#endif

#if LANES == 1
typedef double Vector;
typedef long long Mask;
#else
typedef double Vector __attribute__((vector_size(8 * LANES)));
typedef long long Mask __attribute__((vector_size(8 * LANES)));
#endif

#define ALWAYS_INLINE inline __attribute__((always_inline))
#define EXPORT __attribute__((visibility("default")))

struct Lanes {
  Vector v;
  Lanes() = default;
#if LANES == 1
  ALWAYS_INLINE Lanes(double s) : v(s) {}
#else
  ALWAYS_INLINE Lanes(double s) : v(s - Vector{}) {}  // minus zero keeps the sign of -0.0
  ALWAYS_INLINE Lanes(Vector v_) : v(v_) {}
#endif
  ALWAYS_INLINE Lanes& operator+=(Lanes b) { v += b.v; return *this; }
  ALWAYS_INLINE Lanes& operator-=(Lanes b) { v -= b.v; return *this; }
  ALWAYS_INLINE Lanes& operator*=(Lanes b) { v *= b.v; return *this; }
  ALWAYS_INLINE Lanes& operator/=(Lanes b) { v /= b.v; return *this; }
  ALWAYS_INLINE double operator[](int i) const {
#if LANES == 1
    (void)i;
    return v;
#else
    return v[i];
#endif
  }
  ALWAYS_INLINE void set(int i, double s) {
#if LANES == 1
    (void)i;
    v = s;
#else
    v[i] = s;
#endif
  }
};

static ALWAYS_INLINE Lanes operator+(Lanes a, Lanes b) { return a.v + b.v; }
static ALWAYS_INLINE Lanes operator-(Lanes a, Lanes b) { return a.v - b.v; }
static ALWAYS_INLINE Lanes operator*(Lanes a, Lanes b) { return a.v * b.v; }
static ALWAYS_INLINE Lanes operator/(Lanes a, Lanes b) { return a.v / b.v; }
static ALWAYS_INLINE Lanes operator+(Lanes a) { return a; }
static ALWAYS_INLINE Lanes operator-(Lanes a) { return -a.v; }

#if LANES == 1
static ALWAYS_INLINE Lanes select(Mask mask, Lanes a, Lanes b) { return mask ? a : b; }
static ALWAYS_INLINE Mask negation(Mask mask) { return !mask; }
#else
static ALWAYS_INLINE Lanes select(Mask mask, Lanes a, Lanes b) { return mask ? a.v : b.v; }
static ALWAYS_INLINE Mask negation(Mask mask) { return ~mask; }
#endif
static ALWAYS_INLINE Lanes truth(Mask mask) { return select(mask, 1.0, 0.0); }

static ALWAYS_INLINE Lanes operator<(Lanes a, Lanes b) { return truth(a.v < b.v); }
static ALWAYS_INLINE Lanes operator<=(Lanes a, Lanes b) { return truth(a.v <= b.v); }
static ALWAYS_INLINE Lanes operator>(Lanes a, Lanes b) { return truth(a.v > b.v); }
static ALWAYS_INLINE Lanes operator>=(Lanes a, Lanes b) { return truth(a.v >= b.v); }
static ALWAYS_INLINE Lanes operator==(Lanes a, Lanes b) { return truth(a.v == b.v); }
static ALWAYS_INLINE Lanes operator!=(Lanes a, Lanes b) { return truth(a.v != b.v); }
static ALWAYS_INLINE Lanes operator!(Lanes a) { return truth(a.v == Lanes(0.0).v); }
static ALWAYS_INLINE Lanes operator&&(Lanes a, Lanes b) { return truth((a.v != Lanes(0.0).v) & (b.v != Lanes(0.0).v)); }
static ALWAYS_INLINE Lanes operator||(Lanes a, Lanes b) { return truth((a.v != Lanes(0.0).v) | (b.v != Lanes(0.0).v)); }

static ALWAYS_INLINE Lanes fmin(Lanes a, Lanes b) { return select(b.v < a.v, b, a); }
static ALWAYS_INLINE Lanes fmax(Lanes a, Lanes b) { return select(b.v > a.v, b, a); }
static ALWAYS_INLINE Lanes if_else_zero(Lanes condition, Lanes value) {
  return select(condition.v != Lanes(0.0).v, value, 0.0);
}

template <typename Scalar> static ALWAYS_INLINE Lanes each_lane(Scalar function, Lanes a) {
  Lanes r;
  for (int i = 0; i < LANES; ++i) r.set(i, function(a[i]));
  return r;
}
template <typename Scalar> static ALWAYS_INLINE Lanes each_lane(Scalar function, Lanes a, Lanes b) {
  Lanes r;
  for (int i = 0; i < LANES; ++i) r.set(i, function(a[i], b[i]));
  return r;
}

static ALWAYS_INLINE Lanes fabs(Lanes a) { return each_lane([](double s) { return __builtin_fabs(s); }, a); }
static ALWAYS_INLINE Lanes sqrt(Lanes a) { return each_lane([](double s) { return __builtin_sqrt(s); }, a); }

// Transcendental functions: one call of glibc's vector library for all lanes where it has the function, else libm lane by
// lane. The names of the vector functions are those of the x86-64 vector ABI.
#if defined(__x86_64__) && defined(__GLIBC__) && LANES > 1 && !defined(NO_VECTOR_LIBM)
#define HAS_VECTOR_LIBM(major, minor) __GLIBC_PREREQ(major, minor)
#else
#define HAS_VECTOR_LIBM(major, minor) 0
#endif
#if LANES == 8
#define VECTOR_NAME(arguments, name) _ZGVeN8##arguments##_##name
#elif LANES == 4
#define VECTOR_NAME(arguments, name) _ZGVdN4##arguments##_##name
#else
#define VECTOR_NAME(arguments, name) _ZGVbN2##arguments##_##name
#endif
#define LANE_BY_LANE_1(name) \
  static ALWAYS_INLINE Lanes name(Lanes a) { return each_lane([](double s) { return ::name(s); }, a); }
#define LANE_BY_LANE_2(name) \
  static ALWAYS_INLINE Lanes name(Lanes a, Lanes b) { \
    return each_lane([](double s, double t) { return ::name(s, t); }, a, b); \
  }
#define VECTORISED_1(name) \
  extern "C" Vector VECTOR_NAME(v, name)(Vector); \
  static ALWAYS_INLINE Lanes name(Lanes a) { return VECTOR_NAME(v, name)(a.v); }
#define VECTORISED_2(name) \
  extern "C" Vector VECTOR_NAME(vv, name)(Vector, Vector); \
  static ALWAYS_INLINE Lanes name(Lanes a, Lanes b) { return VECTOR_NAME(vv, name)(a.v, b.v); }

#if HAS_VECTOR_LIBM(2, 22)
VECTORISED_1(sin)
VECTORISED_1(cos)
VECTORISED_1(exp)
VECTORISED_1(log)
VECTORISED_2(pow)
#else
LANE_BY_LANE_1(sin)
LANE_BY_LANE_1(cos)
LANE_BY_LANE_1(exp)
LANE_BY_LANE_1(log)
LANE_BY_LANE_2(pow)
#endif
#if HAS_VECTOR_LIBM(2, 35)
VECTORISED_1(tan)
VECTORISED_1(asin)
VECTORISED_1(acos)
VECTORISED_1(atan)
VECTORISED_1(sinh)
VECTORISED_1(cosh)
VECTORISED_1(tanh)
VECTORISED_1(asinh)
VECTORISED_1(acosh)
VECTORISED_1(atanh)
VECTORISED_1(erf)
VECTORISED_2(atan2)
VECTORISED_2(hypot)
#else
LANE_BY_LANE_1(tan)
LANE_BY_LANE_1(asin)
LANE_BY_LANE_1(acos)
LANE_BY_LANE_1(atan)
LANE_BY_LANE_1(sinh)
LANE_BY_LANE_1(cosh)
LANE_BY_LANE_1(tanh)
LANE_BY_LANE_1(asinh)
LANE_BY_LANE_1(acosh)
LANE_BY_LANE_1(atanh)
LANE_BY_LANE_1(erf)
LANE_BY_LANE_2(atan2)
LANE_BY_LANE_2(hypot)
#endif
LANE_BY_LANE_1(floor)
LANE_BY_LANE_1(ceil)
LANE_BY_LANE_1(log1p)
LANE_BY_LANE_1(expm1)
LANE_BY_LANE_2(fmod)
LANE_BY_LANE_2(copysign)
LANE_BY_LANE_2(remainder)
static ALWAYS_INLINE Lanes sign_of(Lanes a) {
  return select(a.v < Lanes(0.0).v, -1.0, select(a.v > Lanes(0.0).v, 1.0, a));
}
