// Encloses the generated functions `range` and `slope` over boxes.
//
// Expects VARIABLES (n), PARAMETERS (k) and ROWS (m) as macros, and above: range (x, p) -> (cost, g),
// slope (x, p) -> (gradient of cost (n), Jacobian of g (m, n), by columns).

static casadi_int most_of(int which) {
  casadi_int a[4], b[4];
  range_work(&a[0], &a[1], &a[2], &a[3]);
  slope_work(&b[0], &b[1], &b[2], &b[3]);
  return (a[which] > b[which] ? a[which] : b[which]) + 1;
}

// Bytes of the workspace that the caller brings.
extern "C" EXPORT long long nlp_gait_enclosure_bytes(void) {
  return sizeof(Interval) * (VARIABLES + PARAMETERS + most_of(3)) + most_of(2) * sizeof(casadi_int) +
         (most_of(0) + most_of(1)) * sizeof(void*);
}

// box is (boxes, n) intervals, p is (k); first is (boxes, 1) or (boxes, n) and second (boxes, m) or (boxes, m * n) intervals,
// as `slopes` is 0 or not.
extern "C" EXPORT int nlp_gait_enclose(const Interval* box, long long boxes, const double* p, Interval* first,
                                       Interval* second, int slopes, char* memory) {
  Interval* x = (Interval*)memory;
  Interval* parameters = x + VARIABLES;
  Interval* scratch = parameters + PARAMETERS;
  casadi_int* integers = (casadi_int*)(scratch + most_of(3));
  const Interval** arg = (const Interval**)(integers + most_of(2));
  Interval** res = (Interval**)(arg + most_of(0));
  const int ones = slopes ? VARIABLES : 1;
  for (int j = 0; j < PARAMETERS; ++j) parameters[j] = p[j];
  for (long long i = 0; i < boxes; ++i) {
    for (int j = 0; j < VARIABLES; ++j) x[j] = box[i * VARIABLES + j];
    arg[0] = x;
    arg[1] = parameters;
    res[0] = first + i * ones;
    res[1] = second + i * ones * ROWS;
    if (slopes ? slope(arg, res, integers, scratch, 0) : range(arg, res, integers, scratch, 0)) return 1;
  }
  return 0;
}
