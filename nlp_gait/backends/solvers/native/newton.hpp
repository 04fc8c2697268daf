// ---- the Newton system ----
//   (H + diagonal) dx + J' y = r,   J dx - E y = c
struct Newton {
  const Nlp* nlp = nullptr;
  int n = 0, m = 0, nd = 0, ne = 0, nk = 0;
  vector<int> place;                  // of each variable among the dense (>= 0) or the eliminated ones (~place)
  vector<int> kept;                   // place of each row among those that are kept, or -1
  vector<int> start, column, source;  // rows of J: columns and places in the nonzeros
  struct Lift {                       // an eliminated variable
    int variable;
    vector<int> rows, entry, kept_rows, kept_entry;  // rows with their nonzero; those that are kept
    vector<int> dense;                               // dense variables that meet it
    vector<int> hessian, hessian_at;  // nonzeros of H in its column off the diagonal, and which dense one
    vector<int> diagonal;
    double d = 0;
    Vector slope;  // of minus the variable in the dense ones
  };
  vector<Lift> lifts;
  vector<int> plain;  // rows without eliminated variables that are not kept
  vector<int> dense_hessian, hr, hc;
  vector<char> fixed;
  Vector jacobian, E, D, diagonal, scratch, u, mean;
  Indefinite small;
  double shift = 0;

  void prepare(const Nlp* of, const vector<char>& equation, const vector<char>& is_fixed) {
    nlp = of, n = of->n, m = of->m, fixed = is_fixed;
    const int nnz = of->jacobian_columns[n];
    start.assign(m + 1, 0), column.assign(nnz, 0), source.assign(nnz, 0);
    for (int k = 0; k < nnz; k++) start[of->jacobian_rows[k] + 1]++;
    for (int i = 0; i < m; i++) start[i + 1] += start[i];
    vector<int> next(start.begin(), start.end() - 1);
    for (int j = 0; j < n; j++)
      for (int k = of->jacobian_columns[j]; k < of->jacobian_columns[j + 1]; k++) {
        const int at = next[of->jacobian_rows[k]]++;
        column[at] = j, source[at] = k;
      }
    vector<char> out(n, 0);
    for (int j = of->leading; j < n; j++) out[j] = 1;
    hr.clear(), hc.clear();
    for (int j = 0; j < n; j++)
      for (int k = of->hessian_columns[j]; k < of->hessian_columns[j + 1]; k++)
        hr.push_back(of->hessian_rows[k]), hc.push_back(j);
    for (size_t k = 0; k < hr.size(); k++)
      if (hr[k] != hc[k] && out[hr[k]] && out[hc[k]]) out[hr[k]] = out[hc[k]] = 0;
    place.assign(n, 0), nd = ne = nk = 0;
    for (int j = 0; j < n; j++) place[j] = out[j] ? ~(ne++) : nd++;
    lifts.assign(ne, Lift());
    kept.assign(m, -1), plain.clear();
    for (int i = 0; i < m; i++) {
      int count = 0;
      for (int k = start[i]; k < start[i + 1]; k++) count += place[column[k]] < 0;
      if (equation[i] || count > 1)
        kept[i] = nk++;
      else if (!count)
        plain.push_back(i);
      for (int k = start[i]; k < start[i + 1]; k++)
        if (place[column[k]] < 0) {
          Lift& lift = lifts[~place[column[k]]];
          (kept[i] < 0 ? lift.rows : lift.kept_rows).push_back(i);
          (kept[i] < 0 ? lift.entry : lift.kept_entry).push_back(source[k]);
        }
    }
    dense_hessian.clear();
    vector<int> mark(nd, -1);
    for (int j = 0; j < n; j++)
      if (place[j] < 0) lifts[~place[j]].variable = j;
    for (size_t k = 0; k < hr.size(); k++) {
      const int a = place[hr[k]], b = place[hc[k]];
      if (a >= 0 && b >= 0)
        dense_hessian.push_back(int(k));
      else if (a < 0 && b < 0)
        lifts[~a].diagonal.push_back(int(k));
      else
        lifts[a < 0 ? ~a : ~b].hessian.push_back(int(k));
    }
    for (int e = 0; e < ne; e++) {
      Lift& lift = lifts[e];
      auto add = [&](int d) {
        if (mark[d] < 0) mark[d] = int(lift.dense.size()), lift.dense.push_back(d);
        return mark[d];
      };
      for (int i : lift.rows)
        for (int k = start[i]; k < start[i + 1]; k++)
          if (place[column[k]] >= 0) add(place[column[k]]);
      for (int k : lift.hessian) lift.hessian_at.push_back(add(place[hr[k]] >= 0 ? place[hr[k]] : place[hc[k]]));
      for (int d : lift.dense) mark[d] = -1;
      lift.slope.assign(lift.dense.size(), 0);
    }
    small.n = nd + nk, small.a.assign(size_t(small.n) * small.n, 0);
    jacobian.assign(nnz, 0), scratch.assign(nd, 0), mean.assign(nd, 0);
  }
  void times(const Vector& x, Vector& out) const {  // J x
    out.assign(m, 0);
    for (int i = 0; i < m; i++) {
      double sum = 0;
      for (int k = start[i]; k < start[i + 1]; k++) sum += jacobian[source[k]] * x[column[k]];
      out[i] = sum;
    }
  }
  void transposed(const Vector& y, Vector& out) const {  // J' y
    out.assign(n, 0);
    for (int j = 0; j < n; j++) {
      double sum = 0;
      for (int k = nlp->jacobian_columns[j]; k < nlp->jacobian_columns[j + 1]; k++)
        sum += jacobian[k] * y[nlp->jacobian_rows[k]];
      out[j] = sum;
    }
  }
  void curved(const Vector& x, Vector& out) const {  // (H + diagonal) x
    out.assign(n, 0);
    for (size_t k = 0; k < hr.size(); k++) {
      out[hr[k]] += nlp->hessian[k] * x[hc[k]];
      if (hr[k] != hc[k]) out[hc[k]] += nlp->hessian[k] * x[hr[k]];
    }
    for (int j = 0; j < n; j++) out[j] += (diagonal[j] + shift) * x[j];
  }
  // Whether the condensed matrix has the inertia of a minimum.
  bool factorise(double delta, double dual) {
    shift = delta;
    std::fill(small.a.begin(), small.a.end(), 0.0);
    auto add = [&](int i, int j, double value) { small.at(std::max(i, j), std::min(i, j)) += value; };
    for (int k : dense_hessian) add(place[hr[k]], place[hc[k]], nlp->hessian[k]);
    for (int j = 0; j < n; j++)
      if (place[j] >= 0) add(place[j], place[j], diagonal[j] + delta);
    for (int i : plain) {
      for (int k = start[i]; k < start[i + 1]; k++) {
        const double w = D[i] * jacobian[source[k]];
        double* row = &small.at(place[column[k]], 0);
        for (int l = start[i]; l <= k; l++) row[place[column[l]]] += w * jacobian[source[l]];  // columns ascend
      }
    }
    for (Lift& lift : lifts) {
      const int size = int(lift.dense.size());
      double own = diagonal[lift.variable] + delta, W = 0;
      for (int k : lift.diagonal) own += nlp->hessian[k];
      std::fill(mean.begin(), mean.begin() + std::min(nd, size), 0.0);
      for (size_t r = 0; r < lift.rows.size(); r++) {
        const int i = lift.rows[r];
        const double c = jacobian[lift.entry[r]];
        W += D[i] * c * c;
        for (int k = start[i]; k < start[i + 1]; k++)
          if (place[column[k]] >= 0) scratch[place[column[k]]] += D[i] * c * jacobian[source[k]];
      }
      lift.d = W + own;
      if (!(lift.d > 0) || !std::isfinite(lift.d)) {
        std::fill(scratch.begin(), scratch.end(), 0.0);
        return false;
      }
      for (int a = 0; a < size; a++) mean[a] = W > 0 ? scratch[lift.dense[a]] / W : 0, scratch[lift.dense[a]] = 0;
      // Centred, else two steep rows that nearly cancel leave rounding errors only.
      for (size_t r = 0; r < lift.rows.size(); r++) {
        const int i = lift.rows[r];
        const double c = jacobian[lift.entry[r]], w = D[i] * c * c;
        if (w == 0) continue;
        for (int k = start[i]; k < start[i + 1]; k++)
          if (place[column[k]] >= 0) scratch[place[column[k]]] = jacobian[source[k]] / c;
        for (int a = 0; a < size; a++) {
          const double at_a = w * (scratch[lift.dense[a]] - mean[a]);
          for (int b = 0; b <= a; b++) add(lift.dense[a], lift.dense[b], at_a * (scratch[lift.dense[b]] - mean[b]));
        }
        for (int a : lift.dense) scratch[a] = 0;
      }
      const double share = W / lift.d;
      for (size_t k = 0; k < lift.hessian.size(); k++) scratch[lift.hessian_at[k]] += nlp->hessian[lift.hessian[k]];
      for (int a = 0; a < size; a++) {
        for (int b = 0; b <= a; b++) {
          double value = share * own * mean[a] * mean[b];
          if (!lift.hessian.empty())
            value -= share * (mean[a] * scratch[b] + scratch[a] * mean[b]) + scratch[a] * scratch[b] / lift.d;
          add(lift.dense[a], lift.dense[b], value);
        }
        lift.slope[a] = share * mean[a] + scratch[a] / lift.d;
      }
      for (int at : lift.hessian_at) scratch[at] = 0;
      for (size_t r = 0; r < lift.kept_rows.size(); r++) {
        const int i = nd + kept[lift.kept_rows[r]];
        const double c = jacobian[lift.kept_entry[r]];
        for (int a = 0; a < size; a++) small.at(i, lift.dense[a]) -= c * lift.slope[a];
        for (size_t s = 0; s <= r; s++)
          add(i, nd + kept[lift.kept_rows[s]], -c * jacobian[lift.kept_entry[s]] / lift.d);
      }
    }
    for (int i = 0; i < m; i++)
      if (kept[i] >= 0) {
        for (int k = start[i]; k < start[i + 1]; k++)
          if (place[column[k]] >= 0) small.at(nd + kept[i], place[column[k]]) += jacobian[source[k]];
        E[i] += dual;
        small.at(nd + kept[i], nd + kept[i]) -= E[i];
      }
    return small.factorise() == nk;
  }
  void once(const Vector& r, const Vector& c, Vector& dx, Vector& y) {
    Vector w(m), sum;
    for (int i = 0; i < m; i++) w[i] = kept[i] < 0 ? D[i] * c[i] : 0;
    transposed(w, sum);
    for (int j = 0; j < n; j++) sum[j] += r[j];
    Vector b(nd + nk, 0);
    for (int j = 0; j < n; j++)
      if (place[j] >= 0) b[place[j]] += sum[j];
    for (int i = 0; i < m; i++)
      if (kept[i] >= 0) b[nd + kept[i]] += c[i];
    for (const Lift& lift : lifts) {
      const double value = sum[lift.variable];
      for (size_t a = 0; a < lift.dense.size(); a++) b[lift.dense[a]] -= lift.slope[a] * value;
      for (size_t k = 0; k < lift.kept_rows.size(); k++)
        b[nd + kept[lift.kept_rows[k]]] -= jacobian[lift.kept_entry[k]] * value / lift.d;
    }
    small.solve(b.data());
    dx.assign(n, 0);
    for (int j = 0; j < n; j++)
      if (place[j] >= 0) dx[j] = b[place[j]];
    for (const Lift& lift : lifts) {
      double value = sum[lift.variable] / lift.d;
      for (size_t a = 0; a < lift.dense.size(); a++) value -= lift.slope[a] * b[lift.dense[a]];
      for (size_t k = 0; k < lift.kept_rows.size(); k++)
        value -= jacobian[lift.kept_entry[k]] * b[nd + kept[lift.kept_rows[k]]] / lift.d;
      dx[lift.variable] = value;
    }
    times(dx, y);
    for (int i = 0; i < m; i++) y[i] = kept[i] < 0 ? D[i] * (y[i] - c[i]) : b[nd + kept[i]];
  }
  void solve(const Vector& r, const Vector& c, Vector& dx, Vector& y) {
    once(r, c, dx, y);
    Vector r1, r2, jy, ddx, dy;
    double before = INF;
    for (int round = 0; round < 3; round++) {  // iterative refinement
      curved(dx, r1), transposed(y, jy), times(dx, r2);
      double size = 0, worst = 0;
      for (int j = 0; j < n; j++)
        size = std::max(size, std::fabs(r[j])), r1[j] = r[j] - r1[j] - jy[j], worst = std::max(worst, std::fabs(r1[j]));
      for (int i = 0; i < m; i++)
        size = std::max(size, std::fabs(c[i])), r2[i] = c[i] - r2[i] + E[i] * y[i],
        worst = std::max(worst, std::fabs(r2[i]));
      if (!(worst > 1e-13 * (1 + size)) || !(worst < 0.5 * before)) break;
      before = worst;
      once(r1, r2, ddx, dy);
      for (int j = 0; j < n; j++) dx[j] += ddx[j];
      for (int i = 0; i < m; i++) y[i] += dy[i];
    }
  }
};
