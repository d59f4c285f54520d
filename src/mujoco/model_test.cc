#include "mujoco/model.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "base/rng.h"
#include "base/thread_pool.h"

namespace upswing {
namespace {

constexpr double kRadius = 0.04;  // m

Plant ModeratePlant(Rng& rng) {
  Plant p;
  for (double* x : {&p.mass1, &p.mass2, &p.length1, &p.length2}) *x = rng.Uniform(0.3, 3);
  p.damping1 = rng.Uniform(0, 1);
  p.damping2 = rng.Uniform(0, 1);
  p.gravity = rng.Uniform(1, 20);
  p.torque_limit = rng.Uniform(1, 10);
  return p;
}

/// A ModeratePlant with own centres of mass, inertias and armatures.
Plant ModerateMachine(Rng& rng) {
  Plant p = ModeratePlant(rng);
  for (double* x : {&p.center1, &p.center2}) *x = rng.Uniform(0.1, 3);
  for (double* x : {&p.inertia1, &p.inertia2}) *x = rng.Uniform(0.001, 2);
  p.armature = rng.Uniform(0, 0.1);
  p.armature1 = rng.Uniform(0, 0.1);
  return p;
}

/// The built-in model with a plant written into it at run time.
ModelPtr ModelWith(const Plant& plant) {
  ModelPtr model = CompileModel(Plant());
  WritePlant(plant, FieldsOf(*model));
  const DataPtr data(mj_makeData(model.get()));
  mj_setConst(model.get(), data.get());
  return model;
}

/// Inertia (kg·m²) across a solid capsule by numerical integration: discs along its axis.
double CapsuleInertia(double mass, double length) {
  constexpr int n = 200000;
  const double half = length / 2 + kRadius;
  double volume = 0, moment = 0;
  for (int i = 0; i < n; ++i) {
    const double z = -half + 2 * half * (i + 0.5) / n;
    const double beyond = std::max(0.0, std::abs(z) - length / 2);
    const double r2 = kRadius * kRadius - beyond * beyond;  // squared radius of the disc
    volume += r2;
    moment += r2 * (r2 / 4 + z * z);
  }
  return mass * moment / volume;
}

/// The equations of motion in closed form: M(q) q̈ = τ - c(q, q̇) - g(q) - d q̇, from the energies
/// in absolute link angles, differentiated by hand. I1, I2: moments about the links' centres.
struct ClosedForm {
  Plant p;
  double I1, I2;

  std::array<double, 4> Derivative(const std::array<double, 4>& x, double tau) const {
    const auto [q1, q2, w1, w2] = x;
    const double c1 = p.center1 > 0 ? p.center1 : p.length1 / 2;
    const double c2 = p.center2 > 0 ? p.center2 : p.length2 / 2;
    const double coupling = p.mass2 * p.length1 * c2;
    const double m22 = I2 + p.mass2 * c2 * c2;
    const double m12 = m22 + coupling * std::cos(q2);
    const double m11 = I1 + p.mass1 * c1 * c1 + p.mass2 * p.length1 * p.length1 + m22 +
                       2 * coupling * std::cos(q2);
    const double h = coupling * std::sin(q2);
    const double g2 = p.mass2 * p.gravity * c2 * std::sin(q1 + q2);
    const double g1 = (p.mass1 * c1 + p.mass2 * p.length1) * p.gravity * std::sin(q1) + g2;
    const double f1 = tau + h * (2 * w1 * w2 + w2 * w2) - g1 - p.damping1 * w1;
    const double f2 = -h * w1 * w1 - g2 - p.damping2 * w2;
    const double armature1 = p.armature1 < 0 ? p.armature : p.armature1;
    const double M11 = m11 + armature1, M22 = m22 + p.armature;
    const double det = M11 * M22 - m12 * m12;
    return {w1, w2, (M22 * f1 - m12 * f2) / det, (M11 * f2 - m12 * f1) / det};
  }

  std::array<double, 4> Rk4(const std::array<double, 4>& x, double tau, double h) const {
    const auto along = [&](const std::array<double, 4>& k, double step) {
      std::array<double, 4> y = x;
      for (size_t i = 0; i < 4; ++i) y[i] += step * k[i];
      return y;
    };
    const auto k1 = Derivative(x, tau);
    const auto k2 = Derivative(along(k1, h / 2), tau);
    const auto k3 = Derivative(along(k2, h / 2), tau);
    const auto k4 = Derivative(along(k3, h), tau);
    std::array<double, 4> y = x;
    for (size_t i = 0; i < 4; ++i) y[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
    return y;
  }
};

TEST(Model, HangingHasTheMassMatrixAndInertiasOfTheSpecification) {
  const ModelPtr model = CompileModel(Plant());
  const DataPtr data(mj_makeData(model.get()));
  mj_forward(model.get(), data.get());
  std::array<mjtNum, 4> M{};
  mj_fullM(model.get(), data.get(), M.data());
  EXPECT_NEAR(M[0], 0.686991, 5e-7);
  EXPECT_NEAR(M[1], 0.213495, 5e-7);
  EXPECT_NEAR(M[2], 0.213495, 5e-7);
  EXPECT_NEAR(M[3], 0.098495, 5e-7);
  EXPECT_NEAR(model->body_inertia[3], 0.025995421686746994, 1e-16);
  EXPECT_NEAR(model->body_ipos[5], -0.25, 1e-16);
  EXPECT_EQ(model->opt.timestep, 0.005);
  EXPECT_EQ(model->opt.integrator, mjINT_RK4);
}

TEST(Model, APlantWrittenAtRunTimeEqualsOneThatWasCompiled) {
  Rng rng(1, "plants");
  for (int trial = 0; trial < 20; ++trial) {
    const Plant plant = trial % 2 == 0 ? ModeratePlant(rng) : ModerateMachine(rng);
    const ModelPtr written = ModelWith(plant);
    const ModelPtr compiled = CompileModel(plant);
    const auto same = [](const mjtNum* a, const mjtNum* b, int n) {
      for (int i = 0; i < n; ++i) EXPECT_NEAR(a[i], b[i], 1e-14 * std::max(1.0, std::abs(b[i])));
    };
    const int nbody = static_cast<int>(written->nbody);
    same(written->body_mass, compiled->body_mass, nbody);
    same(written->body_inertia, compiled->body_inertia, 3 * nbody);
    same(written->body_ipos, compiled->body_ipos, 3 * nbody);
    same(written->body_pos, compiled->body_pos, 3 * nbody);
    same(written->body_subtreemass, compiled->body_subtreemass, nbody);
    same(written->body_invweight0, compiled->body_invweight0, 2 * nbody);
    same(written->dof_invweight0, compiled->dof_invweight0, 2);
    same(written->dof_damping, compiled->dof_damping, 2);
    same(written->dof_armature, compiled->dof_armature, 2);
    same(written->actuator_ctrlrange, compiled->actuator_ctrlrange, 2);
    same(written->opt.gravity, compiled->opt.gravity, 3);
  }
}

TEST(Model, MuJoCoStepsLikeTheClosedFormAt100RandomStatesAndPlants) {
  Rng rng(2, "closed form");
  for (int trial = 0; trial < 100; ++trial) {
    const Plant plant = trial % 2 == 0 ? ModeratePlant(rng) : ModerateMachine(rng);
    const ModelPtr model = ModelWith(plant);
    const DataPtr data(mj_makeData(model.get()));
    const ClosedForm closed{plant, model->body_inertia[3], model->body_inertia[6]};
    // The capsule's inertia has its own derivation (midpoint rule, error about 1e-9).
    const double I1 =
        plant.has_own_links() ? plant.inertia1 : CapsuleInertia(plant.mass1, plant.length1);
    EXPECT_NEAR(closed.I1, I1, 1e-8 * closed.I1);

    const std::array<double, 4> x{rng.Uniform(-4, 4), rng.Uniform(-4, 4), rng.Uniform(-8, 8),
                                  rng.Uniform(-8, 8)};
    const double tau = rng.Uniform(-plant.torque_limit, plant.torque_limit);
    std::copy_n(x.data(), 2, data->qpos);
    std::copy_n(x.data() + 2, 2, data->qvel);
    data->ctrl[0] = tau;
    mj_step(model.get(), data.get());
    const auto y = closed.Rk4(x, tau, model->opt.timestep);
    EXPECT_NEAR(data->qpos[0], y[0], 1e-10);
    EXPECT_NEAR(data->qpos[1], y[1], 1e-10);
    EXPECT_NEAR(data->qvel[0], y[2], 1e-10 * std::max(1.0, std::abs(y[2])));
    EXPECT_NEAR(data->qvel[1], y[3], 1e-10 * std::max(1.0, std::abs(y[3])));
  }
}

TEST(Model, DisablingContactsAndConstraintsChangesNoBit) {
  const ModelPtr without = CompileModel(Plant());
  const ModelPtr with = CompileModel(Plant());
  with->opt.disableflags = 0;
  const DataPtr a(mj_makeData(without.get())), b(mj_makeData(with.get()));
  for (int step = 0; step < 2000; ++step) {
    a->ctrl[0] = b->ctrl[0] = 5 * std::sin(0.01 * step);
    mj_step(without.get(), a.get());
    mj_step(with.get(), b.get());
    ASSERT_EQ(a->qpos[0], b->qpos[0]);
    ASSERT_EQ(a->qpos[1], b->qpos[1]);
  }
}

TEST(Model, ThreadsMayCompileAtTheSameTime) {  // for the thread sanitizer
  constexpr int kModels = 16;
  std::vector<ModelPtr> models(kModels);
  ThreadPool pool(4);
  pool.ParallelFor(kModels, [&](int i) {
    Plant plant;
    plant.mass1 = 1 + i;
    models[static_cast<size_t>(i)] = CompileModel(plant);
  });
  for (int i = 0; i < kModels; ++i) {
    EXPECT_EQ(models[static_cast<size_t>(i)]->body_mass[1], 1 + i);
  }
}

}  // namespace
}  // namespace upswing
