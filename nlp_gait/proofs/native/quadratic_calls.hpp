// Functions of quadratic forms and their relaxation that quadratic.py calls.

static const int CONTRACTIONS = 4;
static const double LEAST_SHRINKAGE = 0.1;

// Number of doubles of a form of n variables.
extern "C" EXPORT int nlp_gait_quadratic_size(int n) { return Layout(pad(n)).size; }

// Number of doubles of the memory that the caller provides.
extern "C" EXPORT long long nlp_gait_quadratic_doubles(int slots, int n, int outputs) {
  const Layout at(pad(n));
  return (tape_vectors(at, slots) + 1) * LANES + slots + 1 + (long long)LANES * outputs * at.size;
}

// Enclose boxes (many, n, 2): forms in `result` (many, outputs, size).
extern "C" EXPORT void nlp_gait_quadratic_forms(const Tape* tape, int n, int outputs, long long many, const double* boxes,
                                                double* result, double* memory) {
  Runner runner(*tape, n, memory);
  const long long each = (long long)outputs * runner.at.size;
  for (long long first = 0; first < many; first += LANES) {
    runner.run(n, outputs, boxes, first, many);
    const long long count = first + LANES < many ? LANES : many - first;
    __builtin_memcpy(result + first * each, runner.forms, count * each * sizeof(double));
  }
}

// Cut off slabs of boxes (many, n, 2) in which an output violates its bounds, in place: left (many) 0 or 1.
extern "C" EXPORT void nlp_gait_quadratic_contract(const Tape* tape, int n, int outputs, long long many, double* boxes,
                                                   const double* lower, const double* upper, int* left, double* memory) {
  Runner runner(*tape, n, memory);
  std::vector<int> row(outputs);
  for (int o = 0; o < outputs; ++o) row[o] = o;
  PowerRows rows = {};
  rows.n = n, rows.outputs = rows.rows = outputs, rows.row = row.data(), rows.lower = lower, rows.upper = upper;
  Relaxation relaxation(rows, runner.at);
  const long long each = (long long)outputs * runner.at.size;
  for (long long first = 0; first < many; first += LANES) {
    const int count = first + LANES < many ? LANES : (int)(many - first);
    bool again[LANES];  // the result of a box must not depend on the others
    for (int l = 0; l < LANES; ++l) again[l] = l < count;
    bool any_again = true;
    for (int round = 0; round < CONTRACTIONS && any_again; ++round) {
      runner.run(n, outputs, boxes, first, many);
      any_again = false;
      for (int l = 0; l < count; ++l) {
        if (!again[l]) continue;
        double *box = boxes + (first + l) * n * 2, before[2 * MOST], shrunk = 0.0;
        __builtin_memcpy(before, box, 2 * n * sizeof(double));
        left[first + l] = relaxation.contract(runner.forms + l * each, box);
        for (int i = 0; i < n; ++i) shrunk = most(shrunk, 1.0 - (box[2 * i + 1] - box[2 * i]) / (before[2 * i + 1] - before[2 * i]));
        again[l] = left[first + l] && shrunk > LEAST_SHRINKAGE;
        any_again |= again[l];
      }
    }
  }
}

// Prune boxes (many, n, 2) in place: left (many) 0 or 1, lowest (many), cut (many).
extern "C" EXPORT void nlp_gait_quadratic_prune(const Tape* tape, const PowerRows* rows, double target, long long many, double* boxes,
                                                 int* left, double* lowest, int* cut, double* memory) {
  Runner runner(*tape, rows->n, memory);
  Relaxation relaxation(*rows, runner.at);
  const long long each = (long long)rows->outputs * runner.at.size;
  for (long long first = 0; first < many; first += LANES) {
    runner.run(rows->n, rows->outputs, boxes, first, many);
    for (int l = 0; l < LANES && first + l < many; ++l) {
      const Result found = relaxation.prune(runner.forms + l * each, boxes + (first + l) * rows->n * 2, target);
      left[first + l] = found.left, lowest[first + l] = found.lowest, cut[first + l] = found.cut;
    }
  }
}
