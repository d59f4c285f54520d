#include "agents/controllers.h"

#include "base/error.h"
#include "base/text.h"
#include "control/hybrid.h"
#include "control/mpc.h"
#include "control/swing_up.h"
#include "control/tvlqr.h"

namespace upswing {
namespace {

using Made = std::shared_ptr<const Policy>;

/// Makes a controller that swings up by a law and catches by LQR.
Made WithCatch(const ControllerConfig& config, const std::string& kind, const std::string& what,
               const Options& settings, LawPolicy::Law law) {
  return std::make_shared<HybridPolicy>(
      kind, settings, config.lqr,
      std::make_shared<LawPolicy>(kind, what, settings, config.plant, std::move(law)),
      config.plant);
}

/// Throws BadInput unless the motor is at joint 1, as these control laws assume.
void ExpectPendubot(const char* kind, const Plant& plant) {
  if (plant.actuated_joint == 1) return;
  throw BadInput(
      Concat(kind, ": expected a plant with the motor at joint 1 (actuated_joint), got joint 2"));
}

Made MakeEnergyShaping(const ControllerConfig& config) {
  ExpectPendubot("energy", config.plant);
  const EnergyShapingConfig& energy = config.energy;
  return WithCatch(config, "energy",
                   Concat("energy shaping, weights ", Rounded(energy.kE), ", ", Rounded(energy.kD),
                          " and ", Rounded(energy.kP)),
                   OptionsOfAll(config.lqr, energy),
                   [energy, plant = ManipulatorOf(config.plant)](const StateVector& d) {
                     return EnergyShapingTorque(energy, plant, d);
                   });
}

Made MakePartialFeedback(const ControllerConfig& config) {
  ExpectPendubot("pfl", config.plant);
  const PartialFeedbackConfig& pfl = config.pfl;
  return WithCatch(config, "pfl",
                   Concat("collocated partial feedback linearisation, gains ", Rounded(pfl.kP),
                          ", ", Rounded(pfl.kD), " and ", Rounded(pfl.kE)),
                   OptionsOfAll(config.lqr, pfl),
                   [pfl, plant = ManipulatorOf(config.plant)](const StateVector& d) {
                     return PartialFeedbackTorque(pfl, plant, d);
                   });
}

Made MakeHybrid(const ControllerConfig& config) {
  if (config.swing_up_policy == nullptr) {
    throw BadInput("hybrid: expected a policy that swings up (--swing-up POLICY), got none");
  }
  return std::make_shared<HybridPolicy>("hybrid", OptionsOf(config.lqr), config.lqr,
                                        config.swing_up_policy, config.plant);
}

Made MakeLqr(const ControllerConfig& config) {
  return std::make_shared<LqrPolicy>(config.lqr, config.plant);
}

Made MakeMpc(const ControllerConfig& config) {
  return std::make_shared<MpcPolicy>(config.lqr, config.mpc, config.plant);
}

Made MakeTvlqr(const ControllerConfig& config) {
  return std::make_shared<TvlqrPolicy>(config.lqr, config.tvlqr, config.plant);
}

constexpr ControllerKind kControllers[] = {
    {"energy", "pumps energy by energy shaping until lqr catches", MakeEnergyShaping},
    {"hybrid", "lets lqr catch what --swing-up POLICY swings up", MakeHybrid},
    {.name = "lqr",
     .help = "holds the pendulum upright and does not swing it up",
     .make = MakeLqr,
     .only_balances = true},
    {"mpc", "plans again at each decision", MakeMpc},
    {"pfl", "pumps energy by partial feedback linearisation until lqr catches",
     MakePartialFeedback},
    {"tvlqr", "follows a planned swing-up", MakeTvlqr},
};

}  // namespace

ControllerConfig ControllerConfig::For(const DesignPlant& plant) {
  ControllerConfig config = ControllerConfig().In(TaskScaleOf(plant));
  config.plant = plant;
  return config;
}

ControllerConfig ControllerConfig::In(const Scale& ratio) const {
  ControllerConfig config = *this;
  config.lqr = lqr.In(ratio);
  config.tvlqr = tvlqr.In(ratio);
  config.mpc = mpc.In(ratio);
  config.energy = energy.In(ratio);
  config.pfl = pfl.In(ratio);
  config.plant.control_period *= ratio.time;
  return config;
}

void ControllerConfig::Describe(Options& o) {
  lqr.Describe(o);
  tvlqr.Describe(o);
  mpc.Describe(o);
  energy.Describe(o);
  pfl.Describe(o);
  o.Section("hybrid");
  o.Add(&swing_up, "swing_up",
        "policy that swings up: policy.safetensors, a run folder or a shipped policy")
      .usual = "none";
}

std::span<const ControllerKind> ControllerKinds() { return kControllers; }

const ControllerKind* FindController(const std::string& name) {
  for (const ControllerKind& kind : kControllers) {
    if (name == kind.name) return &kind;
  }
  return nullptr;
}

std::vector<std::string> ControllerNames() { return NamesOf(kControllers); }

bool IsController(const std::string& name) { return FindController(name) != nullptr; }

bool OnlyBalances(const std::string& name) {
  const ControllerKind* kind = FindController(name);
  return kind != nullptr && kind->only_balances;
}

bool HasSection(const std::string& controller, const std::string& section) {
  return section == "lqr" || section == controller;
}

std::shared_ptr<const Policy> MakeController(const std::string& name,
                                             const ControllerConfig& config) {
  if (const ControllerKind* kind = FindController(name)) return kind->make(config);
  throw BadInput(Concat("expected a controller, one of ", Join(ControllerNames(), ", "), ", got \"",
                        name, "\""));
}

std::string TitleOf(const std::string& name, const ControllerConfig& config,
                    const std::string& plant_name, const Plant& named) {
  const auto changes = [](const Options& now, const Options& usual) {
    std::vector<std::string> texts;
    for (const auto& [option, before] : Differences(now, usual)) {
      texts.push_back(Concat(option.name, " ", option.plain_text()));
    }
    return texts;
  };
  const ControllerConfig usual = ControllerConfig::For(config.plant);
  std::vector<std::string> texts = changes(OptionsOf(config), OptionsOf(usual));
  const Plant design = config.plant;
  auto plant = changes(OptionsOf(design), OptionsOf(named));
  if (!plant_name.empty()) plant.insert(plant.begin(), plant_name);
  if (!plant.empty()) texts.push_back(Concat("for ", Join(plant, " and ")));
  return texts.empty() ? name : Concat(name, " (", Join(texts, ", "), ")");
}

}  // namespace upswing
