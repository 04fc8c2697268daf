// Affine arithmetic over boxes: an interpreter of a function's instructions, LANES boxes at once.
//
// A quantity is middle + sum slope_i e_i + error t with symbols e_i in [-1, 1] that the inputs share and its own t in [-1, 1]. It
// also lies in [lower, upper]; both enclosures are valid, and each sharpens the other. Every rounding error is added to the error:
// a sum or product errs by half a unit in its last place, and sums of magnitudes are enlarged by far more than their rounding
// errors (Stolfi, de Figueiredo 1997, sections 3.6 to 3.10; bounds of rounding errors as in Rump 2010, section 2). A nonlinear
// operation is replaced by its Taylor polynomial of degree one about the middle with an enclosed remainder; roots and reciprocals
// by the nearest line (Chebyshev). Where an operation is undefined on part of a box, the result is the whole line.

#define LANES 8
#define EACH _Pragma("GCC ivdep") for (int l = 0; l < LANES; ++l)

// Numbers of CasADi's operations, and two of our own (see HALF_OPEN_* in affine.py).
enum Operation {
  ASSIGN, ADD, SUB, MUL, DIV, NEG, EXP, LOG, POW, CONSTPOW, SQRT, SQ, TWICE, SIN, COS, TAN, ASIN, ACOS, ATAN, LT, LE, EQ, NE,
  NOT, AND, OR, FLOOR, CEIL, FMOD, FABS, SIGN, COPYSIGN, IF_ELSE_ZERO, ERF, FMIN, FMAX, INV, SINH, COSH, TANH, ASINH, ACOSH,
  ATANH, ATAN2, CONST, INPUT, OUTPUT, HALF_OPEN_LE = 200, HALF_OPEN_LT = 201
};

static const double UNIT = 0x1p-51;      // times magnitudes: more than three rounding errors
static const double ROOM = 1 + 0x1p-40;  // times sums of magnitudes: more than their rounding errors, for fewer than 1000 terms
static const double TINY = 1e-300;       // more than an underflow

// Places of a quantity's parts, each LANES numbers: middle, slope_0 ... slope_(n-1), error, lower, upper.
struct View {
  double* at;
  int n;
  double* middle() const { return at; }
  double* slope(int i) const { return at + (1 + i) * LANES; }
  double* error() const { return at + (1 + n) * LANES; }
  double* lower() const { return at + (2 + n) * LANES; }
  double* upper() const { return at + (3 + n) * LANES; }
  Interval range(int l) const { return Interval(lower()[l], upper()[l]); }
};

// A line near a function, alpha x + beta y + gamma with an error of at most delta, and the function's range.
struct Line {
  double alpha = 0.0, beta = 0.0, gamma = 0.0, delta = INFINITY;
  Interval range = whole();
};

static inline double magnitude(Interval a) { return most(__builtin_fabs(a.lo), __builtin_fabs(a.hi)); }
static inline double middle(Interval a) { return 0.5 * a.lo + 0.5 * a.hi; }
// An upper bound of the distance from a point of the interval to its farther end.
static inline double reach(Interval a, double m) { return up(most(up(a.hi - m), up(m - a.lo))); }

static inline Line constant(Interval a) {
  Line line;
  line.range = a;
  if (a.lo == a.hi) {
    line.gamma = a.lo;
    line.delta = 0.0;
  } else if (a.hi - a.lo < INFINITY) {
    line.gamma = middle(a);
    line.delta = reach(a, line.gamma);
  }
  return line;
}

// The line of a function f for which f - alpha x - beta y lies in `rest`.
static inline Line make_line(double alpha, Interval rest, Interval range, double beta = 0.0) {
  Line line = constant(rest);
  if (!(line.delta + __builtin_fabs(alpha) + __builtin_fabs(beta) < INFINITY)) return constant(range);
  line.alpha = alpha;
  line.beta = beta;
  line.range = range;
  return line;
}

// f = f(m) + f'(m) (x - m) + f'' / 2 (x - m)^2 with f'' anywhere in the box.
template <typename F, typename D, typename S>
static inline Line taylor(Interval x, F f, D first, S second) {
  const Interval range = f(x);
  if (x.lo == x.hi || !(x.hi - x.lo < INFINITY)) return constant(range);
  const double m = middle(x), r = reach(x, m);
  const Interval bend = second(x), slope = first(Interval(m));
  if (!(magnitude(bend) < 1e150) || !(magnitude(slope) < 1e150)) return constant(range);
  const double alpha = middle(slope);
  const Interval square(0.0, up(r * r));
  const Interval rest = f(Interval(m)) - Interval(alpha) * Interval(m) +
                        (slope - Interval(alpha)) * Interval(-r, r) + Interval(0.5) * bend * square;
  return make_line(alpha, rest, range);
}

// A convex f (or a concave one, sense -1) lies below its chord, and above the line that touches it at u.
template <typename F, typename D>
static inline Line chord(Interval x, double sense, F f, D first, double u, double alpha) {
  const Interval range = f(x);
  if (!(u >= x.lo && u <= x.hi)) u = middle(x);
  const Interval a(alpha);
  const Interval left = f(Interval(x.lo)) - a * Interval(x.lo), right = f(Interval(x.hi)) - a * Interval(x.hi);
  const double far = most(up(x.hi - u), up(u - x.lo));
  const Interval touch = f(Interval(u)) - a * Interval(u) + (first(Interval(u)) - a) * Interval(-far, far);
  const Interval rest = sense > 0.0 ? Interval(touch.lo, most(left.hi, right.hi))
                                    : Interval(least(left.lo, right.lo), touch.hi);
  return rest.lo <= rest.hi ? make_line(alpha, rest, range) : constant(range);
}

static inline Interval power(Interval a, int k) {  // k >= 0
  if (k == 0) return Interval(1.0);
  if (k % 2 == 0) return squared(power(a, k / 2));
  Interval r = a;
  if (k > 1) {  // odd: rising
    const Interval low = power(Interval(a.lo), k - 1) * Interval(a.lo), high = power(Interval(a.hi), k - 1) * Interval(a.hi);
    r = Interval(low.lo, high.hi);
  }
  return r;
}
static inline Interval reciprocal(Interval a) { return Interval(1.0) / a; }
static inline Interval sinh(Interval a) { return outward(::sinh(a.lo), ::sinh(a.hi), LIBM_UNITS); }
static inline Interval cosh(Interval a) {
  const Interval b = fabs(a);
  return outward(::cosh(b.lo), ::cosh(b.hi), LIBM_UNITS);
}
static inline Interval tan(Interval a) {
  const double half = 1.5707963267948966;
  return a.lo > -half && a.hi < half ? outward(::tan(a.lo), ::tan(a.hi), LIBM_UNITS) : whole();
}

static Line square_root(Interval x) {
  const auto f = [](Interval v) { return sqrt(v); };
  if (!(x.lo >= 0.0) || !(x.hi < INFINITY) || x.lo == x.hi) return constant(f(x));
  const double alpha = 1.0 / (__builtin_sqrt(x.lo) + __builtin_sqrt(x.hi));
  return chord(x, -1.0, f, [](Interval v) { return Interval(0.5) / sqrt(v); }, 0.25 / (alpha * alpha), alpha);
}
static Line inverse(Interval x) {
  const auto f = [](Interval v) { return reciprocal(v); };
  if (contains(x, 0.0) || !(x.hi - x.lo < INFINITY) || x.lo == x.hi) return constant(f(x));
  const double alpha = -1.0 / x.lo / x.hi, u = __builtin_sqrt(-1.0 / alpha);
  return chord(x, x.lo > 0.0 ? 1.0 : -1.0, f, [](Interval v) { return -squared(reciprocal(v)); }, x.lo > 0.0 ? u : -u, alpha);
}
static Line square(Interval x) {
  const double inf = INFINITY;
  if (!(x.hi - x.lo < inf) || x.lo == x.hi) return constant(squared(x));
  return chord(x, 1.0, [](Interval v) { return squared(v); }, [](Interval v) { return v + v; }, middle(x), x.lo + x.hi);
}
static Line absolute(Interval x) {
  Line line;
  line.range = fabs(x);
  if (x.lo >= 0.0 || x.hi <= 0.0) {
    line.alpha = x.lo >= 0.0 ? 1.0 : -1.0;
    line.delta = 0.0;
    return line;
  }
  if (!(x.hi - x.lo < INFINITY)) return constant(line.range);
  const double alpha = (x.hi + x.lo) / (x.hi - x.lo);  // |x| - alpha x is 0 at 0 and greatest at an end
  const Interval a(alpha), low = Interval(-x.lo) - a * Interval(x.lo), high = Interval(x.hi) - a * Interval(x.hi);
  return make_line(alpha, Interval(0.0, most(low.hi, high.hi)), line.range);
}
static Line raise_to(Interval x, Interval exponent) {
  const double p = exponent.lo;
  if (exponent.lo != exponent.hi || !(__builtin_fabs(p) < 64.0)) return Line();
  const int k = (int)p;
  if (k == p && k >= 2)
    return taylor(
        x, [k](Interval v) { return power(v, k); }, [k](Interval v) { return Interval(k) * power(v, k - 1); },
        [k](Interval v) { return Interval(k * (k - 1.0)) * power(v, k - 2); });
  if (k == p && k == 1) return make_line(1.0, Interval(0.0), x);
  if (k == p && k <= 0) return constant(reciprocal(power(x, -k)));
  return x.lo > 0.0 ? constant(exp(Interval(p) * log(x))) : Line();
}

static Line unary(int op, Interval x) {
  switch (op) {
    case EXP:
      return taylor(x, [](Interval v) { return exp(v); }, [](Interval v) { return exp(v); }, [](Interval v) { return exp(v); });
    case LOG:
      return taylor(x, [](Interval v) { return log(v); }, [](Interval v) { return reciprocal(v); },
                    [](Interval v) { return -squared(reciprocal(v)); });
    case SQRT: return square_root(x);
    case SQ: return square(x);
    case INV: return inverse(x);
    case FABS: return absolute(x);
    case SIN:
      return taylor(x, [](Interval v) { return sin(v); }, [](Interval v) { return cos(v); }, [](Interval v) { return -sin(v); });
    case COS:
      return taylor(x, [](Interval v) { return cos(v); }, [](Interval v) { return -sin(v); }, [](Interval v) { return -cos(v); });
    case TAN:
      return taylor(x, [](Interval v) { return tan(v); }, [](Interval v) { return Interval(1.0) + squared(tan(v)); },
                    [](Interval v) { return Interval(2.0) * tan(v) * (Interval(1.0) + squared(tan(v))); });
    case ASIN:
    case ACOS: {
      const double sense = op == ASIN ? 1.0 : -1.0;
      const auto slope = [sense](Interval v) { return Interval(sense) / sqrt((Interval(1.0) - v) * (Interval(1.0) + v)); };
      const auto bend = [sense](Interval v) {
        const Interval s = (Interval(1.0) - v) * (Interval(1.0) + v);
        return Interval(sense) * v / (s * sqrt(s));
      };
      return op == ASIN ? taylor(x, [](Interval v) { return asin(v); }, slope, bend)
                        : taylor(x, [](Interval v) { return acos(v); }, slope, bend);
    }
    case ATAN:
      return taylor(x, [](Interval v) { return atan(v); }, [](Interval v) { return reciprocal(Interval(1.0) + squared(v)); },
                    [](Interval v) { return Interval(-2.0) * v * squared(reciprocal(Interval(1.0) + squared(v))); });
    case SINH:
      return taylor(x, [](Interval v) { return sinh(v); }, [](Interval v) { return cosh(v); }, [](Interval v) { return sinh(v); });
    case COSH:
      return taylor(x, [](Interval v) { return cosh(v); }, [](Interval v) { return sinh(v); }, [](Interval v) { return cosh(v); });
    case TANH:
      return taylor(x, [](Interval v) { return tanh(v); }, [](Interval v) { return Interval(1.0) - squared(tanh(v)); },
                    [](Interval v) { return Interval(-2.0) * tanh(v) * (Interval(1.0) - squared(tanh(v))); });
    case SIGN: return constant(sign(x));
    case NOT: return constant(!x);
    case FLOOR: return constant(floor(x));
    case CEIL: return constant(-floor(-x));
    default: return Line();
  }
}

// The angle of a point: its second derivatives are at most 1 / distance^2 in every direction.
static Line angle(Interval y, Interval x) {
  Line line = constant(atan2(y, x));
  if ((x.lo <= 0.0 && contains(y, 0.0)) || !(x.hi - x.lo < INFINITY) || !(y.hi - y.lo < INFINITY)) return line;
  const double my = middle(y), mx = middle(x);
  const Interval nearest = squared(fabs(x)) + squared(fabs(y));
  if (!(nearest.lo > 1e-200)) return line;
  const Interval Y(my), X(mx), distance = squared(X) + squared(Y);
  const Interval by_y = X / distance, by_x = -(Y / distance);
  const double ry = reach(y, my), rx = reach(x, mx);
  const double alpha = middle(by_y), beta = middle(by_x);
  const double bend = up(up(up(up(rx * rx) + up(ry * ry)) / nearest.lo) * 0.5);
  const Interval rest = atan2(Y, X) - Interval(alpha) * Y - Interval(beta) * X + (by_y - Interval(alpha)) * Interval(-ry, ry) +
                        (by_x - Interval(beta)) * Interval(-rx, rx) + Interval(-bend, bend);
  return make_line(alpha, rest, line.range, beta);
}

static Line remainder_of(Interval x, Interval y) {
  if (y.lo != y.hi || y.lo == 0.0 || !(magnitude(x) < 1e15)) return Line();
  const double d = __builtin_fabs(y.lo);
  const Interval turns = x / Interval(d);
  const double low = __builtin_trunc(turns.lo), high = __builtin_trunc(turns.hi);
  if (low == high && x.lo != 0.0 && turns.lo * turns.hi > 0.0) {
    const Interval rest = -(Interval(low) * Interval(d));
    return make_line(1.0, rest, x + rest);
  }
  return constant(Interval(x.lo < 0.0 ? -d : 0.0, x.hi > 0.0 ? d : 0.0));
}

// The maximum, from bounds of the difference x - y: y + max(d, 0) = alpha x + (1 - alpha) y + rest.
static Line larger(Interval x, Interval y, Interval d) {
  Line line;
  line.range = fmax(x, y);
  if (d.lo >= 0.0 || d.hi <= 0.0) {
    (d.lo >= 0.0 ? line.alpha : line.beta) = 1.0;
    line.delta = 0.0;
    line.range = d.lo >= 0.0 ? x : y;
    return line;
  }
  if (!(d.hi - d.lo < INFINITY)) return constant(line.range);
  const double alpha = __builtin_floor(d.hi / (d.hi - d.lo) * 0x1p30) * 0x1p-30, beta = 1.0 - alpha;  // both exact
  return make_line(alpha, Interval(0.0, most(up(-alpha * d.lo), up(beta * d.hi))), line.range, beta);
}

static Line binary(int op, Interval x, Interval y, Interval difference) {
  switch (op) {
    case LT: return constant(x < y);
    case LE: return constant(x <= y);
    case EQ: return constant(x == y);
    case NE: return constant(x != y);
    case AND: return constant(x && y);
    case OR: return constant(x || y);
    case HALF_OPEN_LE: return constant(y.hi <= x.lo ? Interval(0.0) : x <= y);
    case HALF_OPEN_LT: return constant(x.hi <= y.lo ? Interval(1.0) : x < y);
    case POW:
    case CONSTPOW: return raise_to(x, y);
    case FMOD: return remainder_of(x, y);
    case ATAN2: return angle(x, y);
    case FMAX: return larger(x, y, difference);
    case FMIN: {
      Line line = larger(-x, -y, -difference);
      line.gamma = -line.gamma;
      line.range = -line.range;
      return line;
    }
    case COPYSIGN: {
      const Interval size = fabs(x);
      if (y.lo > 0.0) return constant(size);
      return constant(y.hi < 0.0 ? -size : Interval(-size.hi, size.hi));
    }
    case IF_ELSE_ZERO: {
      Line line;
      line.range = if_else_zero(x, y);
      if (is(x, 0.0)) return constant(Interval(0.0));
      if (!contains(x, 0.0)) {
        line.beta = 1.0;
        line.delta = 0.0;
        return line;
      }
      const double half = 0.5 * magnitude(y);
      if (!(half < INFINITY)) return constant(line.range);
      line.beta = 0.5;
      line.delta = half;
      return line;
    }
    default: return Line();
  }
}

// Sharpen the range of a result by its form; make a form from the range where there is none.
static inline void settle(View z) {
  double reached[LANES];
  double *c = z.middle(), *e = z.error(), *lo = z.lower(), *hi = z.upper();
  EACH reached[l] = e[l];
  for (int i = 0; i < z.n; ++i) {
    const double* a = z.slope(i);
    EACH reached[l] += __builtin_fabs(a[l]);
  }
  EACH {
    const double r = reached[l] * ROOM, low = c[l] - r, high = c[l] + r;
    const double below = low - (0x1p-52 * __builtin_fabs(low) + 0x1p-1074);
    const double above = high + (0x1p-52 * __builtin_fabs(high) + 0x1p-1074);
    lo[l] = below > lo[l] ? below : lo[l];
    hi[l] = above < hi[l] ? above : hi[l];
  }
  bool regular = true;
  EACH regular &= (reached[l] < INFINITY) & (lo[l] <= hi[l]);
  if (regular) return;
  EACH if (!(reached[l] < INFINITY) || !(lo[l] <= hi[l])) {
    if (!(lo[l] <= hi[l])) lo[l] = -INFINITY, hi[l] = INFINITY;
    const Line line = constant(z.range(l));
    c[l] = line.gamma;
    e[l] = line.delta;
    for (int i = 0; i < z.n; ++i) z.slope(i)[l] = 0.0;
  }
}

// z = alpha x + beta y + gamma with an error of delta; the range of z is already set. y may be missing.
static inline void combine(View z, View x, const double* alpha, const View* y, const double* beta, const double* gamma,
                           const double* delta) {
  double off[LANES], c[LANES], e[LANES];
  EACH {
    const double p = alpha[l] * x.middle()[l];
    off[l] = __builtin_fabs(p) + __builtin_fabs(gamma[l]);
    c[l] = p + gamma[l];
    e[l] = delta[l] + (alpha[l] == 0.0 ? 0.0 : __builtin_fabs(alpha[l]) * x.error()[l]);
  }
  if (y) EACH {
    const double p = beta[l] * y->middle()[l];
    off[l] += __builtin_fabs(p);
    c[l] += p;
    e[l] += beta[l] == 0.0 ? 0.0 : __builtin_fabs(beta[l]) * y->error()[l];
  }
  for (int i = 0; i < z.n; ++i) {
    double* a = z.slope(i);
    const double* xa = x.slope(i);
    if (y) {
      const double* ya = y->slope(i);
      EACH {
        const double p = alpha[l] * xa[l], q = beta[l] * ya[l];
        off[l] += __builtin_fabs(p) + __builtin_fabs(q);
        a[l] = p + q;
      }
    } else EACH {
      const double p = alpha[l] * xa[l];
      off[l] += __builtin_fabs(p);
      a[l] = p;
    }
  }
  EACH {
    const bool exact = (alpha[l] == 0.0 || __builtin_fabs(alpha[l]) == 1.0) && (!y || beta[l] == 0.0 || __builtin_fabs(beta[l]) == 1.0);
    z.middle()[l] = c[l];
    z.error()[l] = (e[l] + UNIT * off[l] * (exact && gamma[l] == 0.0 && (!y || alpha[l] * beta[l] == 0.0) ? 0.0 : 1.0)) * ROOM +
               (exact ? 0.0 : TINY);
  }
  settle(z);
}

// A sum never underflows. z may be x or y.
static inline void sum(View z, View x, View y, double sign) {
  double off[LANES];
  EACH {
    const double b = sign > 0.0 ? y.lower()[l] : -y.upper()[l], d = sign > 0.0 ? y.upper()[l] : -y.lower()[l];
    const double lo = x.lower()[l] + b, hi = x.upper()[l] + d, c = x.middle()[l] + sign * y.middle()[l];
    z.lower()[l] = lo == INFINITY ? __DBL_MAX__ : lo - 0x1p-52 * __builtin_fabs(lo);
    z.upper()[l] = hi == -INFINITY ? -__DBL_MAX__ : hi + 0x1p-52 * __builtin_fabs(hi);
    z.middle()[l] = c;
    z.error()[l] = x.error()[l] + y.error()[l];
    off[l] = __builtin_fabs(c);
  }
  for (int i = 0; i < z.n; ++i) {
    const double *xa = x.slope(i), *ya = y.slope(i);
    double* a = z.slope(i);
    EACH {
      const double s = xa[l] + sign * ya[l];
      a[l] = s;
      off[l] += __builtin_fabs(s);
    }
  }
  EACH z.error()[l] = (z.error()[l] + UNIT * off[l]) * ROOM;
  settle(z);
}

// (xc + sum xa s + xe t) (yc + sum ya s + ye t'): squares s_i^2 lie in [0, 1], all other products of symbols in [-1, 1].
static void product(View z, View x, View y) {
  double c[LANES], off[LANES], rx[LANES], ry[LANES], shared[LANES], squares[LANES], lo[LANES], hi[LANES], e[LANES];
  EACH {
    const Interval r = x.range(l) * y.range(l);
    lo[l] = r.lo, hi[l] = r.hi;
    c[l] = x.middle()[l] * y.middle()[l];
    off[l] = __builtin_fabs(c[l]);
    rx[l] = x.error()[l], ry[l] = y.error()[l];
    shared[l] = squares[l] = 0.0;
  }
  for (int i = 0; i < z.n; ++i) {
    const double *xa = x.slope(i), *ya = y.slope(i);
    EACH {
      const double p = xa[l] * ya[l];
      rx[l] += __builtin_fabs(xa[l]);
      ry[l] += __builtin_fabs(ya[l]);
      squares[l] += p;
      shared[l] += __builtin_fabs(p);
    }
  }
  EACH {
    const double rest = rx[l] * ry[l] * ROOM - 0.5 * shared[l] * (2.0 - ROOM);
    e[l] = (rest > 0.0 ? rest : 0.0) + __builtin_fabs(x.middle()[l]) * y.error()[l] + __builtin_fabs(y.middle()[l]) * x.error()[l];
    // For up to 1000 symbols the sum of squares errs by less than 2^-42 of its terms' magnitudes.
    e[l] += rx[l] * ry[l] * 0x1p-40 + 0x1p-42 * shared[l];
    off[l] += 0.5 * shared[l];
  }
  for (int i = 0; i < z.n; ++i) {
    const double *xa = x.slope(i), *ya = y.slope(i);
    double* a = z.slope(i);
    EACH {
      const double p = x.middle()[l] * ya[l], q = y.middle()[l] * xa[l];
      off[l] += __builtin_fabs(p) + __builtin_fabs(q);
      a[l] = p + q;
    }
  }
  EACH {
    z.middle()[l] = c[l] + 0.5 * squares[l];
    z.error()[l] = (e[l] + UNIT * off[l]) * ROOM + (is(x.range(l), 0.0) || is(y.range(l), 0.0) ? 0.0 : TINY);
    z.lower()[l] = lo[l], z.upper()[l] = hi[l];
  }
  settle(z);
}

static Interval difference_of(View x, View y, int l) {
  const Interval plain = x.range(l) - y.range(l);
  double r = x.error()[l] + y.error()[l], off = __builtin_fabs(x.middle()[l]) + __builtin_fabs(y.middle()[l]);
  for (int i = 0; i < x.n; ++i) {
    r += __builtin_fabs(x.slope(i)[l] - y.slope(i)[l]);
    off += __builtin_fabs(x.slope(i)[l]) + __builtin_fabs(y.slope(i)[l]);
  }
  r = (r + UNIT * off) * ROOM;
  const double c = x.middle()[l] - y.middle()[l], low = down(c - r), high = up(c + r);
  return low <= high ? Interval(most(plain.lo, low), least(plain.hi, high)) : plain;
}

static void apply(int op, View z, View x, const View* y) {
  double alpha[LANES], beta[LANES], gamma[LANES], delta[LANES], lo[LANES], hi[LANES];
  const bool compares = op == FMAX || op == FMIN;
  EACH {
    const Line line = y ? binary(op, x.range(l), y->range(l), compares ? difference_of(x, *y, l) : whole())
                        : unary(op, x.range(l));
    alpha[l] = line.alpha, beta[l] = line.beta, gamma[l] = line.gamma, delta[l] = line.delta;
    lo[l] = line.range.lo, hi[l] = line.range.hi;
  }
  EACH z.lower()[l] = lo[l], z.upper()[l] = hi[l];
  combine(z, x, alpha, y, beta, gamma, delta);
}

static void negate(View z, View x) {
  EACH {
    const double lo = x.lower()[l];
    z.middle()[l] = -x.middle()[l], z.error()[l] = x.error()[l], z.lower()[l] = -x.upper()[l], z.upper()[l] = -lo;
  }
  for (int i = 0; i < z.n; ++i) EACH z.slope(i)[l] = -x.slope(i)[l];
}

struct Instruction {
  int op, out, first, second;
};

// Number of doubles of the memory that the caller provides.
extern "C" EXPORT long long nlp_gait_affine_doubles(int slots, int n) { return (long long)(slots + 2) * (n + 4) * LANES; }

// Enclose a function over boxes.
//
//   code, constants  (count) instructions; an INPUT's `first` is its number, an OUTPUT's `out` its own and `first` a slot
//   symbols          (inputs) number of the symbol along which an input varies; -1 makes its width an error
//   boxes            (many, inputs, 2)
//   result           (many, outputs, n + 4): middle, slopes, error, lower, upper
extern "C" EXPORT void nlp_gait_affine(const Instruction* code, const double* constants, long long count, int n, int inputs,
                                       const int* symbols, long long many, const double* boxes, int outputs, double* result,
                                       double* memory) {
  const int width = (n + 4) * LANES;
  const auto at = [&](int slot) { return View{memory + (long long)(slot + 2) * width, n}; };
  const View spare{memory, n}, turned{memory + width, n};
  for (long long first = 0; first < many; first += LANES) {
    const auto box = [&](int l) { return first + l < many ? first + l : many - 1; };
    for (long long k = 0; k < count; ++k) {
      const Instruction& now = code[k];
      if (now.op == OUTPUT) {
        const View x = at(now.first);
        for (int l = 0; l < LANES && first + l < many; ++l)
          for (int part = 0; part < n + 4; ++part)
            result[((first + l) * outputs + now.out) * (n + 4) + part] = x.at[part * LANES + l];
        continue;
      }
      const View z = at(now.out);
      if (now.op == INPUT || now.op == CONST) {
        for (int i = 0; i < n; ++i) EACH z.slope(i)[l] = 0.0;
        EACH {
          const double* ends = now.op == INPUT ? boxes + (box(l) * inputs + now.first) * 2 : constants + k;
          const Interval r(ends[0], now.op == INPUT ? ends[1] : ends[0]);
          const Line line = constant(r);
          const int symbol = now.op == INPUT ? symbols[now.first] : -1;
          z.middle()[l] = line.gamma, z.error()[l] = line.delta, z.lower()[l] = r.lo, z.upper()[l] = r.hi;
          if (symbol >= 0 && line.delta < INFINITY) z.slope(symbol)[l] = line.delta, z.error()[l] = 0.0;
        }
        continue;
      }
      const View x = at(now.first);
      if (now.second < 0) {
        if (now.op == ASSIGN) {
          if (now.out != now.first) __builtin_memcpy(z.at, x.at, width * sizeof(double));
        } else if (now.op == NEG) negate(z, x);
        else if (now.op == TWICE) sum(z, x, x, 1.0);
        else apply(now.op, z, x, nullptr);
        continue;
      }
      const View y = at(now.second);
      // A result may be stored in the place of an argument, so it is computed in the spare place.
      const View r = now.out == now.first || now.out == now.second ? spare : z;
      if (now.op == ADD || now.op == SUB) sum(r, x, y, now.op == ADD ? 1.0 : -1.0);
      else if (now.op == MUL) product(r, x, y);
      else if (now.op == DIV) {
        apply(INV, turned, y, nullptr);
        product(r, x, turned);
      } else apply(now.op, r, x, &y);
      if (r.at == spare.at) __builtin_memcpy(z.at, spare.at, width * sizeof(double));
    }
  }
}
