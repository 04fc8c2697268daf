// Convex functions below quadratic ones over a box, and their tangents.
//
// A sum of forms is bounded from below by making it convex with squares e_i^2 <= 1, and a convex function lies above its tangents
// (Adjiman, Androulakis, Floudas 1998; Neumaier, Shcherbina 2004). The eigenvectors need not be exact. Every sum here errs by less
// than SLACK times its magnitudes.

static const double SLACK = 0x1p-40;

static inline double least(double a, double b) { return b < a ? b : a; }
static inline double most(double a, double b) { return b > a ? b : a; }
static inline double size_of(double a) { return __builtin_fabs(a); }
static inline double down(double a) { return a - (0x1p-51 * size_of(a) + TINY); }
static inline double up(double a) { return a + (0x1p-51 * size_of(a) + TINY); }

// c + sum g_i e_i + sum_(i<=j) h e_i e_j with an error of d: middle, slopes, bends; mag bounds the summed magnitudes.
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
    for (int k = 0; k < n * (n + 1) / 2; ++k) h[k] += w * form[at.bends + k];
    d += size_of(w) * form[at.error];
    mag += size_of(w) * (size_of(form[0]) + form[at.slope_sum] + form[at.bend_sum]);
  }
  // The same in coordinates e' with e = m + r e'.
  Quadratic rescale(int n, const double* m, const double* r) const {
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
  // Lower bound of everything but c and g.
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

// Eigenvalues on a's diagonal and eigenvectors in v's columns, by Jacobi's rotations.
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

  // Find a point near the minimum in the box.
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

  // The tangent at e.
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
