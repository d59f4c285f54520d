#pragma once

#include <mujoco/mjbatch.h>
#include <mujoco/mujoco.h>

#include <memory>
#include <string>
#include <vector>

#include "sim/double_pendulum.h"

/// Owning handles of MuJoCo objects, and the plant's numbers within a compiled model.
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

/// Such as "4.0.0".
std::string MuJoCoVersion();

/// Compiles MJCF. Throws BadInput with MuJoCo's own message, after `where` (a file's name).
ModelPtr CompileModel(const std::string& mjcf, const std::string& where);

/// Compiles untrusted MJCF after CheckMjcf. Throws BadInput, too, unless the model is built like
/// the built-in one: two solid capsules hanging on hinges about +y, a motor of the same limit both
/// ways at one of them, gravity along -z, springs at rest hanging, limits of the joints the same
/// both ways, a timestep that divides the control period, and a plant within the ranges of its
/// settings. Armature, friction, stiffness, the capsules' radius and the integrator may differ.
ModelPtr LoadModel(const std::string& mjcf, const std::string& where);

/// Differences of a loaded model from the built-in one that affect the motion, apart from the
/// plant's parameters; such as "armature1 0.02 kg·m²".
std::vector<std::string> DifferencesFromBuiltIn(const mjModel& model);

/// The plant that a loaded model describes, without rotors and dry friction, which only the
/// built-in one has.
Plant PlantOf(const mjModel& model);

/// Pointers to the plant's numbers: in an mjModel, or in rows that a batch has expanded. The
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
  // Null where the model was compiled without rotors or without dry friction.
  mjtNum* dof_armature;      // (2)
  mjtNum* tendon_armature;   // (1)
  mjtNum* wrap_prm;          // (2)
  mjtNum* dof_frictionloss;  // (2)
};
/// Whether a model has what a plant's rotors, and what its dry friction is written to.
bool HasRotors(const mjModel& model);
bool HasDryFriction(const mjModel& model);
ModelFields FieldsOf(mjModel& model);

/// Writes a plant into a loaded model, as if its MJCF had these numbers. mj_setConst or
/// mjb_setConst must follow. Throws BadInput if the plant has rotors or dry friction and the model
/// was compiled without them.
void WritePlant(const Plant& plant, const ModelFields& fields);

}  // namespace upswing
