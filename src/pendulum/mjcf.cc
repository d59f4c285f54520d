#include "pendulum/mjcf.h"

#include <algorithm>

#include "base/text.h"

namespace upswing {

std::string Mjcf(const Plant& plant) {
  // The model has no contacts and no constraints. Disabling these stages saves time and does not
  // change the trajectory.
  std::string mjcf = R"(<mujoco model="double_pendulum">@size
  <option gravity="0 0 -@gravity" timestep="0.005" integrator="RK4">
    <flag contact="disable" constraint="disable"/>
  </option>
  <worldbody>
    <body name="link1">
      <joint name="joint1" type="hinge" axis="0 1 0" damping="@damping1" armature="@armature1"@friction1/>@inertial1
      <geom type="capsule" size="@radius1" fromto="0 0 0 0 0 -@length1" mass="@mass1"/>
      <body name="link2" pos="0 0 -@length1">
        <joint name="joint2" type="hinge" axis="0 1 0" damping="@damping2" armature="@armature"@friction2/>@inertial2
        <geom type="capsule" size="@radius2" fromto="0 0 0 0 0 -@length2" mass="@mass2"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="torque@actuated_joint" joint="joint@actuated_joint" ctrllimited="true" ctrlrange="-@torque_limit @torque_limit"/>
  </actuator>@tendon
</mujoco>
)";
  // @name stands for the parameter of this name, or for a part defined below.
  const auto fill = [&](const std::string& field, const std::string& text) {
    mjcf = Replaced(mjcf, field, text);
  };
  const bool rotors = plant.rotor_inertia != 0, friction = plant.has_dry_friction();
  fill("@armature1", FormatNumber(Armature1(plant)));
  fill("@tendon", rotors ? R"(
  <tendon>
    <fixed name="rotor2" armature="@rotor_inertia">
      <joint joint="joint1" coef="1"/>
      <joint joint="joint2" coef="-@gear_ratio"/>
    </fixed>
  </tendon>)"
                         : "");
  fill("@size", friction ? "\n  <size nuser_jnt=\"1\"/>" : "");
  for (const std::string joint : {"1", "2"}) {
    fill("@friction" + joint,
         friction ? Concat(" frictionloss=\"@coulomb", joint, "\" user=\"", kFrictionSlope, '"')
                  : "");
  }
  const auto inertial = [&](const Link& link, const std::string& indent) {
    // The moment of inertia about the link's axis moves nothing. MuJoCo takes at most twice I.
    const double along =
        std::min(CapsuleInertia(link.m, CapsuleRadius(link.l), link.l).along, link.I);
    const std::string I = FormatNumber(link.I);
    return Concat(indent, "<inertial pos=\"0 0 -", FormatNumber(link.c), "\" mass=\"",
                  FormatNumber(link.m), "\" diaginertia=\"", I, ' ', I, ' ', FormatNumber(along),
                  "\"/>");
  };
  const auto [link1, link2] = LinksOf(plant);
  fill("@radius1", FormatNumber(CapsuleRadius(plant.length1)));
  fill("@radius2", FormatNumber(CapsuleRadius(plant.length2)));
  fill("@inertial1", plant.has_own_links() ? inertial(link1, "\n      ") : "");
  fill("@inertial2", plant.has_own_links() ? inertial(link2, "\n        ") : "");
  const Options options = OptionsOf(plant);
  for (const Option& option : options.all()) fill("@" + option.name, option.text());
  return mjcf;
}

}  // namespace upswing
