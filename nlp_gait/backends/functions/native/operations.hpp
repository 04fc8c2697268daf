// Operations of CasADi that the problems' kernels do not need, for lanes.

#if HAS_VECTOR_LIBM(2, 35)
VECTORISED_1(asinh)
VECTORISED_1(acosh)
VECTORISED_1(atanh)
VECTORISED_1(erf)
#else
LANE_BY_LANE_1(asinh)
LANE_BY_LANE_1(acosh)
LANE_BY_LANE_1(atanh)
LANE_BY_LANE_1(erf)
#endif
LANE_BY_LANE_2(remainder)
static ALWAYS_INLINE Lanes sign_of(Lanes a) {
  return select(a.v < Lanes(0.0).v, -1.0, select(a.v > Lanes(0.0).v, 1.0, a));
}
