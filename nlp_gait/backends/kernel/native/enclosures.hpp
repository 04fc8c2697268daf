// Encloses the generated functions over boxes.
//
// Expects VARIABLES (n) and PARAMETERS (k) as macros, and above, each of (x, p): `values` with two outputs, `gradient` and
// `jacobian` with one.

static casadi_int most_of(int which) {
  casadi_int sizes[3][4], most = 0;
  values_work(&sizes[0][0], &sizes[0][1], &sizes[0][2], &sizes[0][3]);
  gradient_work(&sizes[1][0], &sizes[1][1], &sizes[1][2], &sizes[1][3]);
  jacobian_work(&sizes[2][0], &sizes[2][1], &sizes[2][2], &sizes[2][3]);
  for (const casadi_int* size : {sizes[0], sizes[1], sizes[2]})
    if (size[which] > most) most = size[which];
  return most + 1;
}

// Bytes of the workspace that the caller brings.
extern "C" EXPORT long long nlp_gait_enclosure_bytes(void) {
  return sizeof(Interval) * (VARIABLES + PARAMETERS + most_of(3)) + most_of(2) * sizeof(casadi_int) +
         (most_of(0) + most_of(1)) * sizeof(void*);
}

// Function `which` (0 values, 1 gradient, 2 jacobian) over boxes (count, n) of intervals, p being (k) numbers. Its first
// output has `ones` entries for each box, its second, if it has one, `twos`.
extern "C" EXPORT int nlp_gait_enclose(int which, const Interval* boxes, long long count, long long ones, long long twos,
                                       const double* p, Interval* first, Interval* second, char* memory) {
  Interval* x = (Interval*)memory;
  Interval* parameters = x + VARIABLES;
  Interval* scratch = parameters + PARAMETERS;
  casadi_int* integers = (casadi_int*)(scratch + most_of(3));
  const Interval** arg = (const Interval**)(integers + most_of(2));
  Interval** res = (Interval**)(arg + most_of(0));
  for (int j = 0; j < PARAMETERS; ++j) parameters[j] = p[j];
  for (long long i = 0; i < count; ++i) {
    for (int j = 0; j < VARIABLES; ++j) x[j] = boxes[i * VARIABLES + j];
    arg[0] = x;
    arg[1] = parameters;
    res[0] = first + i * ones;
    res[1] = second + i * twos;
    const int failed = which == 0   ? values(arg, res, integers, scratch, 0)
                       : which == 1 ? gradient(arg, res, integers, scratch, 0)
                                    : jacobian(arg, res, integers, scratch, 0);
    if (failed) return 1;
  }
  return 0;
}
