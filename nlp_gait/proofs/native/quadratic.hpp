// Quadratic forms over boxes: an interpreter of a function's instructions, LANES boxes at once.
//
// A quantity is c + sum g_i e_i + sum_(i<=j) h_ij e_i e_j + d t with the symbols e_i in [-1, 1] that the inputs share and an error
// t in [-1, 1] of its own, and it lies in [lo, hi] as well. All rounding errors go into d: with magnitudes C = |c|, G = sum |g_i|,
// H = sum |h_ij| the coefficients of a sum err by less than UNIT (C + G + H) of both together, those of a product by less than
// UNIT times the product of both (a coefficient is a sum of four products at most; UNIT is eight half units in the last place).
// Roots and reciprocals are their Taylor polynomial of degree two with an enclosed remainder. Where something is undefined on
// part of a box, a form is lost: its error is infinite.
//
// Source: Messine (2002), Extensions of affine arithmetic, with all mixed terms kept; rounding as in affine.hpp.

#include <math.h>

#define EXPORT __attribute__((visibility("default")))
#define LANES 8
typedef double V __attribute__((vector_size(8 * LANES)));
typedef long long Mask __attribute__((vector_size(8 * LANES)));

enum { MOST = 12 };  // symbols
static const double UNIT = 0x1p-50;
static const double ROOM = 1 + 0x1p-40;  // on sums of up to 1000 magnitudes
static const double TINY = 1e-290;       // more than what underflows
static const double LARGEST = 1e100;     // of any part of a form

static inline V splat(double s) { return s - V{}; }
static inline V size_of(V a) { return (V)((Mask)a & 0x7fffffffffffffffLL); }
static inline V least(V a, V b) { return a < b ? a : b; }
static inline V most(V a, V b) { return a > b ? a : b; }
static inline V down(V a) { return a - (0x1p-51 * size_of(a) + TINY); }
static inline V up(V a) { return a + (0x1p-51 * size_of(a) + TINY); }

// Places of a form's parts; h is the upper triangle, column by column: h_ij of i <= j is at j (j + 1) / 2 + i. A form that
// depends on the first m symbols has zeros elsewhere.
struct Layout {
  int n, h, d, lo, hi, G, H, size;
  explicit constexpr Layout(int n_)
      : n(n_), h(1 + n_), d(1 + n_ + n_ * (n_ + 1) / 2), lo(d + 1), hi(d + 2), G(d + 3), H(d + 4), size(d + 5) {}
};

static inline bool any(Mask mask) {
  long long found = 0;
  for (int l = 0; l < LANES; ++l) found |= mask[l];
  return found != 0;
}

// After c, g, h, d and first bounds of the value: magnitudes, and what the form says of the range.
template <int M>
static inline void settle(const Layout& at, V* z) {
  V G = V{}, H = V{}, other = V{}, positive = V{}, negative = V{};
  for (int i = 1; i <= M; ++i) G += size_of(z[i]);
  const V* h = z + at.h;
  for (int j = 0; j < M; ++j, h += j) {
    for (int i = 0; i + 1 < j; i += 2) H += size_of(h[i]), other += size_of(h[i + 1]);
    if (j % 2) H += size_of(h[j - 1]);
    positive += most(h[j], V{});
    negative += most(-h[j], V{});
  }
  G *= ROOM, H = (H + other) * ROOM, positive *= ROOM, negative *= ROOM;
  const V off = z[at.d] + G + H, slack = UNIT * (size_of(z[0]) + off + positive + negative);
  const V lo = most(z[at.lo], z[0] - (off + negative) * ROOM - slack);
  const V hi = least(z[at.hi], z[0] + (off + positive) * ROOM + slack);
  H = (H + positive + negative) * ROOM;
  z[at.lo] = lo, z[at.hi] = hi, z[at.G] = G, z[at.H] = H;
  const Mask lost = ~((size_of(z[0]) + G + H + z[at.d] < LARGEST) & (lo <= hi));
  // An error wider than the range: the range says more.
  const V middle = lo * 0.5 + hi * 0.5, half = up(most(hi - middle, middle - lo));
  const Mask vague = z[at.d] > half;
  if (any(lost | vague))
    for (int l = 0; l < LANES; ++l) {
      if (!lost[l] && !vague[l]) continue;
      for (int i = 0; i < at.d; ++i) z[i][l] = 0.0;
      z[0][l] = lost[l] ? 0.0 : middle[l];
      z[at.d][l] = lost[l] ? INFINITY : half[l];
      if (lost[l]) z[at.lo][l] = -INFINITY, z[at.hi][l] = INFINITY;
      z[at.G][l] = 0.0, z[at.H][l] = 0.0;
    }
}

// Zeros in place of what is with symbols beyond the first M.
template <int M>
static inline void clear_rest(const Layout& at, V* z) {
  for (int i = 1 + M; i <= at.n; ++i) z[i] = V{};
  for (int i = at.h + M * (M + 1) / 2; i < at.d; ++i) z[i] = V{};
}

static inline V magnitude(const Layout& at, const V* x) { return size_of(x[0]) + x[at.G] + x[at.H]; }

template <int M>
static void sum(const Layout& at, V* z, const V* x, const V* y, double sign) {
  clear_rest<M>(at, z);
  for (int i = 0; i <= M; ++i) z[i] = x[i] + sign * y[i];
  for (int i = at.h; i < at.h + M * (M + 1) / 2; ++i) z[i] = x[i] + sign * y[i];
  z[at.d] = (x[at.d] + y[at.d] + UNIT * (magnitude(at, x) + magnitude(at, y))) * ROOM;
  z[at.lo] = down(x[at.lo] + (sign > 0.0 ? y[at.lo] : -y[at.hi]));
  z[at.hi] = up(x[at.hi] + (sign > 0.0 ? y[at.hi] : -y[at.lo]));
  settle<M>(at, z);
}

static void shifted(const Layout& at, V* z, const V* x, double k) {
  for (int i = 1; i < at.size; ++i) z[i] = x[i];
  z[0] = x[0] + k;
  z[at.d] = (x[at.d] + UNIT * size_of(z[0])) * ROOM;
  z[at.lo] = down(x[at.lo] + k), z[at.hi] = up(x[at.hi] + k);
}

template <int M>
static void scaled(const Layout& at, V* z, const V* x, double k) {
  const double size = __builtin_fabs(k);
  clear_rest<M>(at, z);
  for (int i = 0; i <= M; ++i) z[i] = k * x[i];
  for (int i = at.h; i < at.h + M * (M + 1) / 2; ++i) z[i] = k * x[i];
  z[at.G] = x[at.G] * (size * ROOM), z[at.H] = x[at.H] * (size * ROOM);
  const V total = size_of(z[0]) + z[at.G] + z[at.H], kept = size == 0.0 ? V{} : size * x[at.d];
  z[at.d] = (kept + UNIT * total) * ROOM + TINY;
  const V a = k * x[at.lo], b = k * x[at.hi];
  z[at.lo] = size == 0.0 ? V{} : down(k > 0.0 ? a : b), z[at.hi] = size == 0.0 ? V{} : up(k > 0.0 ? b : a);
}

template <int M>
static void product(const Layout& at, V* z, const V* x, const V* y) {
  clear_rest<M>(at, z);
  const V cx = x[0], cy = y[0];
  z[0] = cx * cy;
  for (int i = 1; i <= M; ++i) z[i] = cx * y[i] + cy * x[i];
  for (int j = 0, k = at.h; j < M; ++j) {
    const V a = x[1 + j], b = y[1 + j];
    for (int i = 0; i < j; ++i, ++k) z[k] = (cx * y[k] + cy * x[k]) + (a * y[1 + i] + b * x[1 + i]);
    z[k] = cx * y[k] + cy * x[k] + a * b;
    ++k;
  }
  const V rx = x[at.H] + x[at.d], ry = y[at.H] + y[at.d];
  const V higher = x[at.G] * ry + rx * (y[at.G] + ry) + size_of(cx) * y[at.d] + size_of(cy) * x[at.d];
  z[at.d] = (higher + UNIT * (magnitude(at, x) * magnitude(at, y))) * ROOM + TINY;
  const V p = x[at.lo] * y[at.lo], q = x[at.lo] * y[at.hi], r = x[at.hi] * y[at.lo], s = x[at.hi] * y[at.hi];
  const V low = x == y ? (x[at.lo] > 0.0 ? p : x[at.hi] < 0.0 ? s : V{}) : least(least(p, q), least(r, s));
  z[at.lo] = down(low);
  z[at.hi] = up(most(most(p, q), most(r, s)));
  settle<M>(at, z);
}

// f(m) + f1 (x - m) + f2 (x - m)^2, each of the three known to eight half units, and a remainder; lo and hi of z are set.
template <int M>
static inline void taylor(const Layout& at, V* z, const V* x, V m, V f0, V f1, V f2, V remainder) {
  const V shift = x[0] - m, slope = f1 + 2.0 * f2 * shift;
  z[0] = f0 + shift * (f1 + f2 * shift);
  clear_rest<M>(at, z);
  for (int i = 1; i <= M; ++i) z[i] = slope * x[i];
  for (int j = 0, k = at.h; j < M; ++j) {
    const V a = f2 * x[1 + j];
    for (int i = 0; i < j; ++i, ++k) z[k] = slope * x[k] + 2.0 * (a * x[1 + i]);
    z[k] = slope * x[k] + a * x[1 + j];
    ++k;
  }
  const V first = size_of(f1), second = size_of(f2), G = x[at.G], rest = x[at.H] + x[at.d];
  const V moved = size_of(shift) + UNIT * (size_of(x[0]) + size_of(m)), all = moved + G + rest;
  V off = remainder + size_of(slope) * x[at.d] + second * (rest * (2.0 * G + rest));
  off += UNIT * 8.0 * (size_of(f0) + first * all + second * all * all) + UNIT * (first + 2.0 * second * all) * (size_of(x[0]) + size_of(m));
  z[at.d] = off * ROOM + TINY;
  settle<M>(at, z);
}

// Farthest of m within the range.
static inline V reach(const Layout& at, const V* x, V m) { return up(most(x[at.hi] - m, m - x[at.lo])); }

template <int M>
static void inverse(const Layout& at, V* z, const V* x) {
  const Mask bad = ~((x[at.lo] > 0.0) | (x[at.hi] < 0.0));
  const V m = x[at.lo] * 0.5 + x[at.hi] * 0.5, near = least(size_of(x[at.lo]), size_of(x[at.hi]));
  const V f0 = 1.0 / m, f1 = -f0 * f0, f2 = -f1 * f0, r = reach(at, x, m), square = near * near;
  const V a = 1.0 / x[at.hi], b = 1.0 / x[at.lo];
  z[at.lo] = down(bad ? splat(-INFINITY) : a), z[at.hi] = up(bad ? splat(INFINITY) : b);
  const V remainder = r * r * r / (square * square) * ROOM;  // |f'''| / 6 = 1 / x^4
  taylor<M>(at, z, x, m, f0, f1, f2, bad ? splat(INFINITY) : remainder);
}

static inline V root(V a) {
  V r;
  for (int l = 0; l < LANES; ++l) r[l] = __builtin_sqrt(a[l]);
  return r;
}

template <int M>
static void square_root(const Layout& at, V* z, const V* x) {
  const Mask bad = ~(x[at.lo] > 0.0);
  const V lo = bad ? splat(1.0) : x[at.lo], m = lo * 0.5 + x[at.hi] * 0.5;
  const V f0 = root(m), f1 = 0.5 / f0, f2 = -0.25 * f1 / m, r = reach(at, x, m), end = root(lo);
  z[at.lo] = down(end), z[at.hi] = up(root(x[at.hi]));
  const V remainder = r * r * r / (lo * lo * end) * (0.0625 * ROOM);  // |f'''| / 6 = x^(-5/2) / 16
  taylor<M>(at, z, x, m, f0, f1, f2, bad ? splat(INFINITY) : remainder);
}

// |x| lies between a x with a = (lo + hi) / (hi - lo), or with the sign where it is known, and that and the gap at both ends.
template <int M>
static void absolute(const Layout& at, V* z, const V* x) {
  const V lo = x[at.lo], hi = x[at.hi];
  const Mask above = lo >= 0.0, below = hi <= 0.0;
  const V slope = above ? splat(1.0) : below ? splat(-1.0) : (lo + hi) / (hi - lo);
  const V gap = above | below ? V{} : up(up(most(hi * (1.0 - slope), -lo * (1.0 + slope)))) * ROOM;
  for (int i = 0; i < at.d; ++i) z[i] = slope * x[i];
  z[0] += 0.5 * gap;
  z[at.d] = (size_of(slope) * x[at.d] + 0.5 * gap + UNIT * (magnitude(at, x) + gap)) * ROOM + TINY;
  z[at.lo] = above ? lo : below ? -hi : V{};
  z[at.hi] = most(size_of(lo), size_of(hi));
  settle<M>(at, z);
}

// The larger one of x and k: below the chord over the range, and above it less the gap where x = k.
template <int M>
static void larger(const Layout& at, V* z, const V* x, double k) {
  const V lo = x[at.lo], hi = x[at.hi];
  const Mask above = lo >= k, below = hi <= k;
  const V slope = above ? splat(1.0) : below ? V{} : (hi - k) / (hi - lo);
  const V base = above | below ? V{} : k - slope * lo, gap = above | below ? V{} : up(slope * (k - lo)) * ROOM;
  for (int i = 0; i < at.d; ++i) z[i] = slope * x[i];
  z[0] += below ? splat(k) : base - 0.5 * gap;
  z[at.d] = (slope * x[at.d] + 0.5 * gap + 4.0 * UNIT * (magnitude(at, x) + gap + size_of(lo) + __builtin_fabs(k))) * ROOM + TINY;
  z[at.lo] = most(lo, splat(k)), z[at.hi] = most(hi, splat(k));
  settle<M>(at, z);
}

// y where x < k, else 0; where both may be, all between them.
static void where_below(const Layout& at, V* z, const V* x, const V* y, double k) {
  const Mask always = x[at.hi] < k, never = x[at.lo] >= k;
  const V lo = least(y[at.lo], V{}), hi = most(y[at.hi], V{}), middle = lo * 0.5 + hi * 0.5;
  for (int i = 0; i < at.size; ++i) z[i] = always ? y[i] : V{};
  if (!any(~(always | never))) return;
  const Mask unknown = ~(always | never);
  z[0] = unknown ? middle : z[0];
  z[at.d] = unknown ? up(most(hi - middle, middle - lo)) : z[at.d];
  z[at.lo] = unknown ? lo : z[at.lo], z[at.hi] = unknown ? hi : z[at.hi];
}

// Operations of a tape (see quadratic.py); `value` is the number of those that have one.
enum Code { INPUT, NUMBER, OUTPUT, SUM, DIFFERENCE, SHIFT, SCALE, PRODUCT, INVERSE, ROOT, ABSOLUTE, LARGER, BELOW, WHERE_BELOW };

struct Step {
  int code, out, first, second, symbols;
};

// An operation among the first M symbols.
template <int M>
static void work(const Layout& at, const Step& now, double value, V* z, const V* x, const V* y) {
  switch (now.code) {
    case SUM: return sum<M>(at, z, x, y, 1.0);
    case DIFFERENCE: return sum<M>(at, z, x, y, -1.0);
    case SCALE: return scaled<M>(at, z, x, value);
    case PRODUCT: return product<M>(at, z, x, y);
    case INVERSE: return inverse<M>(at, z, x);
    case ROOT: return square_root<M>(at, z, x);
    case ABSOLUTE: return absolute<M>(at, z, x);
    case LARGER: return larger<M>(at, z, x, value);
  }
}

// Symbols of a form of n variables: forms come in some sizes only, known to the compiler.
static constexpr int SIZES[] = {2, 4, 7, 8, 9, MOST};
static inline int padded(int n) {
  int k = 0;
  while (SIZES[k] < n) ++k;
  return SIZES[k];
}

// Vectors of the memory for so many places.
static inline long long tape_vectors(const Layout& at, int slots) { return (long long)(slots + 2) * at.size; }

// Runs a tape over LANES boxes; box l is boxes[l], (inputs, 2). Input i is symbol i. result[l] is (outputs, size).
static void run_tape(const Layout& at, const Step* steps, const double* values, long long count, int slots, const double** boxes,
                     double** result, V* memory, V** places) {
  for (int k = 0; k <= slots; ++k) places[k] = memory + (long long)k * at.size;
  V* spare = memory + (long long)(slots + 1) * at.size;
  for (long long k = 0; k < count; ++k) {
    const Step& now = steps[k];
    if (now.code == OUTPUT) {
      const V* x = places[now.first];
      for (int l = 0; l < LANES; ++l)
        for (int part = 0; part < at.size; ++part) result[l][(long long)now.out * at.size + part] = x[part][l];
      continue;
    }
    const V* x = now.first >= 0 ? places[now.first] : nullptr;
    const V* y = now.second >= 0 ? places[now.second] : nullptr;
    V* z = spare;
    switch (now.code) {
      case INPUT:
      case NUMBER: {
        for (int i = 0; i < at.size; ++i) z[i] = V{};
        z[0] = z[at.lo] = z[at.hi] = splat(values[k]);
        if (now.code == INPUT) {
          const int i = (int)values[k];
          for (int l = 0; l < LANES; ++l) z[at.lo][l] = boxes[l][2 * i], z[at.hi][l] = boxes[l][2 * i + 1];
          z[0] = z[at.lo] * 0.5 + z[at.hi] * 0.5;
          z[at.G] = z[1 + i] = reach(at, z, z[0]);
        }
        break;
      }
      case SHIFT: shifted(at, z, x, values[k]); break;
      case BELOW:  // the argument, which is of interest only where it is at most the value
        for (int i = 0; i < at.size; ++i) z[i] = x[i];
        z[at.hi] = least(z[at.hi], splat(values[k]));
        z[at.d] = z[at.lo] <= z[at.hi] ? z[at.d] : splat(INFINITY);
        break;
      case WHERE_BELOW: where_below(at, z, x, y, values[k]); break;
      default:
        switch (now.symbols) {
          case 0: case 1: case 2: work<2>(at, now, values[k], z, x, y); break;
          case 3: case 4: work<4>(at, now, values[k], z, x, y); break;
          case 5: case 6: case 7: work<7>(at, now, values[k], z, x, y); break;
          case 8: work<8>(at, now, values[k], z, x, y); break;
          case 9: work<9>(at, now, values[k], z, x, y); break;
          default: work<MOST>(at, now, values[k], z, x, y);
        }
    }
    spare = places[now.out];
    places[now.out] = z;
  }
}

struct Tape {
  const Step* steps;
  const double* values;
  long long count;
  int slots;
};

// A tape with its memory; forms of LANES boxes at a time.
struct Runner {
  const Tape& tape;
  const Layout at;
  V* vectors;
  V** places;
  double* forms;

  Runner(const Tape& tape_, int n, double* memory) : tape(tape_), at(padded(n)) {
    vectors = (V*)(((unsigned long long)memory + sizeof(V) - 1) / sizeof(V) * sizeof(V));
    places = (V**)(vectors + tape_vectors(at, tape.slots));
    forms = (double*)(places + tape.slots + 1);
  }
  void run(int n, int outputs, const double* boxes, long long first, long long many) {
    const double* box[LANES];
    double* out[LANES];
    for (int l = 0; l < LANES; ++l) {
      box[l] = boxes + (first + l < many ? first + l : many - 1) * n * 2;
      out[l] = forms + (long long)l * outputs * at.size;
    }
    run_tape(at, tape.steps, tape.values, tape.count, tape.slots, box, out, vectors, places);
  }
};
