// Closed intervals, rounded outward.
//
// Every result is widened outward by at least the rounding error of its operation: basic operations and the square root
// are rounded correctly (IEEE 754), so half a unit in the last place is enough for them and a whole one is taken; functions
// of libm get LIBM_UNITS units. What is undefined (0/0, NaN) is the whole line. Comparisons give [0, 0], [1, 1] or [0, 1].

#include <math.h>

#include <initializer_list>

#define EXPORT __attribute__((visibility("default")))
#define INLINED __attribute__((always_inline))
#define LIBM_UNITS 4.0

struct Interval {
  double lo, hi;
  Interval() = default;
  Interval(double s) : lo(s), hi(s) {}
  Interval(double lo_, double hi_) : lo(lo_), hi(hi_) {}
};

static inline double down(double s, double units = 1.0) {
  const double below = s - (units * 0x1p-52 * __builtin_fabs(s) + units * 0x1p-1074);
  return s == -INFINITY ? s : s == INFINITY ? __DBL_MAX__ : below;
}
static inline double up(double s, double units = 1.0) { return -down(-s, units); }
static inline Interval whole() { return Interval(-INFINITY, INFINITY); }
static inline Interval outward(double lo, double hi, double units = 1.0) {
  if (!(lo <= hi)) return whole();
  return Interval(down(lo, units), up(hi, units));
}
static inline double least(double a, double b) { return b < a ? b : a; }
static inline double most(double a, double b) { return b > a ? b : a; }
static inline bool contains(Interval a, double s) { return a.lo <= s && s <= a.hi; }
static inline bool is(Interval a, double s) { return (a.lo == s) & (a.hi == s); }

static inline Interval operator-(Interval a) { return Interval(-a.hi, -a.lo); }
static inline Interval operator+(Interval a, Interval b) { return outward(a.lo + b.lo, a.hi + b.hi); }
static inline Interval operator-(Interval a, Interval b) { return a + -b; }

// 0 times an infinite end is 0: an interval's end is a bound, not a value.
static inline double product(double s, double t) {
  const double p = s * t;
  return (s == 0.0) | (t == 0.0) ? 0.0 : p;
}
// Without branches, so that compilers multiply several intervals at once.
static inline INLINED Interval operator*(Interval a, Interval b) {
  const double p = product(a.lo, b.lo), q = product(a.lo, b.hi), r = product(a.hi, b.lo), s = product(a.hi, b.hi);
  const double low = least(least(p, q), least(r, s)), high = most(most(p, q), most(r, s));
  const bool bounded = low <= high, none = is(a, 0.0) | is(b, 0.0), second = is(a, 1.0), first = is(b, 1.0);
  const double lo = bounded ? down(low) : -INFINITY, hi = bounded ? up(high) : INFINITY;
  return Interval(none ? 0.0 : second ? b.lo : first ? a.lo : lo, none ? 0.0 : second ? b.hi : first ? a.hi : hi);
}
static inline Interval operator/(Interval a, Interval b) {
  if (contains(b, 0.0)) return whole();
  const double p = a.lo / b.lo, q = a.lo / b.hi, r = a.hi / b.lo, s = a.hi / b.hi;
  return outward(least(least(p, q), least(r, s)), most(most(p, q), most(r, s)));
}

static inline Interval verdict(bool always, bool never) { return Interval(always ? 1.0 : 0.0, never ? 0.0 : 1.0); }
static inline Interval operator<(Interval a, Interval b) { return verdict(a.hi < b.lo, a.lo >= b.hi); }
static inline Interval operator<=(Interval a, Interval b) { return verdict(a.hi <= b.lo, a.lo > b.hi); }
static inline Interval operator!(Interval a) { return verdict(is(a, 0.0), !contains(a, 0.0)); }
static inline Interval operator&&(Interval a, Interval b) {
  return verdict(!contains(a, 0.0) && !contains(b, 0.0), is(a, 0.0) || is(b, 0.0));
}
static inline Interval operator||(Interval a, Interval b) {
  return verdict(!contains(a, 0.0) || !contains(b, 0.0), is(a, 0.0) && is(b, 0.0));
}
static inline Interval operator==(Interval a, Interval b) {
  return verdict(a.lo == a.hi && b.lo == b.hi && a.lo == b.lo, a.hi < b.lo || b.hi < a.lo);
}
static inline Interval operator!=(Interval a, Interval b) { return !(a == b); }
static inline Interval if_else_zero(Interval condition, Interval value) {
  if (is(condition, 0.0)) return Interval(0.0);
  return contains(condition, 0.0) ? Interval(least(0.0, value.lo), most(0.0, value.hi)) : value;
}

static inline Interval fmax(Interval a, Interval b) { return Interval(most(a.lo, b.lo), most(a.hi, b.hi)); }
static inline Interval fabs(Interval a) {
  const double s = __builtin_fabs(a.lo), t = __builtin_fabs(a.hi);
  return Interval(contains(a, 0.0) ? 0.0 : least(s, t), most(s, t));
}
static inline Interval sign(Interval a) {
  return Interval(a.lo > 0.0 ? 1.0 : a.lo == 0.0 ? 0.0 : -1.0, a.hi < 0.0 ? -1.0 : a.hi == 0.0 ? 0.0 : 1.0);
}
static inline Interval squared(Interval a) {
  const Interval b = fabs(a);
  const Interval s = outward(b.lo * b.lo, b.hi * b.hi);
  return Interval(most(s.lo, 0.0), s.hi);
}
static inline Interval sqrt(Interval a) {
  if (a.hi < 0.0) return whole();
  const Interval s = outward(__builtin_sqrt(most(a.lo, 0.0)), __builtin_sqrt(a.hi));
  return a.lo < 0.0 ? whole() : Interval(most(s.lo, 0.0), s.hi);
}
static inline Interval within(Interval a, double lo, double hi) { return Interval(most(a.lo, lo), least(a.hi, hi)); }

// Whether a turning point (`at`, modulo the period) may lie in an interval, with a margin.
static inline bool may_turn(Interval a, double at) {
  const double period = 6.283185307179586, slack = 1e-9;
  const double n = floor((a.hi - at + slack) / period);
  return at + n * period >= a.lo - slack;
}
static inline Interval wave(Interval a, double top, double (*function)(double)) {
  if (!(a.hi - a.lo < 6.3) || !(__builtin_fabs(a.lo) < 1e6)) return Interval(-1.0, 1.0);
  const double s = function(a.lo), t = function(a.hi);
  const Interval r = outward(least(s, t), most(s, t), LIBM_UNITS);
  const double pi = 3.141592653589793;
  return within(Interval(may_turn(a, top + pi) ? -1.0 : r.lo, may_turn(a, top) ? 1.0 : r.hi), -1.0, 1.0);
}
static inline Interval sin(Interval a) { return wave(a, 1.5707963267948966, ::sin); }
static inline Interval cos(Interval a) { return wave(a, 0.0, ::cos); }
static inline Interval acos(Interval a) {
  if (a.hi < -1.0 || a.lo > 1.0) return whole();
  return outward(::acos(least(a.hi, 1.0)), ::acos(most(a.lo, -1.0)), LIBM_UNITS);
}
static inline Interval asin(Interval a) {
  if (a.hi < -1.0 || a.lo > 1.0) return whole();
  return outward(::asin(most(a.lo, -1.0)), ::asin(least(a.hi, 1.0)), LIBM_UNITS);
}
static inline Interval atan(Interval a) { return outward(::atan(a.lo), ::atan(a.hi), LIBM_UNITS); }
static inline Interval tanh(Interval a) { return outward(::tanh(a.lo), ::tanh(a.hi), LIBM_UNITS); }
static inline Interval exp(Interval a) { return outward(::exp(a.lo), ::exp(a.hi), LIBM_UNITS); }
static inline Interval log(Interval a) { return a.lo <= 0.0 ? whole() : outward(::log(a.lo), ::log(a.hi), LIBM_UNITS); }
static inline Interval floor(Interval a) { return Interval(__builtin_floor(a.lo), __builtin_floor(a.hi)); }
static inline Interval atan2(Interval y, Interval x) {
  const double pi = 3.1415926535897936;  // not below pi
  if (x.lo <= 0.0 && contains(y, 0.0)) return Interval(-pi, pi);  // the origin or the cut
  double lo = INFINITY, hi = -INFINITY;  // monotone in each argument away from them: the extremes are at corners
  for (double s : {y.lo, y.hi})
    for (double t : {x.lo, x.hi}) {
      const double angle = ::atan2(s, t);
      lo = least(lo, angle);
      hi = most(hi, angle);
    }
  return outward(lo, hi, LIBM_UNITS);
}
