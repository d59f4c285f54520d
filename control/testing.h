#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/json.h"

/// What tests of controllers share.
namespace upswing {

/// An equation of control/riccati.h, and what SciPy says of it (testdata/make_riccati.py).
struct RiccatiCase {
  std::string name;
  Eigen::MatrixXd A, B, Q, R, P;
  double spectral_radius;  // of A - B K
};

inline Eigen::MatrixXd MatrixOf(const nlohmann::json& rows) {
  Eigen::MatrixXd matrix(rows.size(), rows.at(0).size());
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
      matrix(i, j) = rows.at(static_cast<size_t>(i)).at(static_cast<size_t>(j)).get<double>();
    }
  }
  return matrix;
}

inline nlohmann::json TestData(const char* name) {
  const auto folder = std::filesystem::path(__FILE__).parent_path();
  return nlohmann::json::parse(std::ifstream(folder / "testdata" / name));
}

/// All cases; those of the pendulum first, and the standard one first of all.
inline std::vector<RiccatiCase> SciPyCases() {
  std::vector<RiccatiCase> cases;
  const nlohmann::json file = TestData("riccati.json");
  for (const auto& c : file.at("cases")) {
    cases.push_back({c.at("name"), MatrixOf(c.at("A")), MatrixOf(c.at("B")), MatrixOf(c.at("Q")),
                     MatrixOf(c.at("R")), MatrixOf(c.at("P")), c.at("spectral_radius")});
  }
  return cases;
}

}  // namespace upswing
