// Works through a plan (see plan.py): one memory of doubles, filled step by step.
//
// Expects lanes.hpp; the tables and functions of one sample above it are generated.

enum Level { NOTHING, VALUES, FIRST };  // what is known at the point that the memory holds
enum Kind { RESET, TAPE, RUNS, PRODUCTS, CALL };

struct Memory {
  Level level;
  double* x;     // SIZE numbers
  Vector* in;    // what a function of one sample reads, aligned
  Vector* out;   // and writes
  double* initial;
};

static double* aligned(void* place) {
  const unsigned long long start = (unsigned long long)place;
  return (double*)((start + sizeof(Vector) - 1) / sizeof(Vector) * sizeof(Vector));
}

extern "C" EXPORT long long nlp_gait_bytes(void) {
  return sizeof(Memory) + 2 * sizeof(Vector) + (MOST_IN + MOST_OUT) * sizeof(Vector) + 2 * SIZE * sizeof(double);
}

// The memory need not be aligned beyond what malloc gives.
extern "C" EXPORT void nlp_gait_prepare(void* place) {
  Memory* memory = (Memory*)place;
  memory->in = (Vector*)aligned(memory + 1);
  memory->out = memory->in + MOST_IN;
  memory->x = (double*)(memory->out + MOST_OUT);
  memory->initial = memory->x + SIZE;
  for (long long i = 0; i < SIZE; ++i) memory->initial[i] = 0.0;
  for (int i = 0; i < INITIALS; ++i) memory->initial[initial_place[i]] = initial_value[i];
  for (long long i = 0; i < SIZE; ++i) memory->x[i] = memory->initial[i];
  memory->level = NOTHING;
}

static void work_tape(double* x, const int (*tape)[4], const int (*end)[4]) {
  for (; tape != end; ++tape) {
    const double a = x[(*tape)[2]], b = x[(*tape)[3]];
    double r;
    switch ((*tape)[0]) { OPERATIONS default: r = NAN; }
    x[(*tape)[1]] = r;
  }
}

static void add_runs(double* x, const int (*run)[4], const int (*end)[4]) {
  for (; run != end; ++run) {
    double* __restrict target = x + (*run)[0];
    const double* __restrict source = x + (*run)[1];
    const double factor = x[(*run)[2]];
    const int length = (*run)[3];
    for (int i = 0; i < length; ++i) target[i] += factor * source[i];
  }
}

static void add_products(double* x, const int (*run)[5], const int (*end)[5]) {
  for (; run != end; ++run) {
    double* __restrict target = x + (*run)[0];
    const double* __restrict source = x + (*run)[1];
    const double factor = x[(*run)[2]] * x[(*run)[3]];
    const int length = (*run)[4];
    for (int i = 0; i < length; ++i) target[i] += factor * source[i];
  }
}

static void call(const Memory* memory, const Call& task) {
  double* x = memory->x;
  int sample = 0, direction = -1;
  for (;;) {
    int samples[LANES], directions[LANES], count = 0;
    while (count < LANES) {
      const int most = task.directions ? task.directions[sample] : 1;
      if (++direction >= most) {
        if (++sample >= task.count) break;
        direction = -1;
        continue;
      }
      samples[count] = sample;
      directions[count++] = direction;
    }
    if (!count) return;
    Vector* in = memory->in;
    for (const Block* block = task.inputs; block != task.outputs; in += (block++)->length)
      for (int lane = 0; lane < LANES; ++lane) {
        const int k = lane < count ? lane : 0;
        const double* from = x + block->base + block->sample * samples[k] + block->direction * directions[k];
        double* to = (double*)in + lane;
        for (int i = 0; i < block->length; ++i) to[i * LANES] = from[i * block->step];
      }
    task.function(memory->in, memory->out);
    const Vector* out = memory->out;
    for (const Block* block = task.outputs; block != task.end; out += (block++)->length)
      for (int lane = 0; lane < count; ++lane) {
        if (directions[lane] && !block->direction) continue;
        double* to = x + block->base + block->sample * samples[lane] + block->direction * directions[lane];
        const double* from = (const double*)out + lane;
        for (int i = 0; i < block->length; ++i) to[i * block->step] = from[i * LANES];
      }
    if (sample >= task.count) return;
  }
}

static void work(const Memory* memory, const int (*step)[3], const int (*end)[3]) {
  double* x = memory->x;
  for (; step != end; ++step) {
    const int first = (*step)[1], last = (*step)[2];
    switch ((*step)[0]) {
      case RESET:
        memcpy(x + first, memory->initial + first, last * sizeof(double));
        break;
      case TAPE:
        work_tape(x, tape + first, tape + last);
        break;
      case RUNS:
        add_runs(x, runs + first, runs + last);
        break;
      case PRODUCTS:
        add_products(x, products + first, products + last);
        break;
      case CALL:
        call(memory, calls[first]);
    }
  }
}

// Numbers where the caller has some; zeros where the pointer is null, as CasADi means it.
static bool moved(double* known, const double* given, int count) {
  bool differs = false;
  for (int i = 0; i < count; ++i) {
    const double value = given ? given[i] : 0.0;
    differs |= !(known[i] == value);
    known[i] = value;
  }
  return differs;
}

static double* known(void* place, const double* w, const double* p, Level level) {
  Memory* memory = (Memory*)place;
  const bool at_another = moved(memory->x + W, w, VARIABLES) | moved(memory->x + P, p, PARAMETERS);
  if (at_another) memory->level = NOTHING;
  if (memory->level < VALUES) work(memory, value_steps, value_steps + VALUE_STEPS);
  if (memory->level < FIRST && level >= FIRST) work(memory, first_steps, first_steps + FIRST_STEPS);
  if (memory->level < level) memory->level = level;
  return memory->x;
}

// A call at the point of the last call with this memory does only what is not known yet. A null result is not written.
extern "C" EXPORT void nlp_gait_values(void* memory, const double* w, const double* p, double* cost, double* rows) {
  const double* x = known(memory, w, p, VALUES);
  if (cost) *cost = x[VALUE];
  if (rows) memcpy(rows, x + VALUE + 1, ROWS * sizeof(double));
}

extern "C" EXPORT void nlp_gait_first(void* memory, const double* w, const double* p, double* gradient, double* jacobian) {
  const double* x = known(memory, w, p, FIRST);
  if (gradient) memcpy(gradient, x + GRADIENT, VARIABLES * sizeof(double));
  if (jacobian)
    for (int i = 0; i < JACOBIAN_NONZEROS; ++i) jacobian[i] = x[jacobian_place[i]];
}

extern "C" EXPORT void nlp_gait_second(void* memory, const double* w, const double* p, double cost_weight,
                                       const double* row_weights, double* hessian) {
  double* x = known(memory, w, p, FIRST);
  x[WEIGHT] = cost_weight;
  moved(x + WEIGHT + 1, row_weights, ROWS);
  work((const Memory*)memory, second_steps, second_steps + SECOND_STEPS);
  memcpy(hessian, x + HESSIAN, HESSIAN_NONZEROS * sizeof(double));
}
