#include "nn/network_policy.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <utility>

#include "base/argmax.h"
#include "base/error.h"
#include "base/text.h"
#include "nn/gaussian.h"

namespace upswing {
namespace {

constexpr int kBlock = 128;  // rows in one forward pass: the activations stay in the L2 cache
// Probability that a normal number is more than one standard deviation below its mean.
constexpr double kLowTail = 0.15865525393145707;

/// Buffers for a forward pass of one block of rows.
struct Workspace : Policy::Memory {
  Network::Activations network, critic;
  AlignedVector<float> outputs;        // (block × outputs)
  AlignedVector<float> critic_inputs;  // (block × (D + A))
  std::vector<double> action;          // (A)
};

/// Calls `f(first, rows)` for each block of rows.
template <typename F>
void ForBlocks(int rows, const F& f) {
  for (int first = 0; first < rows; first += kBlock) f(first, std::min(kBlock, rows - first));
}

/// Throws BadInput unless the sizes of the parts fit each other. Each network checks its own sizes.
NetworkPolicyParts Checked(NetworkPolicyParts parts) {
  const auto A = parts.action_limit.size(), Q = parts.torques.size();
  const ActionRuleFacts& rule = parts.facts();
  size_t outputs = 2 * A;
  bool fits = A > 0 && Q == 0;
  if (rule.chooses_torque()) {
    const size_t limits = rule.is_actor() ? 1 : 0;
    outputs = Q;
    fits = A == limits && Q > 0;
  }
  if (!fits) {
    throw BadInput(Concat("policy: expected torques or limits for a ", rule.name, ", got ", Q,
                          " torques and ", A, " limits"));
  }
  if (static_cast<size_t>(parts.shape.outputs) != outputs) {
    throw BadInput(Concat("policy: expected a network of ", outputs,
                          " outputs, one for each torque or two for each limit, got ",
                          parts.shape.outputs));
  }
  const int D = parts.shape.inputs, with_action = D + parts.action_size();
  const int inputs = parts.critic.inputs;
  const bool critic_fits = rule.is_actor() && (inputs == D || inputs == with_action);
  if (inputs != 0 && !(critic_fits && parts.critic.outputs == 1)) {
    throw BadInput(Concat("policy: expected a critic of ", D, " or ", with_action,
                          " inputs and one output, or of Q-values none, got ", inputs, " and ",
                          parts.critic.outputs));
  }
  return parts;
}

/// The smallest torque at which the cumulative probability of these logits (Q) reaches `share`.
double CategoricalQuantile(std::span<const double> torques, std::span<const float> logits,
                           double share) {
  const double largest = *std::ranges::max_element(logits);
  std::map<double, double> weights;  // e^logit by torque, in ascending order
  double sum = 0;
  for (size_t i = 0; i < torques.size(); ++i) {
    const double weight = std::exp(logits[i] - largest);
    weights[torques[i]] += weight;
    sum += weight;
  }
  double below = 0;
  for (const auto& [torque, weight] : weights) {
    below += weight;
    if (below >= share * sum) return torque;
  }
  return weights.rbegin()->first;
}

/// Rounds to the nearest bfloat16, ties to even. Writing the file rejects numbers that are not
/// finite.
float RoundedToBfloat16(float x) {
  const auto bits = std::bit_cast<uint32_t>(x);
  return std::bit_cast<float>((bits + 0x7fff + (bits >> 16 & 1)) & 0xffff0000);
}

}  // namespace

NetworkPolicy::NetworkPolicy(NetworkPolicyParts parts, PolicyInfo info)
    : parts_(Checked(std::move(parts))), network_(parts_.shape), info_(std::move(info)) {
  if (parts_.critic.inputs > 0) critic_ = std::make_unique<const Network>(parts_.critic);
  const size_t of_critic = critic_ ? critic_->num_parameters() : 0;
  if (parts_.parameters.size() == network_.num_parameters() &&
      parts_.critic_parameters.size() == of_critic) {
    return;
  }
  throw BadInput(Concat("policy: expected ", network_.num_parameters(), " parameters and ",
                        of_critic, " of the critic, got ", parts_.parameters.size(), " and ",
                        parts_.critic_parameters.size()));
}

std::string NetworkPolicy::description() const {
  const NetworkShape& shape = parts_.shape;
  const ActionRuleFacts& rule = parts_.facts();
  const char* head = "";
  if (!is_actor()) head = shape.dueling() ? " dueling" : " plain";
  return Concat(rule.choice, head, ' ', rule.distribution, ' ', shape.Text(),
                shape.layer_norm ? ", layer normalisation" : "",
                critic_ ? ", critic " + parts_.critic.Text() : "");
}

std::vector<LayerView> NetworkPolicy::CriticLayers() const {
  return critic_ ? critic_->Views(parts_.critic_parameters) : std::vector<LayerView>();
}

std::unique_ptr<Policy::Memory> NetworkPolicy::Start(int /*num_envs*/) const {
  auto workspace = std::make_unique<Workspace>();
  workspace->network = network_.MakeActivations(kBlock, false);
  workspace->outputs.resize(static_cast<size_t>(kBlock) * num_outputs());
  workspace->action.resize(parts_.action_limit.size());
  if (!critic_) return workspace;
  workspace->critic = critic_->MakeActivations(kBlock, false);
  workspace->critic_inputs.resize(static_cast<size_t>(kBlock) * parts_.critic.inputs);
  return workspace;
}

void NetworkPolicy::Outputs(Matrix<const float> obs, Matrix<float> outputs, Memory& memory) const {
  auto& workspace = static_cast<Workspace&>(memory);
  ForBlocks(obs.rows(), [&](int first, int rows) {
    network_.Forward(parts_.parameters, obs.Rows(first, rows), {0, rows}, workspace.network,
                     outputs.Rows(first, rows));
  });
}

void NetworkPolicy::Act(Matrix<const float> obs, Matrix<double> action, Memory& memory) const {
  auto& workspace = static_cast<Workspace&>(memory);
  ForBlocks(obs.rows(), [&](int first, int rows) {
    const Matrix<float> outputs(workspace.outputs, rows, num_outputs());
    network_.ForwardPreferences(parts_.parameters, obs.Rows(first, rows), {0, rows},
                                workspace.network, outputs);
    for (int i = 0; i < rows; ++i) Choose(outputs.row(i), action.row(first + i));
  });
}

void NetworkPolicy::Choose(std::span<const float> outputs, std::span<double> action) const {
  if (parts_.facts().chooses_torque()) {
    action[0] = parts_.torques[ArgMax(outputs)];
    return;
  }
  for (size_t k = 0; k < action.size(); ++k) action[k] = Bounded(outputs[k], k);
}

double NetworkPolicy::Bounded(double u, size_t k) const {
  return parts_.action_limit[k] * parts_.facts().bound->bounded(u);
}

int NetworkPolicy::num_values() const {
  if (!is_actor()) return num_outputs();
  return critic_ ? 1 : 0;
}

Matrix<const double> NetworkPolicy::value_actions() const {
  if (is_actor()) return {};
  return {std::span<const double>(parts_.torques), num_outputs(), 1};
}

void NetworkPolicy::Values(Matrix<const float> obs, Matrix<float> values, Memory& memory) const {
  if (!is_actor()) return Outputs(obs, values, memory);
  auto& workspace = static_cast<Workspace&>(memory);
  const bool takes_action = parts_.critic.inputs > obs_size();
  ForBlocks(obs.rows(), [&](int first, int rows) {
    Matrix<const float> inputs = obs.Rows(first, rows);
    if (takes_action) {
      const Matrix<float> outputs(workspace.outputs, rows, num_outputs());
      const Matrix<float> joined(workspace.critic_inputs, rows, parts_.critic.inputs);
      Outputs(inputs, outputs, memory);
      for (int i = 0; i < rows; ++i) {
        Choose(outputs.row(i), workspace.action);
        float* row = std::ranges::copy(inputs.row(i), joined.row(i).data()).out;
        for (size_t k = 0; k < workspace.action.size(); ++k) {
          row[k] = static_cast<float>(workspace.action[k] / parts_.action_limit[k]);
        }
      }
      inputs = joined;
    }
    critic_->Forward(parts_.critic_parameters, inputs, {0, rows}, workspace.critic,
                     values.Rows(first, rows));
  });
}

void NetworkPolicy::Spread(Matrix<const float> obs, Matrix<double> low, Matrix<double> high,
                           Memory& memory) const {
  AlignedVector<float> outputs(static_cast<size_t>(obs.rows()) * num_outputs());
  const Matrix<float> rows(outputs, obs.rows(), num_outputs());
  Outputs(obs, rows, memory);
  for (int i = 0; i < obs.rows(); ++i) Spread(rows.row(i), low.row(i), high.row(i));
}

void NetworkPolicy::Spread(std::span<const float> outputs, std::span<double> low,
                           std::span<double> high) const {
  if (parts_.facts().chooses_torque()) {
    low[0] = CategoricalQuantile(parts_.torques, outputs, kLowTail);
    high[0] = CategoricalQuantile(parts_.torques, outputs, 1 - kLowTail);
    return;
  }
  const auto A = parts_.action_limit.size();
  for (size_t k = 0; k < A; ++k) {
    const auto u = Gaussian<double>::From(outputs[k], outputs[A + k]);
    low[k] = Bounded(u.mean - u.std, k);
    high[k] = Bounded(u.mean + u.std, k);
  }
}

NetworkPolicy NetworkPolicy::WithTorques(double factor, PolicyInfo info) const {
  NetworkPolicyParts parts = parts_;
  for (double& torque : parts.torques) torque *= factor;
  for (double& limit : parts.action_limit) limit *= factor;
  return {std::move(parts), std::move(info)};
}

NetworkPolicy NetworkPolicy::Rounded() const {
  NetworkPolicyParts parts = parts_;
  for (float& x : parts.parameters) x = RoundedToBfloat16(x);
  for (float& x : parts.critic_parameters) x = RoundedToBfloat16(x);
  return {std::move(parts), info_};
}

}  // namespace upswing
