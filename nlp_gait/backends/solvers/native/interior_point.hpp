// ---- bounds, each with its distance and multiplier ----
enum Owner { SLACK, VARIABLE, ABOVE, BELOW };
struct Side {
  Owner owner;
  double sign;
  vector<int> index;
  Vector gap, z;
  Side(Owner owner, double sign) : owner(owner), sign(sign) {}
};
struct Step {
  Vector x, y, t, a, b;
  vector<Vector> z;
  const Vector& of(Owner owner) const { return owner == SLACK ? t : owner == VARIABLE ? x : owner == ABOVE ? a : b; }
};
// Steps of a fraction of the way to the bounds.
static const double FRACTION = 0.99;
static const double LEAST_SIGMA = 1e-6, LARGEST_SIGMA = 100;
static const int SECTIONS = 8;
static const int BOXES = 6;
static const double LARGEST_MULTIPLIER = 1000;  // at the start

class InteriorPoint {
 public:
  // Adaptive: the barrier parameter is chosen anew in each iteration, as long as that makes progress.
  InteriorPoint(const Nlp& nlp, const Settings& settings, bool adaptive)
      : nlp(nlp), settings(settings), n(nlp.n), m(nlp.m), may_adapt(adaptive) {}
  int iterations = 0;

  int solve(double* x_io, double* y_io, double* bounds_out, const double* lower, const double* upper,
            const double* row_lower, const double* row_upper) {
    if (!begin(x_io, y_io, lower, upper, row_lower, row_upper)) return INVALID;
    const int status = iterate();
    std::copy(x.begin(), x.end(), x_io);
    for (int i = 0; i < m; i++) y_io[i] = y[i] * row_scale[i] / f_scale;
    Vector jy;
    newton.transposed(y, jy);
    for (int j = 0; j < n; j++) bounds_out[j] = 0;
    for (const Side& side : sides)
      if (side.owner == VARIABLE)
        for (size_t k = 0; k < side.index.size(); k++) bounds_out[side.index[k]] -= side.sign * side.z[k] / f_scale;
    for (int j = 0; j < n; j++)
      if (newton.fixed[j]) bounds_out[j] = -fixed_slope(j) / f_scale;
    return status;
  }

 private:
  const Nlp& nlp;
  const Settings& settings;
  const int n, m;
  const bool may_adapt;
  Newton newton;
  vector<Side> sides;
  Vector x, t, a, b, y, g, df, raw_slopes, residual, lower_row, upper_row, row_scale;
  vector<char> equation;
  double f = 0, f_scale = 1, mu = 0, rho = 0, last_delta = 0;
  bool elastic = false;
  int bounded = 0;
  typedef std::pair<double, double> Pair;
  vector<Pair> filter, progress;

  // A value that lies within its bounds, off them by a share of their distance.
  static double inside(double value, double low, double high, double push) {
    const double width = high - low;
    if (std::isfinite(low))
      value = std::max(value,
                       low + std::min(push * std::max(1.0, std::fabs(low)), std::isfinite(high) ? push * width : INF));
    if (std::isfinite(high))
      value = std::min(value,
                       high - std::min(push * std::max(1.0, std::fabs(high)), std::isfinite(low) ? push * width : INF));
    return value;
  }
  bool values(const Vector& at, double& cost, Vector& rows) {
    std::copy(at.begin(), at.end(), nlp.x);
    if (nlp.call(VALUES)) return stopped = true, false;
    cost = *nlp.f * f_scale, rows.resize(m);
    bool finite = std::isfinite(cost);
    for (int i = 0; i < m; i++) rows[i] = nlp.g[i] * row_scale[i], finite = finite && std::isfinite(rows[i]);
    return finite;
  }
  // Gradient and Jacobian at the point of the last values.
  bool slopes() {
    std::copy(x.begin(), x.end(), nlp.x);
    if (nlp.call(SLOPES)) return stopped = true, false;
    bool finite = true;
    for (int j = 0; j < n; j++) {
      df[j] = nlp.gradient[j] * f_scale, finite = finite && std::isfinite(df[j]);
      for (int k = nlp.jacobian_columns[j]; k < nlp.jacobian_columns[j + 1]; k++) {
        const double value = nlp.jacobian[k] * row_scale[nlp.jacobian_rows[k]];
        finite = finite && std::isfinite(value);
        raw_slopes[k] = value, newton.jacobian[k] = newton.fixed[j] ? 0 : value;
      }
    }
    return finite;
  }
  double fixed_slope(int j) const {
    double sum = df[j];
    for (int k = nlp.jacobian_columns[j]; k < nlp.jacobian_columns[j + 1]; k++)
      sum += raw_slopes[k] * y[nlp.jacobian_rows[k]];
    return sum;
  }
  bool stopped = false;

  bool begin(const double* start, const double* multipliers, const double* lower, const double* upper,
             const double* row_lower, const double* row_upper) {
    equation.assign(m, 0);
    vector<char> fixed(n, 0);
    for (int i = 0; i < m; i++) equation[i] = row_lower[i] == row_upper[i];
    for (int j = 0; j < n; j++) fixed[j] = lower[j] == upper[j];
    newton.prepare(&nlp, equation, fixed);
    const double push = settings.warm ? 1e-6 : 1e-2;
    x.assign(start, start + n), row_scale.assign(m, 1), df.assign(n, 0), raw_slopes.assign(nlp.jacobian_columns[n], 0);
    for (int j = 0; j < n; j++) x[j] = fixed[j] ? lower[j] : inside(x[j], lower[j], upper[j], push);
    if (!values(x, f, g) || !slopes()) return false;
    double steepest = 0;
    Vector row(m, 0);
    for (int j = 0; j < n; j++) {
      if (!fixed[j]) steepest = std::max(steepest, std::fabs(df[j]));
      for (int k = nlp.jacobian_columns[j]; k < nlp.jacobian_columns[j + 1]; k++)
        row[nlp.jacobian_rows[k]] = std::max(row[nlp.jacobian_rows[k]], std::fabs(newton.jacobian[k]));
    }
    f_scale = steepest > 100 ? std::max(100 / steepest, 1e-8) : 1;
    for (int i = 0; i < m; i++) row_scale[i] = row[i] > 100 ? std::max(100 / row[i], 1e-8) : 1;
    f *= f_scale;
    for (double& value : df) value *= f_scale;
    for (int j = 0; j < n; j++)
      for (int k = nlp.jacobian_columns[j]; k < nlp.jacobian_columns[j + 1]; k++)
        newton.jacobian[k] *= row_scale[nlp.jacobian_rows[k]], raw_slopes[k] *= row_scale[nlp.jacobian_rows[k]];
    sides = {Side(SLACK, 1), Side(SLACK, -1), Side(VARIABLE, 1), Side(VARIABLE, -1), Side(ABOVE, 1), Side(BELOW, 1)};
    lower_row.resize(m), upper_row.resize(m), t.resize(m), a.assign(m, 0), b.assign(m, 0), y.assign(m, 0);
    lower_x.assign(lower, lower + n), upper_x.assign(upper, upper + n);
    for (int i = 0; i < m; i++) {
      lower_row[i] = row_lower[i] * row_scale[i], upper_row[i] = row_upper[i] * row_scale[i], g[i] *= row_scale[i];
      t[i] = equation[i] ? lower_row[i] : inside(g[i], lower_row[i], upper_row[i], push);
      if (settings.warm) y[i] = multipliers[i] * f_scale / row_scale[i];
      if (equation[i]) continue;
      if (std::isfinite(lower_row[i]))
        sides[0].index.push_back(i), sides[0].z.push_back(settings.warm ? std::max(-y[i], 1e-6) : 1);
      if (std::isfinite(upper_row[i]))
        sides[1].index.push_back(i), sides[1].z.push_back(settings.warm ? std::max(y[i], 1e-6) : 1);
      if (!settings.warm) y[i] = double(std::isfinite(upper_row[i])) - double(std::isfinite(lower_row[i]));
    }
    for (int j = 0; j < n; j++)
      if (!fixed[j]) {
        const double slope = settings.warm ? fixed_slope(j) : 0;
        if (std::isfinite(lower[j]))
          sides[2].index.push_back(j), sides[2].z.push_back(settings.warm ? std::max(slope, 1e-6) : 1);
        if (std::isfinite(upper[j]))
          sides[3].index.push_back(j), sides[3].z.push_back(settings.warm ? std::max(-slope, 1e-6) : 1);
      }
    measure();
    if (!settings.warm) estimate_multipliers();
    return true;
  }
  // Multipliers of the rows with which the gradient of the Lagrangian is smallest (least squares); 0 if they are large.
  void estimate_multipliers() {
    Vector r(n), c(m, 0), towards, estimate;
    for (int j = 0; j < n; j++) r[j] = newton.fixed[j] ? 0 : -df[j];
    for (const Side& side : sides)
      for (size_t k = 0; k < side.gap.size(); k++)
        (side.owner == VARIABLE ? r : c)[side.index[k]] += side.sign * side.z[k];
    std::fill(nlp.hessian, nlp.hessian + nlp.hessian_columns[n], 0.0);
    newton.diagonal.assign(n, 1), newton.D.assign(m, 1), newton.E.assign(m, 1);
    for (int i = 0; i < m; i++)
      if (equation[i]) newton.D[i] = newton.E[i] = 0;
    y.assign(m, 0);
    if (!newton.factorise(0, 0)) return;
    newton.solve(r, c, towards, estimate);
    double largest = 0;
    for (double value : estimate) largest = std::max(largest, std::fabs(value));
    if (largest <= LARGEST_MULTIPLIER) y = estimate;
  }
  Vector lower_x, upper_x;
  double distance(const Side& side, size_t k, const Vector& at_x, const Vector& at_t, const Vector& at_a,
                  const Vector& at_b) const {
    const int i = side.index[k];
    switch (side.owner) {
      case SLACK:
        return side.sign > 0 ? at_t[i] - lower_row[i] : upper_row[i] - at_t[i];
      case VARIABLE:
        return side.sign > 0 ? at_x[i] - lower_x[i] : upper_x[i] - at_x[i];
      case ABOVE:
        return at_a[i];
      default:
        return at_b[i];
    }
  }
  void measure() {  // gaps and residuals at the point
    bounded = 0;
    for (Side& side : sides) {
      side.gap.resize(side.index.size()), bounded += int(side.index.size());
      for (size_t k = 0; k < side.index.size(); k++) side.gap[k] = std::max(distance(side, k, x, t, a, b), 1e-300);
    }
    residual.resize(m);
    for (int i = 0; i < m; i++) residual[i] = g[i] - t[i] + a[i] - b[i];
  }
  double cost() const {
    double sum = 0;
    if (elastic)
      for (int i = 0; i < m; i++) sum += a[i] + b[i];
    return f + rho * sum;
  }
  static double one_norm(const Vector& v) {
    double sum = 0;
    for (double value : v) sum += std::fabs(value);
    return sum;
  }
  double complementarity() const {
    double sum = 0;
    for (const Side& side : sides)
      for (size_t k = 0; k < side.gap.size(); k++) sum += side.gap[k] * side.z[k];
    return sum / std::max(bounded, 1);
  }
  struct Errors {
    double all, dual, primal, centre, dual2;
  };
  Errors errors(double about) const {
    Vector jy;
    newton.transposed(y, jy);
    Vector rx(n), rt(m), ra(elastic ? m : 0), rb(elastic ? m : 0);
    for (int j = 0; j < n; j++) rx[j] = newton.fixed[j] ? 0 : df[j] + jy[j];
    for (int i = 0; i < m; i++) {
      rt[i] = equation[i] ? 0 : -y[i];
      if (elastic) ra[i] = rho + y[i], rb[i] = rho - y[i];
    }
    double centre = 0, sum = 0;
    for (const Side& side : sides) {
      Vector& r = side.owner == SLACK ? rt : side.owner == VARIABLE ? rx : side.owner == ABOVE ? ra : rb;
      for (size_t k = 0; k < side.gap.size(); k++) {
        r[side.index[k]] -= side.sign * side.z[k], sum += side.z[k];
        centre = std::max(centre, std::fabs(side.gap[k] * side.z[k] - about));
      }
    }
    double dual = 0, dual2 = 0, primal = 0;
    for (const Vector* r : {&rx, &rt, &ra, &rb})
      for (double value : *r) dual = std::max(dual, std::fabs(value)), dual2 += value * value;
    for (double value : residual) primal = std::max(primal, std::fabs(value));
    const double sd = std::max(100.0, (one_norm(y) + sum) / (m + bounded)) / 100,
                 sc = std::max(100.0, sum / std::max(bounded, 1)) / 100;
    return {std::max({dual / sd, primal, centre / sc}), dual, primal, centre, dual2};
  }
  Vector slack_weight, above_weight, below_weight;
  bool factorised() {
    for (int i = 0; i < m; i++) nlp.multipliers[i] = y[i] * row_scale[i];
    std::copy(x.begin(), x.end(), nlp.x), *nlp.factor = f_scale;
    if (nlp.call(CURVATURE)) return stopped = true, false;
    newton.diagonal.assign(n, 0), newton.D.assign(m, 0), newton.E.assign(m, 0);
    slack_weight.assign(m, 0), above_weight.assign(m, 1), below_weight.assign(m, 1);
    for (const Side& side : sides)
      for (size_t k = 0; k < side.gap.size(); k++) {
        Vector& weight = side.owner == SLACK      ? slack_weight
                         : side.owner == VARIABLE ? newton.diagonal
                         : side.owner == ABOVE    ? above_weight
                                                  : below_weight;
        const double w = side.z[k] / side.gap[k];
        if (side.owner >= ABOVE)
          weight[side.index[k]] = w;
        else
          weight[side.index[k]] += w;
      }
    for (int i = 0; i < m; i++) {
      double e = equation[i] ? 0 : 1 / std::max(slack_weight[i], 1e-20);
      if (elastic) e += 1 / above_weight[i] + 1 / below_weight[i];
      newton.E[i] = e, newton.D[i] = e > 0 ? 1 / e : 0;
    }
    for (int j = 0; j < n; j++) {
      for (int k = nlp.hessian_columns[j]; k < nlp.hessian_columns[j + 1]; k++)
        if (newton.fixed[j] || newton.fixed[nlp.hessian_rows[k]]) nlp.hessian[k] = 0;
      if (newton.fixed[j]) newton.diagonal[j] = 1;
    }
    const Vector E = newton.E;
    double delta = 0;
    while (!newton.factorise(delta, delta > 0 ? 1e-8 * std::pow(mu, 0.25) : 0)) {
      newton.E = E;
      if (delta == 0)
        delta = last_delta == 0 ? 1e-4 : std::max(1e-20, last_delta / 3);
      else
        delta *= last_delta == 0 ? 100 : 8;
      if (!(delta < 1e40)) return false;
    }
    if (delta > 0) last_delta = delta;
    return true;
  }
  void direction(double barrier, const Vector& rows, Step& step) {
    Vector r(n), c(m), bt(m, 0), jd;
    for (int j = 0; j < n; j++) r[j] = newton.fixed[j] ? 0 : -df[j];
    for (const Side& side : sides)
      for (size_t k = 0; k < side.gap.size(); k++) {
        if (side.owner == VARIABLE) r[side.index[k]] += side.sign * barrier / side.gap[k];
        if (side.owner == SLACK) bt[side.index[k]] -= side.sign * barrier / side.gap[k];
      }
    for (int i = 0; i < m; i++) {
      c[i] = -rows[i] - (equation[i] ? 0 : bt[i] / std::max(slack_weight[i], 1e-20));
      if (elastic) c[i] += -(barrier / a[i] - rho) / above_weight[i] + (barrier / b[i] - rho) / below_weight[i];
    }
    newton.solve(r, c, step.x, step.y);
    newton.times(step.x, jd);
    step.t.assign(m, 0), step.a.assign(elastic ? m : 0, 0), step.b.assign(elastic ? m : 0, 0);
    for (int i = 0; i < m; i++) {
      if (elastic) {
        step.a[i] = (barrier / a[i] - rho - step.y[i]) / above_weight[i];
        step.b[i] = (barrier / b[i] - rho + step.y[i]) / below_weight[i];
      }
      // From the multiplier, and what gives way most from the row: near a bound its differences are all rounding.
      const double row = jd[i] + rows[i];
      if (!equation[i])
        step.t[i] =
            (elastic || slack_weight[i] > 1) && slack_weight[i] > 0 ? (step.y[i] - bt[i]) / slack_weight[i] : row;
      if (elastic) {
        const double w = equation[i] ? INF : slack_weight[i];
        if (w <= std::min(above_weight[i], below_weight[i]))
          step.t[i] = row + step.a[i] - step.b[i];
        else if (above_weight[i] <= below_weight[i])
          step.a[i] = step.t[i] + step.b[i] - row;
        else
          step.b[i] = row + step.a[i] - step.t[i];
      }
      step.y[i] -= y[i];
    }
    step.z.resize(BOXES);
    for (int s = 0; s < BOXES; s++) {
      const Side& side = sides[s];
      const Vector& moved = step.of(side.owner);
      step.z[s].resize(side.gap.size());
      for (size_t k = 0; k < side.gap.size(); k++)
        step.z[s][k] = (barrier - side.z[k] * side.sign * moved[side.index[k]]) / side.gap[k] - side.z[k];
    }
  }
  static double until(double value, double change, double tau) {
    return change < 0 ? std::min(1.0, -tau * value / change) : 1.0;
  }
  Pair longest(const Step& step, double tau) const {
    double primal = 1, dual = 1;
    for (int s = 0; s < BOXES; s++) {
      const Side& side = sides[s];
      const Vector& moved = step.of(side.owner);
      for (size_t k = 0; k < side.gap.size(); k++) {
        primal = std::min(primal, until(side.gap[k], side.sign * moved[side.index[k]], tau));
        dual = std::min(dual, until(side.z[k], step.z[s][k], tau));
      }
    }
    return {primal, dual};
  }
  // For each bound its distance, multiplier, and how both move: without a barrier, and what the mean one adds.
  Vector gaps, multipliers, moved, more, turned, more_turned;
  void gather() {
    for (Vector* each : {&gaps, &multipliers, &moved, &more, &turned, &more_turned}) each->clear();
    for (int s = 0; s < BOXES; s++) {
      const Side& side = sides[s];
      const Vector &u = none.of(side.owner), &v = whole.of(side.owner);
      for (size_t k = 0; k < side.gap.size(); k++) {
        const int i = side.index[k];
        gaps.push_back(side.gap[k]), multipliers.push_back(side.z[k]);
        moved.push_back(side.sign * u[i]), more.push_back(side.sign * (v[i] - u[i]));
        turned.push_back(none.z[s][k]), more_turned.push_back(whole.z[s][k] - none.z[s][k]);
      }
    }
  }
  // Linearised optimality conditions after the step for a share sigma of the mean complementarity.
  double quality(double sigma, double dual2, double primal2) const {
    const size_t count = gaps.size();
    double nearer = 0, smaller = 0, sum = 0;  // largest shares of what is left, without branches
    for (size_t k = 0; k < count; k++) {
      nearer = std::max(nearer, -(moved[k] + sigma * more[k]) / gaps[k]);
      smaller = std::max(smaller, -(turned[k] + sigma * more_turned[k]) / multipliers[k]);
    }
    const double alpha = nearer > FRACTION ? FRACTION / nearer : 1, beta = smaller > FRACTION ? FRACTION / smaller : 1;
    for (size_t k = 0; k < count; k++) {
      const double product = (gaps[k] + alpha * (moved[k] + sigma * more[k])) *
                             (multipliers[k] + beta * (turned[k] + sigma * more_turned[k]));
      sum += product * product;
    }
    return (1 - beta) * (1 - beta) * dual2 / (n + m) + (1 - alpha) * (1 - alpha) * primal2 / std::max(m, 1) +
           sum / std::max(bounded, 1);
  }
  // Barrier parameter whose step has the best quality, by golden sections of its logarithm on the better side of 1.
  double best_barrier(double average, double dual2) {
    direction(0, residual, none), direction(average, residual, whole), gather();
    double primal2 = 0;
    for (double value : residual) primal2 += value * value;
    auto of = [&](double logarithm) { return quality(std::exp(logarithm), dual2, primal2); };
    const double share = (3 - std::sqrt(5.0)) / 2, below = std::log(0.99);
    const double at_one = of(0), at_below = of(below);
    const bool rises = at_below > at_one;
    const double first = rises ? 0 : std::log(LEAST_SIGMA), last = rises ? std::log(LARGEST_SIGMA) : below;
    double low = first, high = last, left = low + share * (high - low), right = high - share * (high - low);
    double at_left = of(left), at_right = of(right);
    for (int section = 0; section < SECTIONS; section++) {
      if (at_left > at_right)
        low = left, left = right, at_left = at_right, right = high - share * (high - low), at_right = of(right);
      else
        high = right, right = left, at_right = at_left, left = low + share * (high - low), at_left = of(left);
    }
    double best = std::min(at_left, at_right), chosen = at_left < at_right ? left : right;
    if (high == last && (rises ? of(last) : at_below) < best)
      chosen = last;
    else if (low == first && (rises ? at_one : of(first)) < best)
      chosen = first;
    return std::exp(chosen) * average;
  }
  // The step for a barrier parameter lies on the line through these two.
  Step none, whole;
  void between(double share, Step& step) const {
    auto mix = [share](const Vector& u, const Vector& v, Vector& out) {
      out.resize(u.size());
      for (size_t k = 0; k < u.size(); k++) out[k] = u[k] + share * (v[k] - u[k]);
    };
    mix(none.x, whole.x, step.x), mix(none.y, whole.y, step.y), mix(none.t, whole.t, step.t);
    mix(none.a, whole.a, step.a), mix(none.b, whole.b, step.b);
    step.z.resize(BOXES);
    for (int s = 0; s < BOXES; s++) mix(none.z[s], whole.z[s], step.z[s]);
  }
  double barrier_value(double cost, const Vector& at_x, const Vector& at_t, const Vector& at_a,
                       const Vector& at_b) const {
    double sum = 0;
    for (const Side& side : sides) {
      double product = 1;  // few logarithms
      for (size_t k = 0; k < side.index.size(); k++) {
        const double gap = distance(side, k, at_x, at_t, at_a, at_b);
        if (!(gap > 0)) return INF;
        product *= gap;
        if (product < 1e-200 || product > 1e200) sum += std::log(product), product = 1;
      }
      sum += std::log(product);
    }
    return cost - mu * sum;
  }
  void stretch(double cost_of_violation) {  // rows become elastic
    elastic = true, rho = cost_of_violation;
    for (int s : {4, 5}) sides[s].index.clear(), sides[s].z.clear();
    for (int i = 0; i < m; i++) {
      if (!equation[i]) t[i] = inside(g[i], lower_row[i], upper_row[i], 1e-2);
      const double c = g[i] - t[i], half = (mu - rho * c) / (2 * rho),
                   root = std::sqrt(half * half + mu * c / (2 * rho) + 0.0);
      a[i] = half + (std::isfinite(root) ? root : std::fabs(half)), b[i] = c + a[i];
      if (!(a[i] > 0) || !(b[i] > 0)) a[i] = std::max(-c, 0.0) + mu / rho, b[i] = std::max(c, 0.0) + mu / rho;
      sides[4].index.push_back(i), sides[5].index.push_back(i);
      sides[4].z.push_back(mu / a[i]), sides[5].z.push_back(mu / b[i]);
      y[i] = 0;
    }
    measure();
    for (int side : {0, 1})
      for (size_t k = 0; k < sides[side].z.size(); k++)
        sides[side].z[k] = mu / sides[side].gap[k], y[sides[side].index[k]] -= sides[side].sign * sides[side].z[k];
    for (double& multiplier : y) multiplier = std::min(std::max(multiplier, -0.9 * rho), 0.9 * rho);
    filter.clear(), progress.clear();
    measure();
  }
  void tighten() {  // and stiff again, where they hold
    elastic = false, rho = 0;
    for (int s : {4, 5}) sides[s].index.clear(), sides[s].z.clear();
    std::fill(a.begin(), a.end(), 0.0), std::fill(b.begin(), b.end(), 0.0);
    filter.clear(), progress.clear();
    measure();
  }
  int iterate() {
    const double least = settings.tolerance / 1000;
    bool adaptive = may_adapt;
    int acceptable = 0, failures = 0, stuck = 0;
    mu = settings.warm ? settings.barrier : std::max(complementarity(), least);
    Step step, correction;
    Vector nx(n), nt(m), na(m), nb(m), ng, rows(m);
    for (;; iterations++) {
      const Errors e = errors(0);
      double beyond = 0, stretched = 0;
      for (int i = 0; i < m; i++)
        beyond = std::max(beyond, std::fabs(residual[i]) / row_scale[i]),
        stretched = std::max(stretched, std::fabs(a[i] - b[i]) / row_scale[i]);
      if (!std::isfinite(e.all)) return INVALID;
      acceptable = e.all <= 1e-6 && beyond <= 1e-2 && stretched <= 1e-6 ? acceptable + 1 : 0;
      if (e.all <= settings.tolerance && e.dual <= 1 && beyond <= 1e-4 && e.centre <= 1e-4) {
        if (!elastic) return SUCCEEDED;
        if (stretched > 1e-6 && rho >= 1e6) return INFEASIBLE;
        if (stretched > 1e-6)
          mu = std::max(mu, 1e-4), adaptive = false, stretch(100 * rho);
        else
          tighten();
        continue;
      }
      if (elastic && e.all <= 1e-3 && stretched <= 1e-6) {
        tighten();
        continue;
      }
      if (acceptable >= 15) return ACCEPTABLE;
      if (iterations >= settings.iterations) return ITERATIONS;
      if (nlp.call(ITERATION)) return STOPPED;
      if (!factorised()) return stopped ? STOPPED : SINGULAR;
      // barrier parameter
      const double average = complementarity(), theta = one_norm(residual), value = cost(),
                   margin = 1e-5 * std::min(1.0, e.all);
      bool improves = true;
      for (const Pair& p : progress) improves = improves && (value <= p.first - margin || theta <= p.second - margin);
      if (adaptive && !improves)
        adaptive = false, mu = std::max(0.8 * average, least), filter.clear();
      else if (!adaptive && improves && may_adapt)
        adaptive = true;
      if (adaptive) {
        progress.push_back({value, theta}), filter.clear();
        mu = std::min(
            std::max({best_barrier(average, e.dual2), least, std::min(average, 1e-5 * std::max(e.dual, e.primal))}),
            1e5);
      } else {
        while (mu > least && errors(mu).all <= 10 * mu)
          mu = std::max(least, std::min(0.2 * mu, std::pow(mu, 1.5))), filter.clear();
      }
      const double tau = std::max(FRACTION, 1 - mu);
      if (adaptive)
        between(mu / average, step);
      else
        direction(mu, residual, step);
      Pair most = longest(step, tau);
      const double phi = barrier_value(value, x, t, a, b), noise = 10 * EPS * std::fabs(phi);
      double slope = 0;
      for (int j = 0; j < n; j++) slope += df[j] * step.x[j];
      if (elastic)
        for (int i = 0; i < m; i++) slope += rho * (step.a[i] + step.b[i]);
      for (const Side& side : sides)
        for (size_t k = 0; k < side.gap.size(); k++)
          slope -= mu * side.sign * step.of(side.owner)[side.index[k]] / side.gap[k];
      // filter line search
      const double small_theta = 1e-4 * std::max(1.0, first_theta(theta)),
                   large_theta = 1e4 * std::max(1.0, first_theta(theta));
      double shortest = 1e-5;
      if (slope < 0) {
        shortest = std::min(shortest, 1e-5 * theta / -slope);
        if (theta <= small_theta) shortest = std::min(shortest, std::pow(theta, 1.1) / std::pow(-slope, 2.3));
      }
      shortest = std::max(shortest * 0.05, 1e-14);
      double alpha = most.first, new_f = 0, new_phi = 0, new_theta = 0;
      bool found = false, armijo = false;
      const Step* used = &step;
      auto acceptable_trial = [&](double length) {
        for (int j = 0; j < n; j++) nx[j] = x[j] + length * used->x[j];
        for (int i = 0; i < m; i++) nt[i] = t[i] + length * used->t[i];
        double sum = 0;
        if (elastic)
          for (int i = 0; i < m; i++)
            na[i] = a[i] + length * used->a[i], nb[i] = b[i] + length * used->b[i], sum += na[i] + nb[i];
        if (!values(nx, new_f, ng)) return false;
        new_theta = 0;
        for (int i = 0; i < m; i++) new_theta += std::fabs(ng[i] - nt[i] + (elastic ? na[i] - nb[i] : 0));
        new_phi = barrier_value(new_f + rho * sum, nx, nt, na, nb);
        if (!std::isfinite(new_phi) || new_theta > large_theta) return false;
        for (const Pair& p : filter)
          if (new_theta >= p.first && new_phi - noise >= p.second) return false;
        const bool switching = slope < 0 && length * std::pow(-slope, 2.3) > std::pow(theta, 1.1);
        armijo = new_phi - phi - noise <= 1e-8 * length * slope;
        if (switching && theta <= small_theta) return armijo;
        armijo = false;
        return new_theta <= (1 - 1e-5) * theta || new_phi - phi - noise <= -1e-5 * theta;
      };
      for (bool first = true; alpha >= shortest || first; alpha *= 0.5, first = false) {
        used = &step;
        if ((found = acceptable_trial(alpha)) || stopped) break;
        if (first && std::isfinite(new_phi) && new_theta >= theta && theta > 0) {  // second-order corrections
          double before = theta, length = alpha;
          rows = residual;
          for (int round = 0; round < 4 && !found; round++) {
            for (int i = 0; i < m; i++) rows[i] = length * rows[i] + ng[i] - nt[i] + (elastic ? na[i] - nb[i] : 0);
            direction(mu, rows, correction);
            length = longest(correction, tau).first, used = &correction;
            found = acceptable_trial(length);
            if (stopped || !(new_theta <= 0.99 * before)) break;
            before = new_theta;
          }
          if (found) {
            alpha = length;
            break;
          }
        }
      }
      if (stopped) return STOPPED;
      stuck = alpha < 1e-3 ? stuck + 1 : 0;
      if (!found || (stuck >= 4 && !elastic)) {
        stuck = 0;
        if (e.all <= 1e-6 && stretched <= 1e-6) return ACCEPTABLE;
        if (++failures > 20) return TOO_SMALL;
        adaptive = false, mu = std::max(10 * mu, average);
        stretch(elastic ? rho : 100);
        continue;
      }
      if (!armijo) filter.push_back({(1 - 1e-5) * theta, phi - 1e-5 * theta});
      x = nx, t = nt, f = new_f, g = ng;
      if (elastic) a = na, b = nb;
      for (int i = 0; i < m; i++) y[i] += alpha * step.y[i];
      for (int s = 0; s < BOXES; s++)
        for (size_t k = 0; k < sides[s].z.size(); k++) sides[s].z[k] += most.second * step.z[s][k];
      measure();
      for (Side& side : sides)
        for (size_t k = 0; k < side.z.size(); k++)
          side.z[k] = std::min(std::max(side.z[k], mu / (1e10 * side.gap[k])), 1e10 * mu / side.gap[k]);
      if (!slopes()) return stopped ? STOPPED : INVALID;
    }
  }
  double theta_at_first = -1;
  double first_theta(double theta) {
    if (theta_at_first < 0) theta_at_first = theta;
    return theta_at_first;
  }
};

#define EXPORTED extern "C" __attribute__((visibility("default")))

EXPORTED int nlp_gait_condensed(const Nlp* nlp, const Settings* settings, double* x, double* y, double* bounds,
                                const double* lower, const double* upper, const double* row_lower,
                                const double* row_upper, int* iterations) {
  const Vector x0(x, x + nlp->n), y0(y, y + nlp->m);
  *iterations = 0;
  for (bool adaptive : {true, false}) {  // what the fast strategy cannot do, the patient one may
    if (settings->warm && adaptive) continue;
    std::copy(x0.begin(), x0.end(), x), std::copy(y0.begin(), y0.end(), y);
    InteriorPoint method(*nlp, *settings, adaptive);
    const int status = method.solve(x, y, bounds, lower, upper, row_lower, row_upper);
    *iterations += method.iterations;
    const bool failed = status == INFEASIBLE || status == ITERATIONS || status == TOO_SMALL || status == SINGULAR;
    if (!adaptive || !failed) return status;
  }
  return INVALID;
}

// Rows of the matrix that is factorised.
EXPORTED int nlp_gait_condensed_size(const Nlp* nlp, const char* equations) {
  Newton newton;
  newton.prepare(nlp, vector<char>(equations, equations + nlp->m), vector<char>(nlp->n, 0));
  return newton.nd + newton.nk;
}
