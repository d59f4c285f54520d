#include "extras/machine/drive/learn_candidates.h"

#include "base/text.h"
#include "extras/machine/drive/policy_controller.h"

namespace upswing::machine {
namespace {

constexpr double kUsualCompensation = 0.95;

/// Makes candidates for a plant. The numbers are for the size of RealAIGym's boards.
class CandidateMaker {
 public:
  explicit CandidateMaker(const Plant& plant)
      : plant_(plant),
        scale_(TaskScaleOf(plant)),
        usual_(ControllerConfig::For(WithoutDryFriction(plant))) {}

  const ControllerConfig& usual() const { return usual_; }

  /// The default design with these weights of the regulator, of both angles and of the torque.
  ControllerConfig Weighted(double angles, double torque) const {
    ControllerConfig config = usual_;
    config.lqr.q1 = config.lqr.q2 = angles;
    config.lqr.torque = torque / (scale_.torque * scale_.torque);
    return config;
  }

  /// With more damping (s/rad, for dry friction) of the joint without a motor: in the regulator's
  /// linear model, damping stands for the friction that no motor compensates.
  ControllerConfig Damped(ControllerConfig config, double seconds) const {
    const double damping = seconds * scale_.time;
    if (plant_.actuated_joint == 1) {
      config.plant.damping2 += damping * plant_.coulomb2;
    } else {
      config.plant.damping1 += damping * plant_.coulomb1;
    }
    return config;
  }

  ControllerConfig Slow() const {
    ControllerConfig config = usual_;
    config.tvlqr = {.seconds = 6 * scale_.time, .reserve = 0.1};
    return config;
  }

  /// With a horizon of mpc (s), and goals without many turns.
  ControllerConfig Planning(ControllerConfig config, double seconds) const {
    config.mpc.seconds = seconds * scale_.time;
    config.mpc.angle_range = 9;
    return config;
  }

  /// With dry friction in the plans.
  ControllerConfig WithFriction(ControllerConfig config) const {
    config.plant.coulomb1 = plant_.coulomb1;
    config.plant.coulomb2 = plant_.coulomb2;
    return config;
  }

 private:
  const Plant& plant_;
  Scale scale_;
  ControllerConfig usual_;
};

}  // namespace

// mpc needs milliseconds for a decision, so tvlqr comes first. The first candidates leave dry
// friction to the motors. Under noise, compensation shakes a light link, and a joint may have no
// motor: others plan with the friction, or with damping in its place.
std::vector<Candidate> CandidatesFor(const Plant& plant) {
  const CandidateMaker make(plant);
  const ControllerConfig stiff = make.Weighted(100, 0.3), stiffest = make.Weighted(1000, 0.3);
  return {{"tvlqr", make.usual(), kUsualCompensation},
          {"tvlqr", stiff, kUsualCompensation},
          {"tvlqr", make.Damped(stiffest, 0.25), kUsualCompensation},
          {"tvlqr", make.Damped(stiff, 0.5), 0},
          {"tvlqr", make.Damped(stiffest, 0.25), 0},
          {"tvlqr", make.Slow(), kUsualCompensation},
          {"mpc", make.Planning(make.WithFriction(stiff), 0.5), 0},
          {"mpc", make.Planning(make.WithFriction(make.usual()), 1), 0},
          {"mpc", make.Planning(stiff, 0.3), kUsualCompensation},
          {"mpc", make.Planning(make.WithFriction(make.Damped(make.usual(), 2)), 1), 0}};
}

PolicyArguments ArgumentsOf(const Candidate& candidate, const Plant& plant) {
  const Plant usual_plant = WithoutDryFriction(plant);
  const ControllerConfig usual = ControllerConfig::For(usual_plant);
  PolicyArguments arguments;
  arguments.name = candidate.controller;
  for (const auto& [setting, before] : Differences(OptionsOf(candidate.config), OptionsOf(usual))) {
    arguments.flags.push_back({setting.name, setting.plain_text()});
  }
  for (const auto& [setting, before] :
       Differences(OptionsOf(candidate.config.plant), OptionsOf(usual_plant))) {
    arguments.made_for.push_back(Concat(setting.name, "=", setting.plain_text()));
  }
  return arguments;
}

}  // namespace upswing::machine
