#include "mujoco/mjcf_check.h"

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "mujoco/model.h"
#include "pendulum/mjcf.h"
#include "pendulum/plant.h"

namespace upswing {
namespace {

/// The built-in model with the first occurrence of `from` replaced by `to`.
std::string Changed(const std::string& from, const std::string& to) {
  std::string mjcf = Mjcf(Plant());
  return mjcf.replace(mjcf.find(from), from.size(), to);
}

/// The message that `check` throws; empty if it throws nothing.
std::string ErrorOf(
    const std::string& mjcf,
    const std::function<void(const std::string&, const std::string&)>& check = CheckMjcf) {
  try {
    check(mjcf, "m.xml");
  } catch (const Error& error) {
    EXPECT_EQ(error.exit_code(), 2);
    return error.what();
  }
  return "";
}

/// Expects one short line that begins with the file's name and contains `words`.
void ExpectRefused(const std::string& mjcf, const std::string& words) {
  const std::string error = ErrorOf(mjcf);
  EXPECT_TRUE(error.starts_with("m.xml:")) << error;
  EXPECT_NE(error.find(words), std::string::npos) << error;
  EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  EXPECT_LT(error.size(), 600U) << error;
}

TEST(MjcfCheck, TakesTheBuiltInModelOfAnyPlant) {
  EXPECT_EQ(ErrorOf(Mjcf(Plant())), "");
  Plant plant;
  plant.mass1 = 0.01;
  plant.length2 = 10;
  plant.gravity = 100;
  plant.torque_limit = 1000;
  EXPECT_EQ(ErrorOf(Mjcf(plant)), "");
}

// Hand-written variants that MuJoCo accepts and that are double pendulums.
TEST(MjcfCheck, AcceptsHandWrittenModels) {
  const std::string mjcf =
      "\xef\xbb\xbf"
      R"(<?xml version="1.0" encoding="utf-8"?>
<!-- A double pendulum: θ1, θ2. -->
<mujoco model="own">
  <compiler angle="radian" autolimits="true" coordinate="local" inertiafromgeom="true"/>
  <option timestep="0.002" integrator="implicitfast" gravity="0 0 -9.81" iterations="50"
          solver="Newton" tolerance="1e-10" density="1.2" viscosity="0.00002">
    <flag contact="disable" warmstart="enable"/>
  </option>
  <default>
    <joint type="hinge" axis="0 1 0" damping="0.1" armature="0.02" frictionloss="0.01"/>
    <geom type="capsule" size=".03" rgba="0.8 0.6 0.4 1" mass="1" contype="0" conaffinity="0"/>
    <default class="strong"><motor ctrlrange="-6 6"/></default>
  </default>
  <worldbody>
    <light name="sun" pos="0 0 3" dir="0 0 -1" directional="true" diffuse="1 1 1"/>
    <camera name="side" pos="0 -3 0" xyaxes="1 0 0 0 0 1" fovy="45"/>
    <site name="pivot" size="0.01"/>
    <body name="upper" pos="0 0 0">
      <joint name="shoulder" range="-9 9"/>
      <geom name="arm" fromto="0 0 0  0 0 -0.6"/>
      <body name="lower" pos="0 0 -.6">
        <joint name="elbow" stiffness="0.01"/>
        <geom name="forearm" fromto="0 0 0  0 0 -0.4"/>
        <site name="tip" pos="0 0 -0.4" size="0.01" rgba="1 0 0 1"/>
      </body>
    </body>
  </worldbody>
  <contact><exclude body1="upper" body2="lower"/></contact>
  <actuator><motor name="m" class="strong" joint="shoulder" gear="1"/></actuator>
  <sensor><jointpos joint="shoulder"/><jointvel name="w" joint="elbow"/></sensor>
  <keyframe><key name="up" qpos="3.1416 0" qvel="0 0" ctrl="0"/></keyframe>
</mujoco>
)";
  EXPECT_EQ(ErrorOf(mjcf), "");
  const LoadedModel model = LoadModel(mjcf, "m.xml");
  EXPECT_EQ(model.plant.torque_limit, 6);
  const std::vector<std::string> differences = DifferencesFromBuiltIn(model);
  const std::vector<std::string> expected{"timestep 0.002 s",       "integrator implicitfast",
                                          "density 1.2 kg/m³",      "viscosity 2e-05 Pa·s",
                                          "radius1 0.03 m",         "armature1 0.02 kg·m²",
                                          "frictionloss1 0.01 N·m", "limit1 9 rad",
                                          "radius2 0.03 m",         "armature2 0.02 kg·m²",
                                          "frictionloss2 0.01 N·m", "stiffness2 0.01 N·m/rad"};
  EXPECT_EQ(differences, expected);
  EXPECT_TRUE(DifferencesFromBuiltIn(LoadModel(Mjcf(Plant()), "m.xml")).empty());
}

TEST(MjcfCheck, NamesTheUnexpectedElementAndItsPlace) {
  ExpectRefused(Changed("<motor ", "<moter "), "did you mean motor?");
  for (const std::string element : {"extension", "deformable", "tendon", "equality", "option2"}) {
    ExpectRefused(Changed("<worldbody>", "<" + element + "/><worldbody>"),
                  "m.xml:5: expected <compiler>, <option>");
  }
  for (const std::string place : {"<worldbody>", "<body name=\"link1\">", "<actuator>"}) {
    ExpectRefused(Changed(place, place + "<include file=\"a.xml\"/>"), "without <include>");
  }
  ExpectRefused("<mujoco><visual><map><include/></map></visual></mujoco>", "without <include>");
  for (const std::string element :
       {"replicate count=\"100000\"", "attach", "flexcomp", "composite", "plugin", "freejoint"}) {
    ExpectRefused(Changed("<body name=\"link1\">", "<" + element + "/><body name=\"link1\">"),
                  "m.xml:6: expected <body>");
  }
  ExpectRefused("<robot/>", "m.xml:1: expected <mujoco>, got \"robot\"");
  ExpectRefused("<mujocoinclude/>", "m.xml:1: expected <mujoco>");
  ExpectRefused("<mujoco><option>\n<option/></option></mujoco>",
                "m.xml:2: expected <flag> in <opt");
  ExpectRefused("<mujoco/>\n<robot/>", "m.xml:2: expected one <mujoco>, got \"robot\"");
  ExpectRefused("<mujoco/>\n<mujoco/>", "m.xml:2: expected one <mujoco>");
}

TEST(MjcfCheck, NamesTheUnexpectedAttributeAndItsPlace) {
  const std::string joint = "<joint name=\"joint1\"";
  ExpectRefused(Changed(joint, "<joint user=\"1\" name=\"joint1\""),
                "m.xml:7: <joint> takes no \"user\" here");
  ExpectRefused(Changed("damping=", "dampng="), "did you mean damping?");
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
           {"<motor ", "<motor nsample=\"200000000\" "},  // would allocate a buffer of that size
           {"<motor ", "<motor delay=\"0.1\" "},
           {"<motor ", "<motor user=\"1 2\" "},
           {"<body name=\"link2\"", "<body mocap=\"true\" name=\"link2\""},
           {"<body name=\"link2\"", "<body sleep=\"allowed\" name=\"link2\""},
           {"<option ", "<option actuatorgroupdisable=\"1\" "},
           {"<flag ", "<flag sleep=\"enable\" "},
           {"<geom ", "<geom mesh=\"m\" "},
           {"<worldbody>", "<size nuserdata=\"200000000\"/><worldbody>"},
           {"<worldbody>", "<size nuser_body=\"200000000\"/><worldbody>"}}) {
    ExpectRefused(Changed(from, to), " takes no ");
  }
}

// Errors that this check leaves to MuJoCo and to LoadModel.
TEST(MjcfCheck, LoadModelRefusesEveryOtherNumberAndWord) {
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
           {"\"0.005\"", "\"1e-9\""},
           {"\"0.005\"", "\"0.005 0.005\""},
           {"\"0.005\"", "\"Euler\""},
           {"<option ", "<option iterations=\"1000000\" "},
           {"<option ", "<option ls_iterations=\"1000000\" "},
           {"<option ", "<option ls_iterations=\"0\" "},
           {"<option ", "<option density=\"-1\" "},
           {"<option ", "<option viscosity=\"-1\" "},
           {"armature=\"0.01\"", "armature=\"-0.01\""},
           {"damping=\"0.2\"", "damping=\"-0.2\""},
           {"damping=\"0.2\"", "damping=\"0.2 -1\""},
           {"damping=\"0.2\"", "damping=\"0.2 1\""},
           {"damping=", "stiffness=\"-1\" damping="},
           {"damping=", "stiffness=\"0 1\" damping="},
           {"damping=", "frictionloss=\"-1\" damping="},
           {"0 0 0 0 0 -0.5", "0 0 0 0 0 -0.5 1"},
           {"0 0 -9.81", "0 0"},
           {"size=\"0.04\"", "size=\"0.04 1 1 1\""},
           {"type=\"hinge\"", "type=\"capsule\""},
           {"RK4", "PGS"}}) {
    const std::string error =
        ErrorOf(Changed(from, to),
                [](const std::string& mjcf, const std::string& where) { LoadModel(mjcf, where); });
    EXPECT_TRUE(error.starts_with("m.xml: ")) << to << ": " << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  }
}

TEST(MjcfCheck, BoundsEveryNumber) {
  for (const auto& [from, to, words] : std::vector<std::array<std::string, 3>>{
           {"\"0.005\"", "\"nan\"", "<option> timestep: expected numbers within 1000000"},
           {"\"0.005\"", "\"\"", "timestep"},
           {"\"0.005\"", "\"0.005x\"", "timestep"},
           {"\"0.005\"", "\"0x1p900\"", "timestep"},
           {"<option ", "<option iterations=\"1000000000\" ", "got \"1000000000\""},
           {"armature=\"0.01\"", "armature=\"inf\"", "armature"},
           {"armature=\"0.01\"", "armature=\"-Infinity\"", "armature"},
           {"armature=\"0.01\"", "armature=\"1e300\"", "armature"},
           {"damping=\"0.2\"", "damping=\"0.2 NaN\"", "damping"},
           {"type=\"hinge\"", "type=\"screw\"", "or a keyword of MJCF, got \"screw\""},
           {"type=\"capsule\"", "type=\"hfield\"", "type"},
           {"RK4", "rk4", "integrator"}}) {
    ExpectRefused(Changed(from, to), words);
  }
}

TEST(MjcfCheck, RefusesOtherTextThanPlainXml) {
  ExpectRefused("", "m.xml:");
  ExpectRefused("no XML at all", "not well-formed XML");
  ExpectRefused("<mujoco>\n<worldbody>", "not well-formed XML");
  ExpectRefused("<mujoco>\n<option></mujoco>", "m.xml:2: not well-formed XML: mismatched element");
  ExpectRefused("<mujoco a='1' a='2'/>", "not well-formed XML");
  ExpectRefused("<!-- nothing -->", "expected <mujoco>");
  ExpectRefused("<mujoco>\ntext</mujoco>", "expected only elements and comments, got");
  ExpectRefused("<mujoco><![CDATA[text]]></mujoco>", "expected only elements and comments");
  // Nested entities, each ten times the previous one; the parser must not expand them.
  ExpectRefused(
      "<!DOCTYPE m [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;&a;\">]>\n"
      "<mujoco model=\"&b;\"/>",
      "m.xml:1: expected only elements and comments");
  ExpectRefused(Mjcf(Plant()) + std::string(1, '\0'), "UTF-8 text without control characters");
  ExpectRefused("<mujoco model=\"\x1b[2J\"/>", "without control characters");
  ExpectRefused("<mujoco model=\"&#27;[2J\"/>", "model: expected a name");
  ExpectRefused("<mujoco model=\"\xff\xfe\"/>", "UTF-8");
}

TEST(MjcfCheck, BoundsTextNamesElementsAndNesting) {
  const std::string ours = Mjcf(Plant());
  const std::string blanks(kMostMjcfBytes - ours.size(), ' ');
  EXPECT_EQ(ErrorOf(ours + blanks), "");
  ExpectRefused(ours + blanks + " ", "at most 65536 bytes, got 65537");
  const std::string name(60000, 'a');
  ExpectRefused("<mujoco model=\"" + name + "\"/>", "a name of at most 100 bytes");
  ExpectRefused("<mujoco " + name + "=\"1\"/>", "takes no \"aaaa");
  ExpectRefused("<" + name + "/>", "expected <mujoco>, got \"aaaa");
  ExpectRefused("<mujoco><option gravity=\"" + std::string(60000, '1') + "\"/></mujoco>",
                "gravity: expected numbers");
  std::string many = "<mujoco><worldbody>", nested = many, deep;
  for (int i = 0; i < 5000; ++i) many += "<light/>";
  ExpectRefused(many + "</worldbody></mujoco>", "at most 200 elements");
  for (int i = 0; i < 50; ++i) nested += "<body>";
  for (int i = 0; i < 50; ++i) nested += "</body>";
  ExpectRefused(nested + "</worldbody></mujoco>", "nested at most 10 deep");
  for (int i = 0; i < 20000; ++i) deep += "<a>";
  ExpectRefused(deep, "not well-formed XML");
}

}  // namespace
}  // namespace upswing
