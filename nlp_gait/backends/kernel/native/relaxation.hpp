// What quadratic forms say of a gait's least power over a box: a bound, and the part of the box in which less may be had.
//
// The cost is u (sum of w |torque rate|) + heat with u = 1 / T; rows are forms with bounds. On a box, in coordinates in [-1, 1]:
//   u C >= u_min C + C_min (u - u_min), and u lies above its tangents
//   |torque rate| is the product where its sign is known; else it lies above +-(least |rate|) torque, or +-(least |torque|) rate
//   rows that may fail enter with multipliers, found by a linear program over what is linear in all forms
// Any multipliers >= 0 give a bound: the sum of forms is bounded from below by making it convex with squares e_i^2 <= 1, and a
// convex function lies above its tangents (Adjiman, Androulakis, Floudas 1998; Neumaier, Shcherbina 2004). So neither the linear
// program nor the eigenvectors need be right. All that is summed here errs by less than SLACK of the magnitudes summed.

#include <vector>

static const double SLACK = 0x1p-40;
static const int SWEEPS = 3, PIVOTS = 32, ROUNDS = 3, CONTRACTIONS = 4;
static const double LEAST_SHRINKAGE = 0.1, WIDTH_SHARE = 0.125;

struct Gait {
  int n, outputs, rows, terms, heats, time;
  const int *row, *power, *torque, *rate, *heat;
  const double *lower, *upper, *weight, *loss, *range;
};

static inline double least(double a, double b) { return b < a ? b : a; }
static inline double most(double a, double b) { return b > a ? b : a; }
static inline double size_of(double a) { return __builtin_fabs(a); }
static inline double down(double a) { return a - (0x1p-51 * size_of(a) + TINY); }
static inline double up(double a) { return a + (0x1p-51 * size_of(a) + TINY); }

// c + sum g_i e_i + sum_(i<=j) h e_i e_j, off by d; mag bounds what was summed.
struct Quadratic {
  double c = 0.0, d = 0.0, mag = 0.0, g[MOST] = {}, h[MOST * (MOST + 1) / 2] = {};

  void add(int n, double w, const Quadratic& q) {
    c += w * q.c;
    for (int i = 0; i < n; ++i) g[i] += w * q.g[i];
    for (int k = 0; k < n * (n + 1) / 2; ++k) h[k] += w * q.h[k];
    d += size_of(w) * q.d;
    mag += size_of(w) * q.mag;
  }
  void add(int n, const Layout& at, double w, const double* form) {
    c += w * form[0];
    for (int i = 0; i < n; ++i) g[i] += w * form[1 + i];
    for (int k = 0; k < n * (n + 1) / 2; ++k) h[k] += w * form[at.h + k];
    d += size_of(w) * form[at.d];
    mag += size_of(w) * (size_of(form[0]) + form[at.G] + form[at.H]);
  }
  // In coordinates with e = m + r e'.
  Quadratic moved(int n, const double* m, const double* r) const {
    Quadratic q;
    q.c = c, q.d = d, q.mag = 4.0 * mag;
    for (int i = 0; i < n; ++i) q.g[i] = g[i], q.c += g[i] * m[i];
    for (int j = 0, k = 0; j < n; ++j)
      for (int i = 0; i <= j; ++i, ++k) {
        q.c += h[k] * m[i] * m[j];
        q.g[i] += h[k] * m[j], q.g[j] += h[k] * m[i];
        q.h[k] = h[k] * r[i] * r[j];
      }
    for (int i = 0; i < n; ++i) q.g[i] *= r[i];
    return q;
  }
  // What is left of it beside c and g, from below.
  double rest(int n) const {
    double low = -d;
    for (int j = 0, k = 0; j < n; ++j)
      for (int i = 0; i <= j; ++i, ++k) low -= i == j ? most(-h[k], 0.0) : size_of(h[k]);
    return low - SLACK * (mag + d);
  }
  double at(int n, const double* e) const {
    double value = c;
    for (int j = 0, k = 0; j < n; ++j) {
      value += g[j] * e[j];
      for (int i = 0; i <= j; ++i, ++k) value += h[k] * e[i] * e[j];
    }
    return value;
  }
  void slope(int n, const double* e, double* out) const {
    for (int i = 0; i < n; ++i) out[i] = g[i];
    for (int j = 0, k = 0; j < n; ++j)
      for (int i = 0; i <= j; ++i, ++k) out[i] += h[k] * e[j], out[j] += h[k] * e[i];
  }
};

// A linear function from below: c + g e.
struct Linear {
  double c = -INFINITY, g[MOST] = {};
  double low(int n) const {
    double value = c, sum = 0.0;
    for (int i = 0; i < n; ++i) sum += size_of(g[i]);
    value -= sum;
    return value - SLACK * (size_of(c) + sum);
  }
};

// Eigenvalues on a's diagonal and vectors in v's columns, by Jacobi's rotations.
static void eigen(int n, double a[MOST][MOST], double v[MOST][MOST]) {
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) v[i][j] = i == j;
  for (int sweep = 0; sweep < 8; ++sweep) {
    double off = 0.0, on = 0.0;
    for (int i = 0; i < n; ++i) {
      on += a[i][i] * a[i][i];
      for (int j = 0; j < i; ++j) off += a[i][j] * a[i][j];
    }
    if (!(off > 1e-16 * on)) return;
    for (int p = 0; p < n; ++p)
      for (int q = p + 1; q < n; ++q) {
        if (a[p][q] == 0.0) continue;
        const double theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
        const double t = (theta >= 0.0 ? 1.0 : -1.0) / (size_of(theta) + __builtin_sqrt(theta * theta + 1.0));
        const double c = 1.0 / __builtin_sqrt(t * t + 1.0), s = t * c;
        for (int k = 0; k < n; ++k) {
          const double x = a[k][p], y = a[k][q];
          a[k][p] = c * x - s * y, a[k][q] = s * x + c * y;
        }
        for (int k = 0; k < n; ++k) {
          const double x = a[p][k], y = a[q][k];
          a[p][k] = c * x - s * y, a[q][k] = s * x + c * y;
        }
        for (int k = 0; k < n; ++k) {
          const double x = v[k][p], y = v[k][q];
          v[k][p] = c * x - s * y, v[k][q] = s * x + c * y;
        }
      }
  }
}

// A convex function below a quadratic over [-1, 1]^n: c + g e + |L' e|^2.
struct Convex {
  int n;
  double c, mag, g[MOST], L[MOST][MOST], added[MOST];

  Convex(int n_, const Quadratic& q) : n(n_), c(q.c - q.d) {
    double S[MOST][MOST], a[MOST][MOST], v[MOST][MOST], scale = 0.0;
    for (int j = 0, k = 0; j < n; ++j) {
      g[j] = q.g[j];
      for (int i = 0; i <= j; ++i, ++k) S[i][j] = S[j][i] = a[i][j] = a[j][i] = i == j ? q.h[k] : 0.5 * q.h[k];
    }
    eigen(n, a, v);
    for (int i = 0; i < n; ++i) scale = most(scale, size_of(a[i][i]));
    for (int i = 0; i < n; ++i) added[i] = 1e-12 * scale;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        double part = 0.0;
        for (int k = 0; k < n; ++k)
          if (a[k][k] < 0.0) part -= a[k][k] * v[i][k] * v[j][k];
        added[i] += size_of(part);
      }
    double left = 0.0;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j <= i; ++j) {
        double s = S[i][j] + (i == j ? added[i] : 0.0);
        for (int k = 0; k < j; ++k) s -= L[i][k] * L[j][k];
        L[i][j] = i == j ? __builtin_sqrt(most(s, 0.0)) : L[j][j] > 0.0 ? s / L[j][j] : 0.0;
      }
      for (int j = i + 1; j < n; ++j) L[i][j] = 0.0;
    }
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        double s = S[i][j] + (i == j ? added[i] : 0.0), terms = size_of(s);
        for (int k = 0; k < n; ++k) s -= L[i][k] * L[j][k], terms += size_of(L[i][k] * L[j][k]);
        left += size_of(s) + SLACK * terms;
      }
    mag = q.mag + q.d + left;
    c -= left;
    for (int i = 0; i < n; ++i) c -= added[i], mag += added[i];
  }

  // Near the least in the box.
  void minimise(double* e) const {
    double A[MOST][MOST];
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        A[i][j] = 0.0;
        for (int k = 0; k < n; ++k) A[i][j] += L[i][k] * L[j][k];
      }
    for (int sweep = 0; sweep < 40; ++sweep) {
      double change = 0.0;
      for (int i = 0; i < n; ++i) {
        double s = g[i];
        for (int j = 0; j < n; ++j)
          if (j != i) s += 2.0 * A[i][j] * e[j];
        double to = A[i][i] > 0.0 ? -s / (2.0 * A[i][i]) : s > 0.0 ? -1.0 : 1.0;
        to = least(1.0, most(-1.0, to));
        change += size_of(to - e[i]);
        e[i] = to;
      }
      if (change < 1e-6) break;
    }
  }

  // What touches it at e.
  Linear tangent(const double* e) const {
    Linear line;
    double total = mag, a[MOST];
    line.c = c;
    for (int k = 0; k < n; ++k) {
      a[k] = 0.0;
      for (int i = 0; i < n; ++i) a[k] += L[i][k] * e[i];
      line.c -= a[k] * a[k], total += a[k] * a[k];
    }
    for (int i = 0; i < n; ++i) {
      line.g[i] = g[i];
      for (int k = 0; k < n; ++k) line.g[i] += 2.0 * L[i][k] * a[k], total += size_of(2.0 * L[i][k] * a[k]);
    }
    line.c -= SLACK * total;
    return line;
  }
};

// A row (value <= 0) or something that the cost holds if it is positive, in [-1, 1]^n.
struct Column {
  Quadratic form;
  double p, q[MOST], most_;
};

// Multipliers x in [0, most] that make min over the box of c + sum x (p + q e) large; a primal simplex method with n rows.
static void multipliers(int n, const double* cost, double constant, const std::vector<Column>& columns, double enough,
                        std::vector<double>& x) {
  const int m = (int)columns.size();
  int basis[MOST];  // a column, or m + 2 j (+ 1) for the ends of symbol j
  double inverse[MOST][MOST] = {}, value[MOST], e[MOST];
  std::vector<char> state(m, 0);  // 0 at zero, 1 at its most, 2 in the basis
  x.assign(m, 0.0);
  for (int j = 0; j < n; ++j) {
    const bool plus = cost[j] >= 0.0;
    basis[j] = m + 2 * j + !plus;
    inverse[j][j] = plus ? -1.0 : 1.0;
    value[j] = size_of(cost[j]);
  }
  const auto profit_of = [&](int k) { return k < m ? columns[k].p : -1.0; };
  for (int pivot = 0; pivot < PIVOTS; ++pivot) {
    double total = constant;
    for (int j = 0; j < n; ++j) {
      e[j] = 0.0;
      for (int i = 0; i < n; ++i) e[j] -= inverse[i][j] * profit_of(basis[i]);
      total += profit_of(basis[j]) * value[j];
    }
    for (int k = 0; k < m; ++k)
      if (state[k] == 1) total += columns[k].p * columns[k].most_;
    if (total > enough) break;
    int enters = -1;
    double best = 1e-10, gain = 0.0;
    for (int k = 0; k < m; ++k) {
      if (state[k] == 2) continue;
      double profit = columns[k].p, norm = 1e-9;
      for (int j = 0; j < n; ++j) profit += columns[k].q[j] * e[j], norm += size_of(columns[k].q[j]);
      const double worth = (state[k] ? -profit : profit) / norm;
      if (worth > best) best = worth, enters = k, gain = profit;
    }
    for (int j = 0; j < n; ++j)
      if (size_of(e[j]) - 1.0 > best) {
        best = size_of(e[j]) - 1.0;
        enters = m + 2 * j + (e[j] > 0.0);
        gain = best;
      }
    if (enters < 0) break;
    double column[MOST] = {}, change[MOST];
    if (enters < m)
      for (int j = 0; j < n; ++j) column[j] = columns[enters].q[j];
    else
      column[(enters - m) / 2] = (enters - m) % 2 ? 1.0 : -1.0;
    const double sense = enters < m && state[enters] == 1 ? -1.0 : 1.0;
    int leaves = -1;
    double step = enters < m ? columns[enters].most_ : INFINITY;
    bool to_most = false;
    for (int i = 0; i < n; ++i) {
      change[i] = 0.0;
      for (int j = 0; j < n; ++j) change[i] -= inverse[i][j] * column[j];
      change[i] *= sense;
      const double limit = basis[i] < m ? columns[basis[i]].most_ : INFINITY;
      if (change[i] < -1e-11 && most(value[i], 0.0) / -change[i] < step)
        step = most(value[i], 0.0) / -change[i], leaves = i, to_most = false;
      else if (change[i] > 1e-11 && limit < INFINITY && most(limit - value[i], 0.0) / change[i] < step)
        step = most(limit - value[i], 0.0) / change[i], leaves = i, to_most = true;
    }
    const bool endless = !(step < INFINITY);
    if (endless) step = 2.0 * (enough - total + 1.0) / size_of(gain);
    for (int i = 0; i < n; ++i) value[i] += step * change[i];
    if (endless) {
      if (enters < m) x[enters] = step;
      break;
    }
    if (leaves < 0) {
      state[enters] = sense > 0.0;
      continue;
    }
    const double now = enters < m && state[enters] == 1 ? columns[enters].most_ - step : step;
    if (basis[leaves] < m) state[basis[leaves]] = to_most;
    if (enters < m) state[enters] = 2;
    basis[leaves] = enters;
    value[leaves] = now;
    const double by = -sense * change[leaves];
    for (int j = 0; j < n; ++j) inverse[leaves][j] /= by;
    for (int i = 0; i < n; ++i)
      if (i != leaves)
        for (int j = 0; j < n; ++j) inverse[i][j] += sense * change[i] * inverse[leaves][j];
  }
  for (int k = 0; k < m; ++k)
    if (state[k] == 1) x[k] = columns[k].most_;
  for (int i = 0; i < n; ++i)
    if (basis[i] < m) x[basis[i]] = least(columns[basis[i]].most_, most(0.0, value[i]));
}

// What is known of one box.
struct Box {
  double low[MOST], high[MOST];  // in [-1, 1]

  // Without what a e <= b excludes; false if nothing is left.
  bool contract(int n, const double* a, double b) {
    double sum = 0.0, size = size_of(b);
    for (int j = 0; j < n; ++j) sum += least(a[j] * low[j], a[j] * high[j]), size += size_of(a[j]);
    const double room = b - sum + SLACK * size;
    if (!(room >= 0.0)) return room != room;
    for (int j = 0; j < n; ++j) {
      if (!(size_of(a[j]) * (high[j] - low[j]) > room)) continue;
      if (a[j] > 0.0) high[j] = least(high[j], low[j] + room / a[j] + SLACK);
      else low[j] = most(low[j], high[j] + room / a[j] - SLACK);
    }
    return true;
  }
};

struct Result {
  bool left;
  double lowest;
  int cut;
};

class Relaxation {
 public:
  Relaxation(const Gait& gait, const Layout& layout) : G(gait), at(layout), n(gait.n) {}

  // `box` (n, 2) is replaced by what is left of it.
  Result assess(const double* forms, double* box, double target) {
    Box e;
    double score[MOST] = {};
    if (!begin(forms, box, e) || !bounded(e, box, target, score) || !inner(e, box)) return Result{false, INFINITY, 0};
    int cut = 0;
    for (int i = 1; i < n; ++i)
      if (score[i] > score[cut]) cut = i;
    return Result{true, lowest, cut};
  }

  // By rows alone; false if nothing is left.
  bool contract(const double* forms, double* box) {
    Box e;
    return begin(forms, box, e) && inner(e, box);
  }

 private:
  const Gait& G;
  const Layout& at;
  const int n;
  const double* F = nullptr;
  double centre[MOST], half[MOST], middle[MOST], radius[MOST], lowest = 0.0;
  std::vector<Column> columns;
  std::vector<double> x;
  struct Row {
    int row;
    double sense, bound;
  };
  std::vector<Row> open;

  bool begin(const double* forms, const double* box, Box& e) {
    F = forms;
    for (int i = 0; i < n; ++i) {
      e.low[i] = -1.0, e.high[i] = 1.0;
      centre[i] = 0.5 * box[2 * i] + 0.5 * box[2 * i + 1];
      half[i] = up(most(box[2 * i + 1] - centre[i], centre[i] - box[2 * i]));
    }
    return rows_leave(e);
  }

  // The box in its own coordinates, outward rounded; false if it is empty.
  bool inner(const Box& e, double* box) const {
    for (int i = 0; i < n; ++i) {
      const double slack = SLACK * half[i] + 0x1p-50 * size_of(centre[i]);
      box[2 * i] = most(box[2 * i], centre[i] + half[i] * e.low[i] - slack);
      box[2 * i + 1] = least(box[2 * i + 1], centre[i] + half[i] * e.high[i] + slack);
      if (!(box[2 * i] <= box[2 * i + 1])) return false;
    }
    return true;
  }

  const double* form(int o) const { return F + (long long)o * at.size; }

  // Bounds of sense * form over the box: least of what is not linear, its slopes from the middle of the symbols.
  double constant_of(const double* f, double sense, const Box& e) const {
    double low = sense * f[0] - f[at.d];
    for (int j = 0, k = at.h; j < n; ++j)
      for (int i = 0; i <= j; ++i, ++k) {
        const double h = sense * f[k];
        if (i == j) {
          const double far = most(-e.low[i], e.high[i]), near = e.low[i] > 0.0 ? e.low[i] : e.high[i] < 0.0 ? -e.high[i] : 0.0;
          low += h > 0.0 ? h * near * near : h * far * far;
        } else
          low -= size_of(h) * most(-e.low[i], e.high[i]) * most(-e.low[j], e.high[j]);
      }
    return low - SLACK * (size_of(f[0]) + f[at.G] + f[at.H] + f[at.d]);
  }

  bool rows_leave(Box& e) {
    open.clear();
    for (int r = 0; r < G.rows; ++r) {
      const double* f = form(G.row[r]);
      if (f[at.lo] > G.upper[r] || f[at.hi] < G.lower[r]) return false;
      if (!(f[at.d] < INFINITY)) continue;
      if (f[at.hi] > G.upper[r]) open.push_back(Row{r, 1.0, G.upper[r]});
      if (f[at.lo] < G.lower[r]) open.push_back(Row{r, -1.0, -G.lower[r]});
    }
    for (int sweep = 0; sweep < SWEEPS; ++sweep) {
      const Box before = e;
      for (const Row& row : open) {
        const double* f = form(G.row[row.row]);
        double a[MOST];
        for (int j = 0; j < n; ++j) a[j] = row.sense * f[1 + j];
        if (!e.contract(n, a, row.bound - constant_of(f, row.sense, e))) return false;
      }
      double change = 0.0;
      for (int j = 0; j < n; ++j) change = most(change, (before.high[j] - before.low[j]) - (e.high[j] - e.low[j]));
      if (change < 0.05) break;
    }
    return true;
  }

  void add_column(const Quadratic& q, double most_) {
    columns.emplace_back();
    Column& column = columns.back();
    column.form = q.moved(n, middle, radius);
    column.most_ = most_;
    column.p = column.form.c + column.form.rest(n);
    for (int j = 0; j < n; ++j) column.q[j] = column.form.g[j];
    double up_to = column.p;
    for (int j = 0; j < n; ++j) up_to += size_of(column.q[j]);
    if (!(up_to > 0.0)) columns.pop_back();  // holds, or adds nothing, anywhere
  }

  // The cost's form, and columns.
  Quadratic cost(const Box& e, const double* box, double* score) {
    columns.clear();
    const int T = G.time;
    const double latest = least(box[2 * T + 1], up(centre[T] + half[T] * e.high[T] + SLACK * half[T]));
    const double first = most(box[2 * T], down(centre[T] + half[T] * e.low[T] - SLACK * half[T]));
    const double slowest = (1.0 / latest) * (1.0 - SLACK), mid = 0.5 * (latest + first);
    Quadratic C, total;
    double surely = 0.0, greatest = 0.0;
    for (int k = 0; k < G.terms; ++k) {
      const double *P = form(G.power[k]), *tau = form(G.torque[k]), *rate = form(G.rate[k]), w = G.weight[k];
      if (P[at.d] < INFINITY && (P[at.lo] >= 0.0 || P[at.hi] <= 0.0)) {
        const double sense = P[at.lo] >= 0.0 ? w : -w, at_least = P[at.lo] >= 0.0 ? P[at.lo] : -P[at.hi];
        surely += w * at_least;
        greatest += w * (P[at.lo] >= 0.0 ? P[at.hi] : -P[at.lo]);
        if (P[at.d] > 0.25 * (P[at.hi] - P[at.lo])) {
          C.c += w * at_least, C.mag += w * at_least;
          Quadratic q;
          q.add(n, at, sense * slowest, P);
          q.c -= w * slowest * at_least, q.mag += w * slowest * at_least;
          add_column(q, 1.0);
        } else
          C.add(n, at, sense, P);
        for (int j = 0; j < n; ++j)
          score[j] += w * slowest * P[at.d] * 0.7 * (e.high[j] - e.low[j]) * (size_of(rate[1 + j]) / (rate[at.G] + TINY) + size_of(tau[1 + j]) / (tau[at.G] + TINY));
        continue;
      }
      const double turning = most(0.0, most(rate[at.lo], -rate[at.hi])), pulling = most(0.0, most(tau[at.lo], -tau[at.hi]));
      const double* held = turning > 0.0 ? tau : pulling > 0.0 ? rate : P;
      const double size = w * slowest * (turning > 0.0 ? turning : pulling > 0.0 ? pulling : 1.0) * (1.0 - SLACK);
      if (tau[at.d] < INFINITY && rate[at.d] < INFINITY)
        for (int j = 0; j < n; ++j) {
          const double bend = size_of(rate[1 + j]) * tau[at.G] + size_of(tau[1 + j]) * rate[at.G];
          score[j] += 0.5 * w * slowest * bend * (e.high[j] - e.low[j]) * 0.5;
        }
      if (!(held[at.d] < INFINITY)) continue;
      for (double sense : {1.0, -1.0}) {
        Quadratic q;
        q.add(n, at, sense * size, held);
        add_column(q, 1.0);
      }
    }
    surely *= 1.0 - SLACK;
    total.add(n, slowest, C);
    Quadratic u;
    u.c = 2.0 / mid - centre[T] / (mid * mid) - slowest;
    u.g[T] = -half[T] / (mid * mid);
    u.mag = 4.0 / mid + 2.0 * centre[T] / (mid * mid);
    total.add(n, surely, u);
    score[T] += (1.0 / first - 1.0 / latest) * (greatest - surely) * 0.25;
    double heat = 0.0;
    for (int k = 0; k < G.heats; ++k) {
      const double *f = form(G.heat[k]), least_ = most(0.0, f[at.lo]);
      heat += G.loss[k] * least_;
      if (f[at.d] < 0.25 * (f[at.hi] - f[at.lo])) total.add(n, at, G.loss[k], f);
      else total.c += G.loss[k] * least_, total.mag += G.loss[k] * least_;
    }
    lowest = most(lowest, (slowest * surely + heat) * (1.0 - SLACK));
    return total;
  }

  bool bounded(Box& e, const double* box, double target, double* score) {
    lowest = -INFINITY;
    Quadratic relative;
    for (int round = 0; round < ROUNDS; ++round) {
      for (int i = 0; i < n; ++i) {
        middle[i] = 0.5 * (e.low[i] + e.high[i]);
        radius[i] = most(e.high[i] - middle[i], middle[i] - e.low[i]) * (1.0 + SLACK) + SLACK;
        score[i] = 0.0;
      }
      const Quadratic whole = cost(e, box, score).moved(n, middle, radius);
      for (const Row& row : open) {
        const double* f = form(G.row[row.row]);
        Quadratic q;
        q.add(n, at, row.sense, f);
        q.c -= row.bound;
        q.mag += size_of(row.bound);
        add_column(q, INFINITY);
      }
      double point[MOST] = {};
      Box within;
      for (int i = 0; i < n; ++i) within.low[i] = -1.0, within.high[i] = 1.0;
      const Convex first(n, whole);
      Linear line = first.tangent(point);
      double shrunk = 0.0;
      for (int pass = 0; pass < 3; ++pass) {
        if (columns.empty() && pass) break;
        if (pass)  // columns from their values and slopes there: for the multipliers, not for the bound
          for (Column& column : columns) {
            column.form.slope(n, point, column.q);
            column.p = column.form.at(n, point);
            for (int j = 0; j < n; ++j) column.p -= column.q[j] * point[j];
          }
        const double enough = pass ? INFINITY : target + 1e-6 * size_of(target);
        multipliers(n, line.g, line.c, columns, enough < INFINITY ? enough : 1e3 * (1.0 + size_of(target)), x);
        Quadratic sum = whole;
        for (size_t k = 0; k < columns.size(); ++k)
          if (x[k] != 0.0) sum.add(n, x[k], columns[k].form);
        const Convex convex(n, sum);
        double at_least[MOST];
        for (int i = 0; i < n; ++i) at_least[i] = point[i];
        convex.minimise(at_least);
        const Linear touching = convex.tangent(at_least);
        const double bound = touching.low(n);
        const bool better = bound > lowest;
        lowest = most(lowest, bound);
        if (lowest >= target) return false;
        if (!within.contract(n, touching.g, target - touching.c)) return false;
        if (better || pass == 0)
          for (int i = 0; i < n; ++i) relative.g[i] = convex.added[i], relative.h[i] = size_of(touching.g[i]);
        for (int i = 0; i < n; ++i) point[i] = at_least[i];
        line = first.tangent(point);
      }
      for (int i = 0; i < n; ++i) {
        const double low = middle[i] + radius[i] * within.low[i] - SLACK, high = middle[i] + radius[i] * within.high[i] + SLACK;
        shrunk = most(shrunk, 1.0 - (within.high[i] - within.low[i]) / 2.0);
        e.low[i] = most(e.low[i], low), e.high[i] = least(e.high[i], high);
        if (!(e.low[i] <= e.high[i])) return false;
      }
      if (shrunk < 0.15 || round + 1 == ROUNDS) break;
    }
    double gap = 0.0, width = 0.0, wide[MOST];
    for (int i = 0; i < n; ++i) {
      score[i] += relative.g[i];
      gap += score[i];
      wide[i] = half[i] * (e.high[i] - e.low[i]) / G.range[i];
      width = most(width, wide[i]);
    }
    for (int i = 0; i < n; ++i) score[i] = (gap > 0.0 && gap < INFINITY ? score[i] / gap : 0.0) + WIDTH_SHARE * wide[i] / width;
    return true;
  }
};

// Numbers of a form of n variables.
extern "C" EXPORT int nlp_gait_quadratic_size(int n) { return Layout(padded(n)).size; }

// Doubles of the memory that the caller brings.
extern "C" EXPORT long long nlp_gait_quadratic_doubles(int slots, int n, int outputs) {
  const Layout at(padded(n));
  return (tape_vectors(at, slots) + 1) * LANES + slots + 1 + (long long)LANES * outputs * at.size;
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

// Forms of boxes (many, n, 2) in `result` (many, outputs, size).
extern "C" EXPORT void nlp_gait_quadratic_forms(const Tape* tape, int n, int outputs, long long many, const double* boxes,
                                                double* result, double* memory) {
  Runner runner(*tape, n, memory);
  const long long each = (long long)outputs * runner.at.size;
  for (long long first = 0; first < many; first += LANES) {
    runner.run(n, outputs, boxes, first, many);
    const long long count = first + LANES < many ? LANES : many - first;
    __builtin_memcpy(result + first * each, runner.forms, count * each * sizeof(double));
  }
}

// Boxes (many, n, 2) without slabs in which an output is beyond its bounds, in place: left (many) 0 or 1.
extern "C" EXPORT void nlp_gait_quadratic_contract(const Tape* tape, int n, int outputs, long long many, double* boxes,
                                                   const double* lower, const double* upper, int* left, double* memory) {
  Runner runner(*tape, n, memory);
  std::vector<int> row(outputs);
  for (int o = 0; o < outputs; ++o) row[o] = o;
  Gait gait = {};
  gait.n = n, gait.outputs = gait.rows = outputs, gait.row = row.data(), gait.lower = lower, gait.upper = upper;
  Relaxation relaxation(gait, runner.at);
  const long long each = (long long)outputs * runner.at.size;
  for (long long first = 0; first < many; first += LANES) {
    const int count = first + LANES < many ? LANES : (int)(many - first);
    bool again[LANES];  // each box for itself: what becomes of it must not depend on the others
    for (int l = 0; l < LANES; ++l) again[l] = l < count;
    bool any_again = true;
    for (int round = 0; round < CONTRACTIONS && any_again; ++round) {
      runner.run(n, outputs, boxes, first, many);
      any_again = false;
      for (int l = 0; l < count; ++l) {
        if (!again[l]) continue;
        double *box = boxes + (first + l) * n * 2, before[2 * MOST], shrunk = 0.0;
        __builtin_memcpy(before, box, 2 * n * sizeof(double));
        left[first + l] = relaxation.contract(runner.forms + l * each, box);
        for (int i = 0; i < n; ++i) shrunk = most(shrunk, 1.0 - (box[2 * i + 1] - box[2 * i]) / (before[2 * i + 1] - before[2 * i]));
        again[l] = left[first + l] && shrunk > LEAST_SHRINKAGE;
        any_again |= again[l];
      }
    }
  }
}

// What is left of boxes (many, n, 2), in place: left (many) 0 or 1, lowest (many), cut (many).
extern "C" EXPORT void nlp_gait_quadratic_assess(const Tape* tape, const Gait* gait, double target, long long many, double* boxes,
                                                 int* left, double* lowest, int* cut, double* memory) {
  Runner runner(*tape, gait->n, memory);
  Relaxation relaxation(*gait, runner.at);
  const long long each = (long long)gait->outputs * runner.at.size;
  for (long long first = 0; first < many; first += LANES) {
    runner.run(gait->n, gait->outputs, boxes, first, many);
    for (int l = 0; l < LANES && first + l < many; ++l) {
      const Result found = relaxation.assess(runner.forms + l * each, boxes + (first + l) * gait->n * 2, target);
      left[first + l] = found.left, lowest[first + l] = found.lowest, cut[first + l] = found.cut;
    }
  }
}
