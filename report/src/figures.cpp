#include "figures.hpp"

#include <algorithm>
#include <array>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <functional>
#include <numeric>

#include "decimate.hpp"
#include "innovations.hpp"
#include "trihedron/core/outlier_gate.hpp"
#include "trihedron/core/telemetry.hpp"
#include "trihedron/records/run.hpp"
#include "units.hpp"

namespace trihedron::report {
namespace {

using nlohmann::json;

/// Number of time bins of a decimated series: about the width in pixels of a figure across the page, or of one in two
/// columns.
constexpr std::size_t kWide = 700;
constexpr std::size_t kHalf = 350;
constexpr std::size_t kTrack = 1500;

/// Number of missing fixes from which on a line is interrupted.
constexpr double kFixesOfGap = 10;

class Figures {
 public:
  Figures(const ReportInput& input, const std::vector<Parameter>& parameters)
      : input_(input),
        run_(input.run),
        parameters_(parameters),
        fix_period_(period_of_fixes(input)),
        fix_step_min_(kFixesOfGap * to_minutes(fix_period_)) {}

  [[nodiscard]] json all() const {
    json data = {{"duration_min", to_minutes(input_.pass.settings.duration)}, {"gyros", run_.calibration.gyros.size()}};
    const auto put = [&](const char* name, json value) {
      if (!value.empty()) {
        data[name] = std::move(value);
      }
    };
    put("parameters", parameters());
    put("corrections", corrections());
    if (input_.evaluation != nullptr) {
      put("navigation", errors(input_.evaluation->navigation.errors));
      put("attitude", errors(input_.evaluation->attitude.errors));
      put("open_loops", open_loops());
    }
    put("forecast", forecast());
    put("innovations", innovations());
    put("histogram", histogram());
    put("nis", nis());
    put("drift_models", drift_models());
    put("correlation", correlation());
    put("tracks", tracks());
    put("angle", angle());
    put("telemetry", telemetry());
    return data;
  }

 private:
  [[nodiscard]] double minutes(Time t) const { return to_minutes(t - run_.calibration.epoch); }

  [[nodiscard]] json parameters() const {
    json figures = json::object();
    const ParameterHistory& history = run_.parameters;
    for (std::size_t column = 0; column < parameters_.size() && !history.t.empty(); ++column) {
      const Parameter& parameter = parameters_[column];
      const double unit = parameter.id.is_alignment() ? kArcsecond_rad : kMicroradian;
      Series series(2, fix_step_min_ + to_minutes(ParameterHistory::kStep));
      for (std::size_t row = 0; row < history.t.size(); ++row) {
        series.add(minutes(history.t[row]),
                   {history.value[row][parameter.row] / unit, history.sigma[row][parameter.row] / unit});
      }
      json figure = series.drawn(kHalf);
      figure["gyro"] = parameter.id.gyro() + 1;
      figure["name"] = short_name_of(parameter.id);
      figure["symbol"] = parameter.symbol;
      figure["final"] = parameter.value / unit;
      figure["final_sigma"] = parameter.sigma / unit;
      if (parameter.truth) {
        figure["truth"] = *parameter.truth / unit;
      }
      if (parameter.converged_min) {
        figure["converged"] = *parameter.converged_min;
      }
      figures[name_of(parameter.id)] = std::move(figure);
    }
    return figures;
  }

  [[nodiscard]] json corrections() const {
    json times = json::array();
    for (const FixRecord& fix : run_.fixes) {
      if (fix.corrected_navigator) {
        times.push_back(rounded(minutes(fix.t), 6));
      }
    }
    return times;
  }

  /// Roll, pitch, heading: error and, where claimed, sigma, ″.
  [[nodiscard]] json errors(const ground::AttitudeErrors& errors) const {
    json axes = json::array();
    for (Eigen::Index axis = 0; axis < 3 && !errors.t.empty(); ++axis) {
      Series series(errors.sigma_rad.empty() ? 1 : 2, fix_step_min_);
      for (std::size_t i = 0; i < errors.t.size(); ++i) {
        const double error = errors.error_rad[i](axis) / kArcsecond_rad;
        if (errors.sigma_rad.empty()) {
          series.add(minutes(errors.t[i]), {error});
        } else {
          series.add(minutes(errors.t[i]), {error, errors.sigma_rad[i](axis) / kArcsecond_rad});
        }
      }
      axes.push_back(series.drawn(kWide));
    }
    return axes;
  }

  /// Per correction the total error over the time since it, ″.
  [[nodiscard]] json open_loops() const {
    const auto total = [&](const ground::AttitudeErrors& errors) {
      Series series(1, fix_step_min_);
      for (std::size_t i = 0; i < errors.t.size(); ++i) {
        series.add(errors.age_s[i] / 60, {errors.error_rad[i].norm() / kArcsecond_rad});
      }
      return series.drawn(kHalf / 2);
    };
    json loops = json::array();
    for (const ground::OpenLoops& one : input_.evaluation->open_loops) {
      if (one.calibrated.t.size() > 1 && one.known_before.t.size() > 1) {
        loops.push_back({{"corrected", rounded(minutes(one.calibrated.t.front()), 6)},
                         {"known_before", total(one.known_before)},
                         {"calibrated", total(one.calibrated)}});
      }
    }
    return loops.empty() ? loops : json{{"limit", input_.evaluation->limit_rad / kArcsecond_rad}, {"loops", loops}};
  }

  /// Of the total error over the time since the correction, min, in steps of this length, ″.
  [[nodiscard]] static Series medians(const ground::AttitudeErrors& errors, double step_min) {
    Series series(1, 2 * step_min);
    for (std::size_t begin = 0; begin < errors.t.size();) {
      const double step = std::floor(errors.age_s[begin] / 60 / step_min);
      std::vector<double> totals;
      for (; begin < errors.t.size() && std::floor(errors.age_s[begin] / 60 / step_min) == step; ++begin) {
        totals.push_back(errors.error_rad[begin].norm() / kArcsecond_rad);
      }
      const auto middle = totals.begin() + static_cast<std::ptrdiff_t>(totals.size() / 2);
      std::ranges::nth_element(totals, middle);
      series.add((step + 0.5) * step_min, {*middle});
    }
    return series;
  }

  /// The predicted total error over the time since the correction, ″, and how far the open loops of the pass have gone.
  [[nodiscard]] json forecast() const {
    const std::optional<OpenLoopForecast>& its = run_.calibration.forecast;
    if (!its || its->errors.size() < 2) {
      return {};
    }
    Series series(3, 2 * to_minutes(its->errors[1].after));
    for (const PredictedError& error : its->errors) {
      series.add(to_minutes(error.after), {error.error_68_rad / kArcsecond_rad, error.error_95_rad / kArcsecond_rad,
                                           error.error_997_rad / kArcsecond_rad});
    }
    json loops = json::array();
    // At the first correction nothing is calibrated yet.
    for (std::size_t i = 1; input_.evaluation != nullptr && i < input_.evaluation->open_loops.size(); ++i) {
      const ground::OpenLoops& one = input_.evaluation->open_loops[i];
      if (one.predicted.size() < 2 || one.calibrated.t.size() < 2) {
        continue;
      }
      const double step_min = to_minutes(one.predicted[1].after);
      Series predicted(1, 2 * step_min);
      for (const PredictedError& error : one.predicted) {
        predicted.add(to_minutes(error.after), {error.error_997_rad / kArcsecond_rad});
      }
      const Series flown = medians(one.calibrated, step_min);
      loops.push_back({{"corrected", rounded(minutes(one.calibrated.t.front()), 6)},
                       {"flown", flown.drawn(kHalf / 2)},
                       {"predicted", predicted.drawn(kHalf / 2)}});
    }
    json figure = {
        {"predicted", series.drawn(kHalf)}, {"limit", its->usual.limit_rad / kArcsecond_rad}, {"loops", loops}};
    if (its->need) {
      figure["need"] = {{"limit", its->need->need.error_rad / kArcsecond_rad},
                        {"interval", to_minutes(its->need->need.interval)}};
    }
    return figure;
  }

  /// Per component the used ones with their sigmas, and the ones that the gate rejected.
  [[nodiscard]] json innovations() const {
    json components = json::array();
    for (std::size_t i = 0; i < innovations_of(run_); ++i) {
      Series used(2, fix_step_min_);
      Series rejected(1, to_minutes(input_.pass.settings.duration));
      for (const FixRecord& fix : run_.fixes) {
        if (fix.status == FixStatus::kUsed) {
          used.add(minutes(fix.t), {fix.innovation[i] / kArcsecond_rad, fix.innovation_sigma[i] / kArcsecond_rad});
        } else if (fix.status == FixStatus::kRejectedByGate) {
          rejected.add(minutes(fix.t), {fix.innovation[i] / kArcsecond_rad});
        }
      }
      if (used.empty() && rejected.empty()) {
        return json::array();
      }
      components.push_back({{"used", used.drawn(kHalf)}, {"rejected", rejected.drawn(kHalf)}});
    }
    return components;
  }

  [[nodiscard]] json histogram() const {
    constexpr double kWidth = 0.25;
    constexpr int kBins = 40;
    std::vector<double> count(kBins, 0);
    double total = 0;
    long outside = 0;
    for_each_normalised(run_.fixes, [&](std::size_t, double value) {
      ++total;
      const int bin = static_cast<int>(std::floor(std::clamp(value / kWidth, -1e6, 1e6))) + kBins / 2;
      if (bin >= 0 && bin < kBins) {
        ++count[static_cast<std::size_t>(bin)];
      } else {
        ++outside;
      }
    });
    if (total == 0) {
      return {};
    }
    const boost::math::normal normal;
    json centre = json::array();
    json density = json::array();
    json expected = json::array();
    for (int bin = 0; bin < kBins; ++bin) {
      const double x = (bin + 0.5 * (1 - kBins)) * kWidth;
      centre.push_back(x);
      density.push_back(rounded(count[static_cast<std::size_t>(bin)] / total / kWidth, 4));
      expected.push_back(rounded(boost::math::pdf(normal, x), 4));
    }
    return {{"x", centre}, {"density", density}, {"normal", expected}, {"width", kWidth}, {"outside", outside}};
  }

  [[nodiscard]] json nis() const {
    Series used(1, fix_step_min_);
    Series rejected(1, to_minutes(input_.pass.settings.duration));
    std::vector<double> t;
    std::vector<double> nis;
    json reopened = json::array();
    for (const FixRecord& fix : run_.fixes) {
      if (fix.status == FixStatus::kUsed) {
        used.add(minutes(fix.t), {fix.nis});
        t.push_back(minutes(fix.t));
        nis.push_back(fix.nis);
      } else if (fix.status == FixStatus::kRejectedByGate) {
        rejected.add(minutes(fix.t), {fix.nis});
      } else if (fix.status == FixStatus::kUsedAfterReopening || fix.status == FixStatus::kRestarted) {
        reopened.push_back(rounded(minutes(fix.t), 6));
      }
    }
    if (used.empty()) {
      return {};
    }
    const auto freedom = static_cast<double>(innovations_of(run_));
    const boost::math::chi_squared one(freedom);
    json figure = {{"used", used.drawn(kWide)},
                   {"rejected", rejected.drawn(kWide)},
                   {"reopened", reopened},
                   {"expected", freedom},
                   {"low", boost::math::quantile(one, 0.025)},
                   {"high", boost::math::quantile(one, 0.975)},
                   {"gate", gate_of_freedom(static_cast<int>(freedom), run_.options.gate_nis)}};
    const std::size_t window = std::min<std::size_t>(100, nis.size());
    const auto sum_freedom = freedom * static_cast<double>(window);
    const boost::math::chi_squared sum(sum_freedom);
    Series mean(1, fix_step_min_);
    double total = std::accumulate(nis.begin(), nis.begin() + static_cast<std::ptrdiff_t>(window), 0.0);
    for (std::size_t end = window; end <= nis.size(); ++end) {
      // At the fix in the middle, so that the line is interrupted where fixes are missing.
      mean.add(t[end - 1 - window / 2], {total / static_cast<double>(window)});
      if (end < nis.size()) {
        total += nis[end] - nis[end - window];
      }
    }
    figure["mean"] = mean.drawn(kWide);
    figure["window"] = window;
    figure["mean_low"] = boost::math::quantile(sum, 0.025) / static_cast<double>(window);
    figure["mean_high"] = boost::math::quantile(sum, 0.975) / static_cast<double>(window);
    return figure;
  }

  [[nodiscard]] json drift_models() const {
    json models = json::array();
    for (const DriftModelForecast& model : run_.drift_models) {
      models.push_back({{"name", name_of(model.drift_model)},
                        {"coefficients", model.drift_model.size()},
                        {"gain", std::round(model.log_likelihood * 10) / 10},
                        {"error", rounded(model.open_loop_rms_rad / kArcsecond_rad, 3)},
                        {"used", model.drift_model == run_.calibration.gyros[0].drift_model}});
    }
    return models;
  }

  [[nodiscard]] json correlation() const {
    json names = json::array();
    json rows = json::array();
    const Eigen::MatrixXd& covariance = run_.calibration.covariance;
    for (std::size_t i = 0; i < parameters_.size(); ++i) {
      names.push_back({{"gyro", parameters_[i].id.gyro() + 1}, {"symbol", parameters_[i].symbol}});
      json row = json::array();
      for (std::size_t j = 0; j < parameters_.size(); ++j) {
        const double rho =
            covariance(static_cast<Eigen::Index>(parameters_[i].row), static_cast<Eigen::Index>(parameters_[j].row)) /
            (parameters_[i].sigma * parameters_[j].sigma);
        row.push_back(std::round(rho * 1000) / 1000);
      }
      rows.push_back(std::move(row));
    }
    return names.empty() ? json{} : json{{"names", names}, {"values", rows}};
  }

  /// Of each momentum in its case axes: x, y, z over time.
  [[nodiscard]] json tracks() const {
    json figures = json::array();
    const GyroTelemetry& gyro = input_.pass.gyro;
    for (int k = 0; k < gyro.gyros && gyro.size() > 0; ++k) {
      Series series(3, kFixesOfGap * to_minutes(input_.pass.settings.gyro_period));
      for (std::size_t i = 0; i < gyro.size(); ++i) {
        const Eigen::Vector3d h = gyro.direction(i, k);
        if (nearly_unit(h.norm())) {
          series.add(minutes(gyro.t[i]), {h.x(), h.y(), h.z()});
        }
      }
      figures.push_back(series.drawn(kTrack));
    }
    return figures;
  }

  /// z1, in 1e-6.
  [[nodiscard]] json angle() const {
    Series series(2, fix_step_min_);
    for (std::size_t i = 0; i < run_.angle_t.size(); ++i) {
      series.add(minutes(run_.angle_t[i]), {run_.angle_residual_min[i] * 1e6, run_.angle_residual_max[i] * 1e6});
    }
    return series.empty() ? json{} : series.drawn(kWide);
  }

  /// Per time bin the fraction of expected samples and fixes that came, by what was done with them.
  [[nodiscard]] json telemetry() const {
    const PassSettings& settings = input_.pass.settings;
    const double duration_min = to_minutes(settings.duration);
    if (!(duration_min > 0)) {
      return {};
    }
    const double width_min = std::max(1.0, std::ceil(duration_min / 180));
    const auto bins = static_cast<std::size_t>(std::ceil(duration_min / width_min));
    const auto bin_of = [&](Time t) {
      return std::min(bins - 1, static_cast<std::size_t>(std::max(0.0, minutes(t) / width_min)));
    };
    using Counts = std::vector<double>;
    const Counts none(bins, 0);

    std::array<Counts, 2> gyro{none, none};  // good, bad
    for (std::size_t i = 0; i < input_.pass.gyro.size(); ++i) {
      bool good = true;
      for (int k = 0; k < input_.pass.gyro.gyros; ++k) {
        good = good && nearly_unit(input_.pass.gyro.direction(i, k).norm());
      }
      ++gyro[good ? 0 : 1][bin_of(input_.pass.gyro.t[i])];
    }
    std::array<Counts, 3> fixes{none, none, none};  // used, rejected by the gate, rejected for another reason
    for (const FixRecord& fix : run_.fixes) {
      const bool by_gate = fix.status == FixStatus::kRejectedByGate;
      ++fixes[fix.used() ? 0 : by_gate ? 1 : 2][bin_of(fix.t)];
    }
    const auto percent = [&](const Counts& counts, Duration period) {
      json result = json::array();
      for (std::size_t bin = 0; bin < bins; ++bin) {
        const double length_min = std::min(width_min, duration_min - static_cast<double>(bin) * width_min);
        result.push_back(rounded(100 * counts[bin] * to_minutes(period) / length_min, 4));
      }
      return result;
    };
    return {
        {"width", width_min},
        {"bins", bins},
        {"gyro", {percent(gyro[0], settings.gyro_period), percent(gyro[1], settings.gyro_period)}},
        {"fixes", {percent(fixes[0], fix_period_), percent(fixes[1], fix_period_), percent(fixes[2], fix_period_)}}};
  }

  /// Of those of the first star tracker that are used where none is rejected.
  static Duration period_of_fixes(const ReportInput& input) {
    for (const CorrelatedFixes& its : input.run.correlated_fixes) {
      if (its.head == 0) {
        return from_seconds(its.apart_s);
      }
    }
    return input.pass.settings.star_tracker_period;
  }

  const ReportInput& input_;
  const CalibrationRun& run_;
  const std::vector<Parameter>& parameters_;
  Duration fix_period_;
  double fix_step_min_;
};

}  // namespace

json figure_data(const ReportInput& input, const std::vector<Parameter>& parameters) {
  return Figures(input, parameters).all();
}

}  // namespace trihedron::report
