#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/matrix.h"
#include "core/policy.h"
#include "core/tensors.h"
#include "nn/policy_file.h"
#include "nn/q_network.h"

namespace upswing {

/// Takes the action with the largest Q-value of a network. Stored in one `policy.safetensors`, with
/// its description and origin, and with sample inputs and outputs that every load recomputes.
/// docs/policy-format.md describes the file for other readers. Q: number of actions that it chooses
/// from.
class QPolicy : public Policy {
 public:
  /// `parameters` (network.num_parameters()), `torques` (Q): what each action applies, N·m, `info`:
  /// what it was made for, and how.
  QPolicy(QNetworkShape shape, std::vector<float> parameters, std::vector<double> torques,
          PolicyInfo info);

  const QNetworkShape& shape() const { return network_.shape(); }
  size_t num_parameters() const override { return network_.num_parameters(); }

  std::string kind() const override { return "q-network"; }
  std::string description() const override;
  int obs_size() const override { return shape().inputs; }
  int action_size() const override { return 1; }
  const PolicyInfo& info() const override { return info_; }

  /// Buffers of a forward pass, for any number of rows.
  std::unique_ptr<Memory> Start(int num_envs) const override;

  /// The action with the largest Q-value, up to rounding; of a dueling network by its advantages
  /// alone.
  void Act(Matrix<const float> obs, Matrix<double> action, Memory& memory) const override;

  /// Q-values (N × Q).
  int num_values() const override { return shape().actions; }
  void Values(Matrix<const float> obs, Matrix<float> q, Memory& memory) const override;
  Matrix<const double> value_actions() const override {
    return {std::span<const double>(torques_), shape().actions, 1};
  }

  /// The checks on loading.
  const SelfCheck& self_check() const { return self_check_; }

  /// The same with its parameters rounded to bfloat16, for a file of half the size.
  QPolicy Rounded() const;

  /// What its file holds. Throws Failure if a parameter is not finite.
  Tensors ToTensors() const override;

  /// Reads and checks what a file holds: format, metadata, shapes, finite numbers, samples, and the
  /// checksum where it has one. A changed parameter that moves no Q-value of the samples by more
  /// than rounding, say of a unit that none of them activates, is detected by the checksum alone.
  /// Takes memory in proportion to the file's size. Throws BadInput.
  static QPolicy From(const Tensors& file);

 private:
  /// Recomputes the stored outputs from the stored inputs. Throws BadInput.
  void CheckSamples(const Tensors& file);

  QNetwork<float> network_;
  AlignedVector<float> parameters_;
  std::vector<double> torques_;
  PolicyInfo info_;
  SelfCheck self_check_;
};

}  // namespace upswing
