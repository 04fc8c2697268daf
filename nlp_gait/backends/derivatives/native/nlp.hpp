// Works through a plan (see plan.py): one memory of doubles, filled step by step.
//
// Expects lanes.hpp and operations.hpp; the tables above it are generated.

enum Level { NOTHING, VALUES, FIRST };  // what is known at the point that the memory holds
enum Kind { RESET, TAPE, RUNS, PRODUCTS, CALL };

struct Memory {
  Level level;
  double* x;      // SIZE numbers
  Vector* slots;  // of a function of one sample, BLOCK vectors each, aligned
  double* initial;
};

static double* aligned(void* place) {
  const unsigned long long start = (unsigned long long)place;
  return (double*)((start + sizeof(Vector) - 1) / sizeof(Vector) * sizeof(Vector));
}

extern "C" EXPORT long long nlp_gait_bytes(void) {
  return sizeof(Memory) + 2 * sizeof(Vector) + MOST_SLOTS * BLOCK * sizeof(Vector) + 2 * SIZE * sizeof(double);
}

// The memory need not be aligned beyond what malloc gives.
extern "C" EXPORT void nlp_gait_prepare(void* place) {
  Memory* memory = (Memory*)place;
  memory->slots = (Vector*)aligned(memory + 1);
  memory->x = (double*)(memory->slots + MOST_SLOTS * BLOCK);
  memory->initial = memory->x + SIZE;
  for (long long i = 0; i < SIZE; ++i) memory->initial[i] = 0.0;
  for (int i = 0; i < INITIALS; ++i) memory->initial[initial_place[i]] = initial_value[i];
  for (long long i = 0; i < SIZE; ++i) memory->x[i] = memory->initial[i];
  memory->level = NOTHING;
}

static void work_tape(double* x, const Operation* task, const Operation* end) {
#define WORK(expression) r = expression; break;
  for (; task != end; ++task) {
    const double a = x[task->first], b = x[task->second];
    double r;
    switch (task->code) { NUMBER_OPERATIONS default: r = NAN; }
    x[task->target] = r;
  }
#undef WORK
}

// The same on slots of BLOCK vectors, of which the first ones are used.
static void work_tape(Vector* slots, int used, const Operation* task, const Operation* end) {
#define WORK(expression)                                     \
  for (int i = 0; i < used; ++i) {                           \
    const Vector a = firsts[i], b = seconds[i];              \
    targets[i] = expression;                                 \
  }                                                          \
  break;
  for (; task != end; ++task) {
    const Vector *firsts = slots + task->first * BLOCK, *seconds = slots + task->second * BLOCK;
    Vector* targets = slots + task->target * BLOCK;
    switch (task->code) { VECTOR_OPERATIONS }
  }
#undef WORK
}

static void add_runs(double* x, const Run* run, const Run* end) {
  for (; run != end; ++run) {
    double* __restrict target = x + run->target;
    const double* __restrict source = x + run->source;
    const double factor = x[run->factor];
    for (int i = 0; i < run->length; ++i) target[i] += factor * source[i];
  }
}

static void add_products(double* x, const Product* run, const Product* end) {
  for (; run != end; ++run) {
    double* __restrict target = x + run->target;
    const double* __restrict source = x + run->source;
    const double factor = x[run->first] * x[run->second];
    for (int i = 0; i < run->length; ++i) target[i] += factor * source[i];
  }
}

static void call(const Memory* memory, const Call& task) {
  const Function& function = functions[task.function];
  double *x = memory->x, *slots = (double*)memory->slots;
  for (int i = 0; i < function.constants; ++i)
    for (int k = 0; k < WIDTH; ++k)
      slots[(function.inputs + function.outputs + i) * WIDTH + k] = constants[function.first_constant + i];
  int sample = 0, direction = -1;
  for (;;) {
    int samples[WIDTH], directions[WIDTH], count = 0;
    while (count < WIDTH) {
      const int most = task.directions < 0 ? 1 : all_directions[task.directions + sample];
      if (++direction >= most) {
        if (++sample >= task.count) break;
        direction = -1;
        continue;
      }
      samples[count] = sample;
      directions[count++] = direction;
    }
    if (!count) return;
    const int used = (count + LANES - 1) / LANES;
    double* to = slots;
    for (int b = task.inputs; b < task.outputs; ++b)
      for (int i = 0; i < blocks[b].length; ++i, to += WIDTH)
        for (int k = 0; k < used * LANES; ++k) {
          const int pair = k < count ? k : 0;
          to[k] = x[blocks[b].base + blocks[b].sample * samples[pair] + blocks[b].direction * directions[pair] +
                    i * blocks[b].step];
        }
    work_tape(memory->slots, used, tape + function.begin, tape + function.end);
    const double* from = slots + function.inputs * WIDTH;
    for (int b = task.outputs; b < task.end; ++b)
      for (int i = 0; i < blocks[b].length; ++i, from += WIDTH)
        for (int k = 0; k < count; ++k)
          if (!directions[k] || blocks[b].direction)
            x[blocks[b].base + blocks[b].sample * samples[k] + blocks[b].direction * directions[k] +
              i * blocks[b].step] = from[k];
    if (sample >= task.count) return;
  }
}

static void work(const Memory* memory, const Step* step, const Step* end) {
  double* x = memory->x;
  for (; step != end; ++step) {
    const int first = step->first, last = step->last;
    switch (step->kind) {
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
