#pragma once

#include <mujoco/mjbatch.h>
#include <mujoco/mujoco.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "pendulum/plant.h"

/// Owning handles of MuJoCo objects, and access to the plant's numbers in a compiled model.
namespace upswing {

struct MuJoCoDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
  void operator()(mjData* data) const { mj_deleteData(data); }
  void operator()(mjSpec* spec) const { mj_deleteSpec(spec); }
  void operator()(mjBatch* batch) const { mjb_deleteBatch(batch); }
};
using ModelPtr = std::unique_ptr<mjModel, MuJoCoDeleter>;
using DataPtr = std::unique_ptr<mjData, MuJoCoDeleter>;
using BatchPtr = std::unique_ptr<mjBatch, MuJoCoDeleter>;

/// MuJoCo's version, such as "4.0.0".
std::string MuJoCoVersion();

/// Compiles MJCF. Throws BadInput with `where` (a file's name) and MuJoCo's own message.
/// `only_motion`: leaves out elements without an effect on the motion, such as textures, cameras,
/// sensors and key frames.
ModelPtr CompileModel(const std::string& mjcf, const std::string& where, bool only_motion = false);

/// How an angle of the program (rad, from hanging) follows from the angle of a joint in a file:
/// q = sign · joint + offset.
struct JointAngle {
  std::string joint;  // its name in the file
  double sign = 1, offset = 0;

  double Of(double joint_angle) const { return sign * joint_angle + offset; }
  double Back(double q) const { return sign * (q - offset); }
};

/// The built-in model with the numbers of a file.
struct LoadedModel {
  ModelPtr model;
  /// Own centres of mass and inertias where the links are not solid capsules. No rotors, no dry
  /// friction and the default armature: a file has its own.
  Plant plant;
  std::array<JointAngle, 2> angles;
};

/// Compiles untrusted MJCF after CheckMjcf, and translates it into the built-in model. Both then
/// move alike: they are compared at random states. The file may have any base, shapes, hinge axes,
/// joint angles, gear and extras. Throws BadInput, with the cause, unless the file has
/// - two links on two parallel hinges, across which gravity acts
/// - the centre of mass of link 1 on the line from its hinge to the second one
/// - a motor at one hinge, with the same limit both ways
/// - no contact within reach of the links
/// - springs at rest when hanging, and joint limits that are the same both ways
/// - a timestep that divides the control period
/// - a plant within the ranges of its settings
LoadedModel LoadModel(const std::string& mjcf, const std::string& where);

/// Differences of a loaded model from the built-in one that affect the motion, without the plant's
/// parameters; such as "armature1 0.02 kg·m²". A limit or friction that a flag of the model
/// switches off is one of them, and says so. Also angles that the file counts in another way.
std::vector<std::string> DifferencesFromBuiltIn(const LoadedModel& loaded);

/// Pointers to the plant's numbers in an mjModel, or in rows that a batch has expanded. The
/// comments give sizes.
struct ModelFields {
  mjtNum* body_mass;           // (3)
  mjtNum* body_inertia;        // (3 × 3)
  mjtNum* body_ipos;           // (3 × 3)
  mjtNum* body_pos;            // (3 × 3)
  mjtNum* geom_pos;            // (2 × 3)
  mjtNum* geom_size;           // (2 × 3)
  mjtNum* dof_damping;         // (2)
  mjtNum* actuator_ctrlrange;  // (1 × 2)
  int* actuator_trnid;         // (1 × 2)
  mjtNum* gravity;             // (3)
  mjtNum* dof_armature;        // (2) null if the model is from a file, which has its own
  // Null if the model was compiled without rotors or without dry friction:
  mjtNum* tendon_armature;   // (1)
  mjtNum* wrap_prm;          // (2)
  mjtNum* dof_frictionloss;  // (2)
};
/// The fields of a model. `built_in`: it is the built-in one, not from a file.
ModelFields FieldsOf(mjModel& model, bool built_in = true);
/// The fields of simulation `row` of a batch. Every simulation gets its own. Throws Failure.
ModelFields FieldsOf(mjBatch* batch, int row, bool built_in);

/// Writes a plant into a loaded model, as if its MJCF had these numbers. The caller then calls
/// mj_setConst or mjb_setConst. Throws BadInput if the plant has rotors or dry friction and the
/// model was compiled without them, or another armature than the default for a model from a file.
void WritePlant(const Plant& plant, const ModelFields& fields);

}  // namespace upswing
