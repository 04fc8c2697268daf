// Multipliers of rows and of terms of the cost, by a linear program over the linear parts of all forms.
//
// All multipliers >= 0 give a valid bound, so the linear program need not be solved to optimality.

#include <vector>

static const int PIVOTS = 32;

// A row (value <= 0), or a term of which the cost contains the positive part, in [-1, 1]^n.
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
  std::vector<char> state(m, 0);  // 0 at zero, 1 at its maximum, 2 in the basis
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
