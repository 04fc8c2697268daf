// Evaluates rows of candidates with the generated `kernel`, LANES at a time, and sums their violations.
//
// Expects VARIABLES (n), PARAMETERS (k) and ROWS (m) as macros, and the kernel (x, p) -> (cost, g) above.

struct Workspace {
  Lanes x[VARIABLES];
  Lanes p[PARAMETERS + 1];
  Lanes g[ROWS + 1];
  Lanes scratch[1];  // as many as the kernel asks for
};

static casadi_int work_size(int which) {
  casadi_int sizes[4];
  kernel_work(&sizes[0], &sizes[1], &sizes[2], &sizes[3]);
  return sizes[which];
}

extern "C" EXPORT long long nlp_gait_lanes(void) { return LANES; }

// Bytes of the workspace that each thread brings; it need not be aligned.
extern "C" EXPORT long long nlp_gait_workspace_bytes(void) {
  return sizeof(Lanes) + sizeof(Workspace) + work_size(3) * sizeof(Lanes) + work_size(2) * sizeof(casadi_int) +
         (work_size(0) + work_size(1)) * sizeof(void*);
}

// X is (rows, n), p (k), lower, upper and weight (m), f and violation (rows); g is (rows, m) or null.
// A row of X that is not finite gets f = violation = infinity.
extern "C" EXPORT int nlp_gait_evaluate(const double* X, long long rows, const double* p, const double* lower,
                                        const double* upper, const double* weight, double* f, double* violation,
                                        double* g, char* memory) {
  unsigned long long start = (unsigned long long)memory;
  Workspace* work = (Workspace*)((start + sizeof(Lanes) - 1) / sizeof(Lanes) * sizeof(Lanes));
  Lanes* scratch = work->scratch;
  casadi_int* integers = (casadi_int*)(scratch + work_size(3));
  const Lanes** arg = (const Lanes**)(integers + work_size(2));
  Lanes** res = (Lanes**)(arg + work_size(0));

  for (int j = 0; j < PARAMETERS; ++j) work->p[j] = p[j];
  for (long long first = 0; first < rows; first += LANES) {
    const int count = rows - first < LANES ? (int)(rows - first) : LANES;
    Lanes nothing = 0.0;  // stays zero where all of x is finite
    for (int j = 0; j < VARIABLES; ++j) {
      for (int i = 0; i < LANES; ++i) work->x[j].set(i, X[(first + (i < count ? i : 0)) * VARIABLES + j]);
      nothing += 0.0 * work->x[j];
    }
    Lanes cost;
    arg[0] = work->x;
    arg[1] = work->p;
    res[0] = &cost;
    res[1] = work->g;
    if (kernel(arg, res, integers, scratch, 0)) return 1;
    Lanes sum = 0.0;
    for (int j = 0; j < ROWS; ++j) {
      const Lanes excess = fmax(fmax(lower[j] - work->g[j], work->g[j] - upper[j]), 0.0);
      sum += excess * weight[j];
    }
    const Mask bad = nothing.v != Lanes(0.0).v;
    cost = select(bad, INFINITY, cost);
    sum = select(bad, INFINITY, sum);
    for (int i = 0; i < count; ++i) {
      f[first + i] = cost[i];
      violation[first + i] = sum[i];
      if (g)
        for (int j = 0; j < ROWS; ++j) g[(first + i) * ROWS + j] = work->g[j][i];
    }
  }
  return 0;
}
