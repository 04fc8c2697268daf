/* nlp-gait: Dense linear algebra of small sizes: eigenvectors of a symmetric matrix, and quadratic programs.
 *
 * Matrices are stored by rows. Nothing is allocated.
 */
#ifndef NLP_GAIT_DENSE_H
#define NLP_GAIT_DENSE_H

#include <math.h>
#include <string.h>

static double dot(int n, const double *a, const double *b) {
  double sum = 0.0;
  for (int i = 0; i < n; ++i) sum += a[i] * b[i];
  return sum;
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
        const double between = a[i * n + j];
        if (between == 0.0) continue;
        const double ratio = (a[j * n + j] - a[i * n + i]) / (2.0 * between);
        const double t = (ratio < 0.0 ? -1.0 : 1.0) / (fabs(ratio) + sqrt(ratio * ratio + 1.0));
        const double c = 1.0 / sqrt(t * t + 1.0), s = t * c;
        for (int k = 0; k < n; ++k) {
          const double left = a[k * n + i], right = a[k * n + j];
          a[k * n + i] = c * left - s * right;
          a[k * n + j] = s * left + c * right;
        }
        for (int k = 0; k < n; ++k) {
          const double upper = a[i * n + k], lower = a[j * n + k];
          a[i * n + k] = c * upper - s * lower;
          a[j * n + k] = s * upper + c * lower;
          const double first = vectors[i * n + k], second = vectors[j * n + k];
          vectors[i * n + k] = c * first - s * second;
          vectors[j * n + k] = s * first + c * second;
        }
        a[i * n + j] = a[j * n + i] = 0.0;
      }
  }
}

/* A strictly convex quadratic program in y (n): minimise 1/2 y' H y + c' y subject to lower <= (y, A y) <= upper.
 *
 * The dual method of Goldfarb and Idnani (1983), "A numerically stable dual method for solving strictly convex quadratic
 * programs": begin at the minimum without constraints, add one violated constraint after another, and drop an active one
 * whose multiplier would become negative. Each addition or drop takes at most 14 n^2 + 2 n rows operations. */
typedef struct {
  int n, rows;
  int coupled;                   /* variables from this one on have a diagonal Hessian, and lower bounds that are finite */
  const double *linear, *matrix; /* c (n), A (rows, n) */
  const double *lower, *upper;   /* (n + rows) of y, then of A y */
  double *hessian;               /* H (n, n), destroyed */
  double *basis;                 /* (n, n) work: its rows b span y, with H b of one orthogonal to the others */
  double *triangle;              /* (n, n) work: row k has the coordinates of active constraint k */
  double *along, *move, *drop;   /* (n) work */
  double *price;                 /* (n + 1) of the active constraints */
  int *active, *side;            /* (n + 1) their numbers, and 1 at a lower bound, -1 at an upper one */
  char *is_active;               /* (n + rows) */
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
  const double length = hypot(a, b);
  const double c = length > 0.0 ? a / length : 1.0, s = length > 0.0 ? b / length : 0.0;
  double *first = q->basis + i * q->n, *second = q->basis + j * q->n;
  for (int k = 0; k < q->n; ++k) {
    const double old = first[k];
    first[k] = c * old + s * second[k];
    second[k] = c * second[k] - s * old;
  }
  *cosine = c, *sine = s;
  return length;
}

/* Begin at the minimum without constraints, apart from the lower bounds of the last variables that are active there; return
 * their number, or -1 if H is not positive definite. */
static int begin_program(Program *q) {
  const int n = q->n, first = q->coupled;
  int count = 0;
  double *h = q->hessian;
  for (int j = 0; j < first; ++j) { /* H = L L', in place */
    const double pivot = h[j * n + j] - dot(j, h + j * n, h + j * n);
    if (!(pivot > 0.0)) return -1;
    h[j * n + j] = sqrt(pivot);
    for (int i = j + 1; i < first; ++i) h[i * n + j] = (h[i * n + j] - dot(j, h + i * n, h + j * n)) / h[j * n + j];
  }
  memset(q->basis, 0, (size_t)n * n * sizeof(double));
  memset(q->y, 0, n * sizeof(double));
  for (int is_free = 0, row = 0; is_free < 2; ++is_free)
    for (int i = first; i < n; ++i) {
      const double price = q->linear[i] + h[i * n + i] * q->lower[i];
      if (!(h[i * n + i] > 0.0)) return -1;
      if ((price >= 0.0) == is_free) continue;
      q->basis[row * n + i] = 1.0 / sqrt(h[i * n + i]);
      if (!is_free) {
        memset(q->triangle + row * n, 0, n * sizeof(double));
        q->triangle[row * n + row] = q->basis[row * n + i];
        q->active[row] = i, q->side[row] = 1, q->price[row] = price, q->is_active[i] = 1;
        q->y[i] = q->lower[i];
        ++count;
      }
      ++row;
    }
  for (int i = 0; i < first; ++i) { /* rows of L's inverse */
    double *row = q->basis + (n - first + i) * n;
    for (int k = 0; k <= i; ++k) {
      double sum = i == k ? 1.0 : 0.0;
      for (int j = k; j < i; ++j) sum -= h[i * n + j] * q->basis[(n - first + j) * n + k];
      row[k] = sum / h[i * n + i];
    }
  }
  for (int k = count; k < n; ++k) {
    const double length = -dot(n, q->basis + k * n, q->linear);
    for (int i = 0; i < n; ++i) q->y[i] += length * q->basis[k * n + i];
  }
  return count;
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

/* Return the constraint to add, or -1: equations first, else the one that is violated most. */
static int choose_violated(const Program *q, int equations, int *side) {
  int chosen = -1;
  double most = FEASIBLE;
  for (int i = 0; i < q->n + q->rows; ++i) {
    const int is_equation = q->lower[i] >= q->upper[i];
    if (q->is_active[i] || (equations && !is_equation)) continue;
    const double value = product(q, i, q->y), below = q->lower[i] - value, above = value - q->upper[i];
    const double violation = fmax(below, above);
    if (!(violation > most || (equations && chosen < 0))) continue;
    most = fmax(violation, FEASIBLE), chosen = i, *side = below >= above ? 1 : -1;
  }
  return chosen;
}

/* Solve a program with at most so many additions and drops. */
static int solve_program(Program *q, int limit) {
  const int n = q->n;
  int count, side = 1, equations = 1;
  double c, s;
  memset(q->is_active, 0, n + q->rows);
  memset(q->multipliers, 0, (n + q->rows) * sizeof(double));
  if ((count = begin_program(q)) < 0) return NO_CONVERGENCE;
  for (;;) {
    int chosen = choose_violated(q, equations, &side);
    if (chosen < 0 && equations) {
      equations = 0;
      continue;
    }
    if (chosen < 0) break;
    double price = 0.0;
    for (;;) { /* until the chosen constraint is satisfied */
      if (limit-- <= 0) return NO_CONVERGENCE;
      double all = 0.0, outside = 0.0;
      memset(q->move, 0, n * sizeof(double));
      for (int k = 0; k < n; ++k) {
        const double *row = q->basis + k * n;
        q->along[k] = side * product(q, chosen, row);
        all += q->along[k] * q->along[k];
        if (k < count) continue;
        outside += q->along[k] * q->along[k];
        for (int i = 0; i < n; ++i) q->move[i] += q->along[k] * row[i];
      }
      for (int k = count - 1; k >= 0; --k) {
        double sum = q->along[k];
        for (int j = k + 1; j < count; ++j) sum -= q->triangle[j * n + k] * q->drop[j];
        q->drop[k] = sum / q->triangle[k * n + k];
      }
      int first = -1;
      double shortest = INFINITY;
      for (int k = 0; k < count; ++k) {
        if (q->lower[q->active[k]] >= q->upper[q->active[k]] || q->drop[k] <= 0.0) continue;
        if (q->price[k] / q->drop[k] < shortest) shortest = q->price[k] / q->drop[k], first = k;
      }
      const double value = product(q, chosen, q->y);
      const double missing = side > 0 ? q->lower[chosen] - value : value - q->upper[chosen];
      const int depends = outside <= DEPENDENT * DEPENDENT * all || count == n;
      const double whole = depends ? INFINITY : missing / outside, length = fmin(whole, shortest);
      if (depends && equations) {
        if (missing > FEASIBLE) return NO_POINT;
        q->is_active[chosen] = 2; /* the other equations imply it */
        break;
      }
      if (isinf(length)) return NO_POINT;
      if (!depends)
        for (int i = 0; i < n; ++i) q->y[i] += length * q->move[i];
      for (int k = 0; k < count; ++k) q->price[k] -= length * q->drop[k];
      price += length;
      if (whole <= shortest) {
        for (int k = n - 1; k > count; --k) {
          q->along[k - 1] = turn(q, k - 1, k, q->along[k - 1], q->along[k], &c, &s);
          q->along[k] = 0.0;
        }
        memcpy(q->triangle + count * n, q->along, n * sizeof(double));
        q->active[count] = chosen, q->side[count] = side, q->price[count] = price;
        q->is_active[chosen] = 1;
        ++count;
        break;
      }
      remove_active(q, first, count--);
    }
  }
  for (int k = 0; k < count; ++k) q->multipliers[q->active[k]] = -q->side[k] * q->price[k];
  return SOLVED;
}

#endif
