// Sine and cosine of a vector of doubles, for every target of Highway.
// No #pragma once: Highway's foreach_target.h includes this once for each target.
#if defined(UPSWING_SIM_SINE_COSINE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef UPSWING_SIM_SINE_COSINE_INL_H
#undef UPSWING_SIM_SINE_COSINE_INL_H
#else
#define UPSWING_SIM_SINE_COSINE_INL_H
#endif

#include <hwy/highway.h>

#include <numbers>

HWY_BEFORE_NAMESPACE();
namespace upswing::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using hn::MulAdd;
using hn::NegMulAdd;

inline constexpr size_t kWidest = 8;  // doubles in the widest vector
using D = hn::CappedTag<double, kWidest>;
using V = hn::Vec<D>;
inline constexpr D kDoubles;

HWY_INLINE V Constant(double x) { return hn::Set(kDoubles, x); }

struct Angle {
  V s, c;
};

/// x - n π/2, rounded once, for an integer n.
HWY_INLINE V ReduceByHalfPi(V x, V n) {
#if HWY_NATIVE_FMA
  // π/2 in three parts of 53 bits. The first difference is exact. The third part only matters where
  // the first two nearly cancel.
  const V coarse = NegMulAdd(n, Constant(0x1.921fb54442d18p+0), x);
  const V fine = NegMulAdd(n, Constant(0x1.1a62633145c07p-54), coarse);
  return NegMulAdd(n, Constant(-0x1.f1976b7ed8fbcp-110), fine);
#else
  // π/2 in parts of 33, 33 and 53 bits: the products with the first two are exact for |n| < 2^20.
  const V coarse = x - n * Constant(0x1.921fb544p+0);
  const V step = n * Constant(0x1.0b4611a6p-34);
  const V fine = coarse - step;
  const V lost = (coarse - fine) - step;
  return fine + (lost - n * Constant(0x1.3198a2e037073p-69));
#endif
}

/// Sine and cosine of x (rad), within 2 ulp for |x| ≤ 1e6: x = n π/2 + r with |r| ≤ π/4, fdlibm's
/// polynomials in r (error below 2^-57), then the quadrant n mod 4.
HWY_INLINE Angle SineCosineOf(V x) {
  const hn::RebindToSigned<D> integers;
  // Adding 1.5·2^52 rounds x to an integer, held in the last bits of the sum.
  const V to_integer = Constant(0x1.8p52);
  const V shifted = MulAdd(x, Constant(2 / std::numbers::pi), to_integer);
  const V r = ReduceByHalfPi(x, shifted - to_integer);

  const V z = r * r;
  V p = Constant(1.58969099521155010221e-10);
  p = MulAdd(p, z, Constant(-2.50507602534068634195e-08));
  p = MulAdd(p, z, Constant(2.75573137070700676789e-06));
  p = MulAdd(p, z, Constant(-1.98412698298579493134e-04));
  p = MulAdd(p, z, Constant(8.33333333332248946124e-03));
  p = MulAdd(p, z, Constant(-1.66666666666666324348e-01));
  const V sine = MulAdd(r * z, p, r);
  V q = Constant(-1.13596475577881948265e-11);
  q = MulAdd(q, z, Constant(2.08757232129817482790e-09));
  q = MulAdd(q, z, Constant(-2.75573143513906633035e-07));
  q = MulAdd(q, z, Constant(2.48015872894767294178e-05));
  q = MulAdd(q, z, Constant(-1.38888888888741095749e-03));
  q = MulAdd(q, z, Constant(4.16666666666666019037e-02));
  q = MulAdd(q, z, Constant(-0.5));
  const V cosine = MulAdd(q, z, Constant(1));

  // Odd quadrants swap sine and cosine. Bit 1 of n is the sine's sign, bit 1 of n + 1 the cosine's.
  const auto n = hn::BitCast(integers, shifted);
  const auto one = hn::Set(integers, 1);
  const auto odd = hn::RebindMask(kDoubles, hn::TestBit(n, one));
  const V sign = hn::SignBit(kDoubles);
  const auto last_bits = hn::ShiftLeft<62>(n);
  const V sine_sign = hn::And(sign, hn::BitCast(kDoubles, last_bits));
  const V cosine_sign =
      hn::And(sign, hn::BitCast(kDoubles, last_bits + hn::Set(integers, int64_t{1} << 62)));
  return {hn::Xor(hn::IfThenElse(odd, cosine, sine), sine_sign),
          hn::Xor(hn::IfThenElse(odd, sine, cosine), cosine_sign)};
}

}  // namespace
}  // namespace upswing::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // UPSWING_SIM_SINE_COSINE_INL_H
