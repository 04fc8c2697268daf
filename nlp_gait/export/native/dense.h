/* nlp-gait: Dense linear algebra of small sizes: eigenvectors of a symmetric matrix, and quadratic programs.
 *
 * Matrices are stored by rows. Nothing is allocated.
 */
#ifndef NLP_GAIT_DENSE_H
#define NLP_GAIT_DENSE_H

#include <math.h>
#include <string.h>

static double dot(int n, const double *restrict a, const double *restrict b) {
  double sum[8] = {0.0}, all = 0.0; /* of every eighth product, which the compiler can add at once */
  int i = 0;
  for (; i + 8 <= n; i += 8)
    for (int k = 0; k < 8; ++k) sum[k] += a[i + k] * b[i + k];
  for (; i < n; ++i) all += a[i] * b[i];
  for (int k = 0; k < 8; ++k) all += sum[k];
  return all;
}

/* Turn rows a and b (n). */
static void rotate(int n, double *restrict a, double *restrict b, double c, double s) {
  for (int k = 0; k < n; ++k) {
    const double old = a[k];
    a[k] = c * old - s * b[k];
    b[k] = s * old + c * b[k];
  }
}

/* Eigenvalues and eigenvectors of a symmetric matrix a (n, n) by Jacobi's rotations: a becomes diagonal, and row i of
 * vectors (n, n) belongs to the eigenvalue a[i][i]. At most 30 sweeps, of 6 n^3 operations each. */
static void find_eigenvectors(int n, double *a, double *vectors) {
  for (int i = 0; i < n * n; ++i) vectors[i] = i % (n + 1) ? 0.0 : 1.0;
  for (int sweep = 0; sweep < 30; ++sweep) {
    double outside = 0.0, all = 0.0;
    for (int i = 0; i < n * n; ++i) {
      all += a[i] * a[i];
      if (i % (n + 1)) outside += a[i] * a[i];
    }
    if (outside <= 1e-34 * all) return;
    for (int i = 0; i < n; ++i)
      for (int j = i + 1; j < n; ++j) {
        double *first = a + i * n, *second = a + j * n;
        const double between = first[j];
        if (between * between <= 1e-34 * all / (n * n)) continue;
        const double ratio = (second[j] - first[i]) / (2.0 * between);
        const double t = (ratio < 0.0 ? -1.0 : 1.0) / (fabs(ratio) + sqrt(ratio * ratio + 1.0));
        const double c = 1.0 / sqrt(t * t + 1.0), s = t * c;
        const double less = first[i] - t * between, more = second[j] + t * between;
        rotate(n, first, second, c, s);
        rotate(n, vectors + i * n, vectors + j * n, c, s);
        first[i] = less, second[j] = more, first[j] = second[i] = 0.0;
        for (int k = 0; k < n; ++k) a[k * n + i] = first[k], a[k * n + j] = second[k];
      }
  }
}

/* A strictly convex quadratic program in y (n): minimise 1/2 y' H y + c' y subject to lower <= (y, A y) <= upper.
 *
 * The dual method of Goldfarb and Idnani (1983), "A numerically stable dual method for solving strictly convex quadratic
 * programs": begin at the minimum with the guessed constraints active whose multipliers have the right sign; then add one
 * violated constraint after another, and drop an active one whose multiplier would become negative. Each addition or drop takes
 * at most 14 n^2 + 2 n rows operations. */
typedef struct {
  int n, rows;
  int coupled;                   /* from this variable on, H is diagonal */
  const double *linear, *matrix; /* c (n), A (rows, n) */
  const double *lower, *upper;   /* (n + rows) of y, then of A y */
  const signed char *guess;      /* (n + rows) 1 if probably active at the lower bound, -1 at the upper one, else 0 */
  double *hessian;               /* H (n, n), destroyed */
  double *basis;                 /* (n, n) work: its rows b span y, with H b of one orthogonal to the others */
  double *triangle;              /* (n, n) work: row k has the coordinates of active constraint k */
  double *along, *move, *drop;   /* (n) work */
  double *price;                 /* (n + 1) of the active constraints */
  int *active, *side;            /* (n + 1) their numbers, and 1 at a lower bound, -1 at an upper one */
  char *is_active;               /* (n + rows) 1, or 2 for an equation that others imply */
  double *y;                     /* result */
  double *multipliers;           /* (n + rows) result, positive at an upper bound */
} Program;

enum { SOLVED, NO_POINT, NO_CONVERGENCE }; /* NO_POINT: the constraints contradict each other */

#define FEASIBLE 1e-10  /* violation that is allowed */
#define DEPENDENT 1e-10 /* a constraint's share outside the active ones, below which it depends on them */

static double product(const Program *q, int i, const double *y) {
  return i < q->n ? y[i] : dot(q->n, q->matrix + (i - q->n) * q->n, y);
}

/* Turn rows i and j of the basis, so that (a, b) becomes (length, 0). */
static double turn(Program *q, int i, int j, double a, double b, double *cosine, double *sine) {
  const double length = sqrt(a * a + b * b);
  const double c = length > 0.0 ? a / length : 1.0, s = length > 0.0 ? b / length : 0.0;
  rotate(q->n, q->basis + i * q->n, q->basis + j * q->n, c, -s);
  *cosine = c, *sine = s;
  return length;
}

/* Find a basis with no constraint active; return whether H is positive definite. */
static int find_basis(Program *q) {
  const int n = q->n, first = q->coupled, alone = n - first;
  double *h = q->hessian;
  memset(q->basis, 0, (size_t)n * n * sizeof(double));
  for (int i = 0; i < alone; ++i) {
    if (!(h[(first + i) * (n + 1)] > 0.0)) return 0;
    q->basis[i * n + first + i] = 1.0 / sqrt(h[(first + i) * (n + 1)]);
  }
  for (int j = 0; j < first; ++j) { /* H = L L', in place */
    const double pivot = h[j * n + j] - dot(j, h + j * n, h + j * n);
    if (!(pivot > 0.0)) return 0;
    h[j * n + j] = sqrt(pivot);
    for (int i = j + 1; i < first; ++i) h[i * n + j] = (h[i * n + j] - dot(j, h + i * n, h + j * n)) / h[j * n + j];
  }
  for (int i = 0; i < first; ++i) { /* rows of L's inverse */
    double *row = q->basis + (alone + i) * n;
    row[i] = 1.0;
    for (int j = 0; j < i; ++j)
      for (int k = 0; k <= j; ++k) row[k] -= h[i * n + j] * q->basis[(alone + j) * n + k];
    for (int k = 0; k <= i; ++k) row[k] /= h[i * n + i];
  }
  return 1;
}

/* Find the coordinates of a constraint; return whether it depends on the first count active ones. */
static int find_along(Program *q, int chosen, int side, int count, double *outside) {
  double all = 0.0;
  *outside = 0.0;
  for (int k = 0; k < q->n; ++k) {
    q->along[k] = side * product(q, chosen, q->basis + k * q->n);
    all += q->along[k] * q->along[k];
    if (k >= count) *outside += q->along[k] * q->along[k];
  }
  return *outside <= DEPENDENT * DEPENDENT * all || count == q->n;
}

/* Add the constraint of find_along to the first count active ones. */
static void add_active(Program *q, int chosen, int side, double price, int count) {
  double c, s;
  for (int k = q->n - 1; k > count; --k) {
    if (q->along[k] == 0.0) continue;
    q->along[k - 1] = turn(q, k - 1, k, q->along[k - 1], q->along[k], &c, &s);
    q->along[k] = 0.0;
  }
  memcpy(q->triangle + count * q->n, q->along, q->n * sizeof(double));
  q->active[count] = chosen, q->side[count] = side, q->price[count] = price, q->is_active[chosen] = 1;
}

/* Remove active constraint k of the first count ones. */
static void remove_active(Program *q, int k, int count) {
  const int n = q->n;
  double c, s;
  q->is_active[q->active[k]] = 0;
  for (int i = k; i + 1 < count; ++i) {
    q->active[i] = q->active[i + 1], q->side[i] = q->side[i + 1], q->price[i] = q->price[i + 1];
    memcpy(q->triangle + i * n, q->triangle + (i + 1) * n, n * sizeof(double));
  }
  for (int i = k; i + 1 < count; ++i) {
    double *row = q->triangle + i * n;
    row[i] = turn(q, i, i + 1, row[i], row[i + 1], &c, &s);
    row[i + 1] = 0.0;
    for (int j = i + 1; j + 1 < count; ++j) {
      double *next = q->triangle + j * n;
      const double old = next[i];
      next[i] = c * old + s * next[i + 1];
      next[i + 1] = c * next[i + 1] - s * old;
    }
  }
}

/* Solve with the transposed triangle of the first count active constraints. */
static void find_prices(const Program *q, const double *right, int count, double *prices) {
  memcpy(prices, right, count * sizeof(double));
  for (int k = count - 1; k >= 0; --k) {
    const double *row = q->triangle + k * q->n, price = prices[k] / row[k];
    for (int j = 0; j < k; ++j) prices[j] -= price * row[j];
    prices[k] = price;
  }
}

static int is_equation(const Program *q, int i) { return q->lower[i] >= q->upper[i]; }

/* Begin at the minimum with the equations and those guessed constraints whose multipliers are positive; return their number. */
static int begin_program(Program *q) {
  const int n = q->n;
  int count = 0, worst;
  double outside;
  for (int pass = 0; pass < 2; ++pass) /* equations first */
    for (int i = 0; i < n + q->rows; ++i) {
      const int side = pass ? q->guess[i] : 1;
      if (is_equation(q, i) == pass || !side || isinf(side > 0 ? q->lower[i] : q->upper[i])) continue;
      if (!find_along(q, i, side, count, &outside)) add_active(q, i, side, 0.0, count++);
      else if (!pass) q->is_active[i] = 2;
    }
  for (;;) {
    for (int k = 0; k < n; ++k) { /* coordinates of y, and of its gradient */
      const double slope = dot(n, q->basis + k * n, q->linear), *row = q->triangle + k * n;
      const int i = k < count ? q->active[k] : 0;
      const double bound = q->side[k] > 0 ? q->lower[i] : -q->upper[i];
      q->move[k] = k < count ? (bound - dot(k, row, q->move)) / row[k] : -slope;
      q->along[k] = q->move[k] + slope;
    }
    find_prices(q, q->along, count, q->price);
    worst = -1;
    for (int k = 0; k < count; ++k)
      if (!is_equation(q, q->active[k]) && q->price[k] < 0.0 && (worst < 0 || q->price[k] < q->price[worst])) worst = k;
    if (worst < 0) break;
    remove_active(q, worst, count--);
  }
  memset(q->y, 0, n * sizeof(double));
  for (int k = 0; k < n; ++k)
    for (int i = 0; i < n; ++i) q->y[i] += q->move[k] * q->basis[k * n + i];
  return count;
}

/* How much y violates a constraint, and at which side. */
static double find_violation(const Program *q, int i, int *side) {
  const double value = product(q, i, q->y), below = q->lower[i] - value, above = value - q->upper[i];
  *side = below >= above ? 1 : -1;
  return fmax(below, above);
}

/* Return the constraint that is violated most, or -1. */
static int choose_violated(const Program *q, int *side) {
  int chosen = -1, own;
  double most = FEASIBLE;
  for (int i = 0; i < q->n + q->rows; ++i) {
    const double violation = q->is_active[i] ? 0.0 : find_violation(q, i, &own);
    if (violation > most) most = violation, chosen = i, *side = own;
  }
  return chosen;
}

/* Solve a program with at most so many additions and drops after the beginning. */
static int solve_program(Program *q, int limit) {
  const int n = q->n;
  int side = 1;
  memset(q->is_active, 0, n + q->rows);
  memset(q->multipliers, 0, (n + q->rows) * sizeof(double));
  if (!find_basis(q)) return NO_CONVERGENCE;
  int count = begin_program(q);
  for (int i = 0; i < n + q->rows; ++i)
    if (q->is_active[i] == 2 && find_violation(q, i, &side) > FEASIBLE) return NO_POINT;
  for (int chosen; (chosen = choose_violated(q, &side)) >= 0;) {
    double price = 0.0;
    for (;;) { /* until the chosen constraint is satisfied */
      if (limit-- <= 0) return NO_CONVERGENCE;
      double outside, shortest = INFINITY;
      const int depends = find_along(q, chosen, side, count, &outside);
      find_prices(q, q->along, count, q->drop);
      int first = -1;
      for (int k = 0; k < count; ++k)
        if (!is_equation(q, q->active[k]) && q->drop[k] > 0.0 && q->price[k] < shortest * q->drop[k])
          shortest = q->price[k] / q->drop[k], first = k;
      const double missing = find_violation(q, chosen, &(int){0}), whole = depends ? INFINITY : missing / outside;
      const double length = fmin(whole, shortest);
      if (isinf(length)) return NO_POINT;
      for (int k = count; k < n && !depends; ++k)
        for (int i = 0; i < n; ++i) q->y[i] += length * q->along[k] * q->basis[k * n + i];
      for (int k = 0; k < count; ++k) q->price[k] -= length * q->drop[k];
      price += length;
      if (whole <= shortest) break;
      remove_active(q, first, count--);
    }
    add_active(q, chosen, side, price, count++);
  }
  for (int k = 0; k < count; ++k) q->multipliers[q->active[k]] = -q->side[k] * q->price[k];
  return SOLVED;
}

#endif
