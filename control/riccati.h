#pragma once

#include <Eigen/Core>
#include <optional>

/// The discrete algebraic Riccati equation
///   P = Q + A' P A - A' P B (R + B' P B)⁻¹ B' P A.
/// Shapes: A, Q, P (n × n), B (n × m), R (m × m); Q ≥ 0 and R > 0, both symmetric.
namespace upswing {

/// Whether every mode of x⁺ = A x + B u that does not decay can be reached by u, by the test of
/// Popov, Belevitch and Hautus: [λI - A, B] has full rank. Numerically: the smallest singular value
/// is above 1e-9 times the largest.
bool IsStabilizable(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

/// The stabilising solution P, by structure-preserving doubling: Chu, Fan, Lin, Wang,
/// "Structure-preserving algorithms for periodic discrete-time algebraic Riccati equations",
/// International Journal of Control 77 (2004), algorithm 2.1. Nothing where there is none: (A, B)
/// cannot be stabilised, or Q does not see every mode that has to be.
std::optional<Eigen::MatrixXd> SolveRiccati(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                                            const Eigen::MatrixXd& Q, const Eigen::MatrixXd& R);

/// The gain of u = -K x (m × n) that belongs to a solution: (R + B' P B)⁻¹ B' P A.
Eigen::MatrixXd GainOf(const Eigen::MatrixXd& P, const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                       const Eigen::MatrixXd& R);

/// Largest |eigenvalue|: x⁺ = A x decays where it is below 1.
double SpectralRadius(const Eigen::MatrixXd& A);

/// Norm of the difference of the equation's two sides, over that of P.
double RiccatiResidual(const Eigen::MatrixXd& P, const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                       const Eigen::MatrixXd& Q, const Eigen::MatrixXd& R);

}  // namespace upswing
