#include "runs/run_rows.h"

namespace upswing {

Row EpisodeRow(const TrainState& s, const FinishedEpisode& episode, const EnvSpec& spec) {
  Row row{{"step", s.steps},
          {"episode", s.episodes},
          {"return", episode.reward_sum},
          {"length", episode.length},
          {"terminated", episode.terminated ? 1 : 0}};
  const std::vector<std::string>& names = spec.term_names;
  for (size_t k = 0; k < names.size(); ++k) row.emplace_back(names[k], episode.terms[k]);
  return row;
}

Row MetricsRow(const TrainState& s, const Metrics& metrics) {
  Row row{{"step", s.steps}, {"episodes", s.episodes}};
  row.insert(row.end(), metrics.begin(), metrics.end());
  row.emplace_back("mean_return", s.mean_return());
  row.emplace_back("success_rate", s.last_success_rate);
  row.emplace_back("seconds", s.seconds);
  return row;
}

Row EvaluationCells(const TrainState& s, const Evaluation& e) {
  Row row{{"step", s.steps},
          {"success_rate", e.success_rate()},
          {"success_low", e.success_interval.low},
          {"success_high", e.success_interval.high}};
  for (const EvaluationFigure& figure : EvaluationFigures()) {
    if (figure.column != nullptr) row.emplace_back(figure.column, figure.Of(e));
  }
  row.emplace_back("seconds", s.seconds);
  return row;
}

}  // namespace upswing
