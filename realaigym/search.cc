#include "realaigym/search.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "core/text.h"

namespace upswing {
namespace {

/// Throws BadInput unless what has to be is even.
const GymSearchConfig& Checked(const GymSearchConfig& c) {
  for (const auto& [name, value] : {std::pair{"hidden", c.hidden},
                                    {"first_population", c.first_population},
                                    {"population", c.population}}) {
    if (value % 2 != 0) {
      throw BadInput(Concat(FlagOf(name), ": expected an even number, got ", value));
    }
  }
  return c;
}

GymRobot RobotOf(const std::string& name) {
  return name == "acrobot" ? GymRobot::kAcrobot : GymRobot::kPendubot;
}

std::vector<double> Deviations(const SwingNet& net, double of_network, double of_linear) {
  std::vector<double> deviations(net.size(), of_network);
  std::fill_n(deviations.begin(), SwingNet::kLinear, of_linear);
  return deviations;
}

/// The performance score, with something to climb where there is none yet.
double NominalFitness(const GymOutcome& o, double weight) {
  const bool done = o.above_line && o.at_goal;
  const double idle = done ? 0 : 1e-4 * std::min(500.0, o.torque_cost);
  return (done ? weight * PerformanceScore(o) : 0) + 0.5 * o.held + 0.3 * o.nearest - idle;
}

}  // namespace

Snes::Snes(std::vector<double> mean, std::vector<double> deviation, double mean_rate, uint64_t seed)
    : mean_(std::move(mean)),
      deviation_(std::move(deviation)),
      mean_rate_(mean_rate),
      rng_(seed, "snes") {}

const std::vector<std::vector<double>>& Snes::Ask(int population) {
  const size_t n = mean_.size();
  z_.assign(static_cast<size_t>(population), std::vector<double>(n));
  candidates_ = z_;
  for (size_t k = 0; k < z_.size(); ++k) {
    for (size_t i = 0; i < n; ++i) {
      z_[k][i] = k % 2 == 0 ? rng_.Normal() : -z_[k - 1][i];
      candidates_[k][i] = mean_[i] + deviation_[i] * z_[k][i];
    }
  }
  return candidates_;
}

void Snes::Tell(const std::vector<double>& fitness) {
  const size_t population = fitness.size(), n = mean_.size();
  std::vector<size_t> order(population);
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, [&](size_t a, size_t b) { return fitness[a] > fitness[b]; });
  std::vector<double> utility(population);
  const auto size = static_cast<double>(population);
  for (size_t rank = 0; rank < population; ++rank) {
    utility[rank] = std::max(0.0, std::log(size / 2 + 1) - std::log(rank + 1.0));
  }
  const double sum = std::accumulate(utility.begin(), utility.end(), 0.0);
  const double dimensions = static_cast<double>(n);
  const double rate = (3 + std::log(dimensions)) / (5 * std::sqrt(dimensions));
  std::vector<double> mean_gradient(n, 0.0), deviation_gradient(n, 0.0);
  for (size_t rank = 0; rank < population; ++rank) {
    const double u = utility[rank] / sum - 1 / size;
    const std::vector<double>& z = z_[order[rank]];
    for (size_t i = 0; i < n; ++i) {
      mean_gradient[i] += u * z[i];
      deviation_gradient[i] += u * (z[i] * z[i] - 1);
    }
  }
  for (size_t i = 0; i < n; ++i) {
    mean_[i] += mean_rate_ * deviation_[i] * mean_gradient[i];
    deviation_[i] *= std::exp(rate / 2 * deviation_gradient[i]);
  }
}

void GymSearchConfig::Describe(Options& o) {
  o.Section("search");
  o.AddChoice(&robot, "robot", {"pendubot", "acrobot"}, "which joint has the motor");
  o.Add(&seed, "seed", 1, {0, 1e15}, "", "of the search's random numbers");
  o.Add(&hidden, "hidden", 16, {4, 32}, "", "units in each of the network's two layers");
  o.Add(&alone, "alone", 60, {0, 1e6}, "", "generations on the nominal plant alone");
  o.Add(&generations, "generations", 1500, {0, 1e6}, "", "generations after that");
  o.Add(&first_population, "first_population", 192, {4, 1e5}, "",
        "candidates of a generation on the nominal plant");
  o.Add(&population, "population", 64, {4, 1e5}, "", "candidates of a generation after that");
  o.Add(&episodes, "episodes", 24, {2, 64}, "", "simulations of a candidate after that");
  o.Add(&deviation, "deviation", 0.12, kPositive, "", "of the network's numbers at first");
  o.Add(&mean_rate, "mean_rate", 2, kPositive, "", "rate at which the mean follows the gradient");
  o.Add(&performance_weight, "performance_weight", 5, {0, 100}, "",
        "weight of the performance score after that");
  o.Add(&interleaved, "interleaved", 0, {0, 100}, "",
        "generations on the nominal plant alone between two of the others");
  o.Add(&robustness_weight, "robustness_weight", 1, {0, 100}, "",
        "weight of the share of random simulations that end at the goal, to the performance score");
}

GymSearch::GymSearch(const GymSearchConfig& config)
    : GymSearch(config, [&] {
        const SwingNet net(RobotOf(config.robot), static_cast<int>(Checked(config).hidden));
        return SwingPolicy{net, net.Initial(static_cast<uint64_t>(config.seed))};
      }()) {}

GymSearch::GymSearch(const GymSearchConfig& config, const SwingPolicy& first)
    : config_(Checked(config)),
      net_(first.net),
      snes_(first.numbers, Deviations(net_, config.deviation, 0.1), config.mean_rate,
            static_cast<uint64_t>(config.seed)),
      rng_(static_cast<uint64_t>(config.seed), "realaigym: search"),
      average_(snes_.mean()) {}

int GymSearch::generations() const { return static_cast<int>(config_.alone + config_.generations); }

std::vector<GymEpisode> GymSearch::DrawEpisodes() {
  // The nominal plant; then a mixture in which what is hardest has most.
  std::vector<GymEpisode> episodes{GymEpisode()};
  if (IsAlone()) return episodes;
  while (static_cast<int64_t>(episodes.size()) < config_.episodes) {
    constexpr int kShares[kGymRows] = {28, 1, 2, 3, 12, 18};
    int left = static_cast<int>(rng_.Below(64));
    int row = 0;
    while (left >= kShares[row]) left -= kShares[row++];
    // The dampings and frictions have twice the share of the others.
    static constexpr int kParameters[] = {0, 1, 2, 3, 4, 5, 6, 6, 7, 7, 8, 8, 9, 9, 9};
    const int parameter = kParameters[rng_.Below(std::size(kParameters))];
    episodes.push_back(EpisodeOf(static_cast<GymRow>(row), parameter, rng_.Uniform(), rng_.Next()));
  }
  return episodes;
}

bool GymSearch::IsAlone() const {
  return generation_ < config_.alone ||
         (generation_ - config_.alone) % (1 + config_.interleaved) != 0;
}

bool GymSearch::Step(ThreadPool* pool, Report& report) {
  if (generation_ >= generations()) return false;
  const auto& candidates =
      snes_.Ask(static_cast<int>(IsAlone() ? config_.first_population : config_.population));
  const std::vector<GymEpisode> own = DrawEpisodes();
  const size_t E = own.size();

  // One candidate's simulations after the other's.
  std::vector<GymEpisode> all;
  std::vector<size_t> of;  // candidate of each
  for (size_t k = 0; k < candidates.size(); ++k) {
    all.insert(all.end(), own.begin(), own.end());
    of.insert(of.end(), E, k);
  }
  const auto make = [&](size_t first) {
    std::vector<std::span<const double>> numbers;
    const size_t last = std::min(first + kGymBlock, of.size());
    for (size_t i = first; i < last; ++i) numbers.emplace_back(candidates[of[i]]);
    if (of[first] == of[last - 1]) numbers.resize(1);
    return net_.Control(std::move(numbers));
  };
  const std::vector<GymOutcome> outcomes = SimulateGym(net_.robot(), all, make, pool);

  std::vector<double> fitness(candidates.size());
  std::vector<double> reached(candidates.size(), 0.0);
  for (size_t k = 0; k < candidates.size(); ++k) {
    const GymOutcome* outcome = &outcomes[k * E];
    fitness[k] = NominalFitness(outcome[0], E > 1 ? config_.performance_weight : 1);
    double shaped = 0;
    for (size_t e = 1; e < E; ++e) {
      const double goal = outcome[e].at_goal ? 1 : 0;
      reached[k] += goal / static_cast<double>(E - 1);
      shaped += (0.6 * goal + 0.4 * outcome[e].held) / static_cast<double>(E - 1);
    }
    fitness[k] += config_.robustness_weight * shaped;
  }
  snes_.Tell(fitness);
  ++generation_;
  // The average of the last means: they wander about a good place.
  constexpr double kKept = 0.97;
  const bool first = generation_ <= config_.alone;
  for (size_t i = 0; i < average_.size(); ++i) {
    average_[i] = first ? snes_.mean()[i] : kKept * average_[i] + (1 - kKept) * snes_.mean()[i];
  }

  const auto best = static_cast<size_t>(std::ranges::max_element(fitness) - fitness.begin());
  const std::array<GymEpisode, 1> nominal;
  report = {generation_, fitness[best],
            SimulateGym(
                net_.robot(), nominal, [&](size_t) { return net_.Control({average_}); }, nullptr)
                .front(),
            reached[best]};
  return true;
}

}  // namespace upswing
