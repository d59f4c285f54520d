#include "extras/view/pendulum_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/text.h"

namespace upswing {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kMostGeoms = 2000;
using Point = std::array<double, 3>;
using Color = std::array<float, 4>;  // red, green, blue, opacity

constexpr Color kTorqueColor{0.96F, 0.55F, 0.10F, 1}, kTrailColor{0.95F, 0.50F, 0.15F, 0.8F},
    kGoalColor{0.45F, 0.55F, 0.65F, 0.55F}, kReachedColor{0.20F, 0.75F, 0.35F, 0.9F};

/// The model to draw; @name stands for a number. The links are the plant's, with the pivot at the
/// origin; the rest is the room around them.
constexpr const char* kTemplate = R"(<mujoco model="picture">
  <option gravity="0 0 -@gravity"/>
  <visual>
    <headlight ambient="0.38 0.38 0.38" diffuse="0.25 0.25 0.25" specular="0.05 0.05 0.05"/>
    <quality shadowsize="1024" offsamples="4"/>
    <map znear="0.02" zfar="60" force="0.08" shadowclip="1.6"/>
    <rgba haze="0.86 0.90 0.94 1" force="0.85 0.20 0.55 1"/>
    <scale forcewidth="0.04"/>
    <global fovy="40"/>
  </visual>
  <statistic extent="@reach" center="0 0 0"/>
  <asset>
    <texture type="skybox" builtin="gradient" rgb1="0.96 0.97 0.99" rgb2="0.66 0.75 0.84" width="64"
             height="384"/>
    <texture name="floor" type="2d" builtin="checker" mark="edge" rgb1="0.80 0.83 0.86"
             rgb2="0.74 0.77 0.81" markrgb="0.66 0.70 0.74" width="256" height="256"/>
    <material name="floor" texture="floor" texuniform="true" texrepeat="@tiles @tiles"
              specular="0.2" shininess="0.2"/>
    <material name="link1" rgba="0.13 0.30 0.52 1" specular="0.5" shininess="0.6"/>
    <material name="link2" rgba="0.22 0.52 0.80 1" specular="0.5" shininess="0.6"/>
    <material name="metal" rgba="0.62 0.65 0.69 1" specular="0.6" shininess="0.5"/>
    <material name="motor" rgba="0.24 0.27 0.31 1" specular="0.5" shininess="0.5"/>
  </asset>
  <worldbody>
    <light directional="true" pos="@l1x @l1y @l1z" dir="0.35 0.55 -1" diffuse="0.62 0.62 0.60"
           specular="0.25 0.25 0.25" castshadow="true"/>
    <geom type="plane" pos="0 0 @floor" size="0 0 1" material="floor"/>
    <geom type="box" pos="0 @back @post" size="@thin @thin @height" material="metal"/>
    <geom type="box" pos="0 @back @foot" size="@wide @wide @thin" material="metal"/>
    <geom type="cylinder" fromto="0 @near 0 0 @back 0" size="@housing" material="motor"/>
    <body name="link1">
      <joint type="hinge" axis="0 1 0" damping="@damping1" armature="0.01"/>
      <geom type="capsule" size="@radius1" fromto="0 0 0 0 0 -@length1" mass="@mass1"
            material="link1"/>
      <geom type="cylinder" size="@pin1" fromto="0 -@end1 0 0 @end1 0" mass="0" material="metal"/>
      <body name="link2" pos="0 0 -@length1">
        <joint type="hinge" axis="0 1 0" damping="@damping2" armature="0.01"/>
        <geom type="capsule" size="@radius2" fromto="0 0 0 0 0 -@length2" mass="@mass2"
              material="link2"/>
        <geom type="cylinder" size="@pin2" fromto="0 -@end2 0 0 @end2 0" mass="0"
              material="metal"/>
      </body>
    </body>
  </worldbody>
</mujoco>
)";

/// The template with each @name replaced by its value.
std::string Fill(const std::vector<std::pair<std::string, double>>& values) {
  std::string text = kTemplate;
  for (const auto& [name, value] : values) {
    text = Replaced(std::move(text), "@" + name, FormatNumber(value));
  }
  return text;
}

/// The links' radii (m): from the model file if there is one.
std::array<double, 2> RadiiOf(const std::string& mjcf) {
  if (mjcf.empty()) return {kCapsuleRadius, kCapsuleRadius};
  const ModelPtr model = LoadModel(mjcf, "model");
  return {model->geom_size[0], model->geom_size[3]};
}

/// Compiles the model to draw. A share of `reach` (m) limits the radii, because a larger link would
/// hide everything else.
ModelPtr MakeModel(const Plant& plant, const std::string& mjcf, double reach) {
  const auto [given1, given2] = RadiiOf(mjcf);
  const double most = 0.15 * reach;
  const double radius1 = std::clamp(given1, 1e-3, most), radius2 = std::clamp(given2, 1e-3, most);
  const double wider = std::max(radius1, radius2);
  const double floor = -1.15 * reach, back = 0.32 * reach, thin = 0.035 * reach;
  std::vector<std::pair<std::string, double>> values = PlantValues(plant);
  const std::vector<std::pair<std::string, double>> more{
      {"reach", reach},
      {"tiles", 1.0 / reach},
      {"floor", floor},
      {"l1x", -0.7 * reach},
      {"l1y", -1.1 * reach},
      {"l1z", 2.0 * reach},
      {"back", back},
      {"post", (floor + thin) / 2},
      {"height", (thin - floor) / 2},
      {"thin", thin},
      {"foot", floor + thin},
      {"wide", 0.16 * reach},
      {"near", wider + 0.01 * reach},
      {"housing", std::max(1.25 * radius1, 0.05 * reach)},
      {"radius1", radius1},
      {"radius2", radius2},
      {"pin1", 0.55 * radius1},
      {"pin2", 0.55 * std::min(radius1, radius2)},
      {"end1", 1.12 * radius1},
      {"end2", 1.12 * wider}};
  values.insert(values.end(), more.begin(), more.end());
  return CompileModel(Fill(values), "picture");
}

/// Adds a shape between two points, at depth y in front of or behind the plane of motion. Does
/// nothing if the scene is full.
void Add(mjvScene& scene, mjtGeom type, double width, const Point& from, const Point& to,
         const Color& color, float emission) {
  if (scene.ngeom >= scene.maxgeom) return;
  mjvGeom& geom = scene.geoms[scene.ngeom++];
  mjv_initGeom(&geom, type, nullptr, nullptr, nullptr, color.data());
  mjv_connector(&geom, type, width, from.data(), to.data());
  geom.category = mjCAT_DECOR;
  geom.emission = emission;
  geom.castshadow = 0;
  geom.specular = 0.1F;
}

/// A point at a distance from the pivot; the angle grows as the joints' angles do.
Point OnCircle(double radius, double angle, double depth) {
  return {-radius * std::sin(angle), depth, -radius * std::cos(angle)};
}

}  // namespace

PendulumScene::PendulumScene(const Plant& plant, const std::string& mjcf, double reach)
    : plant_(plant),
      reach_(std::max(reach, plant.length1 + plant.length2)),
      model_(MakeModel(plant, mjcf, reach_)),
      data_(mj_makeData(model_.get())) {
  mjv_defaultScene(&scene_);
  mjv_makeScene(model_.get(), &scene_, kMostGeoms);
  mjv_defaultOption(&option_);
  mjv_defaultPerturb(&perturb_);
  SetCamera(Camera(), 1);
  Update(PendulumState(), Marks());
}

PendulumScene::~PendulumScene() { mjv_freeScene(&scene_); }

void PendulumScene::SetCamera(const Camera& camera, double aspect) {
  mjv_defaultFreeCamera(model_.get(), &camera_);
  // By default, the picture shows the links' reach with a margin, in height and width.
  const double half = 1.16 * reach_ / std::tan(20 * kPi / 180);
  camera_.distance = camera.distance > 0 ? camera.distance : half * std::max(1.0, 1 / aspect);
  camera_.azimuth = camera.azimuth;
  camera_.elevation = camera.elevation;
  camera_.lookat[0] = camera_.lookat[1] = 0;
  camera_.lookat[2] = camera.look_at_z;
  // The floor's grid is centred at the scene's camera.
  mjv_updateCamera(model_.get(), data_.get(), &camera_, &scene_);
}

void PendulumScene::Update(const PendulumState& state, const Marks& marks) {
  data_->qpos[0] = state.q1;
  data_->qpos[1] = state.q2;
  data_->qvel[0] = state.w1;
  data_->qvel[1] = state.w2;
  mj_fwdPosition(model_.get(), data_.get());
  mj_fwdVelocity(model_.get(), data_.get());
  mjv_updateScene(model_.get(), data_.get(), &option_, &perturb_, &camera_, mjCAT_ALL, &scene_);
  // Otherwise the floor casts specks of shadow on itself.
  for (mjvGeom& geom : std::span(scene_.geoms, static_cast<size_t>(scene_.ngeom))) {
    if (geom.type == mjGEOM_PLANE) geom.castshadow = 0;
  }
  AddTrail(marks.trail);
  if (marks.goal) AddGoal(state);
  AddTorque(marks.torque, state);
}

std::array<double, 2> PendulumScene::PullTorques() {
  std::array<double, 2> torques{};
  if (perturb_.active == 0 || perturb_.select <= 0) return torques;
  mjtNum* pull = data_->xfrc_applied + ptrdiff_t{6} * perturb_.select;  // force, then torque
  std::fill_n(pull, 6, 0);
  mjv_applyPerturbForce(model_.get(), data_.get(), &perturb_);
  mj_applyFT(model_.get(), data_.get(), pull, pull + 3,
             data_->xipos + ptrdiff_t{3} * perturb_.select, perturb_.select, torques.data());
  return torques;
}

void PendulumScene::AddGoal(const PendulumState& state) {
  const double top = plant_.length1 + plant_.length2, radius = 0.075 * reach_;
  const bool reached = Inverted(state);
  const Color& color = reached ? kReachedColor : kGoalColor;
  constexpr int kPieces = 40;
  for (int k = 0; k < kPieces; ++k) {
    const auto at = [&](int i) {
      Point point = OnCircle(radius, 2 * kPi * i / kPieces, 0);
      point[2] += top;
      return point;
    };
    Add(scene_, mjGEOM_CAPSULE, 0.009 * reach_, at(k), at(k + 1), color, reached ? 0.6F : 0.3F);
  }
}

void PendulumScene::AddTorque(double torque, const PendulumState& state) {
  // An arc in front of the motor that starts at the top. At the motor's limit it spans
  // 135 degrees.
  const double share = std::clamp(torque / plant_.torque_limit, -1.0, 1.0);
  if (std::abs(share) < 0.01) return;
  const double radius = 0.2 * reach_, width = 0.014 * reach_, depth = -0.10 * reach_;
  const double begin = kPi, head = 0.5 * (share > 0 ? 1 : -1);
  const double end = begin + share * 0.75 * kPi;
  const int pieces = 2 + static_cast<int>(std::abs(share) * 24);
  const double arm = plant_.actuated_joint == 1 ? 0 : plant_.length1;
  const auto around = [&](double angle) {
    Point point = OnCircle(radius, angle, depth);
    const Point centre = OnCircle(arm, state.q1, 0);
    for (const size_t axis : {0, 2}) point.at(axis) += centre.at(axis);
    return point;
  };
  for (int k = 0; k < pieces; ++k) {
    const auto at = [&](int i) { return around(begin + (end - begin) * i / pieces); };
    Add(scene_, mjGEOM_CAPSULE, width, at(k), at(k + 1), kTorqueColor, 0.4F);
  }
  // The arrow head, a cone along the same arc.
  constexpr int kSlices = 12;
  for (int k = 0; k < kSlices; ++k) {
    const double slice = head / kSlices, angle = end + slice * k;
    Add(scene_, mjGEOM_CYLINDER, 3.0 * width * (1 - (k + 0.5) / kSlices), around(angle),
        around(angle + 1.05 * slice), kTorqueColor, 0.4F);
  }
}

void PendulumScene::AddTrail(std::span<const std::array<double, 2>> trail) {
  for (size_t k = 1; k < trail.size(); ++k) {
    const double age = static_cast<double>(k) / static_cast<double>(trail.size());  // 1: newest
    Color color = kTrailColor;
    color[3] *= static_cast<float>(age * age);
    const Point from{trail[k - 1][0], 0, trail[k - 1][1]}, to{trail[k][0], 0, trail[k][1]};
    if (from == to) continue;
    Add(scene_, mjGEOM_CAPSULE, 0.010 * reach_ * (0.4 + 0.6 * age), from, to, color, 0.5F);
  }
}

}  // namespace upswing
