#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <utility>

#include "base/error.h"
#include "base/rng.h"
#include "base/text.h"
#include "mujoco/mjcf_check.h"
#include "mujoco/model.h"
#include "pendulum/mjcf.h"

namespace upswing {
namespace {

/// A point in the plane across the hinges, m: the real part counts downwards. The angle from
/// hanging is the argument.
using Point = std::complex<double>;

/// Flags that the plant cannot describe.
constexpr int kMovingFlags =
    mjDSBL_GRAVITY | mjDSBL_SPRING | mjDSBL_DAMPER | mjDSBL_CLAMPCTRL | mjDSBL_ACTUATION;

/// Turns a compiled double pendulum of any form into the built-in model with its numbers.
class Translator {
 public:
  Translator(ModelPtr given, const std::string& where)
      : where_(where), given_(std::move(given)), data_(mj_makeData(given_.get())) {}

  LoadedModel Translate() {
    CheckStructure();
    ReadLinks();
    ReadMotor();
    const Options options = OptionsOf(plant_);
    for (const Option& option : options.all()) {
      option.Set(FormatNumber(option.number()), Concat(where_, ": ", option.name));
    }
    ModelPtr ours = CompileModel(Mjcf(plant_), where_);
    CopyOptions(*ours);
    for (const int j : {0, 1}) CopyJoint(j, *ours);
    WritePlant(plant_, FieldsOf(*ours, false));
    const DataPtr data(mj_makeData(ours.get()));
    mj_setConst(ours.get(), data.get());
    CheckContacts();
    Compare(*ours, *data);
    return {std::move(ours), plant_, angles_};
  }

 private:
  void Expect(bool valid, std::string_view expected) const {
    if (!valid) throw BadInput(Concat(where_, ": expected ", expected));
  }

  /// A joint's or geom's name, or its number.
  std::string NameOf(mjtObj type, int id) const {
    const char* name = mj_id2name(given_.get(), type, id);
    return name != nullptr && *name != '\0' ? Printable(name) : Concat("number ", id + 1);
  }

  /// Whether a body is part of a link, or fixed to it.
  bool IsPart(int body, int link) const {
    return given_->body_weldid[body] == given_->jnt_bodyid[link];
  }

  /// Checks joints, bodies, motor and options.
  void CheckStructure() {
    const mjModel& m = *given_;
    constexpr std::array kTypes{"free", "ball", "slide", "hinge"};
    std::string joints;
    for (int j = 0; j < std::min<int>(m.njnt, 5); ++j) {  // enough to see what it is
      joints +=
          Concat(j > 0 ? ", " : "", NameOf(mjOBJ_JOINT, j), " (", kTypes.at(m.jnt_type[j]), ")");
    }
    Expect(m.njnt == 2 && m.jnt_type[0] == mjJNT_HINGE && m.jnt_type[1] == mjJNT_HINGE,
           Concat("a double pendulum: two hinges and no other joint, got ",
                  joints.empty() ? "no joint" : joints));
    Expect(IsPart(m.body_parentid[m.jnt_bodyid[1]], 0), "a second link that hangs on the first");
    Expect(m.nactuator == 1 && m.nu == 1, Concat("one motor, got ", m.nactuator, " actuators"));
    Expect(m.ngeom <= 50, Concat("at most 50 geoms, got ", m.ngeom));  // bounds CheckContacts
    const double substeps = kControlPeriod / m.opt.timestep;
    // With a shorter timestep, an evaluation would take minutes.
    Expect(substeps > 0.5 && substeps < 200.5 && std::abs(substeps - std::round(substeps)) < 1e-6,
           Concat("a timestep that divides ", kControlPeriod, " s, of at least 1e-04 s, got ",
                  m.opt.timestep));
    for (const int most : {m.opt.iterations, m.opt.ls_iterations, m.opt.noslip_iterations + 1,
                           m.opt.ccd_iterations}) {
      Expect(most >= 1 && most <= 1000, Concat("1 to 1000 iterations of the solver, got ", most));
    }
    for (const double number :
         {m.opt.density, m.opt.viscosity, m.dof_armature[0], m.dof_armature[1],
          m.dof_frictionloss[0], m.dof_frictionloss[1], m.jnt_stiffness[0], m.jnt_stiffness[1]}) {
      Expect(number >= 0,
             Concat("density, viscosity, armature, frictionloss and stiffness that are not "
                    "negative, got ",
                    number));
    }
  }

  /// A point or direction of the world in the plane.
  Point At(const mjtNum* p) const { return {mju_dot3(p, down_), mju_dot3(p, side_)}; }

  /// Reads the plane, the links, and the angles of the file's joints from hanging.
  void ReadLinks() {
    const mjModel& m = *given_;
    mj_forward(&m, data_.get());
    const mjtNum* axis = data_->xaxis;
    const double parallel = mju_dot3(axis, axis + 3);
    Expect(std::abs(std::abs(parallel) - 1) < 1e-9, "hinges about parallel axes");
    mju_addScl3(down_, m.opt.gravity, axis, -mju_dot3(axis, m.opt.gravity));
    plant_.gravity = mju_normalize3(down_);
    Expect(plant_.gravity > 1e-9, "gravity across the axes of the hinges, got none");
    mju_cross(side_, axis, down_);

    // Mass and first moment of each link with all bodies that are fixed to it.
    std::array<double, 2> mass{};
    std::array<Point, 2> center;
    for (int b = 1; b < m.nbody; ++b) {
      for (const int link : {0, 1}) {
        if (!IsPart(b, link)) continue;
        mass[link] += m.body_mass[b];
        center[link] += m.body_mass[b] * At(data_->xipos + 3 * b);
      }
    }
    const Point hinge1 = At(data_->xanchor), hinge2 = At(data_->xanchor + 3);
    const Point center1 = center[0] / mass[0] - hinge1, center2 = center[1] / mass[1] - hinge2;
    plant_.mass1 = mass[0];
    plant_.mass2 = mass[1];
    plant_.length1 = std::abs(hinge2 - hinge1);
    Expect(plant_.length1 > 1e-6, "a distance between the hinges");
    const Point direction1 = (hinge2 - hinge1) / plant_.length1;
    const Point along1 = center1 / direction1;
    Expect(std::abs(along1.imag()) < 1e-6 && along1.real() > 1e-9,
           Concat("the centre of mass of link 1 on the line from its hinge to the second, got ",
                  along1.real(), " m along it and ", along1.imag(), " m next to it"));
    const double c2 = std::abs(center2);
    Expect(c2 > 1e-9, "a distance from the hinge to the centre of mass of link 2");
    const Point direction2 = center2 / c2;
    plant_.length2 = EndOf(hinge2, direction2);
    Expect(plant_.length2 > 1e-9, "a geom on link 2, whose end gives the link's length");

    // Moments about the centres of mass, from the mass matrix.
    std::array<mjtNum, 4> M{};
    mj_fullM(&m, data_.get(), M.data());
    const double I2 = M[3] - m.dof_armature[1] - mass[1] * std::norm(center2);
    const double I1 = M[0] - m.dof_armature[0] - mass[0] * std::norm(center1) - I2 -
                      mass[1] * std::norm(hinge2 + center2 - hinge1);
    SetOwn(0, {mass[0], plant_.length1, along1.real(), I1}, &plant_.center1, &plant_.inertia1);
    SetOwn(1, {mass[1], plant_.length2, c2, I2}, &plant_.center2, &plant_.inertia2);

    angles_[1].sign = parallel > 0 ? 1 : -1;
    const std::array q{std::arg(direction1), std::arg(direction2 / direction1)};
    for (const int j : {0, 1}) {
      angles_[j].joint = NameOf(mjOBJ_JOINT, j);
      angles_[j].offset = q[j] - angles_[j].sign * m.qpos0[j];
    }
  }

  /// Sets a link's centre of mass and inertia, unless they are those of a solid capsule with the
  /// radius of the link's first capsule.
  void SetOwn(int j, const Link& link, double* center, double* inertia) {
    const mjModel& m = *given_;
    for (int g = m.ngeom - 1; g >= 0; --g) {
      const bool capsule = m.geom_type[g] == mjGEOM_CAPSULE && IsPart(m.geom_bodyid[g], j);
      if (capsule) radius_[j] = m.geom_size[3 * g];
    }
    constexpr double kRounding = 1e-9;  // m, and share of an inertia
    const double capsule = CapsuleInertia(link.m, radius_[j], link.l).across;
    if (std::abs(link.c - link.l / 2) > kRounding) *center = link.c;
    // A point mass has at least a little, because 0 means a capsule.
    if (std::abs(link.I - capsule) > kRounding * capsule) *inertia = std::max(link.I, 1e-12);
  }

  /// Distance (m) from the second hinge to the end of link 2's geoms in a direction. A capsule ends
  /// at the centre of its half sphere.
  double EndOf(Point hinge, Point direction) const {
    const mjModel& m = *given_;
    double end = 0;
    for (int g = 0; g < m.ngeom; ++g) {
      if (!IsPart(m.geom_bodyid[g], 1)) continue;
      const int type = m.geom_type[g];
      const bool rod = type == mjGEOM_CAPSULE || type == mjGEOM_CYLINDER;
      double reach = ((At(data_->geom_xpos + 3 * g) - hinge) / direction).real();
      for (int k = 0; k < 3 && type != mjGEOM_SPHERE; ++k) {
        const mjtNum* R = data_->geom_xmat + 9 * g + k;
        const mjtNum axis[3] = {R[0], R[3], R[6]};
        const double half = !rod ? m.geom_size[3 * g + k] : k == 2 ? m.geom_size[3 * g + 1] : 0;
        reach += std::abs((At(axis) / direction).real()) * half;
      }
      end = std::max(end, reach);
    }
    return end;
  }

  /// Reads the motor's joint, its torque for a control of 1, and its limit.
  void ReadMotor() {
    const mjModel& m = *given_;
    const mjtNum *bias = m.actuator_biasprm, gear = m.actuator_gear[0];
    const bool no_bias = m.actuator_biastype[0] == mjBIAS_NONE ||
                         std::all_of(bias, bias + mjNBIAS, [](mjtNum x) { return x == 0; });
    Expect(m.actuator_trntype[0] <= mjTRN_JOINTINPARENT && m.na == 0 && no_bias &&
               m.actuator_gaintype[0] == mjGAIN_FIXED && m.actuator_gainprm[0] * gear != 0,
           "a motor on a hinge: a gear, a fixed gain, no bias and no dynamics");
    const int joint = m.actuator_trnid[0];
    torque_ = m.actuator_gainprm[0] * gear * angles_[joint].sign;
    plant_.torque_limit = std::numeric_limits<double>::infinity();
    const auto limit = [&](bool limited, const mjtNum* range, double scale, const char* name) {
      if (!limited) return;
      Expect(std::abs(range[0] + range[1]) < 1e-9 * range[1],
             Concat(name, " of the motor the same both ways, got ", range[0], " to ", range[1]));
      plant_.torque_limit = std::min(plant_.torque_limit, range[1] * std::abs(scale));
    };
    limit(m.actuator_ctrllimited[0], m.actuator_ctrlrange, torque_, "ctrlrange");
    limit(m.actuator_forcelimited[0], m.actuator_forcerange, gear, "forcerange");
    limit(m.jnt_actfrclimited[joint], m.jnt_actfrcrange + 2 * joint, 1, "actuatorfrcrange");
    Expect(std::isfinite(plant_.torque_limit),
           "a limit of the motor's torque: ctrlrange or forcerange");
    plant_.damping1 = m.dof_damping[0];
    plant_.damping2 = m.dof_damping[1];
    plant_.actuated_joint = joint + 1;
  }

  void CopyOptions(mjModel& ours) const {
    const double gravity = ours.opt.gravity[2];
    ours.opt = given_->opt;
    mju_zero3(ours.opt.gravity);
    mju_zero3(ours.opt.wind);
    ours.opt.gravity[2] = gravity;
    ours.opt.disableflags &= ~kMovingFlags;
    ours.opt.disableflags |= mjDSBL_CONTACT;  // CheckContacts finds none
    ours.opt.enableflags = 0;
  }

  /// Copies the numbers that are no part of the plant: armature, friction, spring, limit, a
  /// capsule's radius.
  void CopyJoint(int j, mjModel& ours) const {
    const mjModel& m = *given_;
    ours.geom_size[3 * j] = radius_[j];
    const auto copy = [&](auto field, int width) {
      std::copy_n(m.*field + width * j, width, ours.*field + width * j);
    };
    for (const auto field : {&mjModel::dof_armature, &mjModel::dof_frictionloss,
                             &mjModel::jnt_stiffness, &mjModel::jnt_margin}) {
      copy(field, 1);
    }
    copy(&mjModel::jnt_limited, 1);
    copy(&mjModel::jnt_solref, mjNREF);
    copy(&mjModel::jnt_solimp, mjNIMP);
    copy(&mjModel::dof_solref, mjNREF);
    copy(&mjModel::dof_solimp, mjNIMP);
    // The mirror image of a motion must be a motion, because learning uses the mirror symmetry.
    const double rest = angles_[j].Of(m.qpos_spring[j]);
    Expect(m.jnt_stiffness[j] == 0 || std::abs(rest) < 1e-6,
           Concat("a spring of ", angles_[j].joint, " at rest where the links hang, got ", rest,
                  " rad from there (springref)"));
    if (m.jnt_limited[j] == 0) return;
    const auto [low, high] =
        std::minmax({angles_[j].Of(m.jnt_range[2 * j]), angles_[j].Of(m.jnt_range[2 * j + 1])});
    Expect(!IsLimited(j) || std::abs(low + high) < 1e-6,
           Concat("limits of ", angles_[j].joint, " the same both ways from hanging, got ", low,
                  " to ", high, " rad from there"));
    ours.jnt_range[2 * j] = (low - high) / 2;
    ours.jnt_range[2 * j + 1] = (high - low) / 2;
  }

  /// Whether a joint has a limit that no flag switches off.
  bool IsLimited(int j) const {
    constexpr int kOff = mjDSBL_CONSTRAINT | mjDSBL_LIMIT;
    return given_->jnt_limited[j] != 0 && (given_->opt.disableflags & kOff) == 0;
  }

  /// Largest angle of a joint from hanging, rad.
  double Most(int j) const {
    const mjtNum* range = given_->jnt_range + 2 * j;
    return IsLimited(j) ? (range[1] - range[0]) / 2 : std::numbers::pi;
  }

  /// Puts the file's model into a state that is given in our angles.
  void SetState(const PendulumState& s) const {
    data_->qpos[0] = angles_[0].Back(s.q1);
    data_->qpos[1] = angles_[1].Back(s.q2);
    data_->qvel[0] = s.w1;
    data_->qvel[1] = angles_[1].sign * s.w2;
  }

  /// Refuses geoms that touch in a position of a grid over the reach of the joints.
  void CheckContacts() const {
    if ((given_->opt.disableflags & (mjDSBL_CONTACT | mjDSBL_CONSTRAINT)) != 0) return;
    constexpr int n = 90;  // positions on each side; of a whole turn, 2 degrees apart
    const double most1 = std::min(Most(0), std::numbers::pi);
    const double most2 = std::min(Most(1), std::numbers::pi);
    for (int i = 0; i < (2 * n + 1) * (2 * n + 1); ++i) {
      const int i1 = i / (2 * n + 1) - n, i2 = i % (2 * n + 1) - n;
      SetState({most1 * i1 / n, most2 * i2 / n, 0, 0});
      mj_kinematics(given_.get(), data_.get());
      mj_collision(given_.get(), data_.get());
      if (data_->ncon == 0) continue;
      const auto geom = [&](int k) { return NameOf(mjOBJ_GEOM, data_->contact[0].geom[k]); };
      Expect(false, Concat("links that touch nothing, but geoms ", geom(0), " and ", geom(1),
                           " touch at ", angles_[0].joint, " ", data_->qpos[0], " rad, ",
                           angles_[1].joint, " ", data_->qpos[1],
                           " rad; contype=\"0\" conaffinity=\"0\" keep a geom from touching"));
    }
  }

  /// Moves both models from random states with random torques, and refuses the file unless they
  /// move alike. This finds whatever the translation does not know.
  void Compare(const mjModel& ours, mjData& data) const {
    Rng rng(1, "check of a model");
    for (int trial = 0; trial < 200; ++trial) {
      mj_resetData(given_.get(), data_.get());
      mj_resetData(&ours, &data);
      const auto within = [&](double x) { return rng.Uniform(-x, x); };
      const double speed = trial % 2 == 0 ? 1 : 20;  // rad/s
      SetState({within(1.1 * Most(0)), within(1.1 * Most(1)), within(speed), within(speed)});
      data.ctrl[0] = within(1.5 * plant_.torque_limit);
      data_->ctrl[0] = data.ctrl[0] / torque_;
      for (const int j : {0, 1}) {
        data.qpos[j] = angles_[j].Of(data_->qpos[j]);
        data.qvel[j] = angles_[j].sign * data_->qvel[j];
      }
      for (const int step : {1, 2}) {
        mj_step(given_.get(), data_.get());
        mj_step(&ours, &data);
        for (const int j : {0, 1}) {
          const double w = data.qvel[j], error = angles_[j].sign * data_->qvel[j] - w;
          if (!(std::abs(error) < 1e-6 * step * std::max(1.0, std::abs(w)))) RefuseMotion();
        }
      }
    }
  }

  /// Names what may move the file's model in another way.
  [[noreturn]] void RefuseMotion() const {
    const mjModel& m = *given_;
    const auto any = [](const mjtNum* x, mjtSize n) {
      return mju_norm(x, static_cast<int>(n)) > 0;
    };
    std::string causes;
    for (const auto& [cause, name] : std::initializer_list<std::pair<bool, const char*>>{
             {any(m.opt.wind, 3), "wind"},
             {m.opt.density > 0 || m.opt.viscosity > 0,
              "air around links that are no solid capsules"},
             {any(m.body_gravcomp, m.nbody), "gravcomp"},
             {any(m.jnt_stiffnesspoly, 2 * mjNPOLY), "a stiffness of several numbers"},
             {any(m.dof_dampingpoly, 2 * mjNPOLY), "a damping of several numbers"},
             {any(m.actuator_damping, 1), "a motor with damping, which its joint can have"},
             {(m.opt.disableflags & kMovingFlags) != 0,
              "a flag that disables gravity, spring, damper, actuation or clampctrl"}}) {
      if (cause) causes += Concat(causes.empty() ? "" : ", ", name);
    }
    throw BadInput(Concat(where_, ": expected the motion of two links and a motor, got ",
                          causes.empty() ? "another" : causes));
  }

  const std::string& where_;
  ModelPtr given_;
  DataPtr data_;
  Plant plant_;
  std::array<JointAngle, 2> angles_;
  mjtNum down_[3]{}, side_[3]{};                                  // axes of the plane in the world
  std::array<double, 2> radius_{kCapsuleRadius, kCapsuleRadius};  // m
  double torque_ = 0;  // of a control of 1, in the direction of our angle, N·m
};

}  // namespace

LoadedModel LoadModel(const std::string& mjcf, const std::string& where) {
  CheckMjcf(mjcf, where);
  try {
    return Translator(CompileModel(mjcf, where, true), where).Translate();
  } catch (const Error& error) {  // an error of MuJoCo is the file's
    if (error.exit_code() == 2) throw;
    throw BadInput(Concat(where, ": ", Printable(error.what())));
  }
}

}  // namespace upswing
