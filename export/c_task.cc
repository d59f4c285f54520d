#include "export/c_task.h"

#include <bit>
#include <numbers>

#include "core/error.h"
#include "core/text.h"
#include "export/c_text.h"
#include "sim/acrobot_v1.h"
#include "sim/pendulum_v1.h"

namespace upswing {
namespace {

/// The constants by which energy and height are computed, as NAME_observe has them. The energy is
/// linear in them, so they follow from Energy at some states.
std::vector<float> EnergyConstants(const Plant& plant) {
  constexpr double kPi = std::numbers::pi;
  const double whole = 2 * EnergyTarget(plant);
  const double hanging = Energy(plant, {0, 0, 0, 0}), folded = Energy(plant, {0, kPi, 0, 0});
  const double own1 = Energy(plant, {0, 0, 1, -1}) - hanging;  // w1 = 1, w1 + w2 = 0
  const double own2 = Energy(plant, {0, 0, 0, 1}) - hanging;   // w1 = 0, w1 + w2 = 1
  const double both = Energy(plant, {0, 0, 1, 0}) - hanging - own1 - own2;
  const double length = plant.length1 + plant.length2;
  std::vector<float> constants;
  for (const double constant :
       {own1 / whole, own2 / whole, both / whole, (hanging + folded) / 2 / whole,
        (hanging - folded) / 2 / whole, plant.length1 / length, plant.length2 / length}) {
    constants.push_back(static_cast<float>(constant));
  }
  return constants;
}

CTask PendulumCode(const LoadedPolicy& loaded) {
  CTask code{"swings up and balances a double pendulum with one motor",
             {{"q1", "rad    angle of link 1, 0 hanging"},
              {"q2", "rad    angle of link 2 relative to link 1, 0 in line with it"},
              {"w1", "rad/s  velocity of q1"},
              {"w2", "rad/s  velocity of q2"}},
             loaded.plant.actuated_joint == 1 ? "at joint 1" : "at joint 2",
             {{"energy", "of the observed energy and height", EnergyConstants(loaded.plant)}},
             "",
             4};
  code.observe = Concat(R"c(  const float *k = NAME_energy;
  const float c1 = cosf(q1), s1 = sinf(q1), c2 = cosf(q2), s2 = sinf(q2);
  const float c12 = c1 * c2 - s1 * s2; /* cos(q1 + q2) */
  const float w12 = w1 + w2;
  observation[0] = c1;
  observation[1] = s1;
  observation[2] = w1 / )c",
                        CLiteral(static_cast<float>(kMaxVelocity1)), R"c(;
  observation[3] = c2;
  observation[4] = s2;
  observation[5] = w2 / )c",
                        CLiteral(static_cast<float>(kMaxVelocity2)), R"c(;
  /* Kinetic and potential energy: 0 hanging at rest, 1 upright at rest. */
  observation[6] = 0.5f + k[0] * w1 * w1 + k[1] * w12 * w12 + k[2] * c2 * w1 * w12 + k[3] * c1 +
                   k[4] * c12;
  /* Height of the tip over the pivot, -1 to 1. */
  observation[7] = -k[5] * c1 - k[6] * c12;
)c");
  if (loaded.memory() == 0) return code;
  code.observe = Concat(R"c(  int i;
)c",
                        code.observe, R"c(  /* What the past steps did, the latest first. */
  if (state->running) {
    for (i = CAPS_MEMORY_SIZE - 1; i >= 3; i--) state->memory[i] = state->memory[i - 3];
    state->memory[0] = (w1 - state->w1) / )c",
                        CLiteral(static_cast<float>(kMemoryVelocity)), R"c(;
    state->memory[1] = (w2 - state->w2) / )c",
                        CLiteral(static_cast<float>(kMemoryVelocity)), R"c(;
    state->memory[2] = state->torque / )c",
                        CLiteral(static_cast<float>(kMemoryTorque)), R"c(;
  }
  for (i = 0; i < CAPS_MEMORY_SIZE; i++) observation[8 + i] = state->memory[i];
  state->running = 1;
  state->w1 = w1;
  state->w2 = w2;
)c");
  return code;
}

}  // namespace

std::string ArrayText(const CArray& array) {
  std::vector<std::string> words;
  for (const float value : array.values) words.push_back(CLiteral(value) + ",");
  words.back().back() = '}';
  const std::string comment = array.comment.empty() ? "" : Concat(" /* ", array.comment, " */");
  return Concat("static const float NAME_", array.name, '[', array.values.size(), "] = {", comment,
                "\n  ", Wrapped(words, "  ", 2), ";\n");
}

CChecksum ChecksumOf(const std::vector<CArray>& arrays) {
  CChecksum checksum{2166136261U, ""};
  for (const CArray& array : arrays) {
    for (const float value : array.values) {
      checksum.sum = (checksum.sum ^ std::bit_cast<uint32_t>(value)) * 16777619U;
    }
    checksum.lines +=
        Concat("  sum = NAME_checksum(sum, NAME_", array.name, ", ", array.values.size(), "L);\n");
  }
  return checksum;
}

std::string PlantParagraph(const Plant& plant, const std::string& what) {
  std::vector<std::string> values;
  for (const auto& [name, value] : PlantValues(plant)) {
    values.push_back(Concat(name, ' ', FormatNumber(value)));
  }
  return Paragraph(Concat("Made for this plant (kg, m, N m s/rad, m/s2, N m), ", what, ": ",
                          Join(values, ", "), '.')) +
         "\n *\n";
}

CTask CTaskOf(const LoadedPolicy& loaded) {
  if (HasPlant(loaded.task)) return PendulumCode(loaded);
  if (loaded.task == kPendulumV1) {
    return {"swings up and balances a pendulum (Gymnasium's Pendulum-v1)",
            {{"theta", "rad    angle, 0 upright"}, {"omega", "rad/s  its velocity"}},
            "at the joint",
            {},
            R"c(  observation[0] = cosf(theta);
  observation[1] = sinf(theta);
  observation[2] = omega;
)c",
            2};
  }
  if (loaded.task == kAcrobotV1) {
    return {"swings the end of a double pendulum up (Gymnasium's Acrobot-v1)",
            {{"theta1", "rad    angle of link 1, 0 hanging"},
             {"theta2", "rad    angle of link 2 relative to link 1, 0 in line with it"},
             {"omega1", "rad/s  velocity of theta1"},
             {"omega2", "rad/s  velocity of theta2"}},
            "at the joint between the links",
            {},
            R"c(  observation[0] = cosf(theta1);
  observation[1] = sinf(theta1);
  observation[2] = cosf(theta2);
  observation[3] = sinf(theta2);
  observation[4] = omega1;
  observation[5] = omega2;
)c",
            4};
  }
  throw UnknownObservations(loaded);
}

}  // namespace upswing
