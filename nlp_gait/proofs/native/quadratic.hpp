// Quadratic forms over boxes: an interpreter of a function's instructions, LANES boxes at once.
//
// A quantity is middle + sum slope_i e_i + sum_(i<=j) bend_ij e_i e_j + error t with symbols e_i in [-1, 1] that the inputs share
// and its own t in [-1, 1], and it also lies in [lower, upper]. All rounding errors are added to the error: with the magnitude
// |middle| + slope_sum + bend_sum, the coefficients of a sum err by less than UNIT times the sum of both magnitudes, those of a
// product by less than UNIT times the product of both (a coefficient is a sum of at most four products; UNIT is eight half units in
// the last place). Roots and reciprocals are Taylor polynomials of degree two with an enclosed remainder. Where an operation is
// undefined on part of a box, there is no form: the error is infinite.
//
// Source: Messine (2002), Extensions of affine arithmetic, with all mixed terms; rounding as in affine.hpp.

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

// Places of a form's parts: the middle, slopes from 1 on, bends (upper triangle by columns: i <= j is at j (j + 1) / 2 + i), ...
// A form that depends on the first m symbols has zeros elsewhere.
struct Layout {
  int n, bends, error, lower, upper, slope_sum, bend_sum, size;
  explicit constexpr Layout(int n_)
      : n(n_), bends(1 + n_), error(1 + n_ + n_ * (n_ + 1) / 2), lower(error + 1), upper(error + 2), slope_sum(error + 3),
        bend_sum(error + 4), size(error + 5) {}
};

static inline bool any(Mask mask) {
  long long found = 0;
  for (int l = 0; l < LANES; ++l) found |= mask[l];
  return found != 0;
}

// Compute the magnitudes of a result, and sharpen its range by its form.
template <int M>
static inline void settle(const Layout& at, V* z) {
  V G = V{}, H = V{}, other = V{}, positive = V{}, negative = V{};
  for (int i = 1; i <= M; ++i) G += size_of(z[i]);
  const V* h = z + at.bends;
  for (int j = 0; j < M; ++j, h += j) {
    for (int i = 0; i + 1 < j; i += 2) H += size_of(h[i]), other += size_of(h[i + 1]);
    if (j % 2) H += size_of(h[j - 1]);
    positive += most(h[j], V{});
    negative += most(-h[j], V{});
  }
  G *= ROOM, H = (H + other) * ROOM, positive *= ROOM, negative *= ROOM;
  const V off = z[at.error] + G + H, slack = UNIT * (size_of(z[0]) + off + positive + negative);
  const V lo = most(z[at.lower], z[0] - (off + negative) * ROOM - slack);
  const V hi = least(z[at.upper], z[0] + (off + positive) * ROOM + slack);
  H = (H + positive + negative) * ROOM;
  z[at.lower] = lo, z[at.upper] = hi, z[at.slope_sum] = G, z[at.bend_sum] = H;
  const Mask lost = ~((size_of(z[0]) + G + H + z[at.error] < LARGEST) & (lo <= hi));
  // If the error is wider than the range, the range is the better enclosure.
  const V middle = lo * 0.5 + hi * 0.5, half = up(most(hi - middle, middle - lo));
  const Mask vague = z[at.error] > half;
  if (any(lost | vague))
    for (int l = 0; l < LANES; ++l) {
      if (!lost[l] && !vague[l]) continue;
      for (int i = 0; i < at.error; ++i) z[i][l] = 0.0;
      z[0][l] = lost[l] ? 0.0 : middle[l];
      z[at.error][l] = lost[l] ? INFINITY : half[l];
      if (lost[l]) z[at.lower][l] = -INFINITY, z[at.upper][l] = INFINITY;
      z[at.slope_sum][l] = 0.0, z[at.bend_sum][l] = 0.0;
    }
}

// Set the coefficients of symbols after the first M to zero.
template <int M>
static inline void clear_rest(const Layout& at, V* z) {
  for (int i = 1 + M; i <= at.n; ++i) z[i] = V{};
  for (int i = at.bends + M * (M + 1) / 2; i < at.error; ++i) z[i] = V{};
}

static inline V magnitude(const Layout& at, const V* x) { return size_of(x[0]) + x[at.slope_sum] + x[at.bend_sum]; }

template <int M>
static void sum(const Layout& at, V* z, const V* x, const V* y, double sign) {
  clear_rest<M>(at, z);
  for (int i = 0; i <= M; ++i) z[i] = x[i] + sign * y[i];
  for (int i = at.bends; i < at.bends + M * (M + 1) / 2; ++i) z[i] = x[i] + sign * y[i];
  z[at.error] = (x[at.error] + y[at.error] + UNIT * (magnitude(at, x) + magnitude(at, y))) * ROOM;
  z[at.lower] = down(x[at.lower] + (sign > 0.0 ? y[at.lower] : -y[at.upper]));
  z[at.upper] = up(x[at.upper] + (sign > 0.0 ? y[at.upper] : -y[at.lower]));
  settle<M>(at, z);
}

static void shift(const Layout& at, V* z, const V* x, double k) {
  for (int i = 1; i < at.size; ++i) z[i] = x[i];
  z[0] = x[0] + k;
  z[at.error] = (x[at.error] + UNIT * size_of(z[0])) * ROOM;
  z[at.lower] = down(x[at.lower] + k), z[at.upper] = up(x[at.upper] + k);
}

template <int M>
static void scale(const Layout& at, V* z, const V* x, double k) {
  const double size = __builtin_fabs(k);
  clear_rest<M>(at, z);
  for (int i = 0; i <= M; ++i) z[i] = k * x[i];
  for (int i = at.bends; i < at.bends + M * (M + 1) / 2; ++i) z[i] = k * x[i];
  z[at.slope_sum] = x[at.slope_sum] * (size * ROOM), z[at.bend_sum] = x[at.bend_sum] * (size * ROOM);
  const V total = size_of(z[0]) + z[at.slope_sum] + z[at.bend_sum], kept = size == 0.0 ? V{} : size * x[at.error];
  z[at.error] = (kept + UNIT * total) * ROOM + TINY;
  const V a = k * x[at.lower], b = k * x[at.upper];
  z[at.lower] = size == 0.0 ? V{} : down(k > 0.0 ? a : b), z[at.upper] = size == 0.0 ? V{} : up(k > 0.0 ? b : a);
}

template <int M>
static void product(const Layout& at, V* z, const V* x, const V* y) {
  clear_rest<M>(at, z);
  const V cx = x[0], cy = y[0];
  z[0] = cx * cy;
  for (int i = 1; i <= M; ++i) z[i] = cx * y[i] + cy * x[i];
  for (int j = 0, k = at.bends; j < M; ++j) {
    const V a = x[1 + j], b = y[1 + j];
    for (int i = 0; i < j; ++i, ++k) z[k] = (cx * y[k] + cy * x[k]) + (a * y[1 + i] + b * x[1 + i]);
    z[k] = cx * y[k] + cy * x[k] + a * b;
    ++k;
  }
  const V rx = x[at.bend_sum] + x[at.error], ry = y[at.bend_sum] + y[at.error];
  const V higher = x[at.slope_sum] * ry + rx * (y[at.slope_sum] + ry) + size_of(cx) * y[at.error] + size_of(cy) * x[at.error];
  z[at.error] = (higher + UNIT * (magnitude(at, x) * magnitude(at, y))) * ROOM + TINY;
  const V p = x[at.lower] * y[at.lower], q = x[at.lower] * y[at.upper], r = x[at.upper] * y[at.lower], s = x[at.upper] * y[at.upper];
  const V low = x == y ? (x[at.lower] > 0.0 ? p : x[at.upper] < 0.0 ? s : V{}) : least(least(p, q), least(r, s));
  z[at.lower] = down(low);
  z[at.upper] = up(most(most(p, q), most(r, s)));
  settle<M>(at, z);
}

// f0 + f1 (x - m) + f2 (x - m)^2, whose coefficients err by eight half units at most, and a remainder; the range of z is set.
template <int M>
static inline void taylor(const Layout& at, V* z, const V* x, V m, V f0, V f1, V f2, V remainder) {
  const V shift = x[0] - m, slope = f1 + 2.0 * f2 * shift;
  z[0] = f0 + shift * (f1 + f2 * shift);
  clear_rest<M>(at, z);
  for (int i = 1; i <= M; ++i) z[i] = slope * x[i];
  for (int j = 0, k = at.bends; j < M; ++j) {
    const V a = f2 * x[1 + j];
    for (int i = 0; i < j; ++i, ++k) z[k] = slope * x[k] + 2.0 * (a * x[1 + i]);
    z[k] = slope * x[k] + a * x[1 + j];
    ++k;
  }
  const V first = size_of(f1), second = size_of(f2), G = x[at.slope_sum], rest = x[at.bend_sum] + x[at.error];
  const V moved = size_of(shift) + UNIT * (size_of(x[0]) + size_of(m)), all = moved + G + rest;
  V off = remainder + size_of(slope) * x[at.error] + second * (rest * (2.0 * G + rest));
  off += UNIT * 8.0 * (size_of(f0) + first * all + second * all * all) + UNIT * (first + 2.0 * second * all) * (size_of(x[0]) + size_of(m));
  z[at.error] = off * ROOM + TINY;
  settle<M>(at, z);
}

// An upper bound of the distance from m to the farther end of the range.
static inline V reach(const Layout& at, const V* x, V m) { return up(most(x[at.upper] - m, m - x[at.lower])); }

template <int M>
static void inverse(const Layout& at, V* z, const V* x) {
  const Mask bad = ~((x[at.lower] > 0.0) | (x[at.upper] < 0.0));
  const V m = x[at.lower] * 0.5 + x[at.upper] * 0.5, near = least(size_of(x[at.lower]), size_of(x[at.upper]));
  const V f0 = 1.0 / m, f1 = -f0 * f0, f2 = -f1 * f0, r = reach(at, x, m), square = near * near;
  const V a = 1.0 / x[at.upper], b = 1.0 / x[at.lower];
  z[at.lower] = down(bad ? splat(-INFINITY) : a), z[at.upper] = up(bad ? splat(INFINITY) : b);
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
  const Mask bad = ~(x[at.lower] > 0.0);
  const V lo = bad ? splat(1.0) : x[at.lower], m = lo * 0.5 + x[at.upper] * 0.5;
  const V f0 = root(m), f1 = 0.5 / f0, f2 = -0.25 * f1 / m, r = reach(at, x, m), end = root(lo);
  z[at.lower] = down(end), z[at.upper] = up(root(x[at.upper]));
  const V remainder = r * r * r / (lo * lo * end) * (0.0625 * ROOM);  // |f'''| / 6 = x^(-5/2) / 16
  taylor<M>(at, z, x, m, f0, f1, f2, bad ? splat(INFINITY) : remainder);
}

// |x| lies between a x, with a = (lower + upper) / (upper - lower) or the known sign, and a x plus the gap at both ends.
template <int M>
static void absolute(const Layout& at, V* z, const V* x) {
  const V lo = x[at.lower], hi = x[at.upper];
  const Mask above = lo >= 0.0, below = hi <= 0.0;
  const V slope = above ? splat(1.0) : below ? splat(-1.0) : (lo + hi) / (hi - lo);
  const V gap = above | below ? V{} : up(up(most(hi * (1.0 - slope), -lo * (1.0 + slope)))) * ROOM;
  for (int i = 0; i < at.error; ++i) z[i] = slope * x[i];
  z[0] += 0.5 * gap;
  z[at.error] = (size_of(slope) * x[at.error] + 0.5 * gap + UNIT * (magnitude(at, x) + gap)) * ROOM + TINY;
  z[at.lower] = above ? lo : below ? -hi : V{};
  z[at.upper] = most(size_of(lo), size_of(hi));
  settle<M>(at, z);
}

// max(x, k) lies below the chord over the range, and above the chord minus the gap at x = k.
template <int M>
static void larger(const Layout& at, V* z, const V* x, double k) {
  const V lo = x[at.lower], hi = x[at.upper];
  const Mask above = lo >= k, below = hi <= k;
  const V slope = above ? splat(1.0) : below ? V{} : (hi - k) / (hi - lo);
  const V base = above | below ? V{} : k - slope * lo, gap = above | below ? V{} : up(slope * (k - lo)) * ROOM;
  for (int i = 0; i < at.error; ++i) z[i] = slope * x[i];
  z[0] += below ? splat(k) : base - 0.5 * gap;
  z[at.error] = (slope * x[at.error] + 0.5 * gap + 4.0 * UNIT * (magnitude(at, x) + gap + size_of(lo) + __builtin_fabs(k))) * ROOM + TINY;
  z[at.lower] = most(lo, splat(k)), z[at.upper] = most(hi, splat(k));
  settle<M>(at, z);
}

// y where x < k, else 0; everything between them where both are possible.
static void where_below(const Layout& at, V* z, const V* x, const V* y, double k) {
  const Mask always = x[at.upper] < k, never = x[at.lower] >= k;
  const V lo = least(y[at.lower], V{}), hi = most(y[at.upper], V{}), middle = lo * 0.5 + hi * 0.5;
  for (int i = 0; i < at.size; ++i) z[i] = always ? y[i] : V{};
  if (!any(~(always | never))) return;
  const Mask unknown = ~(always | never);
  z[0] = unknown ? middle : z[0];
  z[at.error] = unknown ? up(most(hi - middle, middle - lo)) : z[at.error];
  z[at.lower] = unknown ? lo : z[at.lower], z[at.upper] = unknown ? hi : z[at.upper];
}

// Operations of a tape (see quadratic_tape.py).
enum Code { INPUT, NUMBER, OUTPUT, SUM, DIFFERENCE, SHIFT, SCALE, PRODUCT, INVERSE, ROOT, ABSOLUTE, LARGER, BELOW, WHERE_BELOW };

struct Step {
  int code, out, first, second, symbols;
};

// Apply an operation to forms of the first M symbols.
template <int M>
static void work(const Layout& at, const Step& now, double value, V* z, const V* x, const V* y) {
  switch (now.code) {
    case SUM: return sum<M>(at, z, x, y, 1.0);
    case DIFFERENCE: return sum<M>(at, z, x, y, -1.0);
    case SCALE: return scale<M>(at, z, x, value);
    case PRODUCT: return product<M>(at, z, x, y);
    case INVERSE: return inverse<M>(at, z, x);
    case ROOT: return square_root<M>(at, z, x);
    case ABSOLUTE: return absolute<M>(at, z, x);
    case LARGER: return larger<M>(at, z, x, value);
  }
}

// Number of symbols of a form of n variables: one of a few sizes that the compiler knows.
static constexpr int SIZES[] = {2, 4, 7, 8, 9, MOST};
static inline int pad(int n) {
  int k = 0;
  while (SIZES[k] < n) ++k;
  return SIZES[k];
}

// Number of vectors of the memory for so many places.
static inline long long tape_vectors(const Layout& at, int slots) { return (long long)(slots + 2) * at.size; }

// Run a tape over LANES boxes; box l is boxes[l], (inputs, 2). Input i is symbol i. result[l] is (outputs, size).
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
        z[0] = z[at.lower] = z[at.upper] = splat(values[k]);
        if (now.code == INPUT) {
          const int i = (int)values[k];
          for (int l = 0; l < LANES; ++l) z[at.lower][l] = boxes[l][2 * i], z[at.upper][l] = boxes[l][2 * i + 1];
          z[0] = z[at.lower] * 0.5 + z[at.upper] * 0.5;
          z[at.slope_sum] = z[1 + i] = reach(at, z, z[0]);
        }
        break;
      }
      case SHIFT: shift(at, z, x, values[k]); break;
      case BELOW:  // the argument; the form is for points at which it is at most the value
        for (int i = 0; i < at.size; ++i) z[i] = x[i];
        z[at.upper] = least(z[at.upper], splat(values[k]));
        z[at.error] = z[at.lower] <= z[at.upper] ? z[at.error] : splat(INFINITY);
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

  Runner(const Tape& tape_, int n, double* memory) : tape(tape_), at(pad(n)) {
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
