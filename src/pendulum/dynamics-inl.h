// The equations of motion, once for every type T of number: double, dual numbers that carry
// derivatives, Highway's vectors. Symbols: pendulum/equations.h; s and c are sine and cosine, the
// suffix 12 means the sum of both angles.
//   M(q) q̈ = r,  M = [[J1 + J2 + 2 b c2, J2 + b c2], [·, J2 + a]]
//   r1 = τ1 + b s2 (2 w1 + w2) w2 - G1 s1 - G2 s12 - d1 w1 - f1 atan(100 w1)
//   r2 = τ2 - b s2 w1² - G2 s12 - d2 w2 - f2 atan(100 w2)
// No #pragma once and no namespace: closed_form.cc includes this into the namespace of each of
// Highway's targets, because functions of vectors belong to a target. Others include dynamics.h.
// P is the type of the constants. T has MulAdd(x, y, z) = x y + z, MulSub(x, y, z) = x y - z,
// NegMulAdd(x, y, z) = z - x y, Atan, and Number<T>(x) of a double.

/// A number for each joint.
template <typename T>
struct JointPair {
  T one, two;
};

/// Sines and cosines of the joints' angles.
template <typename T>
struct JointAngles {
  T s1, c1, s2, c2;

  [[gnu::always_inline]] T s12() const { return MulAdd(s1, c2, c1 * s2); }
  [[gnu::always_inline]] T c12() const { return NegMulAdd(s1, s2, c1 * c2); }
};

/// M(q) and det M = J1 J2 + a (J1 + J2) + b c2 (2 a - b c2), whose terms do not cancel.
template <typename P, typename T>
[[gnu::always_inline]] inline MassMatrixOf<T> MassAt(const ManipulatorConstants<P>& p,
                                                     const T& c2) {
  const P J12 = p.J1 + p.J2, constant = MulAdd(p.J1, p.J2, p.a * J12);
  const T bc = p.b * c2, rest = p.a + p.a - bc;
  return {bc + bc + J12, p.J2 + bc, T(p.J2 + p.a), MulAdd(bc, rest, constant)};
}

/// r: the torques (N·m) that accelerate the joints.
template <bool kFriction, typename P, typename T>
[[gnu::always_inline]] inline JointPair<T> NetTorque(const ManipulatorConstants<P>& p,
                                                     const JointAngles<T>& angles,
                                                     const JointPair<T>& w,
                                                     const JointPair<T>& tau) {
  const auto& [w1, w2] = w;
  const T bs = p.b * angles.s2, g2 = p.G2 * angles.s12();
  const T coriolis = (w1 + w1 + w2) * w2, centrifugal = w1 * w1;
  const T r1 = MulAdd(bs, coriolis, NegMulAdd(p.G1, angles.s1, NegMulAdd(p.d1, w1, tau.one)) - g2);
  const T r2 = tau.two - MulAdd(bs, centrifugal, MulAdd(p.d2, w2, g2));
  if constexpr (kFriction) {
    const T slope = Number<T>(kFrictionSlope), speed1 = slope * w1, speed2 = slope * w2;
    return {NegMulAdd(p.f1, Atan(speed1), r1), NegMulAdd(p.f2, Atan(speed2), r2)};
  } else {
    return {r1, r2};
  }
}

/// q̈ (rad/s²) of the joints under the net torque r (N·m).
template <typename T>
[[gnu::always_inline]] inline JointPair<T> AccelerationUnder(const JointPair<T>& r,
                                                             const MassMatrixOf<T>& M) {
  const T inverse = Number<T>(1) / M.det;
  return {MulSub(M.M22, r.one, M.M12 * r.two) * inverse,
          MulSub(M.M11, r.two, M.M12 * r.one) * inverse};
}
