// A bound of the least power over a box from quadratic forms, and the part of the box in which it may be lower.
//
// The cost is u (sum of w |torque rate|) + heat with u = 1 / T; rows are forms with bounds. On a box, in coordinates in [-1, 1]:
//   u C >= u_min C + C_min (u - u_min), and u lies above its tangents
//   |torque rate| is the product where its sign is known; else it lies above +-(least |rate|) torque, or +-(least |torque|) rate
//   rows that may be violated are added with multipliers
//   the sum is made convex, and bounded by a tangent

static const int SWEEPS = 3, ROUNDS = 3, PASSES = 3;
// A form whose error is this share of its range is only added with a multiplier.
static const double VAGUE = 0.25;
// Choice of the cut: weights of the errors of products of known sign, and of an edge's width.
static const double ERROR_SHARE = 0.7, WIDTH_SHARE = 0.125;

struct PowerRows {
  int n, outputs, rows, terms, heats, duration;
  const int *row, *power, *torque, *rate, *heat;
  const double *lower, *upper, *weight, *loss, *ranges;
};

// The remaining part of a box.
struct Box {
  double low[MOST], high[MOST];  // in [-1, 1]

  // Cut off the part that a e <= b excludes; false if nothing is left.
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

// A joint's power at an instant.
struct Term {
  const double *power, *torque, *rate, weight;
};

// Sum of the powers of known sign: its form, least and greatest values.
struct Sums {
  Quadratic form;
  double least = 0.0, greatest = 0.0;
};

class Relaxation {
 public:
  Relaxation(const PowerRows& rows, const Layout& layout) : given(rows), at(layout), n(rows.n) {}

  // Replaces `box` (n, 2) by its remaining part.
  Result prune(const double* forms, double* box, double target) {
    Box e;
    double score[MOST] = {};
    if (!start(forms, box, e) || !bound_cost(e, box, target, score) || !write_box(e, box)) return Result{false, INFINITY, 0};
    int cut = 0;
    for (int i = 1; i < n; ++i)
      if (score[i] > score[cut]) cut = i;
    return Result{true, lowest, cut};
  }

  // The same by rows only; false if nothing is left.
  bool contract(const double* forms, double* box) {
    Box e;
    return start(forms, box, e) && write_box(e, box);
  }

 private:
  const PowerRows& given;
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

  bool start(const double* forms, const double* box, Box& e) {
    F = forms;
    for (int i = 0; i < n; ++i) {
      e.low[i] = -1.0, e.high[i] = 1.0;
      centre[i] = 0.5 * box[2 * i] + 0.5 * box[2 * i + 1];
      half[i] = up(most(box[2 * i + 1] - centre[i], centre[i] - box[2 * i]));
    }
    return contract_by_rows(e);
  }

  // Write the remaining part in the coordinates of the box, rounded outward; false if it is empty.
  bool write_box(const Box& e, double* box) const {
    for (int i = 0; i < n; ++i) {
      const double slack = SLACK * half[i] + 0x1p-50 * size_of(centre[i]);
      box[2 * i] = most(box[2 * i], centre[i] + half[i] * e.low[i] - slack);
      box[2 * i + 1] = least(box[2 * i + 1], centre[i] + half[i] * e.high[i] + slack);
      if (!(box[2 * i] <= box[2 * i + 1])) return false;
    }
    return true;
  }

  const double* form(int o) const { return F + (long long)o * at.size; }

  // Lower bound of everything but the linear part of sense * form over the box.
  double bound_rest(const double* f, double sense, const Box& e) const {
    double low = sense * f[0] - f[at.error];
    for (int j = 0, k = at.bends; j < n; ++j)
      for (int i = 0; i <= j; ++i, ++k) {
        const double h = sense * f[k];
        if (i == j) {
          const double far = most(-e.low[i], e.high[i]), near = e.low[i] > 0.0 ? e.low[i] : e.high[i] < 0.0 ? -e.high[i] : 0.0;
          low += h > 0.0 ? h * near * near : h * far * far;
        } else
          low -= size_of(h) * most(-e.low[i], e.high[i]) * most(-e.low[j], e.high[j]);
      }
    return low - SLACK * (size_of(f[0]) + f[at.slope_sum] + f[at.bend_sum] + f[at.error]);
  }

  bool contract_by_rows(Box& e) {
    open.clear();
    for (int r = 0; r < given.rows; ++r) {
      const double* f = form(given.row[r]);
      if (f[at.lower] > given.upper[r] || f[at.upper] < given.lower[r]) return false;
      if (!(f[at.error] < INFINITY)) continue;
      if (f[at.upper] > given.upper[r]) open.push_back(Row{r, 1.0, given.upper[r]});
      if (f[at.lower] < given.lower[r]) open.push_back(Row{r, -1.0, -given.lower[r]});
    }
    for (int sweep = 0; sweep < SWEEPS; ++sweep) {
      const Box before = e;
      for (const Row& row : open) {
        const double* f = form(given.row[row.row]);
        double a[MOST];
        for (int j = 0; j < n; ++j) a[j] = row.sense * f[1 + j];
        if (!e.contract(n, a, row.bound - bound_rest(f, row.sense, e))) return false;
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
    column.form = q.rescale(n, middle, radius);
    column.most_ = most_;
    column.p = column.form.c + column.form.rest(n);
    for (int j = 0; j < n; ++j) column.q[j] = column.form.g[j];
    double up_to = column.p;
    for (int j = 0; j < n; ++j) up_to += size_of(column.q[j]);
    if (!(up_to > 0.0)) columns.pop_back();  // satisfied, or zero, in the whole box
  }

  // |torque rate| of a known sign: its form, or its least value and a column for the rest of the form.
  void add_known(const Term& t, double slowest, const Box& e, Sums& sums, double* score) {
    const bool above = t.power[at.lower] >= 0.0;
    const double sense = above ? t.weight : -t.weight;
    const double at_least = t.weight * (above ? t.power[at.lower] : -t.power[at.upper]);
    sums.least += at_least;
    sums.greatest += t.weight * (above ? t.power[at.upper] : -t.power[at.lower]);
    if (t.power[at.error] > VAGUE * (t.power[at.upper] - t.power[at.lower])) {
      sums.form.c += at_least, sums.form.mag += at_least;
      Quadratic q;
      q.add(n, at, sense * slowest, t.power);
      q.c -= slowest * at_least, q.mag += slowest * at_least;
      add_column(q, 1.0);
    } else
      sums.form.add(n, at, sense, t.power);
    for (int j = 0; j < n; ++j) {
      const double share = size_of(t.rate[1 + j]) / (t.rate[at.slope_sum] + TINY) + size_of(t.torque[1 + j]) / (t.torque[at.slope_sum] + TINY);
      score[j] += ERROR_SHARE * t.weight * slowest * t.power[at.error] * share * (e.high[j] - e.low[j]);
    }
  }

  // |torque rate| of an unknown sign: columns of both signs for the least size of one factor times the other.
  void add_unknown(const Term& t, double slowest, const Box& e, double* score) {
    const double turning = most(0.0, most(t.rate[at.lower], -t.rate[at.upper]));
    const double pulling = most(0.0, most(t.torque[at.lower], -t.torque[at.upper]));
    const double* held = turning > 0.0 ? t.torque : pulling > 0.0 ? t.rate : t.power;
    const double size = t.weight * slowest * (turning > 0.0 ? turning : pulling > 0.0 ? pulling : 1.0) * (1.0 - SLACK);
    if (t.torque[at.error] < INFINITY && t.rate[at.error] < INFINITY)
      for (int j = 0; j < n; ++j) {
        const double bend = size_of(t.rate[1 + j]) * t.torque[at.slope_sum] + size_of(t.torque[1 + j]) * t.rate[at.slope_sum];
        score[j] += 0.25 * t.weight * slowest * bend * (e.high[j] - e.low[j]);
      }
    if (!(held[at.error] < INFINITY)) return;
    for (double sense : {1.0, -1.0}) {
      Quadratic q;
      q.add(n, at, sense * size, held);
      add_column(q, 1.0);
    }
  }

  // Build the form and the columns of the cost.
  Quadratic cost(const Box& e, const double* box, double* score) {
    columns.clear();
    const int T = given.duration;
    const double latest = least(box[2 * T + 1], up(centre[T] + half[T] * e.high[T] + SLACK * half[T]));
    const double first = most(box[2 * T], down(centre[T] + half[T] * e.low[T] - SLACK * half[T]));
    const double slowest = (1.0 / latest) * (1.0 - SLACK), mid = 0.5 * (latest + first);
    Sums sums;
    for (int k = 0; k < given.terms; ++k) {
      const Term term{form(given.power[k]), form(given.torque[k]), form(given.rate[k]), given.weight[k]};
      const bool known = term.power[at.error] < INFINITY && (term.power[at.lower] >= 0.0 || term.power[at.upper] <= 0.0);
      if (known) add_known(term, slowest, e, sums, score);
      else add_unknown(term, slowest, e, score);
    }
    const double surely = sums.least * (1.0 - SLACK);
    Quadratic total, u;
    total.add(n, slowest, sums.form);
    u.c = 2.0 / mid - centre[T] / (mid * mid) - slowest;
    u.g[T] = -half[T] / (mid * mid);
    u.mag = 4.0 / mid + 2.0 * centre[T] / (mid * mid);
    total.add(n, surely, u);
    score[T] += (1.0 / first - 1.0 / latest) * (sums.greatest - surely) * 0.25;
    double heat = 0.0;
    for (int k = 0; k < given.heats; ++k) {
      const double *f = form(given.heat[k]), least_ = most(0.0, f[at.lower]);
      heat += given.loss[k] * least_;
      if (f[at.error] < VAGUE * (f[at.upper] - f[at.lower])) total.add(n, at, given.loss[k], f);
      else total.c += given.loss[k] * least_, total.mag += given.loss[k] * least_;
    }
    lowest = most(lowest, (slowest * surely + heat) * (1.0 - SLACK));
    return total;
  }

  void add_rows() {
    for (const Row& row : open) {
      Quadratic q;
      q.add(n, at, row.sense, form(given.row[row.row]));
      q.c -= row.bound;
      q.mag += size_of(row.bound);
      add_column(q, INFINITY);
    }
  }

  // Linearise the columns at a point, for the multipliers only.
  void touch_columns(const double* point) {
    for (Column& column : columns) {
      column.form.slope(n, point, column.q);
      column.p = column.form.at(n, point);
      for (int j = 0; j < n; ++j) column.p -= column.q[j] * point[j];
    }
  }

  // Bound the cost and cut the box by it; false if nothing is left.
  bool bound_cost(Box& e, const double* box, double target, double* score) {
    lowest = -INFINITY;
    double convexity[MOST] = {};
    for (int round = 0; round < ROUNDS; ++round) {
      for (int i = 0; i < n; ++i) {
        middle[i] = 0.5 * (e.low[i] + e.high[i]);
        radius[i] = most(e.high[i] - middle[i], middle[i] - e.low[i]) * (1.0 + SLACK) + SLACK;
        score[i] = 0.0;
      }
      const Quadratic whole = cost(e, box, score).rescale(n, middle, radius);
      add_rows();
      double point[MOST] = {};
      Box within;
      for (int i = 0; i < n; ++i) within.low[i] = -1.0, within.high[i] = 1.0;
      const Convex first(n, whole);
      Linear line = first.tangent(point);
      double shrunk = 0.0;
      for (int pass = 0; pass < PASSES; ++pass) {
        if (columns.empty() && pass) break;
        if (pass) touch_columns(point);
        const double enough = pass ? 1e3 * (1.0 + size_of(target)) : target + 1e-6 * size_of(target);
        multipliers(n, line.g, line.c, columns, enough, x);
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
          for (int i = 0; i < n; ++i) convexity[i] = convex.added[i];
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
      score[i] += convexity[i];
      gap += score[i];
      wide[i] = half[i] * (e.high[i] - e.low[i]) / given.ranges[i];
      width = most(width, wide[i]);
    }
    for (int i = 0; i < n; ++i) score[i] = (gap > 0.0 && gap < INFINITY ? score[i] / gap : 0.0) + WIDTH_SHARE * wide[i] / width;
    return true;
  }
};
