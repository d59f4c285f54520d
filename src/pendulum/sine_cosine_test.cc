#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "base/rng.h"
#include "base/simd.h"
#include "pendulum/testing.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pendulum/sine_cosine_test.cc"
#include <hwy/foreach_target.h>  // includes this file once per target

#include "pendulum/sine_cosine-inl.h"

HWY_BEFORE_NAMESPACE();
namespace upswing::HWY_NAMESPACE {
namespace {

/// Sine and cosine of x (n), rad.
void SineCosineRange(std::span<const double> x, std::span<double> sine, std::span<double> cosine) {
  const size_t lanes = hn::Lanes(kDoubles);
  for (size_t i = 0; i < x.size(); i += lanes) {
    const size_t count = std::min(lanes, x.size() - i);
    alignas(64) std::array<double, kWidest> in{}, s, c;
    std::copy_n(x.data() + i, count, in.data());
    const Angle result = SineCosineOf(hn::Load(kDoubles, in.data()));
    hn::Store(result.s, kDoubles, s.data());
    hn::Store(result.c, kDoubles, c.data());
    std::copy_n(s.data(), count, sine.data() + i);
    std::copy_n(c.data(), count, cosine.data() + i);
  }
}

}  // namespace
}  // namespace upswing::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace upswing {
namespace {

HWY_EXPORT(SineCosineRange);

TEST(SineCosine, IsWithinTwoUlpOnEachPath) {
  std::vector<double> x(1000000);
  Rng rng(1, "angles");
  for (size_t i = 0; i < x.size(); ++i) {
    const double most = i % 2 == 0 ? 1e4 : 1e6;
    x[i] = rng.Uniform(-most, most);
  }
  for (int i = 0; i < 100000; ++i) x.push_back(std::ldexp(rng.Uniform(-1, 1), -i % 60));
  // Every multiple of π/2 up to 1e4, then every 101st up to 1e6.
  for (int n = -636619; n <= 636619; n += std::abs(n) <= 6366 ? 1 : 101) {
    double near = n * (kPi / 2);  // and its floating-point neighbours
    for (int i = 0; i < 3; ++i) near = std::nextafter(near, -1e9);
    for (int i = 0; i < 7; ++i, near = std::nextafter(near, 1e9)) x.push_back(near);
  }
  std::vector<double> sine(x.size()), cosine(x.size());
  const auto error = [](double got, long double exact) {
    const double size = static_cast<double>(std::abs(exact));
    const double ulp = std::nextafter(size, 2.0) - size;
    return static_cast<double>(std::abs(got - exact)) / ulp;
  };
  for (const std::string& path : SimdPaths()) {
    UseSimdPath(path);
    HWY_DYNAMIC_DISPATCH(SineCosineRange)(x, sine, cosine);
    double worst = 0;
    for (size_t i = 0; i < x.size(); ++i) {
      const long double exact = x[i];
      worst = std::max({worst, error(sine[i], std::sin(exact)), error(cosine[i], std::cos(exact))});
    }
    EXPECT_LE(worst, 2) << path;
  }
  UseSimdPath(SimdPaths().front());
}

}  // namespace
}  // namespace upswing
#endif  // HWY_ONCE
