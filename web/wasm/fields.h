#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <string>

#include "pendulum/identification.h"
#include "pendulum/plant.h"
#include "pendulum/sensors.h"
#include "pendulum/task.h"
#include "web/wasm/step.h"

// The numbers that the page and the core exchange, as structs. Each struct names its fields once,
// in Visit, in the order of its numbers. The page reads names and places from FieldTable.
namespace upswing {

/// Called for each field of a struct, in the order of its numbers.
class FieldVisitor {
 public:
  virtual ~FieldVisitor() = default;
  virtual void Visit(const char* name, std::span<double> numbers) = 0;

  void operator()(const char* name, double& number) { Visit(name, {&number, 1}); }
  template <size_t kCount>
  void operator()(const char* name, std::array<double, kCount>& numbers) {
    Visit(name, numbers);
  }
};

struct PlantFields {
  Plant plant;      // its first kMainParameters
  double size = 1;  // of the pendulum, as a multiple of the built-in plant's

  /// The plant, with armature and capsules of its size. At size 1 these are the usual ones.
  Plant Built() const;
  void Visit(FieldVisitor& field);
};

struct StateFields {
  PendulumState state;
  void Visit(FieldVisitor& field);
};

/// A pendulum at a control step.
struct PendulumFields : PlantFields, StateFields {
  double torque = 0;  // N·m
  void Visit(FieldVisitor& field);
};

struct PushedFields : PendulumFields {
  double timestep = 0;                       // s
  double link = 0, along = 0, x = 0, z = 0;  // see Push
  void Visit(FieldVisitor& field);
};

/// The goal is as in an observation; zeros: it is always upright.
struct JudgedFields : PendulumFields {
  double goal1 = 0, goal2 = 0;
  void Visit(FieldVisitor& field);
};

/// What the task says about a state under a torque.
struct JudgementFields {
  std::array<double, kObservationSize> observation{};
  double energy = 0, normalized_energy = 0;    // J, 1
  double tip_height = 0, relative_height = 0;  // m; over l1 + l2, as in the observation
  double inverted = 0;                         // 1: both links point to the goal within 30°
  std::array<double, kRewardTerms> reward_terms{};
  void Visit(FieldVisitor& field);
};

/// A measured state, and the torque of the control period before it.
struct IdentifierFields : StateFields {
  double torque = 0, noise = 0;  // see Identifier::Update
  void Visit(FieldVisitor& field);
};

/// The part of an observation that identification adds.
struct IdentifiedFields {
  std::array<double, kIdentifiedSize> identified{};
  void Visit(FieldVisitor& field);
};

/// A state at a control step, and the torque of the control period before it.
struct SensorsFields : StateFields {
  double torque = 0;  // N·m
  SensorModel model;
  void Visit(FieldVisitor& field);
};

/// A measured state, Sensors::Torque and SensorModel::velocity_noise.
struct ReadingFields : StateFields {
  double torque = 0, noise = 0;  // N·m, rad/s
  void Visit(FieldVisitor& field);
};

struct CapsuleFields {
  double mass = 0, radius = 0, length = 0;  // kg, m
  void Visit(FieldVisitor& field);
};

/// Moments of inertia of a capsule across and along its axis, kg·m².
struct CapsuleInertiaFields {
  double across = 0, along = 0;
  void Visit(FieldVisitor& field);
};

/// A policy's decision. Numbers of its kind follow.
struct DecisionFields {
  double torque = 0, value = 0;  // N·m; V of the observation, NaN: not estimated
  void Visit(FieldVisitor& field);
};

/// Numbers of a Gaussian actor's decision: the ends of the central 68% (N·m), μ and ln σ.
struct GaussianFields {
  double low = 0, high = 0, mean = 0, log_std = 0;
  void Visit(FieldVisitor& field);
};

/// Copies a struct's numbers into `numbers`, which may be longer.
template <typename T>
void WriteFields(T fields, std::span<double> numbers) {
  struct Writer : FieldVisitor {
    std::span<double> rest;
    void Visit(const char* /*name*/, std::span<double> field) override {
      std::ranges::copy(field, rest.begin());
      rest = rest.subspan(field.size());
    }
  } writer;
  writer.rest = numbers;
  fields.Visit(writer);
}

/// Count of a struct's numbers.
template <typename T>
size_t CountFields() {
  struct Counter : FieldVisitor {
    size_t count = 0;
    void Visit(const char* /*name*/, std::span<double> field) override { count += field.size(); }
  } counter;
  T fields;
  fields.Visit(counter);
  return counter.count;
}

/// A struct from its numbers at the beginning of `numbers`.
template <typename T>
T ReadFields(std::span<const double> numbers) {
  struct Reader : FieldVisitor {
    std::span<const double> rest;
    void Visit(const char* /*name*/, std::span<double> field) override {
      std::ranges::copy(rest.first(field.size()), field.begin());
      rest = rest.subspan(field.size());
    }
  } reader;
  reader.rest = numbers;
  T fields;
  fields.Visit(reader);
  return fields;
}

/// A line for each struct: its name, then NAME:COUNT for each field in the order of the numbers.
std::string FieldTable();

}  // namespace upswing
