// Primal-dual interior-point method with a filter line search, Newton systems condensed to the decision variables.
//
//   minimise f(x)  subject to  row_lower <= g(x) <= row_upper,  lower <= x <= upper
//
// Rows become g(x) - t + a - b = 0 with slacks t within the bounds (equations: t fixed); a, b >= 0 are elastic, cost
// rho each, and are there only after the line search failed once. Slacks, elastics, multipliers and lifted variables
// are eliminated in closed form; what is factorised has the size of the other variables and of the rows that hold
// several lifted ones.
//
// Sources: Waechter, Biegler (2006), On the implementation of an interior-point filter line-search algorithm, for
// steps, filter, second-order corrections, scaling and tests of convergence; Nocedal, Waechter, Waltz (2009), Adaptive
// barrier update strategies, for the quality function; Gould, Orban, Toint (2015), An interior-point l1-penalty method,
// for the elastic rows.
//
// The headers are one program in the order nlp, indefinite, newton, interior_point.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

using std::vector;
typedef vector<double> Vector;
static const double INF = std::numeric_limits<double>::infinity();
static const double EPS = std::numeric_limits<double>::epsilon();

enum Request { VALUES, SLOPES, CURVATURE, ITERATION };
enum Status { SUCCEEDED, ACCEPTABLE, INFEASIBLE, ITERATIONS, STOPPED, TOO_SMALL, INVALID, SINGULAR };

// Sizes, sparsity (columns of the Jacobian and of the upper triangle of the Hessian, compressed) and shared memory.
struct Nlp {
  int n, m, leading;  // variables, rows, variables that are not lifted
  const int *jacobian_columns, *jacobian_rows, *hessian_columns, *hessian_rows;
  double *x, *f, *g, *gradient, *jacobian, *factor, *multipliers, *hessian;
  int (*call)(int);  // computes what is requested at x; not zero to end
};

struct Settings {
  double tolerance;
  int iterations, warm;
  double barrier;  // of a warm start
};
