#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "core/matrix.h"
#include "core/tensor_file.h"
#include "nn/q_network.h"

namespace upswing {

/// A greedy controller: observation → torque, nothing else needed. It lives in one
/// `policy.safetensors`, with what it is, where it comes from, and sample inputs and outputs that
/// every load recomputes. docs/policy-format.md describes the file for other readers.
class Policy {
 public:
  /// `parameters` (network.num_parameters()), `torques` (A): what each action applies, N·m,
  /// `about`: where it comes from (the plant, the run), free text under free names.
  Policy(QNetworkShape shape, std::vector<float> parameters, std::vector<double> torques,
         std::map<std::string, std::string> about);

  const QNetworkShape& shape() const { return network_.shape(); }
  size_t num_parameters() const { return network_.num_parameters(); }
  std::span<const double> torques() const { return torques_; }
  const std::map<std::string, std::string>& about() const { return about_; }

  /// An `about` text that must be there; throws BadInput naming the key.
  const std::string& About(const std::string& key) const;

  /// Room to work in.
  struct Workspace {
    QNetwork<float>::Activations activations;  // of a block of rows
    AlignedVector<float> preferences;          // (block × A)
  };
  Workspace MakeWorkspace() const;

  /// Q-values (B × A) of observations (B × D). Threads may ask at once, each in a workspace of its
  /// own.
  void QValues(Matrix<const float> obs, Matrix<float> q, Workspace& workspace) const;

  /// The same in the policy's own workspace. Not for two threads at once.
  void QValues(Matrix<const float> obs, Matrix<float> q) const { QValues(obs, q, workspace_); }

  /// The torque (B), N·m, of the action with the largest Q-value, up to rounding; of a dueling
  /// network by its advantages alone. Threads may act at once, each in a workspace of its own; a
  /// row's torque does not depend on what other rows there are.
  void Act(Matrix<const float> obs, std::span<double> torque, Workspace& workspace) const;

  /// The same in the policy's own workspace. Not for two threads at once.
  void Act(Matrix<const float> obs, std::span<double> torque) const {
    Act(obs, torque, workspace_);
  }

  /// Largest |difference| between the sample Q-values of the file that it was loaded from and those
  /// that loading recomputed; 0 for a policy that never was in a file.
  double self_check_error() const { return self_check_error_; }

  /// Writes the file atomically. Throws Failure, also if a parameter is not finite.
  void Save(const std::filesystem::path& path) const;

  /// Reads and checks the file: format, shapes, finite numbers, samples. Throws BadInput.
  static Policy Load(const std::filesystem::path& path) { return From(TensorFile::Load(path)); }

  /// The same of a file that has been read.
  static Policy From(const TensorFile& file);

 private:
  /// Recomputes the stored outputs from the stored inputs. Throws BadInput.
  void CheckSamples(const TensorFile& file);

  QNetwork<float> network_;
  AlignedVector<float> parameters_;
  std::vector<double> torques_;
  std::map<std::string, std::string> about_;
  double self_check_error_ = 0;
  mutable Workspace workspace_;
};

/// Index of the largest number, the first of equals.
int ArgMax(std::span<const float> values);

}  // namespace upswing
