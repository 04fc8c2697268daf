
// ---- the functions of the C header; the tables above are the instance's constants ----

extern "C" EXPORT int FUNCTION(const double* X, long long points, double* f, double* violation, double* G) {
  const long long block = 64;  // points whose rows are held at once
  double* g = G ? (double*)malloc((size_t)(block * ROWS) * sizeof(double)) : 0;
  char* memory = (char*)malloc((size_t)nlp_gait_rows_memory());
  int failed = !memory || (G && !g);
  for (long long first = 0; first < points && !failed; first += block) {
    const long long count = points - first < block ? points - first : block;
    const double* inputs[] = {X + first * VARIABLES, instance_parameters, instance_lower, instance_upper, instance_weights};
    const char shared[] = {0, 1, 1, 1, 1};
    double* outputs[] = {f + first, g, violation + first};
    failed = nlp_gait_evaluate_rows(inputs, shared, outputs, count, memory);
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
