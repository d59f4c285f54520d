#include "extras/machine/twin/cogging.h"

#include <cmath>
#include <complex>
#include <cstdint>
#include <numeric>
#include <string_view>

#include "base/text.h"

namespace upswing::machine {
namespace {

constexpr std::array<std::string_view, Cogging::kHarmonics> kHarmonicNames{
    "pole_pairs", "slots", "poles", "2_slots", "2_poles", "3_slots", "common"};

using Complex = std::complex<double>;

/// The product of finite numbers; std::complex also looks after infinite ones.
Complex Product(const Complex& a, const Complex& b) {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

/// Calls `call(joint, index, name)` with each coefficient, joint 0 or 1.
template <typename Call>
void ForEachCoefficient(const Call& call) {
  for (int joint = 0; joint < 2; ++joint) {
    for (int k = 0; k < Cogging::kCoefficients; ++k) {
      const char* kind = k < Cogging::kHarmonics ? "sine" : "cosine";
      call(joint, k, Concat(kind, joint + 1, "_", kHarmonicNames.at(k % Cogging::kHarmonics)));
    }
  }
}

}  // namespace

void Cogging::Describe(Options& o) {
  constexpr Range kTeeth{0, 1000}, kTorque{-1e5, 1e5};
  o.Section("cogging");
  o.Add(&slots, "slots", kTeeth, "", "slots of each motor's stator; 0: no cogging").step = 1;
  o.Add(&poles, "poles", kTeeth, "", "poles of each motor's rotor; 0: no cogging").step = 2;
  ForEachCoefficient([&](int joint, int k, const std::string& name) {
    o.Add(&coefficients[joint][k], name, kTorque, "N·m", "coefficient of the torque by the angle");
  });
}

std::array<double, Cogging::kHarmonics> Cogging::Harmonics() const {
  const double common =
      static_cast<double>(std::lcm(static_cast<int64_t>(slots), static_cast<int64_t>(poles)));
  return {poles / 2, slots, poles, 2 * slots, 2 * poles, 3 * slots, common};
}

std::vector<std::string> CoggingCoefficients() {
  std::vector<std::string> names;
  ForEachCoefficient([&](int, int, const std::string& name) { names.push_back(name); });
  return names;
}

CoggingTorque::CoggingTorque(const Cogging& cogging, const Joints& zero)
    : any_(cogging.any()),
      zero_(zero),
      harmonics_(cogging.Harmonics()),
      coefficients_(cogging.coefficients) {}

std::array<double, Cogging::kCoefficients> CoggingTorque::Factors(int joint, double angle) const {
  angle += zero_[joint];
  const auto turned = [&](double harmonic) { return std::polar(1.0, harmonic * angle); };
  // The order of Harmonics.
  const Complex pole_pairs = turned(harmonics_[0]), slots = turned(harmonics_[1]);
  const Complex poles = Product(pole_pairs, pole_pairs), two_slots = Product(slots, slots);
  const std::array<Complex, Cogging::kHarmonics> powers{pole_pairs,
                                                        slots,
                                                        poles,
                                                        two_slots,
                                                        Product(poles, poles),
                                                        Product(two_slots, slots),
                                                        turned(harmonics_.back())};
  std::array<double, Cogging::kCoefficients> factors{};
  for (int k = 0; k < Cogging::kHarmonics; ++k) {
    factors[k] = powers[k].imag();
    factors[k + Cogging::kHarmonics] = powers[k].real();
  }
  return factors;
}

Joints CoggingTorque::At(const Joints& angle) const {
  Joints torque{};
  if (!any_) return torque;
  for (int j = 0; j < 2; ++j) {
    const auto factors = Factors(j, angle[j]);
    for (int k = 0; k < Cogging::kCoefficients; ++k) torque[j] += coefficients_[j][k] * factors[k];
  }
  return torque;
}

Joints CoggingTorque::SlopeAt(const Joints& angle) const {
  Joints slope{};
  if (!any_) return slope;
  for (int j = 0; j < 2; ++j) {
    const auto factors = Factors(j, angle[j]);
    for (int k = 0; k < Cogging::kHarmonics; ++k) {
      const int c = k + Cogging::kHarmonics;
      slope[j] +=
          harmonics_[k] * (coefficients_[j][k] * factors[c] - coefficients_[j][c] * factors[k]);
    }
  }
  return slope;
}

}  // namespace upswing::machine
