// Evaluates the generated `kernel` at the rows of a batch, LANES at a time.
//
// Expects INPUTS and OUTPUTS as macros, and the sizes of all inputs and outputs in `input_size` and `output_size`.

struct Sizes {
  long long inputs, outputs;
};

static Sizes add_sizes() {
  Sizes sum = {0, 0};
  for (int i = 0; i < INPUTS; ++i) sum.inputs += input_size[i];
  for (int i = 0; i < OUTPUTS; ++i) sum.outputs += output_size[i];
  return sum;
}

static casadi_int work_size(int which) {
  casadi_int sizes[4];
  kernel_work(&sizes[0], &sizes[1], &sizes[2], &sizes[3]);
  return sizes[which];
}

// Bytes of memory that each thread brings; it need not be aligned.
extern "C" EXPORT long long nlp_gait_rows_memory(void) {
  const Sizes sizes = add_sizes();
  return sizeof(Lanes) * (1 + sizes.inputs + sizes.outputs + work_size(3)) + work_size(2) * sizeof(casadi_int) +
         (work_size(0) + work_size(1)) * sizeof(void*);
}

// Input i is (rows, input_size[i]), or (input_size[i]) for all rows if shared[i]; output i is (rows, output_size[i]).
extern "C" EXPORT int nlp_gait_evaluate_rows(const double* const* inputs, const char* shared, double* const* outputs,
                                             long long rows, char* memory) {
  const Sizes sizes = add_sizes();
  const unsigned long long start = (unsigned long long)memory;
  Lanes* in = (Lanes*)((start + sizeof(Lanes) - 1) / sizeof(Lanes) * sizeof(Lanes));
  Lanes* out = in + sizes.inputs;
  Lanes* scratch = out + sizes.outputs;
  casadi_int* integers = (casadi_int*)(scratch + work_size(3));
  const Lanes** arg = (const Lanes**)(integers + work_size(2));
  Lanes** res = (Lanes**)(arg + work_size(0));

  for (long long first = 0; first < rows; first += LANES) {
    const int count = rows - first < LANES ? (int)(rows - first) : LANES;
    Lanes* next = in;
    for (int k = 0; k < INPUTS; next += input_size[k++]) {
      arg[k] = next;
      const long long size = input_size[k];
      if (shared[k]) {
        if (first == 0)
          for (long long j = 0; j < size; ++j) next[j] = inputs[k][j];
        continue;
      }
      const double* row[LANES];
      for (int i = 0; i < LANES; ++i) row[i] = inputs[k] + (first + (i < count ? i : 0)) * size;
      for (long long j = 0; j < size; ++j) {
        Lanes value;
        UNROLL for (int i = 0; i < LANES; ++i) value.set(i, row[i][j]);
        next[j] = value;
      }
    }
    Lanes* result = out;
    for (int k = 0; k < OUTPUTS; result += output_size[k++]) res[k] = result;
    if (kernel(arg, res, integers, scratch, 0)) return 1;
    for (int k = 0; k < OUTPUTS; ++k) {
      const long long size = output_size[k];
      double* row = outputs[k] + first * size;
      for (int i = 0; i < count; ++i, row += size)
        for (long long j = 0; j < size; ++j) row[j] = ((const double*)(res[k] + j))[i];
    }
  }
  return 0;
}
