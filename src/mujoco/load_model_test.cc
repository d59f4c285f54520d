#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/text.h"
#include "mujoco/model.h"

namespace upswing {
namespace {

/// A pendulum with links of 0.5 and 0.4 m along `direction`, hinges with these attributes, and an
/// actuator on joint1. More attributes and elements by place.
struct Form {
  std::string direction = "0 0 -1", joint1 = "axis=\"0 1 0\"", joint2 = "axis=\"0 1 0\"";
  std::string motor = "motor ctrlrange=\"-5 5\"";
  std::string option, world, base = "pos=\"0 0 2\"", top, link2;

  std::string Mjcf() const {
    const auto along = [&](double length) {
      std::string text;
      for (const char c : direction) text += c == '1' ? FormatNumber(length) : std::string(1, c);
      return text;
    };
    const auto geom = [&](double length, const std::string& attributes) {
      return Concat("<geom type=\"capsule\" size=\"0.04\" ", attributes, " fromto=\"0 0 0 ",
                    along(length), "\"/>");
    };
    return Concat("<mujoco>", top, "<option timestep=\"0.005\" integrator=\"RK4\" ", option,
                  "/><worldbody>", world, "<body ", base,
                  "><joint name=\"a\" damping=\"0.2\" armature=\"0.02\" ", joint1, "/>",
                  geom(0.5, "mass=\"1\""), "<body pos=\"", along(0.5),
                  "\"><joint name=\"b\" damping=\"0.1\" armature=\"0.02\" ", joint2, "/>",
                  geom(0.4, "mass=\"0.8\""), link2, "</body></body></worldbody><actuator><", motor,
                  " joint=\"a\"/></actuator></mujoco>");
  }
};

/// A form of the same pendulum: its name, and the torque (N·m) of a control of 1 in the direction
/// of joint a.
struct Same {
  std::string name;
  double torque;
  Form form;
};

std::vector<Same> SamePendulums() {
  std::vector<Same> forms{{"usual", 1, {}}};
  const auto add = [&](const std::string& name, double torque = 1) -> Form& {
    forms.push_back({name, torque, {}});
    return forms.back().form;
  };
  add("links upwards").direction = "0 0 1";
  add("links sideways").direction = "1 0 0";
  Form& about_minus_y = add("axes along -y");
  about_minus_y.joint1 = about_minus_y.joint2 = "axis=\"0 -1 0\"";
  add("joint 2 about -y").joint2 = "axis=\"0 -1 0\"";
  Form& about_x = add("axes along x");
  about_x.joint1 = about_x.joint2 = "axis=\"1 0 0\"";
  Form& planar = add("gravity along -y");
  planar.joint1 = planar.joint2 = "axis=\"0 0 1\"";
  planar.direction = "0 -1 0";
  planar.option = "gravity=\"0 -9.81 0\"";
  add("gravity upwards").option = "gravity=\"0 0 9.81\"";
  add("a tilted base").base = "pos=\"1 2 3\" euler=\"0 40 0\"";
  Form& ref = add("other reference angles");
  ref.joint1 += " ref=\"50\"";
  ref.joint2 += " ref=\"-20\"";
  add("a gear", 10).motor = "motor gear=\"10\" ctrlrange=\"-0.5 0.5\"";
  add("a negative gear", -10).motor = "motor gear=\"-10\" ctrlrange=\"-0.5 0.5\"";
  add("a general actuator", 10).motor =
      "general gear=\"2\" gainprm=\"5\" ctrlrange=\"-2 2\" forcerange=\"-2.5 2.5\"";
  add("a limit of the force").motor = "motor forcerange=\"-5 5\"";
  add("a limit at the joint").joint1 += " actuatorfrcrange=\"-5 5\"";
  add("a floor below").world = "<geom type=\"plane\" pos=\"0 0 1.05\" size=\"1 1 1\"/><light/>";
  add("a floor without contact").world =
      "<geom type=\"plane\" pos=\"0 0 1.9\" size=\"1 1 1\" contype=\"0\" conaffinity=\"0\"/>";
  Form& no_limit = add("limits that a flag switches off");
  no_limit.joint1 += " range=\"0 90\"";
  no_limit.option = "><flag limit=\"disable\"/></option><option ";
  add("values that are the defaults").option = "wind=\"0 0 0\" density=\"0\" gravity=\"0 0 -9.81\"";
  Form& extras = add("extras");
  extras.top =
      "<compiler autolimits=\"true\"/><size memory=\"400G\" nkey=\"200000000\"/><visual><global "
      "offwidth=\"1280\"/></visual><statistic extent=\"2\"/><custom><numeric name=\"n\" "
      "data=\"2\"/></custom><asset><texture name=\"t\" builtin=\"flat\" width=\"40000\" "
      "height=\"40000\"/><material name=\"m\" texture=\"t\"/></asset><default><geom "
      "material=\"m\"/><default class=\"c\"/></default><contact><exclude body1=\"world\" "
      "body2=\"fixed\"/></contact><keyframe><key qpos=\"1 2\"/></keyframe>";
  extras.world = "<body name=\"fixed\"><geom size=\"0.1\" pos=\"9 0 0\"/><site/></body><camera/>";
  return forms;
}

/// The state after a second of MuJoCo from one state, with a torque that goes beyond the limit.
/// The state's angles are those of the program; `angles` are the model's own, and `control` is the
/// torque of its motor for a control of 1.
std::array<double, 4> After(const mjModel& model, const std::array<JointAngle, 2>& angles,
                            double control) {
  const DataPtr data(mj_makeData(&model));
  const std::array start{1.0, 0.5, -2.0, 3.0};
  for (const int j : {0, 1}) {
    data->qpos[j] = angles[j].Back(start[j]);
    data->qvel[j] = angles[j].sign * start[2 + j];
  }
  for (int step = 0; step < 200; ++step) {
    data->ctrl[0] = (step < 100 ? 3 : -8) / control;
    mj_step(&model, data.get());
  }
  return {angles[0].Of(data->qpos[0]), angles[1].Of(data->qpos[1]), angles[0].sign * data->qvel[0],
          angles[1].sign * data->qvel[1]};
}

TEST(LoadModel, EveryFormOfAPendulumMovesAsInMuJoCoAndAsTheUsualForm) {
  const std::array<double, 4> usual = After(*LoadModel(Form().Mjcf(), "m.xml").model, {}, 1);
  for (const Same& same : SamePendulums()) {
    SCOPED_TRACE(same.name);
    const LoadedModel loaded = LoadModel(same.form.Mjcf(), "m.xml");
    const Plant plant = loaded.plant;
    EXPECT_NEAR(plant.torque_limit, 5, 1e-15);
    EXPECT_NEAR(plant.length2, 0.4, 1e-15);
    EXPECT_FALSE(plant.has_own_links());
    const ModelPtr file = CompileModel(same.form.Mjcf(), "m.xml", true);
    const std::array<double, 4> raw = After(*file, loaded.angles, same.torque);
    const std::array<double, 4> ours = After(*loaded.model, {}, 1);
    for (const int i : {0, 1, 2, 3}) {
      // Rounding grows by the chaos of a second.
      EXPECT_NEAR(ours[i], raw[i], 1e-9);
      EXPECT_NEAR(ours[i], usual[i], 1e-9);
    }
  }
}

TEST(LoadModel, TakesWhatMuJoCoWritesOfAModel) {
  for (const Same& same : SamePendulums()) {
    if (same.name == "extras") continue;  // MuJoCo itself has no memory for them
    SCOPED_TRACE(same.name);
    const std::string mjcf = same.form.Mjcf();
    std::array<char, 500> message{};
    const std::unique_ptr<mjSpec, MuJoCoDeleter> spec(
        mj_parseXMLString(mjcf.c_str(), nullptr, message.data(), message.size()));
    const ModelPtr compiled(mj_compile(spec.get(), nullptr));
    std::string written(20000, '\0');
    ASSERT_EQ(mj_saveXMLString(spec.get(), written.data(), 20000, message.data(), 500), 0);
    written.resize(written.find('\0'));
    const Plant before = LoadModel(mjcf, "m.xml").plant;
    const Plant after = LoadModel(written, "m.xml").plant;
    EXPECT_NEAR(before.mass2, after.mass2, 1e-6);
    EXPECT_NEAR(before.length2, after.length2, 1e-6);
    EXPECT_NEAR(before.torque_limit, after.torque_limit, 1e-6);
  }
}

TEST(LoadModel, SaysHowTheFileCountsItsAngles) {
  Form form;
  form.direction = "0 0 1";
  form.joint2 = "axis=\"0 -1 0\"";
  form.joint2 +=
      " range=\"-90 90\" margin=\"0.1\" solreflimit=\"0.01 1\" frictionloss=\"0.1\" "
      "solreffriction=\"0.03 1\"";
  EXPECT_EQ(Join(DifferencesFromBuiltIn(LoadModel(form.Mjcf(), "m.xml")), ", "),
            "q1 = 3.14159 rad + a, q2 = 0 rad - b, armature1 0.02 kg·m², armature2 0.02 kg·m², "
            "frictionloss2 0.1 N·m, solreffriction2 0.03 1, limit2 1.5707963267948966 rad, "
            "margin2 0.1 rad, solreflimit2 0.01 1");
}

TEST(LoadModel, TakesLinksOfSeveralBodiesAndShapes) {
  Form form;
  form.link2 =
      "<geom type=\"box\" size=\"0.05 0.05 0.05\" pos=\"0 0 -0.5\" mass=\"0.2\"/>"
      "<body pos=\"0 0 -0.4\"><frame pos=\"0 0.2 0\"><geom size=\"0.05\" "
      "mass=\"0.3\"/></frame></body>";
  const Plant plant = LoadModel(form.Mjcf(), "m.xml").plant;
  EXPECT_NEAR(plant.mass2, 1.3, 1e-15);
  EXPECT_NEAR(plant.length2, 0.55, 1e-15);
  EXPECT_NEAR(plant.center2, (0.8 * 0.2 + 0.2 * 0.5 + 0.3 * 0.4) / 1.3, 1e-15);
}

TEST(LoadModel, NamesTheCauseOfARefusal) {
  const auto expect = [](const std::string& words, const auto& change) {
    Form form;
    change(form);
    std::string error;
    try {
      LoadModel(form.Mjcf(), "m.xml");
    } catch (const Error& e) {
      error = e.what();
      EXPECT_EQ(e.exit_code(), 2);
    }
    EXPECT_TRUE(error.starts_with("m.xml:")) << words << ": " << error;
    EXPECT_NE(error.find(words), std::string::npos) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  };
  for (const auto& [joint, words] : std::vector<std::pair<std::string, std::string>>{
           {"type=\"slide\"", "two hinges and no other joint, got a (slide), b (hinge)"},
           {"axis=\"0 0 1\"", "parallel axes"},
           {"axis=\"0 1 0\" stiffness=\"1\" springref=\"10\"", "got 0.174533 rad from there"},
           {"axis=\"0 1 0\" stiffness=\"1 1\"", "a stiffness of several numbers"},
           {"axis=\"0 1 0\" range=\"-80 90\"",
            "limits of a the same both ways from hanging, got"}}) {
    expect(words, [&text = joint](Form& f) { f.joint1 = text; });
  }
  for (const auto& [motor, words] : std::vector<std::pair<std::string, std::string>>{
           {"motor", "a limit of the motor's torque: ctrlrange or forcerange"},
           {"motor ctrlrange=\"0 5\"", "ctrlrange of the motor the same both ways, got 0 to 5"},
           {"motor gear=\"0\" ctrlrange=\"-5 5\"", "a motor on a hinge"},
           {"position kp=\"1\"", "expected <motor>, <general> in <actuator>, got \"position\""},
           {"general biastype=\"affine\" biasprm=\"0 -1 0\" ctrlrange=\"-5 5\"", "no bias"},
           {"motor damping=\"0.5\" ctrlrange=\"-5 5\"", "got a motor with damping"},
           {"general dyntype=\"integrator\" ctrlrange=\"-5 5\"", "got \"integrator\""}}) {
    expect(words, [&text = motor](Form& f) { f.motor = text; });
  }
  for (const auto& [option, words] : std::vector<std::pair<std::string, std::string>>{
           {"gravity=\"0 0 0\"", "gravity across the axes of the hinges, got none"},
           {"gravity=\"0 -9.81 0\"", "gravity across the axes of the hinges, got none"},
           {"density=\"1.2\" wind=\"1 0 0\"", "got wind, air"},
           {"actuatorgroupdisable=\"0\"", "takes no \"actuatorgroupdisable\""}}) {
    expect(words, [&text = option](Form& f) { f.option = text; });
  }
  for (const char* flag : {"gravity", "damper", "actuation", "clampctrl"}) {
    expect("a flag that disables",
           [&](Form& f) { f.option = Concat("><flag ", flag, "=\"disable\"/></option><option "); });
  }
  expect("gravcomp", [](Form& f) { f.base += " gravcomp=\"1\""; });
  expect("geoms floor and", [](Form& f) {
    f.world = "<geom name=\"floor\" type=\"plane\" pos=\"0 0 1.07\" size=\"1 1 1\"/>";
  });
  expect("geoms post and number 2",
         [](Form& f) { f.world = "<geom name=\"post\" size=\"0.05\" pos=\"0 0 2\"/>"; });
  expect("geoms ceiling and", [](Form& f) {  // beyond a limit that is switched off
    f.world =
        "<geom name=\"ceiling\" type=\"plane\" pos=\"0 0 2.7\" zaxis=\"0 0 -1\" size=\"1 1 1\"/>";
    f.joint1 += " range=\"-60 60\"";
    f.joint2 += " range=\"-60 60\"";
    f.option = "><flag limit=\"disable\"/></option><option ";
  });
  expect("two hinges and no other joint, got a (hinge), b (hinge), c (hinge)",
         [](Form& f) { f.link2 = "<body><joint name=\"c\"/><geom size=\"0.1\"/></body>"; });
  expect("the centre of mass of link 1 on the line from its hinge to the second",
         [](Form& f) { f.joint2 += " pos=\"0.1 0 0\""; });
  expect("air around links that are no solid capsules", [](Form& f) {
    f.option = "density=\"1.2\"";
    f.link2 = "<geom size=\"0.1\"/>";
  });
}

}  // namespace
}  // namespace upswing
