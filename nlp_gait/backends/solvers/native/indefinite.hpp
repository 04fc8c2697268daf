// ---- symmetric indefinite matrices: Bunch and Kaufman (1977), lower triangle, row by row ----
struct Indefinite {
  int n = 0;
  Vector a;
  vector<int> swap;     // >= 0: block of one; else block of two with ~swap
  vector<char> second;  // of a block of two
  Vector one, two;
  double& at(int i, int j) { return a[size_t(i) * n + j]; }
  // Number of negative eigenvalues, or -1 if singular.
  int factorise() {
    const double alpha = (1 + std::sqrt(17.0)) / 8;
    int negative = 0;
    swap.assign(n, 0), second.assign(n, 0), one.resize(n), two.resize(n);
    double largest = 0;
    for (int i = 0; i < n; i++)
      for (int j = 0; j <= i; j++) {
        if (!std::isfinite(at(i, j))) return -1;
        largest = std::max(largest, std::fabs(at(i, j)));
      }
    for (int k = 0; k < n;) {
      int size = 1, pivot = k, r = k;
      double diagonal = std::fabs(at(k, k)), column = 0;
      for (int i = k + 1; i < n; i++)
        if (std::fabs(at(i, k)) > column) column = std::fabs(at(i, k)), r = i;
      if (std::max(diagonal, column) <= EPS * EPS * largest) return -1;
      if (diagonal < alpha * column) {
        double row = 0;
        for (int j = k; j < r; j++) row = std::max(row, std::fabs(at(r, j)));
        for (int i = r + 1; i < n; i++) row = std::max(row, std::fabs(at(i, r)));
        if (diagonal * row >= alpha * column * column)
          pivot = k;
        else if (std::fabs(at(r, r)) >= alpha * row)
          pivot = r;
        else
          pivot = r, size = 2;
      }
      const int to = k + size - 1;
      if (pivot != to) {
        for (int j = 0; j < k; j++) std::swap(at(to, j), at(pivot, j));
        for (int i = pivot + 1; i < n; i++) std::swap(at(i, to), at(i, pivot));
        for (int i = to + 1; i < pivot; i++) std::swap(at(i, to), at(pivot, i));
        std::swap(at(to, to), at(pivot, pivot));
        if (size == 2) std::swap(at(to, k), at(pivot, k));
      }
      if (size == 1) {
        const double d = at(k, k);
        if (d == 0) return -1;
        negative += d < 0;
        for (int i = k + 1; i < n; i++) one[i] = at(i, k);
        for (int i = k + 1; i < n; i++) {
          const double l = one[i] / d;
          double* to_row = &at(i, 0);
          if (l != 0)
            for (int j = k + 1; j <= i; j++) to_row[j] -= l * one[j];
        }
        for (int i = k + 1; i < n; i++) at(i, k) /= d;
        swap[k] = pivot;
      } else {
        const double p = at(k, k), q = at(k + 1, k), s = at(k + 1, k + 1), det = p * s - q * q;
        if (det == 0) return -1;
        negative += det < 0 ? 1 : (p < 0 ? 2 : 0);
        for (int i = k + 2; i < n; i++) one[i] = at(i, k), two[i] = at(i, k + 1);
        for (int i = k + 2; i < n; i++) {
          const double u = (one[i] * s - two[i] * q) / det, v = (two[i] * p - one[i] * q) / det;
          double* to_row = &at(i, 0);
          for (int j = k + 2; j <= i; j++) to_row[j] -= u * one[j] + v * two[j];
        }
        for (int i = k + 2; i < n; i++) {
          const double u = (at(i, k) * s - at(i, k + 1) * q) / det, v = (at(i, k + 1) * p - at(i, k) * q) / det;
          at(i, k) = u, at(i, k + 1) = v;
        }
        swap[k] = swap[k + 1] = ~pivot, second[k + 1] = 1;
      }
      k += size;
    }
    return negative;
  }
  void solve(double* b) {
    for (int k = 0; k < n; k += swap[k] >= 0 ? 1 : 2)
      std::swap(b[swap[k] >= 0 ? k : k + 1], b[swap[k] >= 0 ? swap[k] : ~swap[k]]);
    for (int i = 0; i < n; i++) {  // blocks of two have no entry of their own below the diagonal
      const int last = i && swap[i] < 0 && second[i] ? i - 1 : i;
      for (int j = 0; j < last; j++) b[i] -= at(i, j) * b[j];
    }
    for (int k = 0; k < n;) {
      if (swap[k] >= 0)
        b[k] /= at(k, k), k++;
      else {
        const double p = at(k, k), q = at(k + 1, k), s = at(k + 1, k + 1), det = p * s - q * q, u = b[k], v = b[k + 1];
        b[k] = (u * s - v * q) / det, b[k + 1] = (v * p - u * q) / det, k += 2;
      }
    }
    for (int i = n - 1; i >= 0; i--) {
      const int last = i && swap[i] < 0 && second[i] ? i - 1 : i;
      for (int j = 0; j < last; j++) b[j] -= at(i, j) * b[i];
    }
    for (int k = n - 1; k >= 0; k--) {
      if (swap[k] >= 0)
        std::swap(b[k], b[swap[k]]);
      else if (second[k])
        std::swap(b[k], b[~swap[k]]);
    }
  }
};
