#pragma once

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <filesystem>
#include <fstream>
#include <string>
#include <variant>
#include <vector>

#include "base/json.h"
#include "base/options.h"
#include "base/rng.h"
#include "control/riccati.h"
#include "pendulum/plant.h"

/// Helpers that the tests of controllers share.
namespace upswing {

/// Eigenvalues and eigenvectors. Uses dynamic sizes, because fixed sizes take twice as long to
/// compile.
using EigenSolver = Eigen::EigenSolver<Eigen::MatrixXd>;
using SymmetricEigenSolver = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;

/// Minimises ∫ x' Q x + R u² dt of ẋ = A x + B u by the sign S of the Hamiltonian matrix: S is -1
/// on its stable subspace [I; P], so that P = -S12⁻¹ (S11 + I) (Roberts, "Linear model reduction
/// and solution of the algebraic Riccati equation by use of the sign function", 1980).
inline Lqr ContinuousLqr(const LinearModel& model, const Eigen::Matrix4d& Q, double R) {
  constexpr int kSteps = 50;  // of Newton's iteration; some ten are enough
  Eigen::MatrixXd S(8, 8);
  S << model.A, -model.B * model.B.transpose() / R, -Q, -model.A.transpose();
  for (int step = 0; step < kSteps; ++step) S = (S + S.inverse()).eval() / 2;
  const Eigen::Matrix4d S11 = S.topLeftCorner<4, 4>(), S12 = S.topRightCorner<4, 4>();
  const Eigen::Matrix4d P = -S12.inverse() * (S11 + Eigen::Matrix4d::Identity());
  return {model.B.transpose() * P / R, P};
}

/// A random plant within 50% of the standard plant's parameters, with the motor at joint 1.
inline Plant DrawPlant(Rng& rng) {
  Plant plant;
  const Options options = OptionsOf(plant);
  for (const Option& option : options.all()) {
    *std::get<double*>(option.target) *= rng.Uniform(0.5, 1.5);
  }
  plant.actuated_joint = 1;
  return plant;
}

/// A problem of control/riccati.h with SciPy's solution (testdata/make_riccati.py).
struct RiccatiCase {
  std::string name;
  LinearModel model;
  Eigen::Matrix4d Q;
  double R;
  Eigen::Matrix4d P;
  double spectral_radius;  // of A - B K
};

/// A matrix of at most four rows and columns, padded with zeros.
inline Eigen::Matrix4d MatrixOf(const nlohmann::json& rows) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Zero();
  for (size_t i = 0; i < rows.size(); ++i) {
    for (size_t j = 0; j < rows[i].size(); ++j) {
      matrix(static_cast<int>(i), static_cast<int>(j)) = rows[i][j].get<double>();
    }
  }
  return matrix;
}

inline nlohmann::json TestData(const char* name) {
  const auto folder = std::filesystem::path(__FILE__).parent_path();
  return nlohmann::json::parse(std::ifstream(folder / "testdata" / name));
}

/// All cases with one input and at most four states. The pendulum's cases come first, and among
/// them the standard plant.
inline std::vector<RiccatiCase> SciPyCases() {
  std::vector<RiccatiCase> cases;
  const nlohmann::json file = TestData("riccati.json");
  for (const auto& c : file.at("cases")) {
    if (c.at("A").size() > 4 || c.at("R").size() > 1) continue;
    cases.push_back({c.at("name"),
                     {MatrixOf(c.at("A")), MatrixOf(c.at("B")).col(0)},
                     MatrixOf(c.at("Q")),
                     c.at("R").at(0).at(0),
                     MatrixOf(c.at("P")),
                     c.at("spectral_radius")});
  }
  return cases;
}

}  // namespace upswing
