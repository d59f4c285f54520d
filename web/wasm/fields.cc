#include "web/wasm/fields.h"

#include <cmath>

#include "base/text.h"

namespace upswing {
namespace {

/// Appends each field to a line.
struct Lister : FieldVisitor {
  std::string line;
  void Visit(const char* name, std::span<double> field) override {
    line += Concat(" ", name, ":", field.size());
  }
};

template <typename T>
std::string LineOf(const char* name) {
  Lister lister;
  T fields;
  fields.Visit(lister);
  return Concat(name, lister.line, "\n");
}

}  // namespace

void PlantFields::Visit(FieldVisitor& field) {
  for (const PlantParameter& parameter : std::span(kPlantParameters).first(kMainParameters)) {
    field(parameter.name, plant.*parameter.value);
  }
  field("size", size);
}

Plant PlantFields::Built() const {
  if (size == 1) return plant;
  const auto inertia = [&](double mass, double length) {
    return CapsuleInertia(mass, size * kCapsuleRadius, length).across;
  };
  Plant built = plant;
  built.inertia1 = inertia(plant.mass1, plant.length1);
  built.inertia2 = inertia(plant.mass2, plant.length2);
  built.armature = std::pow(size, 5) * kArmature;  // masses grow with size³
  return built;
}

void StateFields::Visit(FieldVisitor& field) {
  field("q1", state.q1);
  field("q2", state.q2);
  field("w1", state.w1);
  field("w2", state.w2);
}

void PendulumFields::Visit(FieldVisitor& field) {
  PlantFields::Visit(field);
  StateFields::Visit(field);
  field("torque", torque);
}

void PushedFields::Visit(FieldVisitor& field) {
  PendulumFields::Visit(field);
  field("timestep", timestep);
  field("link", link);
  field("along", along);
  field("x", x);
  field("z", z);
}

void JudgedFields::Visit(FieldVisitor& field) {
  PendulumFields::Visit(field);
  field("goal1", goal1);
  field("goal2", goal2);
}

void JudgementFields::Visit(FieldVisitor& field) {
  field("observation", observation);
  field("energy", energy);
  field("normalized_energy", normalized_energy);
  field("tip_height", tip_height);
  field("relative_height", relative_height);
  field("inverted", inverted);
  field("reward_terms", reward_terms);
}

void IdentifierFields::Visit(FieldVisitor& field) {
  StateFields::Visit(field);
  field("torque", torque);
  field("noise", noise);
}

void IdentifiedFields::Visit(FieldVisitor& field) { field("identified", identified); }

void SensorsFields::Visit(FieldVisitor& field) {
  StateFields::Visit(field);
  field("torque", torque);
  field("sensor_latency", model.latency);
  field("encoder_counts", model.encoder_counts);
  field("velocity_window", model.velocity_window);
  field("velocity_filter", model.velocity_filter);
}

void ReadingFields::Visit(FieldVisitor& field) {
  StateFields::Visit(field);
  field("torque", torque);
  field("noise", noise);
}

void CapsuleFields::Visit(FieldVisitor& field) {
  field("mass", mass);
  field("radius", radius);
  field("length", length);
}

void CapsuleInertiaFields::Visit(FieldVisitor& field) {
  field("across", across);
  field("along", along);
}

void DecisionFields::Visit(FieldVisitor& field) {
  field("torque", torque);
  field("value", value);
}

void GaussianFields::Visit(FieldVisitor& field) {
  field("low", low);
  field("high", high);
  field("mean", mean);
  field("log_std", log_std);
}

std::string FieldTable() {
  return LineOf<PlantFields>("plant") + LineOf<StateFields>("state") +
         LineOf<PushedFields>("pushed") + LineOf<JudgedFields>("judged") +
         LineOf<JudgementFields>("judgement") + LineOf<IdentifierFields>("identifier") +
         LineOf<IdentifiedFields>("identified") + LineOf<SensorsFields>("sensors") +
         LineOf<ReadingFields>("reading") + LineOf<CapsuleFields>("capsule") +
         LineOf<CapsuleInertiaFields>("capsule_inertia") + LineOf<DecisionFields>("decision") +
         LineOf<GaussianFields>("gaussian");
}

}  // namespace upswing
