#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "core/matrix.h"
#include "core/tensor_file.h"
#include "nn/policy_info.h"
#include "nn/q_network.h"

namespace upswing {

/// A greedy controller: observation → torque. It is stored in one `policy.safetensors`, with its
/// description and origin, and with sample inputs and outputs that every load recomputes.
/// docs/policy-format.md describes the file for other readers.
class Policy {
 public:
  /// `parameters` (network.num_parameters()), `torques` (A): what each action applies, N·m,
  /// `info`: what it was made for, and how.
  Policy(QNetworkShape shape, std::vector<float> parameters, std::vector<double> torques,
         PolicyInfo info);

  const QNetworkShape& shape() const { return network_.shape(); }
  size_t num_parameters() const { return network_.num_parameters(); }
  std::span<const double> torques() const { return torques_; }
  const PolicyInfo& info() const { return info_; }

  /// Buffers of a forward pass.
  struct Workspace {
    QNetwork<float>::Activations activations;  // of a block of rows
    AlignedVector<float> preferences;          // (block × A)
  };
  Workspace MakeWorkspace() const;

  /// Q-values (B × A) of observations (B × D). Safe from several threads, each with its own
  /// workspace.
  void QValues(Matrix<const float> obs, Matrix<float> q, Workspace& workspace) const;

  /// The same in the policy's own workspace. Not for two threads at once.
  void QValues(Matrix<const float> obs, Matrix<float> q) const { QValues(obs, q, workspace_); }

  /// The torque (B), N·m, of the action with the largest Q-value, up to rounding; of a dueling
  /// network by its advantages alone. Safe from several threads, each with its own workspace; a
  /// row's torque does not depend on the other rows.
  void Act(Matrix<const float> obs, std::span<double> torque, Workspace& workspace) const;

  /// The same in the policy's own workspace. Not for two threads at once.
  void Act(Matrix<const float> obs, std::span<double> torque) const {
    Act(obs, torque, workspace_);
  }

  /// Result of the checks on loading.
  struct SelfCheck {
    bool has_checksum = false;  // a right one: no bit has changed
    double error = 0;           // largest |difference| of the samples' Q-values when recomputed
    double tolerance = 0;       // largest error that counts as rounding
  };
  const SelfCheck& self_check() const { return self_check_; }

  /// Writes the file atomically. Throws Failure, also if a parameter is not finite.
  void Save(const std::filesystem::path& path) const;

  /// Reads and checks the file: format, metadata, shapes, finite numbers, samples, and the checksum
  /// where it has one. A changed parameter that moves no Q-value of the samples by more than
  /// rounding, say of a unit that none of them activates, is detected by the checksum alone. Takes
  /// memory in proportion to the file's size. Throws BadInput.
  static Policy Load(const std::filesystem::path& path) { return From(TensorFile::Load(path)); }

  /// Load, from a file that has been read.
  static Policy From(const TensorFile& file);

 private:
  /// Recomputes the stored outputs from the stored inputs. Throws BadInput.
  void CheckSamples(const TensorFile& file);
  /// Whether `torque` belongs to the largest of the Q-values (A), or to one that equals it up to
  /// rounding.
  bool MayChoose(double torque, std::span<const float> q) const;

  QNetwork<float> network_;
  AlignedVector<float> parameters_;
  std::vector<double> torques_;
  PolicyInfo info_;
  SelfCheck self_check_;
  mutable Workspace workspace_;
};

/// Index of the largest number, the first of equals.
int ArgMax(std::span<const float> values);

}  // namespace upswing
