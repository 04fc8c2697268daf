
// ---- the functions of the C header; the tables above are the instance's constants ----

extern "C" EXPORT int FUNCTION(const double* X, long long points, double* f, double* violation, double* G) {
  const long long block = 64;  // points whose rows are held at once
  double* g = G ? (double*)malloc((size_t)(block * ROWS) * sizeof(double)) : 0;
  char* memory = (char*)malloc((size_t)nlp_gait_workspace_bytes());
  int failed = !memory || (G && !g);
  for (long long first = 0; first < points && !failed; first += block) {
    const long long count = points - first < block ? points - first : block;
    failed = nlp_gait_evaluate(X + first * VARIABLES, count, instance_parameters, instance_lower, instance_upper,
                               instance_weights, f + first, violation + first, g, memory);
    if (!G || failed) continue;
    for (long long k = 0; k < count; ++k)
      for (int i = 0; i < SIDES; ++i) {
        const int row = instance_rows[i], up = instance_upper_side[i];
        const double excess = up ? g[k * ROWS + row] - instance_upper[row] : instance_lower[row] - g[k * ROWS + row];
        G[(first + k) * SIDES + i] = excess * instance_weights[row];
      }
  }
  free(memory);
  free(g);
  return failed ? 1 : 0;
}
