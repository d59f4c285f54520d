#include "mujoco/model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <type_traits>

#include "base/error.h"
#include "base/text.h"
#include "pendulum/mjcf.h"

namespace upswing {
namespace {

/// Whether a model has the fields for a plant's rotors, and for its dry friction.
bool HasRotors(const mjModel& model) { return model.ntendon == 1; }
bool HasDryFriction(const mjModel& model) { return model.nuser_jnt == 1; }

/// The fields that `field(name, pointer into m)` returns.
template <typename Model, typename Field>
ModelFields FieldsBy(Model& m, const Field& field) {
  const auto if_any = [&](bool any, const char* name, mjtNum* numbers) {
    return any ? field(name, numbers) : nullptr;
  };
  return {field("body_mass", m.body_mass),
          field("body_inertia", m.body_inertia),
          field("body_ipos", m.body_ipos),
          field("body_pos", m.body_pos),
          field("dof_damping", m.dof_damping),
          field("actuator_ctrlrange", m.actuator_ctrlrange),
          field("actuator_trnid", m.actuator_trnid),
          field("opt.gravity", m.opt.gravity),
          field("dof_armature", m.dof_armature),
          if_any(HasRotors(m), "tendon_armature", m.tendon_armature),
          if_any(HasRotors(m), "wrap_prm", m.wrap_prm),
          if_any(HasDryFriction(m), "dof_frictionloss", m.dof_frictionloss)};
}

/// Adds the dry friction c atan(s w) to models that have it; c is a joint's frictionloss and s its
/// user data. MuJoCo's own frictionloss is a constraint, which holds at rest and has no slope. As a
/// passive force, both engines agree to rounding.
void AddDryFriction(const mjModel* model, mjData* data) {
  if (!HasDryFriction(*model)) return;
  for (int i = 0; i < model->nv; ++i) {
    data->qfrc_passive[i] -=
        model->dof_frictionloss[i] * std::atan(model->jnt_user[i] * data->qvel[i]);
  }
}

/// Replaces MuJoCo's handlers, which print warnings, log them to a file in the current folder, and
/// end the program on an error. Adds our handler of dry friction. Runs once, because handlers are
/// global and several threads compile models.
void SetHandlers() {
  static std::once_flag once;
  std::call_once(once, [] {
    mju_user_warning = [](const char*) {};
    mju_user_error = [](const char* message) { throw Failure(Concat("MuJoCo: ", message)); };
    mjcb_passive = AddDryFriction;
  });
}

}  // namespace

std::string MuJoCoVersion() { return mj_versionString(); }

ModelPtr CompileModel(const Plant& plant) {
  SetHandlers();
  // Compile one model at a time: the thread sanitizer reports that parsers in two threads share a
  // buffer within MuJoCo.
  static std::mutex compiling;
  const std::lock_guard lock(compiling);
  std::array<char, 1000> message{};
  const std::unique_ptr<mjSpec, MuJoCoDeleter> spec(
      mj_parseXMLString(Mjcf(plant).c_str(), nullptr, message.data(), message.size()));
  if (spec == nullptr) throw Failure(Concat("MuJoCo: ", message.data()));
  ModelPtr model(mj_compile(spec.get(), nullptr));
  if (model == nullptr) throw Failure(Concat("MuJoCo: ", mjs_getError(spec.get())));
  return model;
}

ModelFields FieldsOf(mjModel& model) {
  return FieldsBy(model, [](const char* /*name*/, auto* field) { return field; });
}

ModelFields FieldsOf(mjBatch* batch, int row) {
  return FieldsBy(*mjb_model(batch), [&](const char* name, auto* field) {
    int size = 0;
    using Number = std::remove_const_t<std::remove_pointer_t<decltype(field)>>;
    auto* rows = static_cast<Number*>(mjb_expand(batch, name, &size, nullptr));
    if (rows == nullptr) throw Failure(Concat("MuJoCo cannot expand ", name));
    return rows + row * size;
  });
}

void WritePlant(const Plant& plant, const ModelFields& fields) {
  const auto links = LinksOf(plant);
  for (const int body : {1, 2}) {  // body 0 is the world
    const auto [m, l, c, I] = links[body - 1];
    fields.body_mass[body] = m;
    fields.body_inertia[3 * body] = I;
    fields.body_inertia[3 * body + 1] = I;
    fields.body_inertia[3 * body + 2] = std::min(CapsuleInertia(m, CapsuleRadius(l), l).along, I);
    fields.body_ipos[3 * body + 2] = -c;
  }
  fields.body_pos[3 * 2 + 2] = -plant.length1;
  fields.dof_damping[0] = plant.damping1;
  fields.dof_damping[1] = plant.damping2;
  fields.dof_armature[0] = Armature1(plant);
  fields.dof_armature[1] = plant.armature;
  fields.actuator_ctrlrange[0] = -plant.torque_limit;
  fields.actuator_ctrlrange[1] = plant.torque_limit;
  fields.actuator_trnid[0] = static_cast<int>(plant.actuated_joint) - 1;
  fields.gravity[2] = -plant.gravity;

  if (fields.tendon_armature != nullptr) {
    fields.tendon_armature[0] = plant.rotor_inertia;
    fields.wrap_prm[1] = -plant.gear_ratio;
  } else if (plant.rotor_inertia != 0) {
    throw BadInput("rotor_inertia: expected 0, because the model has no rotors");
  }
  if (fields.dof_frictionloss != nullptr) {
    fields.dof_frictionloss[0] = plant.coulomb1;
    fields.dof_frictionloss[1] = plant.coulomb2;
  } else if (plant.has_dry_friction()) {
    throw BadInput("coulomb1, coulomb2: expected 0, because the model has no dry friction");
  }
}

}  // namespace upswing
