#include "trihedron/ground/calibrate/history.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

namespace trihedron::ground {
namespace {

std::vector<StartUp> start_ups_of(const std::vector<CatalogueEntry>& catalogue) {
  std::map<std::string, const CatalogueEntry*> best;
  for (const CatalogueEntry& entry : catalogue) {
    if (!entry.calibration.verdict.trustworthy) {
      continue;
    }
    const CatalogueEntry*& held = best[entry.start_up];
    const auto rank = [](const CatalogueEntry& one) { return std::pair(one.passes, one.calibration.t); };
    if (held == nullptr || rank(entry) > rank(*held)) {
      held = &entry;
    }
  }
  std::vector<StartUp> start_ups;
  start_ups.reserve(best.size());
  for (const auto& [name, entry] : best) {
    start_ups.push_back({name, &entry->calibration});
  }
  std::ranges::sort(start_ups, {}, [](const StartUp& start_up) { return start_up.calibration->t; });
  return start_ups;
}

StartUpChange change_of(const StartUp& from, const StartUp& to) {
  const Calibration& a = *from.calibration;
  const Calibration& b = *to.calibration;
  StartUpChange change{from.name, to.name, {}, {}, {}};
  for (const bool alignments : {false, true}) {
    const std::vector<ParameterId> states = common_states(a, b, alignments);
    const Eigen::VectorXd moved = difference(a, b, states);
    const auto rows_a = rows_of(a, states);
    const auto rows_b = rows_of(b, states);
    const Eigen::MatrixXd covariance = a.covariance(rows_a, rows_a) + b.covariance(rows_b, rows_b);
    for (Eigen::Index i = 0; i < moved.size(); ++i) {
      change.parameters.push_back({states[static_cast<std::size_t>(i)], moved(i), std::sqrt(covariance(i, i))});
    }
    (alignments ? change.alignments : change.coefficients) = agreement(moved, covariance);
  }
  return change;
}

std::vector<Spread> spreads_of(const std::vector<StartUp>& start_ups, const std::vector<ParameterId>& states) {
  std::vector<Spread> spreads;
  for (const ParameterId& state : states) {
    std::vector<double> values;
    std::vector<double> sigmas;
    for (const StartUp& start_up : start_ups) {
      const double sigma = sigma_of(*start_up.calibration, state);
      if (!std::isnan(sigma)) {
        values.push_back(value_of(*start_up.calibration, state));
        sigmas.push_back(sigma);
      }
    }
    if (values.size() > 1) {
      spreads.push_back(spread_of(values, sigmas));
      spreads.back().state = state;
    }
  }
  return spreads;
}

std::vector<Finding> findings_of(const std::vector<StartUpChange>& changes) {
  std::vector<Finding> findings;
  for (const StartUpChange& change : changes) {
    if (!change.alignments.holds()) {
      findings.push_back({FindingCode::kAlignmentMoved,
                          fmt::format("From start-up {} to {} the alignments changed, which a start does not explain.",
                                      change.from, change.to),
                          change.alignments.text(),
                          "Look for what turned a gyro or the star tracker, or for sigmas that are too small."});
    }
  }
  return findings;
}

}  // namespace

std::vector<ParameterId> states_of(const std::vector<CatalogueEntry>& catalogue) {
  std::vector<ParameterId> states;
  std::set<ParameterId> seen;
  for (const CatalogueEntry& entry : catalogue) {
    std::ranges::copy_if(entry.calibration.states, std::back_inserter(states), [&](const ParameterId& state) {
      return (state.is_drift() || state.is_alignment()) && seen.insert(state).second;
    });
  }
  return states;
}

History compare_start_ups(const std::vector<CatalogueEntry>& catalogue) {
  History history;
  history.start_ups = start_ups_of(catalogue);
  for (std::size_t i = 1; i < history.start_ups.size(); ++i) {
    history.changes.push_back(change_of(history.start_ups[i - 1], history.start_ups[i]));
  }
  history.spreads = spreads_of(history.start_ups, states_of(catalogue));
  history.findings = findings_of(history.changes);
  return history;
}

Spread spread_of(const std::vector<double>& values, const std::vector<double>& sigmas) {
  const auto count = static_cast<Eigen::Index>(values.size());
  const Eigen::ArrayXd x = Eigen::ArrayXd::Map(values.data(), count);
  const Eigen::ArrayXd own = Eigen::ArrayXd::Map(sigmas.data(), count).square();
  const auto weights = [&](double variance) { return Eigen::ArrayXd((own + variance).inverse()); };
  const auto mean = [&](const Eigen::ArrayXd& weight) { return (weight * x).sum() / weight.sum(); };
  // Falls as the variance between start-ups grows.
  const auto excess = [&](double variance) {
    const Eigen::ArrayXd weight = weights(variance);
    return (weight * (x - mean(weight)).square()).sum() - static_cast<double>(count - 1);
  };
  double low = 0;
  double high = excess(0) > 0 ? (x - x.mean()).square().sum() : 0;
  for (int halving = 0; halving < 100 && low < high; ++halving) {
    const double middle = (low + high) / 2;
    (excess(middle) > 0 ? low : high) = middle;
  }
  const Eigen::ArrayXd weight = weights(high);
  return {{}, static_cast<int>(count), mean(weight), std::sqrt(high), std::sqrt(high + 1 / weight.sum())};
}

}  // namespace trihedron::ground
