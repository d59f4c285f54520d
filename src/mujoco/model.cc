#include "mujoco/model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <numbers>
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
ModelFields FieldsBy(Model& m, bool built_in, const Field& field) {
  const auto if_any = [&](bool any, const char* name, mjtNum* numbers) {
    return any ? field(name, numbers) : nullptr;
  };
  return {field("body_mass", m.body_mass),
          field("body_inertia", m.body_inertia),
          field("body_ipos", m.body_ipos),
          field("body_pos", m.body_pos),
          field("geom_pos", m.geom_pos),
          field("geom_size", m.geom_size),
          field("dof_damping", m.dof_damping),
          field("actuator_ctrlrange", m.actuator_ctrlrange),
          field("actuator_trnid", m.actuator_trnid),
          field("opt.gravity", m.opt.gravity),
          if_any(built_in, "dof_armature", m.dof_armature),
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

constexpr int kLinkBodies[2] = {1, 2};  // body 0 is the world

/// Deletes the elements of a model that move nothing, and clears sizes that would take memory.
void KeepMotion(mjSpec& spec) {
  for (const mjtObj type :
       {mjOBJ_SENSOR, mjOBJ_KEY, mjOBJ_CAMERA, mjOBJ_LIGHT, mjOBJ_SITE, mjOBJ_NUMERIC, mjOBJ_TEXT,
        mjOBJ_TUPLE, mjOBJ_MATERIAL, mjOBJ_TEXTURE}) {
    while (mjsElement* element = mjs_firstElement(&spec, type)) mjs_delete(&spec, element);
  }
  for (auto* geom = mjs_firstElement(&spec, mjOBJ_GEOM); geom != nullptr;
       geom = mjs_nextElement(&spec, geom)) {
    mjs_setString(mjs_asGeom(geom)->material, "");
  }
  mjSpec usual;
  mjs_defaultSpec(&usual);
  spec.memory = usual.memory;
  spec.nstack = usual.nstack;
  spec.njmax = usual.njmax;
  spec.nconmax = usual.nconmax;
  spec.nkey = usual.nkey;
}

}  // namespace

std::string MuJoCoVersion() { return mj_versionString(); }

ModelPtr CompileModel(const std::string& mjcf, const std::string& where, bool only_motion) {
  SetHandlers();
  // Compile one model at a time: the thread sanitizer reports that parsers in two threads share a
  // buffer within MuJoCo.
  static std::mutex compiling;
  const std::lock_guard lock(compiling);
  std::array<char, 1000> message{};
  const std::unique_ptr<mjSpec, MuJoCoDeleter> spec(
      mj_parseXMLString(mjcf.c_str(), nullptr, message.data(), message.size()));
  const auto complaint = [&](std::string text) {
    std::ranges::replace(text, '\n', ' ');  // keeps an error on one line
    return BadInput(Concat(where, ": ", Printable(Trim(text))));
  };
  if (spec == nullptr) throw complaint(message.data());
  if (only_motion) KeepMotion(*spec);
  ModelPtr model(mj_compile(spec.get(), nullptr));
  if (model == nullptr) throw complaint(mjs_getError(spec.get()));
  return model;
}

std::vector<std::string> DifferencesFromBuiltIn(const LoadedModel& loaded) {
  const mjModel& model = *loaded.model;
  const Plant& plant = loaded.plant;
  const ModelPtr ours = CompileModel(Mjcf(plant), "built-in model");
  std::vector<std::string> differences;
  const auto compare = [&](const std::string& what, double a, double b, std::string_view unit) {
    if (a != b) differences.push_back(Concat(what, " ", FormatNumber(a), " ", unit));
  };
  // The built-in model's flag constraint switches limits and friction off, too.
  const auto acts = [&](int flag) {
    return (model.opt.disableflags & (mjDSBL_CONSTRAINT | flag)) == 0;
  };
  const auto unit_under = [&](int flag, const std::string& unit) {
    return acts(flag) ? unit : unit + " (switched off by a flag)";
  };
  const auto soft = [&](const std::string& what, const mjtNum* a, const mjtNum* b, int n) {
    if (std::equal(a, a + n, b)) return;
    differences.push_back(what);
    for (int k = 0; k < n; ++k) differences.back() += Concat(" ", FormatNumber(a[k]));
  };
  for (const int i : {0, 1}) {
    const auto& [joint, sign, offset] = loaded.angles[i];
    if (sign == 1 && std::abs(offset) < 1e-9) continue;
    differences.push_back(
        Concat("q", i + 1, " = ", offset, " rad ", sign > 0 ? "+ " : "- ", joint));
  }
  compare("timestep", model.opt.timestep, ours->opt.timestep, "s");
  if (model.opt.integrator != ours->opt.integrator) {
    constexpr std::array kNames{"Euler", "RK4", "implicit", "implicitfast"};
    const auto index = static_cast<size_t>(model.opt.integrator);
    differences.push_back(Concat("integrator ", index < kNames.size() ? kNames.at(index) : "new"));
  }
  if (model.opt.integrator == mjINT_EULER && (model.opt.disableflags & mjDSBL_EULERDAMP) != 0 &&
      plant.damping1 + plant.damping2 > 0) {
    differences.emplace_back("eulerdamp off");
  }
  compare("density", model.opt.density, ours->opt.density, "kg/m³");
  compare("viscosity", model.opt.viscosity, ours->opt.viscosity, "Pa·s");
  for (const int i : {0, 1}) {
    const std::string number = std::to_string(i + 1);
    // A link with an own inertia does not depend on its radius.
    if ((i == 0 ? plant.inertia1 : plant.inertia2) == 0) {
      compare("radius" + number, model.geom_size[3 * i], ours->geom_size[3 * i], "m");
    }
    compare("armature" + number, model.dof_armature[i], ours->dof_armature[i], "kg·m²");
    compare("frictionloss" + number, model.dof_frictionloss[i], ours->dof_frictionloss[i],
            unit_under(mjDSBL_FRICTIONLOSS, "N·m"));
    compare("stiffness" + number, model.jnt_stiffness[i], ours->jnt_stiffness[i], "N·m/rad");
    if (model.dof_frictionloss[i] > 0 && acts(mjDSBL_FRICTIONLOSS)) {
      soft("solreffriction" + number, model.dof_solref + mjNREF * i, ours->dof_solref, mjNREF);
      soft("solimpfriction" + number, model.dof_solimp + mjNIMP * i, ours->dof_solimp, mjNIMP);
    }
    if (model.jnt_limited[i] == 0) continue;
    const double limit = model.jnt_range[2 * i + 1];
    compare("limit" + number, limit, 0, unit_under(mjDSBL_LIMIT, "rad"));
    if (!acts(mjDSBL_LIMIT)) continue;
    if (i == 0 && limit < std::numbers::pi) differences.back() += " (link 1 cannot stand upright)";
    compare("margin" + number, model.jnt_margin[i], 0, "rad");
    soft("solreflimit" + number, model.jnt_solref + mjNREF * i, ours->jnt_solref, mjNREF);
    soft("solimplimit" + number, model.jnt_solimp + mjNIMP * i, ours->jnt_solimp, mjNIMP);
  }
  return differences;
}

ModelFields FieldsOf(mjModel& model, bool built_in) {
  return FieldsBy(model, built_in, [](const char* /*name*/, auto* field) { return field; });
}

ModelFields FieldsOf(mjBatch* batch, int row, bool built_in) {
  return FieldsBy(*mjb_model(batch), built_in, [&](const char* name, auto* field) {
    int size = 0;
    using Number = std::remove_const_t<std::remove_pointer_t<decltype(field)>>;
    auto* rows = static_cast<Number*>(mjb_expand(batch, name, &size, nullptr));
    if (rows == nullptr) throw Failure(Concat("MuJoCo cannot expand ", name));
    return rows + row * size;
  });
}

void WritePlant(const Plant& plant, const ModelFields& fields) {
  const std::array<double, 2> masses{plant.mass1, plant.mass2};
  const std::array<double, 2> lengths{plant.length1, plant.length2};
  const std::array<double, 2> centers{plant.center1, plant.center2};
  const std::array<double, 2> inertias{plant.inertia1, plant.inertia2};
  for (const int body : kLinkBodies) {
    const int geom = body - 1;
    const double length = lengths[geom], mass = masses[geom];
    const CapsuleInertia capsule(mass, fields.geom_size[3 * geom], length);
    const double across = inertias[geom] > 0 ? inertias[geom] : capsule.across;
    fields.body_mass[body] = mass;
    fields.body_inertia[3 * body] = across;
    fields.body_inertia[3 * body + 1] = across;
    fields.body_inertia[3 * body + 2] = std::min(capsule.along, across);
    fields.body_ipos[3 * body + 2] = -(centers[geom] > 0 ? centers[geom] : length / 2);
    fields.geom_pos[3 * geom + 2] = -length / 2;
    fields.geom_size[3 * geom + 1] = length / 2;
  }
  fields.body_pos[3 * 2 + 2] = -plant.length1;
  fields.dof_damping[0] = plant.damping1;
  fields.dof_damping[1] = plant.damping2;
  fields.actuator_ctrlrange[0] = -plant.torque_limit;
  fields.actuator_ctrlrange[1] = plant.torque_limit;
  fields.actuator_trnid[0] = static_cast<int>(plant.actuated_joint) - 1;
  fields.gravity[0] = fields.gravity[1] = 0;
  fields.gravity[2] = -plant.gravity;

  if (fields.dof_armature != nullptr) {
    fields.dof_armature[0] = Armature1(plant);
    fields.dof_armature[1] = plant.armature;
  } else if (plant.armature != kArmature) {
    throw BadInput(Concat("armature: expected ", kArmature,
                          ", because a model file has its own armatures, got ", plant.armature));
  }
  if (fields.tendon_armature != nullptr) {
    fields.tendon_armature[0] = plant.rotor_inertia;
    fields.wrap_prm[0] = 1;
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
