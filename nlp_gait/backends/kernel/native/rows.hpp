// Evaluates the generated `kernel` at the rows of a batch, LANES at a time.
//
// Expects INPUTS and OUTPUTS, and the sizes of all inputs and outputs in `input_size` and `output_size`. With OBJECTIVE the kernel
// is (x, p) -> (cost, g), three more inputs (lower, upper and weight of g) are read as they are, and the last output is the
// violation that follows from g; it and the cost are infinite where x is not finite.

#if defined(__clang__)
#define UNROLL _Pragma("unroll")
#else
#define UNROLL _Pragma("GCC unroll 8")
#endif

#if defined(__has_builtin) && LANES > 1
#if __has_builtin(__builtin_shufflevector)
#define HAS_SHUFFLE
#endif
#endif

#ifdef HAS_SHUFFLE
typedef Vector Unaligned __attribute__((aligned(8)));

// Exchanges the blocks of WIDTH beside the diagonal of two rows.
template <int WIDTH, int... K> static ALWAYS_INLINE void exchange(Lanes& a, Lanes& b, std::integer_sequence<int, K...>) {
  const Vector low = __builtin_shufflevector(a.v, b.v, (K & WIDTH ? LANES + K - WIDTH : K)...);
  b.v = __builtin_shufflevector(a.v, b.v, (K & WIDTH ? LANES + K : K + WIDTH)...);
  a.v = low;
}

static ALWAYS_INLINE void transpose(Lanes* v) {
  const std::make_integer_sequence<int, LANES> all{};
#if LANES >= 8
  UNROLL for (int i = 0; i < 4; ++i) exchange<4>(v[i], v[i + 4], all);
#endif
#if LANES >= 4
  UNROLL for (int i = 0; i < LANES; ++i)
    if (!(i & 2)) exchange<2>(v[i], v[i + 2], all);
#endif
  UNROLL for (int i = 0; i < LANES; i += 2) exchange<1>(v[i], v[i + 1], all);
}

// Calls `move(j)` for blocks of LANES columns, which may overlap.
template <typename Move> static ALWAYS_INLINE void for_blocks(long long size, Move move) {
  for (long long j = 0; j < size - LANES; j += LANES) move(j);
  move(size - LANES);
}
#endif

// Puts rows (count, size) into lanes (size); lanes without a row get the first one.
static void gather(const double* rows, long long size, int count, Lanes* lanes) {
#ifdef HAS_SHUFFLE
  if (count == LANES && size >= LANES)
    return for_blocks(size, [=](long long j) {
      Lanes block[LANES];
      UNROLL for (int i = 0; i < LANES; ++i) block[i] = *(const Unaligned*)(rows + i * size + j);
      transpose(block);
      UNROLL for (int i = 0; i < LANES; ++i) lanes[j + i] = block[i];
    });
#endif
  for (long long j = 0; j < size; ++j)
    for (int i = 0; i < LANES; ++i) ((double*)(lanes + j))[i] = rows[(i < count ? i : 0) * size + j];
}

// Puts lanes (size) into rows (count, size).
static void scatter(const Lanes* lanes, long long size, int count, double* rows) {
#ifdef HAS_SHUFFLE
  if (count == LANES && size >= LANES)
    return for_blocks(size, [=](long long j) {
      Lanes block[LANES];
      UNROLL for (int i = 0; i < LANES; ++i) block[i] = lanes[j + i];
      transpose(block);
      UNROLL for (int i = 0; i < LANES; ++i) *(Unaligned*)(rows + i * size + j) = block[i].v;
    });
#endif
  for (int i = 0; i < count; ++i)
    for (long long j = 0; j < size; ++j) rows[i * size + j] = ((const double*)(lanes + j))[i];
}

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

#ifdef OBJECTIVE
static void add_violation(const double* const* inputs, const Lanes* x, Lanes** res) {
  const double *lower = inputs[INPUTS], *upper = inputs[INPUTS + 1], *weight = inputs[INPUTS + 2];
  Lanes nothing = 0.0;  // stays zero where all of x is finite
  for (long long j = 0; j < input_size[0]; ++j) nothing += 0.0 * x[j];
  const Lanes* g = res[1];
  Lanes sum = 0.0;
  for (long long j = 0; j < output_size[1]; ++j) sum += fmax(fmax(lower[j] - g[j], g[j] - upper[j]), 0.0) * weight[j];
  const Mask bad = nothing.v != Lanes(0.0).v;
  *res[0] = select(bad, INFINITY, *res[0]);
  *res[2] = select(bad, INFINITY, sum);
}
#endif

// Bytes of memory that each thread brings; it need not be aligned.
extern "C" EXPORT long long nlp_gait_rows_memory(void) {
  const Sizes sizes = add_sizes();
  return sizeof(Lanes) * (1 + sizes.inputs + sizes.outputs + work_size(3)) + work_size(2) * sizeof(casadi_int) +
         (work_size(0) + work_size(1) + OUTPUTS) * sizeof(void*);
}

// Input i is (rows, input_size[i]), or (input_size[i]) for all rows if shared[i]; output i is (rows, output_size[i]), or null.
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
      if (!shared[k])
        gather(inputs[k] + first * size, size, count, next);
      else if (first == 0)
        for (long long j = 0; j < size; ++j) next[j] = inputs[k][j];
    }
    Lanes* result = out;
    for (int k = 0; k < OUTPUTS; result += output_size[k++]) res[k] = result;
    if (kernel(arg, res, integers, scratch, 0)) return 1;
#ifdef OBJECTIVE
    res[2] = result - 1;
    add_violation(inputs, in, res);
#endif
    for (int k = 0; k < OUTPUTS; ++k)
      if (outputs[k]) scatter(res[k], output_size[k], count, outputs[k] + first * output_size[k]);
  }
  return 0;
}
