// The functions of nlp.hpp as CasADi's nlpsol takes them (external functions), with a memory for each thread.

#define casadi_int long long int

struct OfThread {
  void* memory = nullptr;
  ~OfThread() { free(memory); }
};
static thread_local OfThread of_thread;

static void* memory_of_thread() {
  if (!of_thread.memory) {
    of_thread.memory = malloc(nlp_gait_bytes());
    if (of_thread.memory) nlp_gait_prepare(of_thread.memory);
  }
  return of_thread.memory;
}

static const casadi_int variables[] = {VARIABLES, 1, 1}, parameters[] = {PARAMETERS, 1, 1}, rows[] = {ROWS, 1, 1}, number[] = {1, 1, 1};

#define FUNCTION(name, inputs, outputs, in_sparsity, out_sparsity, body)                                        \
  extern "C" EXPORT casadi_int name##_n_in(void) { return inputs; }                                              \
  extern "C" EXPORT casadi_int name##_n_out(void) { return outputs; }                                            \
  extern "C" EXPORT const casadi_int* name##_sparsity_in(casadi_int i) {                                         \
    const casadi_int* all[] = in_sparsity;                                                                       \
    return all[i];                                                                                               \
  }                                                                                                              \
  extern "C" EXPORT const casadi_int* name##_sparsity_out(casadi_int i) {                                        \
    const casadi_int* all[] = out_sparsity;                                                                      \
    return all[i];                                                                                               \
  }                                                                                                              \
  extern "C" EXPORT int name##_work(casadi_int* arg, casadi_int* res, casadi_int* iw, casadi_int* w) {           \
    *arg = inputs, *res = outputs, *iw = 0, *w = 0;                                                              \
    return 0;                                                                                                    \
  }                                                                                                              \
  extern "C" EXPORT int name(const double** arg, double** res, casadi_int*, double*, int) {                      \
    void* memory = memory_of_thread();                                                                           \
    if (!memory) return 1;                                                                                       \
    body return 0;                                                                                               \
  }
#define LIST(...) {__VA_ARGS__}

FUNCTION(nlp_f, 2, 1, LIST(variables, parameters), LIST(number), nlp_gait_values(memory, arg[0], arg[1], res[0], nullptr);)
FUNCTION(nlp_g, 2, 1, LIST(variables, parameters), LIST(rows), nlp_gait_values(memory, arg[0], arg[1], nullptr, res[0]);)
FUNCTION(nlp_grad_f, 2, 2, LIST(variables, parameters), LIST(number, variables),
         nlp_gait_values(memory, arg[0], arg[1], res[0], nullptr);
         if (res[1]) nlp_gait_first(memory, arg[0], arg[1], res[1], nullptr);)
FUNCTION(nlp_jac_g, 2, 2, LIST(variables, parameters), LIST(rows, jacobian_sparsity),
         nlp_gait_values(memory, arg[0], arg[1], nullptr, res[0]);
         if (res[1]) nlp_gait_first(memory, arg[0], arg[1], nullptr, res[1]);)
FUNCTION(nlp_hess_l, 4, 1, LIST(variables, parameters, number, rows), LIST(hessian_sparsity),
         if (res[0]) nlp_gait_second(memory, arg[0], arg[1], arg[2] ? *arg[2] : 0.0, arg[3], res[0]);)
