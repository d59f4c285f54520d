#pragma once

#include <mujoco/mjbatch.h>
#include <mujoco/mujoco.h>

#include <memory>
#include <string>

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

/// Compiles the model of a plant (pendulum/mjcf.h). Throws Failure.
ModelPtr CompileModel(const Plant& plant);

/// Pointers to the plant's numbers in an mjModel, or in rows that a batch has expanded. The
/// comments give sizes.
struct ModelFields {
  mjtNum* body_mass;           // (3)
  mjtNum* body_inertia;        // (3 × 3)
  mjtNum* body_ipos;           // (3 × 3)
  mjtNum* body_pos;            // (3 × 3)
  mjtNum* dof_damping;         // (2)
  mjtNum* actuator_ctrlrange;  // (1 × 2)
  int* actuator_trnid;         // (1 × 2)
  mjtNum* gravity;             // (3)
  mjtNum* dof_armature;        // (2)
  // Null if the model was compiled without rotors or without dry friction:
  mjtNum* tendon_armature;   // (1)
  mjtNum* wrap_prm;          // (2)
  mjtNum* dof_frictionloss;  // (2)
};
/// The fields of a model.
ModelFields FieldsOf(mjModel& model);
/// The fields of simulation `row` of a batch. Every simulation gets its own. Throws Failure.
ModelFields FieldsOf(mjBatch* batch, int row);

/// Writes the numbers of a plant that move it into a compiled model. The caller then calls
/// mj_setConst or mjb_setConst. Throws BadInput if the plant has rotors or dry friction and the
/// model was compiled without them.
void WritePlant(const Plant& plant, const ModelFields& fields);

}  // namespace upswing
