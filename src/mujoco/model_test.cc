#include "mujoco/model.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "base/error.h"
#include "base/rng.h"
#include "base/text.h"
#include "base/thread_pool.h"
#include "pendulum/closed_form.h"
#include "pendulum/mjcf.h"

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

/// A ModeratePlant with own centres of mass, inertias and armature.
Plant ModerateMachine(Rng& rng) {
  Plant p = ModeratePlant(rng);
  for (double* x : {&p.center1, &p.center2}) *x = rng.Uniform(0.1, 3);
  for (double* x : {&p.inertia1, &p.inertia2}) *x = rng.Uniform(0.001, 2);
  p.armature = rng.Uniform(0, 0.1);
  return p;
}

/// The built-in model with a plant written into it at run time.
ModelPtr ModelWith(const Plant& plant) {
  ModelPtr model = CompileModel(Mjcf(Plant()), "test");
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
    const double M11 = m11 + p.armature, M22 = m22 + p.armature;
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
  const ModelPtr model = CompileModel(Mjcf(Plant()), "test");
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
    const ModelPtr compiled = CompileModel(Mjcf(plant), "test");
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
    same(written->geom_pos, compiled->geom_pos, 6);
    same(written->geom_size, compiled->geom_size, 6);
    same(written->actuator_ctrlrange, compiled->actuator_ctrlrange, 2);
    same(written->opt.gravity, compiled->opt.gravity, 3);

    const Plant back = LoadModel(Mjcf(plant), "test").plant;
    EXPECT_NEAR(back.length2, plant.length2, 1e-15);
    EXPECT_EQ(back.mass1, plant.mass1);
    EXPECT_NEAR(back.center1, plant.center1, 1e-15);
    EXPECT_NEAR(back.inertia2, plant.inertia2, 1e-13);
    EXPECT_EQ(back.torque_limit, plant.torque_limit);
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
  const ModelPtr without = CompileModel(Mjcf(Plant()), "test");
  const ModelPtr with = CompileModel(Mjcf(Plant()), "test");
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
    models[static_cast<size_t>(i)] = CompileModel(Mjcf(plant), "test");
  });
  for (int i = 0; i < kModels; ++i) {
    EXPECT_EQ(models[static_cast<size_t>(i)]->body_mass[1], 1 + i);
  }
}

TEST(Model, BrokenMjcfGivesMuJoCosMessage) {
  const auto error_of = [](const std::string& mjcf) -> std::string {
    try {
      LoadModel(mjcf, "file.xml");
    } catch (const Error& error) {
      EXPECT_EQ(error.exit_code(), 2);
      return error.what();
    }
    return "";
  };
  EXPECT_NE(error_of("<mujoco><worldbody><sphere/></worldbody></mujoco>").find("sphere"),
            std::string::npos);
  EXPECT_NE(error_of("<mujoco"), "");
  EXPECT_NE(error_of("<mujoco/>").find("expected a double pendulum"), std::string::npos);
  EXPECT_EQ(error_of(Mjcf(Plant())), "");
}

TEST(Model, RefusesAPlantBeyondTheRangesOfItsSettings) {
  const auto error_of = [](const std::string& from, const std::string& to) -> std::string {
    std::string mjcf = Mjcf(Plant());
    mjcf.replace(mjcf.find(from), from.size(), to);
    try {
      LoadModel(mjcf, "m.xml");
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(error_of("mass=\"1\"", "mass=\"100\""), "");
  EXPECT_NE(error_of("mass=\"1\"", "mass=\"101\"").find("m.xml: mass1: expected"),
            std::string::npos);
  EXPECT_NE(error_of("0 0 -9.81", "0 0 -981").find("m.xml: gravity: expected"), std::string::npos);
  EXPECT_NE(error_of("damping=\"0.2\"", "damping=\"101\"").find("damping1"), std::string::npos);
  EXPECT_NE(error_of("\"-5 5\"", "\"-5000 5000\"").find("torque_limit"), std::string::npos);
}

/// The built-in model with an `inertial` in link 2.
std::string WithInertial(const std::string& attributes) {
  std::string mjcf = Mjcf(Plant());
  const std::string body = "<body name=\"link2\" pos=\"0 0 -0.5\">";
  mjcf.insert(mjcf.find(body) + body.size(), Concat("<inertial ", attributes, "/>"));
  return mjcf;
}

TEST(Model, TakesCentreOfMassAndInertiaFromAFile) {
  // The same body: by its principal moments, in a turned frame, and by a tensor.
  for (const char* attributes :
       {R"(mass="1.2" pos="0 0 -0.4" diaginertia="0.02 0.03 0.015")",
        R"(mass="1.2" pos="0 0 -0.4" euler="0 0 90" diaginertia="0.03 0.02 0.015")",
        R"(mass="1.2" pos="0 0 -0.4" fullinertia="0.02 0.03 0.015 0 0 0")"}) {
    const Plant plant = LoadModel(WithInertial(attributes), "m.xml").plant;
    EXPECT_EQ(plant.mass2, 1.2);
    EXPECT_NEAR(plant.center2, 0.4, 1e-15) << attributes;
    EXPECT_NEAR(plant.inertia2, 0.03, 1e-15) << attributes;
    EXPECT_EQ(plant.center1, 0);
    EXPECT_EQ(plant.inertia1, 0);
  }
}

TEST(Model, AFileWithOwnLinksMovesLikeItsPlantInTheClosedForm) {
  const std::string mjcf =
      WithInertial(R"(mass="1.2" pos="0 0 -0.4" diaginertia="0.02 0.03 0.01")");
  const auto [model, plant, angles] = LoadModel(mjcf, "m.xml");
  const DataPtr data(mj_makeData(model.get()));
  mj_setConst(model.get(), data.get());
  ClosedFormBatch batch(1);
  batch.SetPlant(0, plant);
  batch.SetState(0, {1, 0.5, -2, 3});
  std::copy_n(std::array{1.0, 0.5}.data(), 2, data->qpos);
  std::copy_n(std::array{-2.0, 3.0}.data(), 2, data->qvel);
  for (int step = 0; step < 20; ++step) mj_step(model.get(), data.get());
  Advance(batch, 20, 0, 1);
  EXPECT_NEAR(data->qpos[0], batch.q1[0], 1e-11);
  EXPECT_NEAR(data->qpos[1], batch.q2[0], 1e-11);
}

TEST(Model, RefusesALinkThatHasNoDirection) {
  const auto error_of = [](const std::string& attributes) -> std::string {
    try {
      LoadModel(WithInertial(attributes), "m.xml");
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  const std::string tensor = R"( mass="1" diaginertia="0.02 0.02 0.015")";
  EXPECT_EQ(error_of(R"(pos="0 0 -0.4")" + tensor), "");
  EXPECT_NE(error_of(R"(pos="0 0 0")" + tensor).find("the centre of mass of link 2"),
            std::string::npos);
}

TEST(Model, RefusesInAirPropertiesThatOnlyAirFeels) {
  const auto loads = [](const std::string& moments) {
    std::string mjcf =
        WithInertial(Concat("mass=\"1\" pos=\"0 0 -0.4\" diaginertia=\"", moments, "\""));
    const std::string option = "<option ";
    mjcf.insert(mjcf.find(option) + option.size(), "density=\"1.2\" ");
    try {
      LoadModel(mjcf, "m.xml");
      return true;
    } catch (const Error&) {
      return false;
    }
  };
  const std::string along = FormatNumber(upswing::CapsuleInertia(1.0, 0.04, 0.5).along);
  EXPECT_TRUE(loads("0.03 0.03 " + along));
  EXPECT_FALSE(loads("0.02 0.03 " + along));
}

TEST(Model, AFileKeepsItsOwnArmature) {
  const ModelPtr model = LoadModel(Mjcf(Plant()), "m.xml").model;
  Plant plant;
  plant.armature = 0.02;
  EXPECT_NO_THROW(WritePlant(Plant(), FieldsOf(*model, false)));
  EXPECT_THROW(WritePlant(plant, FieldsOf(*model, false)), Error);
  EXPECT_NO_THROW(WritePlant(plant, FieldsOf(*model)));
  EXPECT_EQ(model->dof_armature[1], 0.02);
}

TEST(Model, RefusesPropertiesOutsideThePlantsParameters) {
  const auto loads = [](const std::string& from, const std::string& to) {
    std::string mjcf = Mjcf(Plant());
    mjcf.replace(mjcf.find(from), from.size(), to);
    try {
      LoadModel(mjcf, "file.xml");
      return true;
    } catch (const Error&) {
      return false;
    }
  };
  EXPECT_TRUE(loads("armature=\"0.01\"", "armature=\"0.02\" stiffness=\"0.1\""));
  EXPECT_TRUE(loads("armature=\"0.01\"", "armature=\"0.02\" springref=\"10\""));  // no spring
  EXPECT_FALSE(loads("axis=\"0 1 0\"", "axis=\"0 1 0\" stiffness=\"0.1\" springref=\"10\""));
  EXPECT_TRUE(loads("RK4", "implicit"));
  EXPECT_FALSE(loads("ctrlrange=\"-5", "ctrlrange=\"-4"));
  EXPECT_FALSE(loads("0.005", "0.003"));
  EXPECT_TRUE(loads("axis=\"0 1 0\"", "axis=\"0 1 0\" limited=\"true\" range=\"-90 90\""));
  // The built-in model disables constraints.
  EXPECT_TRUE(loads("axis=\"0 1 0\"", "axis=\"0 1 0\" limited=\"true\" range=\"-90 80\""));
}

/// A text with `from` replaced by `to` wherever it occurs.
std::string With(std::string text, const std::string& from, const std::string& to) {
  for (size_t at = 0; (at = text.find(from, at)) != text.npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

/// The joint angles of a model that MuJoCo lets fall from 1.5 rad for a second.
std::array<mjtNum, 2> Fallen(const mjModel& model) {
  const DataPtr data(mj_makeData(&model));
  data->qpos[0] = 1.5;
  while (data->time < 1) mj_step(&model, data.get());
  return {data->qpos[0], data->qpos[1]};
}

TEST(Model, DifferencesThatActChangeMuJoCosMotionAndOthersDoNot) {
  const std::string range = " range=\"-60 60\"", friction = " frictionloss=\"0.3\"";
  const auto flag = [](const std::string& name) { return " " + name + "=\"disable\""; };
  struct Change {
    std::string joint, flags, integrator, geom, differences;
  };
  const std::string limits =
      "limit1 1.0471975511965976 rad (link 1 cannot stand upright)|limit2 1.0471975511965976 rad";
  const std::string losses = "frictionloss1 0.3 N·m|frictionloss2 0.3 N·m";
  const std::string off = " (switched off by a flag)";
  const auto both_off = [&](const std::string& both) { return With(both, "|", off + "|") + off; };
  const std::string inertial =
      "<inertial pos=\"0 0 -0.2\" mass=\"1\" diaginertia=\"0.03 0.03 0.001\"/><geom size=\"0.04\"";
  const std::vector<Change> changes{
      {range, "", "RK4", "", limits},
      {range, flag("limit"), "RK4", "",
       both_off(With(limits, " (link 1 cannot stand upright)", ""))},
      {range, flag("frictionloss"), "RK4", "", limits},
      {range, flag("constraint"), "RK4", "",
       both_off(With(limits, " (link 1 cannot stand upright)", ""))},
      {range + " limited=\"false\"", "", "RK4", "", ""},
      {friction, "", "RK4", "", losses},
      {friction, flag("limit"), "RK4", "", losses},
      {friction, flag("frictionloss"), "RK4", "", both_off(losses)},
      {friction, flag("constraint"), "RK4", "", both_off(losses)},
      {" damping=\"0\"", flag("eulerdamp"), "Euler", "", "integrator Euler"},
      {" damping=\"0.2\"", flag("eulerdamp"), "Euler", "", "integrator Euler|eulerdamp off"},
      {"", flag("eulerdamp"), "RK4", "", ""},
      {"", flag("warmstart") + flag("midphase"), "RK4", "", ""},
      {"", "", "RK4", "<geom size=\"0.05\"", "radius1 0.05 m|radius2 0.05 m"},
      {"", "", "RK4", With(inertial, "0.04", "0.05"), ""}};
  std::string bare = With(Mjcf(Plant()), " constraint=\"disable\"", "@flags");
  bare = With(bare, " damping=\"0.2\"", "");
  bare = With(bare, "<geom type=\"capsule\" size=\"0.04\"", "@geom type=\"capsule\"");
  const auto model_of = [&](const Change& c) {
    std::string mjcf = With(bare, "@flags", c.flags);
    mjcf = With(mjcf, "@geom", c.geom.empty() ? "<geom size=\"0.04\"" : c.geom);
    mjcf = With(mjcf, "axis=\"0 1 0\"", "axis=\"0 1 0\"" + c.joint);
    return With(mjcf, "RK4", c.integrator);
  };
  const auto fallen = [](const std::string& mjcf) {
    return Fallen(*LoadModel(mjcf, "m.xml").model);
  };
  for (const Change& change : changes) {
    const std::string mjcf = model_of(change);
    const std::string told = Join(DifferencesFromBuiltIn(LoadModel(mjcf, "m.xml")), "|");
    EXPECT_EQ(told, change.differences);
    Change plain = change;
    plain.flags = "";
    if (plain.joint.find("damping") == std::string::npos) plain.joint = "";
    plain.geom = change.geom.empty() || told.starts_with("radius") ? "" : inertial;
    const bool acts = !told.empty() && told != "integrator Euler" && told.find(off) == told.npos;
    EXPECT_EQ(fallen(mjcf) != fallen(model_of(plain)), acts) << told << change.flags;
  }
}

}  // namespace
}  // namespace upswing
