#include "extras/realaigym/search.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "base/text.h"
#include "extras/realaigym/machine_trials.h"
#include "extras/realaigym/swing_net.h"

namespace upswing::realaigym {
namespace {

/// Throws BadInput unless the sizes that must be even are even.
const BoardSearchConfig& Checked(const BoardSearchConfig& c) {
  for (const auto& [name, value] : {std::pair{"hidden", c.hidden},
                                    {"first_population", c.first_population},
                                    {"population", c.population}}) {
    if (value % 2 != 0) {
      throw BadInput(Concat(FlagOf(name), ": expected an even number, got ", value));
    }
  }
  return c;
}

std::vector<double> Deviations(const SwingNet& net, double of_network, double of_linear) {
  std::vector<double> deviations(net.size(), of_network);
  std::fill_n(deviations.begin(), SwingNet::kLinear, of_linear);
  return deviations;
}

/// The performance score, plus a gradient for the search while the score is 0.
double NominalFitness(const BoardOutcome& o, double weight) {
  const bool done = o.above_line && o.at_goal;
  const double idle = done ? 0 : 1e-4 * std::min(500.0, o.torque_cost);
  return (done ? weight * PerformanceScore(o) : 0) + 0.5 * o.held + 0.3 * o.nearest - idle;
}

constexpr int kShortSteps = 3000;         // 6 s: enough for a swing-up and to see if it holds
constexpr double kLinearDeviation = 0.1;  // initial deviation of the regulator's numbers

/// Draws the simulations of a candidate, as many as a group has: the nominal plant, then the rows
/// with their variation drawn uniformly over its range. Velocity noise is left out, because a
/// SwingNet does not use measured velocities. Easy rows have one simulation with half the weight.
std::vector<DrawnEpisode> BoardEpisodes(Rng& rng) {
  std::vector<DrawnEpisode> drawn{{0, {}}};
  const auto draw = [&](RobustnessRow row, int count, double weight) {
    std::array<int, kBoardVariations.size()> parameters;
    std::iota(parameters.begin(), parameters.end(), 0);
    for (int k = 0; k < count; ++k) {
      const auto i = static_cast<size_t>(k);
      std::swap(parameters[i], parameters[i + rng.Below(parameters.size() - i)]);
      const double level =
          row == RobustnessRow::kModel ? rng.Uniform() : (k + rng.Uniform()) / count;
      drawn.push_back({weight / count, MakeCase(row, parameters[i], level, rng.Next()).episode});
    }
  };
  draw(RobustnessRow::kModel, 6, 0.25);
  draw(RobustnessRow::kTorqueNoise, 1, 0.125);
  draw(RobustnessRow::kResponse, 1, 0.125);
  draw(RobustnessRow::kDelay, 2, 0.25);
  draw(RobustnessRow::kPush, 5, 0.25);
  return drawn;
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

void BoardSearchConfig::Describe(Options& o) {
  o.Section("search");
  o.AddChoice(&robot, "robot", {NameOf(Robot::kPendubot), NameOf(Robot::kAcrobot)},
              "robot; the motor of the pendubot is at joint 1, of the acrobot at joint 2");
  o.Add(&seed, "seed", {0, 1e15}, "", "seed of the search");
  o.Add(&hidden, "hidden", {4, 32}, "", "width of each of the network's two layers");
  o.Add(&starts, "starts", {1, 1000}, "",
        "number of random initial networks; the search continues with the best");
  o.Add(&alone, "alone", {1, 1e5}, "", "generations per initial network, on the nominal plant");
  o.Add(&generations, "generations", {0, 1e6}, "",
        "generations of the robust search, which follows");
  o.Add(&first_population, "first_population", {4, 1e4}, "",
        "candidates per generation on the nominal plant");
  o.Add(&population, "population", {4, 1e4}, "", "candidates per generation of the robust search");
  o.Add(&deviation, "deviation", {1e-6, 10}, "",
        "initial standard deviation of the network's parameters");
  o.Add(&restart, "restart", {1e-6, 10}, "",
        "standard deviation at the start of the robust search");
  o.Add(&mean_rate, "mean_rate", {1e-6, 100}, "", "learning rate of the mean of the candidates");
  o.Add(&performance_weight, "performance_weight", {1e-6, 1e6}, "",
        "weight of the performance score at the start of the robust search");
  o.Add(&last_weight, "last_weight", {1e-6, 1e6}, "",
        "weight of the performance score at the end of the robust search");
}

BoardSearch::BoardSearch(const BoardSearchConfig& config)
    : BoardSearch(config, [&] {
        const SwingNet net(RobotNamed(config.robot).value(),
                           static_cast<int>(Checked(config).hidden));
        return SwingPolicy{net, net.Initial(static_cast<uint64_t>(config.seed))};
      }()) {
  config_.starts = config.starts;
}

BoardSearch::BoardSearch(const BoardSearchConfig& config, const SwingPolicy& first)
    : config_(Checked(config)),
      net_(first.net),
      snes_(first.numbers, Deviations(net_, config.restart, kLinearDeviation), config.mean_rate,
            static_cast<uint64_t>(config.seed)),
      rng_(static_cast<uint64_t>(config.seed), "realaigym: search"),
      best_(first.numbers),
      average_(first.numbers) {
  config_.starts = 0;
}

int BoardSearch::generations() const {
  return static_cast<int>(config_.starts * config_.alone + config_.generations);
}

std::vector<double> BoardSearch::NominalFitnesses(
    const std::vector<std::vector<double>>& candidates, ThreadPool* pool) const {
  BoardEpisode nominal = twin_ ? EpisodeOf(*twin_) : BoardEpisode{};
  nominal.steps = kShortSteps;
  const std::vector<BoardEpisode> episodes(candidates.size(), nominal);
  const auto make = [&](size_t first) {
    const std::vector<std::span<const double>> numbers(
        candidates.begin() + static_cast<std::ptrdiff_t>(first),
        candidates.begin() +
            static_cast<std::ptrdiff_t>(std::min(first + kBoardBlock, candidates.size())));
    return net_.Control(numbers, 1);
  };
  std::vector<double> fitness;
  for (const BoardOutcome& outcome : SimulateOnBoard(net_.robot(), episodes, make, pool)) {
    fitness.push_back(NominalFitness(outcome, 1));
  }
  return fitness;
}

std::vector<double> BoardSearch::Fitnesses(const std::vector<std::vector<double>>& candidates,
                                           double performance_weight, ThreadPool* pool) {
  const std::vector<DrawnEpisode> drawn = DrawEpisodes();
  std::vector<BoardEpisode> all;
  for (size_t k = 0; k < candidates.size(); ++k) {
    for (const DrawnEpisode& each : drawn) all.push_back(each.episode);
  }
  const std::vector<std::span<const double>> numbers(candidates.begin(), candidates.end());
  const auto make = [&](size_t first) {
    return net_.Control(std::span(numbers).subspan(first / kSwingGroup), kSwingGroup);
  };
  const std::vector<BoardOutcome> outcomes = SimulateOnBoard(net_.robot(), all, make, pool);
  std::vector<double> fitness(candidates.size(), 0.0);
  for (size_t i = 0; i < all.size(); ++i) {
    const DrawnEpisode& each = drawn[i % kSwingGroup];
    const BoardOutcome& o = outcomes[i];
    fitness[i / kSwingGroup] += each.weight == 0
                                    ? NominalFitness(o, performance_weight)
                                    : each.weight * ((o.at_goal ? 0.6 : 0) + 0.4 * o.held);
  }
  return fitness;
}

std::vector<DrawnEpisode> BoardSearch::DrawEpisodes() {
  if (!twin_) return BoardEpisodes(rng_);
  std::vector<DrawnEpisode> drawn{{0, EpisodeOf(*twin_)}};
  while (drawn.size() < kSwingGroup) {
    drawn.push_back({1.0 / (kSwingGroup - 1), DrawEpisode(*twin_, net_.robot(), rng_)});
  }
  return drawn;
}

void BoardSearch::Begin(int64_t start) {
  const auto seed = static_cast<uint64_t>(config_.seed) + static_cast<uint64_t>(start) * 1'000'003;
  snes_ = Snes(net_.Initial(seed), Deviations(net_, config_.deviation, kLinearDeviation),
               config_.mean_rate, seed);
}

bool BoardSearch::Step(ThreadPool* pool, Report& report) {
  if (generation_ >= generations()) return false;
  const int64_t first = config_.starts * config_.alone;
  const bool alone = generation_ < first;
  if (alone && generation_ % config_.alone == 0) Begin(generation_ / config_.alone);
  const auto& candidates =
      snes_.Ask(static_cast<int>(alone ? config_.first_population : config_.population));
  const double part = static_cast<double>(generation_ - first) /
                      static_cast<double>(std::max<int64_t>(1, config_.generations));
  const double weight =
      config_.performance_weight * std::pow(config_.last_weight / config_.performance_weight, part);
  const std::vector<double> fitness =
      alone ? NominalFitnesses(candidates, pool) : Fitnesses(candidates, weight, pool);
  snes_.Tell(fitness);
  ++generation_;
  const int64_t round = alone ? config_.alone : 50;
  report = {generation_, alone ? static_cast<int>((generation_ - 1) / config_.alone + 1) : 0,
            (generation_ - (alone ? 0 : first)) % round == 0, *std::ranges::max_element(fitness)};
  if (alone && generation_ % config_.alone == 0 && report.best_fitness > best_fitness_) {
    best_fitness_ = report.best_fitness;
    best_ = snes_.mean();
  }
  if (generation_ == first) {
    snes_ = Snes(best_, Deviations(net_, config_.restart, kLinearDeviation), config_.mean_rate,
                 static_cast<uint64_t>(config_.seed));
  }
  // Average of the last means, which wander about a good point.
  constexpr double kKept = 0.97;
  for (size_t i = 0; i < average_.size(); ++i) {
    const double now = snes_.mean()[i];
    average_[i] = generation_ <= first ? now : kKept * average_[i] + (1 - kKept) * now;
  }
  return true;
}

BoardOutcome BoardSearch::Nominal() const {
  const std::array nominal{twin_ ? EpisodeOf(*twin_) : BoardEpisode{}};
  return SimulateOnBoard(
             net_.robot(), nominal, [&](size_t) { return net_.Control(average_); }, nullptr)
      .front();
}

}  // namespace upswing::realaigym
