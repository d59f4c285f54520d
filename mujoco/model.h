#pragma once

#include <mujoco/mjbatch.h>
#include <mujoco/mujoco.h>

#include <memory>
#include <string>
#include <vector>

#include "sim/double_pendulum.h"

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
ModelPtr CompileModel(const std::string& mjcf, const std::string& where);

/// Compiles untrusted MJCF after CheckMjcf. Throws BadInput unless the model has the structure of
/// the built-in one:
/// - two solid capsules hanging on hinges about +y
/// - a motor at one hinge, with the same limit both ways
/// - gravity along -z
/// - springs at rest when hanging, and joint limits that are the same both ways
/// - a timestep that divides the control period
/// - a plant within the ranges of its settings
///
/// Armature, friction, stiffness, the capsules' radius and the integrator may differ.
ModelPtr LoadModel(const std::string& mjcf, const std::string& where);

/// Differences of a loaded model from the built-in one that affect the motion, without the plant's
/// parameters; such as "armature1 0.02 kg·m²".
std::vector<std::string> DifferencesFromBuiltIn(const mjModel& model);

/// The plant that a loaded model describes. It has no rotors and no dry friction, which only the
/// built-in model can have.
Plant PlantOf(const mjModel& model);

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
  // Null if the model was compiled without rotors or without dry friction:
  mjtNum* dof_armature;      // (2)
  mjtNum* tendon_armature;   // (1)
  mjtNum* wrap_prm;          // (2)
  mjtNum* dof_frictionloss;  // (2)
};
/// Whether a model has the fields for a plant's rotors, and for its dry friction.
bool HasRotors(const mjModel& model);
bool HasDryFriction(const mjModel& model);
ModelFields FieldsOf(mjModel& model);

/// Writes a plant into a loaded model, as if its MJCF had these numbers. The caller then calls
/// mj_setConst or mjb_setConst. Throws BadInput if the plant has rotors or dry friction and the
/// model was compiled without them.
void WritePlant(const Plant& plant, const ModelFields& fields);

}  // namespace upswing
