#include "mujoco/model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>

#include "base/error.h"
#include "base/text.h"
#include "mujoco/mjcf_check.h"
#include "pendulum/mjcf.h"

namespace upswing {
namespace {

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

/// Compiles untrusted MJCF. Turns every MuJoCo error into BadInput.
ModelPtr CompileGiven(const std::string& mjcf, const std::string& where) {
  try {
    return CompileModel(mjcf, where);
  } catch (const Error& error) {
    if (error.exit_code() == 2) throw;
    throw BadInput(Concat(where, ": ", Printable(error.what())));
  }
}

/// Throws BadInput unless each parameter is within the range of its setting.
void CheckRanges(Plant plant, const std::string& where) {
  const Options options = OptionsOf(plant);
  for (const Option& option : options.all()) {
    option.Set(FormatNumber(option.number()), Concat(where, ": ", option.name));
  }
}

/// Callable: throws BadInput about a model from `where` unless `valid`.
class Expectation {
 public:
  explicit Expectation(const std::string& where) : where_(where) {}
  void operator()(bool valid, std::string_view expected) const {
    if (!valid) throw BadInput(Concat(where_, ": not a double pendulum: expected ", expected));
  }

 private:
  const std::string& where_;
};

/// Checks the structure: two bodies, two hinges, two capsules, a motor and the timestep.
void CheckStructure(const mjModel& model, const Expectation& expect) {
  expect(model.nbody == 3 && model.body_parentid[2] == 1, "two bodies, the second on the first");
  expect(model.njnt == 2 && model.jnt_type[0] == mjJNT_HINGE && model.jnt_type[1] == mjJNT_HINGE &&
             model.jnt_bodyid[0] == 1 && model.jnt_bodyid[1] == 2,
         "a hinge for each body");
  expect(std::abs(model.jnt_axis[1] - 1) < 1e-9 && std::abs(model.jnt_axis[4] - 1) < 1e-9,
         "hinges about +y");
  expect(model.ngeom == 2 && model.geom_type[0] == mjGEOM_CAPSULE &&
             model.geom_type[1] == mjGEOM_CAPSULE && model.geom_bodyid[0] == 1 &&
             model.geom_bodyid[1] == 2,
         "one capsule for each body");
  expect(model.nu == 1 && model.actuator_trntype[0] == mjTRN_JOINT && model.na == 0 &&
             model.actuator_ctrllimited[0] != 0,
         "one motor with a control range, on a hinge");
  expect(model.actuator_gear[0] == 1 && model.actuator_gainprm[0] == 1 &&
             model.actuator_biastype[0] == mjBIAS_NONE,
         "a motor whose control is its torque");
  const double substeps = kControlPeriod / model.opt.timestep;
  // With a shorter timestep, an evaluation would take minutes.
  expect(substeps > 0.5 && substeps < 200.5 && std::abs(substeps - std::round(substeps)) < 1e-6,
         Concat("a timestep that divides ", kControlPeriod, " s, of at least 1e-04 s, got ",
                model.opt.timestep));
  for (const int iterations : {model.opt.iterations, model.opt.ls_iterations}) {
    expect(iterations >= 1 && iterations <= 1000,
           Concat("1 to 1000 iterations of the solver, got ", iterations));
  }
  expect(model.opt.density >= 0 && model.opt.viscosity >= 0,
         "density and viscosity that are not negative");
}

/// Checks the numbers of each joint that are not part of the plant.
void CheckJoints(const mjModel& model, const Expectation& expect) {
  for (const int joint : {0, 1}) {
    const auto not_negative = [&](const mjtNum* numbers, std::string_view what) {
      expect(std::isfinite(numbers[joint]) && numbers[joint] >= 0,
             Concat(what, " that is not negative, got ", FormatNumber(numbers[joint])));
    };
    not_negative(model.dof_armature, "armature");
    not_negative(model.dof_damping, "damping");
    not_negative(model.dof_frictionloss, "frictionloss");
    not_negative(model.jnt_stiffness, "stiffness");
    const auto is_zero = [](mjtNum k) { return k == 0; };
    expect(std::all_of(model.jnt_stiffnesspoly + mjNPOLY * joint,
                       model.jnt_stiffnesspoly + mjNPOLY * (joint + 1), is_zero) &&
               std::all_of(model.dof_dampingpoly + mjNPOLY * joint,
                           model.dof_dampingpoly + mjNPOLY * (joint + 1), is_zero),
           "one number for the stiffness and one for the damping of a joint");
    // The mirror image of a motion must be a motion, because learning uses the mirror symmetry.
    expect(model.jnt_stiffness[joint] == 0 || model.qpos_spring[joint] == 0,
           Concat("springs at rest where the links hang (springref 0), got ",
                  FormatNumber(model.qpos_spring[joint]), " rad"));
    const mjtNum* range = model.jnt_range + 2 * joint;
    expect(model.jnt_limited[joint] == 0 || std::abs(range[0] + range[1]) < 1e-9,
           "limits of a joint that are the same both ways");
  }
}

/// Rotation from a body's principal axes of inertia to its frame, row by row.
std::array<mjtNum, 9> PrincipalAxes(const mjModel& model, int body) {
  std::array<mjtNum, 9> R;
  mju_quat2Mat(R.data(), model.body_iquat + 4 * body);
  return R;
}

/// Moment of inertia of a body about its centre of mass and the hinges' axis, kg·m².
double InertiaAcross(const mjModel& model, int body) {
  const std::array<mjtNum, 9> R = PrincipalAxes(model, body);
  double I = 0;
  for (int k = 0; k < 3; ++k) I += R[3 + k] * R[3 + k] * model.body_inertia[3 * body + k];
  return I;
}

/// Checks that the links' positions follow from the plant, so that writing the plant keeps the
/// file's model. Armature, friction, stiffness, radius and integrator may be anything.
void CheckGeometry(const mjModel& model, const std::string& where, const Expectation& expect) {
  const ModelPtr ours = CompileModel(Mjcf(PlantOf(model)), where);
  const auto same = [&](const mjtNum* a, const mjtNum* b, int n, std::string_view what) {
    for (int i = 0; i < n; ++i) expect(std::abs(a[i] - b[i]) < 1e-9, what);
  };
  same(model.qpos0, ours->qpos0, 2, "joint angles that are 0 hanging");
  same(model.jnt_pos, ours->jnt_pos, 6, "hinges at the ends of their links");
  same(model.body_quat, ours->body_quat, 12, "links that hang along -z");
  same(model.body_pos, ours->body_pos, 9, "the second link at the end of the first");
  same(model.geom_pos, ours->geom_pos, 6, "capsules along -z from their hinge");
  same(model.body_ipos, ours->body_ipos, 9,
       "the centre of mass of each link on its axis, below its hinge");
  for (const int body : kLinkBodies) {
    // Writing a plant makes the first two moments equal, which moves nothing but air.
    expect(std::abs(PrincipalAxes(model, body)[5]) < 1e-9,
           "the third principal axis of each link's inertia at a right angle to its hinge");
  }
  if (model.opt.density > 0 || model.opt.viscosity > 0) {
    const ModelPtr written(mj_copyModel(nullptr, &model));
    WritePlant(PlantOf(model), FieldsOf(*written, false));
    same(model.body_inertia, written->body_inertia, 9, "the inertia of solid capsules in air");
  }
  same(model.actuator_ctrlrange, ours->actuator_ctrlrange, 2, "a symmetric control range");
  same(model.opt.gravity, ours->opt.gravity, 3, "gravity along -z");
}

}  // namespace

std::string MuJoCoVersion() { return mj_versionString(); }

ModelPtr CompileModel(const std::string& mjcf, const std::string& where) {
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
  ModelPtr model(mj_compile(spec.get(), nullptr));
  if (model == nullptr) throw complaint(mjs_getError(spec.get()));
  return model;
}

ModelPtr LoadModel(const std::string& mjcf, const std::string& where) {
  CheckMjcf(mjcf, where);
  ModelPtr compiled = CompileGiven(mjcf, where);
  const Expectation expect(where);
  CheckStructure(*compiled, expect);
  CheckJoints(*compiled, expect);
  CheckRanges(PlantOf(*compiled), where);
  CheckGeometry(*compiled, where, expect);
  return compiled;
}

std::vector<std::string> DifferencesFromBuiltIn(const mjModel& model) {
  const Plant plant = PlantOf(model);
  const ModelPtr ours = CompileModel(Mjcf(plant), "built-in model");
  std::vector<std::string> differences;
  const auto compare = [&](const std::string& what, double a, double b, std::string_view unit) {
    if (a != b) differences.push_back(Concat(what, " ", FormatNumber(a), " ", unit));
  };
  // The built-in model's flag constraint switches limits and friction off, too.
  const auto unit_under = [&](int flag, const std::string& unit) {
    const bool acts = (model.opt.disableflags & (mjDSBL_CONSTRAINT | flag)) == 0;
    return acts ? unit : unit + " (switched off by a flag)";
  };
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
    const double limit = model.jnt_limited[i] != 0 ? model.jnt_range[2 * i + 1] : 0;
    compare("limit" + number, limit, 0, unit_under(mjDSBL_LIMIT, "rad"));
  }
  return differences;
}

Plant PlantOf(const mjModel& model) {
  Plant plant;
  plant.mass1 = model.body_mass[1];
  plant.mass2 = model.body_mass[2];
  plant.length1 = 2 * model.geom_size[1];
  plant.length2 = 2 * model.geom_size[4];
  plant.damping1 = model.dof_damping[0];
  plant.damping2 = model.dof_damping[1];
  plant.gravity = -model.opt.gravity[2];
  plant.torque_limit = model.actuator_ctrlrange[1];
  plant.actuated_joint = model.actuator_trnid[0] + 1;
  constexpr double kRounding = 1e-9;  // m, and share of an inertia
  for (const int body : kLinkBodies) {
    const int geom = body - 1;
    const double length = 2 * model.geom_size[3 * geom + 1];
    const double center = -model.body_ipos[3 * body + 2], I = InertiaAcross(model, body);
    const double capsule =
        CapsuleInertia(model.body_mass[body], model.geom_size[3 * geom], length).across;
    if (std::abs(center - length / 2) > kRounding) {
      (body == 1 ? plant.center1 : plant.center2) = center;
    }
    if (std::abs(I - capsule) > kRounding * capsule) {
      (body == 1 ? plant.inertia1 : plant.inertia2) = I;
    }
  }
  return plant;
}

ModelFields FieldsOf(mjModel& model, bool built_in) {
  const bool rotors = HasRotors(model);
  return {model.body_mass,
          model.body_inertia,
          model.body_ipos,
          model.body_pos,
          model.geom_pos,
          model.geom_size,
          model.dof_damping,
          model.actuator_ctrlrange,
          model.actuator_trnid,
          model.opt.gravity,
          built_in ? model.dof_armature : nullptr,
          rotors ? model.tendon_armature : nullptr,
          rotors ? model.wrap_prm : nullptr,
          HasDryFriction(model) ? model.dof_frictionloss : nullptr};
}

bool HasRotors(const mjModel& model) { return model.ntendon == 1; }

bool HasDryFriction(const mjModel& model) { return model.nuser_jnt == 1; }

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
