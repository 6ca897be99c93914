#include "parts.hpp"

#include <filesystem>
#include <utility>

#include "choose/decide.hpp"
#include "trihedron/core/intake.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/evaluate/calibration_evaluation.hpp"
#include "trihedron/ground/onboard/pipeline.hpp"
#include "trihedron/ground/onboard/recorder.hpp"
#include "trihedron/ground/onboard/replay.hpp"
#include "trihedron/io/attitude.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/io/residuals.hpp"
#include "trihedron/lanes/filter_flight.hpp"
#include "trihedron/report/report.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::bench {
namespace {

namespace fs = std::filesystem;

/// A directory that goes with the program.
class Scratch {
 public:
  Scratch() : path_((fs::temp_directory_path() / "trihedron-bench-XXXXXX").string()) {
    if (mkdtemp(path_.data()) == nullptr) {
      throw std::runtime_error("no temporary directory");
    }
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  [[nodiscard]] fs::path operator/(const char* name) const { return fs::path(path_) / name; }

 private:
  std::string path_;
};

const Scratch& scratch() {
  static const Scratch its;
  return its;
}

const sim::SimulatedPass& nine_hours() {
  static const sim::SimulatedPass its = sim::simulate({});
  return its;
}

std::shared_ptr<const Events> events() {
  static const auto its = std::make_shared<const Events>(events_of(scenario_of(9)));
  return its;
}

Run reading(const char* name) {
  const fs::path path = scratch() / name;
  const sim::SimulatedPass& simulated = nine_hours();
  io::write_pass(path, simulated.pass, &simulated.truth);
  return [path] { static_cast<void>(io::read_pass(path)); };
}

Run intake() {
  const auto its = events();
  return [its] {
    Intake intake(test::nominal_setup());
    std::optional<Time> latest;
    for (const GyroSample& sample : its->samples) {
      GyroSample screened = sample;
      static_cast<void>(intake.look_at_clock(sample.t, latest));
      static_cast<void>(intake.screen(screened));
      latest = sample.t;
    }
  };
}

/// All fixes of the pass, of which each comes 3 s after the last and says what the estimate says already.
Run fixes() {
  const auto its = events();
  const auto on_board = test::PairGiven().on_board({.navigate = false});
  std::optional<ComparedFix> last;
  test::fly(its->samples, its->fixes, *on_board, [&](const StepReport& report) {
    if (report.compared) {
      last = report.compared;
    }
  });
  const auto flown = std::make_shared<test::PairEstimator>(on_board->estimator());
  return [its, flown, last] {
    test::PairEstimator estimator = *flown;
    ComparedFix again = *last;
    const Eigen::Matrix3d C_in_c = again.fix.q_in_c.toRotationMatrix();
    for (std::size_t i = 0; i < its->fixes.size(); ++i) {
      again.fix.t += std::chrono::seconds(3);
      // In one step, so that what a fix does after 3 s is all done.
      estimator.predict(C_in_c, again.readings.h_b, again.fix.t, 3);
      for (int k = 0; k < 2; ++k) {
        again.readings.h_b[k] = estimator.gyros()[k].reading_of(C_in_c.transpose() * estimator.gyros()[k].h_in);
      }
      static_cast<void>(estimator.correct(again.fix, again.readings));
    }
  };
}

Run deciding() {
  const Pass& pass = nine_hours().pass;
  return [&pass] { static_cast<void>(ground::decide(pass, CalibrationOptions{})); };
}

Run calibration(Estimator estimator, bool told, bool definitive = false) {
  const Pass& pass = nine_hours().pass;
  CalibrationOptions options = told ? all_told() : CalibrationOptions{};
  options.estimator = estimator;
  options.definitive_attitude = definitive;
  return [&pass, options] { static_cast<void>(ground::calibrate(pass, options)); };
}

/// So many flights of the filter alone, simulated, filtered and compared with the truth: side by side, or a single one
/// by the on-board step.
Run filter_flights(std::size_t flights) {
  std::vector<lanes::FilterFlight> its(flights);
  for (std::size_t i = 0; i < flights; ++i) {
    its[i].scenario = scenario_of(9);
    its[i].scenario.seed = i + 1;
  }
  return [its] {
    if (its.size() == 1) {
      static_cast<void>(lanes::fly_alone(its.front()));
    } else {
      static_cast<void>(lanes::fly(its));
    }
  };
}

/// What `calibrate` writes besides the report.
Run writing(std::shared_ptr<const CalibrationRun> run) {
  return [run] {
    const Time epoch = run->calibration.epoch;
    io::write_calibration(scratch() / "calibration.json", run->calibration);
    io::write_attitude(scratch() / "attitude.csv", epoch, run->attitude);
    io::write_residuals(scratch() / "residuals.nc", epoch, io::residual_tables(*run));
  };
}

std::shared_ptr<const CalibrationRun> calibrated() {
  static const auto its = std::make_shared<const CalibrationRun>(ground::calibrate(nine_hours().pass, all_told()));
  return its;
}

Run rendering() {
  const auto run = calibrated();
  const auto evaluation = std::make_shared<const ground::CalibrationEvaluation>(
      ground::evaluate_calibration(nine_hours().pass, *run, &nine_hours().truth));
  return [run, evaluation] {
    static_cast<void>(report::render({nine_hours().pass, *run, &nine_hours().truth, {}, evaluation.get()}));
  };
}

}  // namespace

Events events_of(const Scenario& scenario) {
  const sim::SimulatedPass simulated = sim::simulate(scenario);
  Events events;
  ground::Events all(simulated.pass, 1);
  while (const auto event = all.next()) {
    if (const auto* sample = std::get_if<GyroSample>(&*event)) {
      events.samples.push_back(*sample);
    } else {
      events.fixes.push_back(std::get<StarFix>(*event));
    }
  }
  return events;
}

Scenario scenario_of(double hours) {
  Scenario scenario;
  scenario.duration = from_seconds(3600 * hours);
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.outside_sigma_rad_s = 0;
  }
  return scenario;
}

Run on_board(std::shared_ptr<const Events> events, bool navigate) {
  using OnBoardStep = OnBoard<test::PairEstimator>;
  const auto on_board = std::make_shared<OnBoardStep>();
  return [=] {
    const test::PairGiven given;
    TRIHEDRON_ASSERT(!on_board->set_up(given.setup, given.prior, given.covariance, {.navigate = navigate}));
    test::fly(events->samples, events->fixes, *on_board, [](const StepReport&) {});
  };
}

CalibrationOptions all_told() {
  CalibrationOptions options;
  options.drift_model = kEsg7;
  options.find_noise = false;
  options.further_states = FurtherStateOptions::none();
  return options;
}

PipelineRun pipeline(const Scenario& scenario, const CalibrationOptions& options) {
  const auto simulated = std::make_shared<const sim::SimulatedPass>(sim::simulate(scenario));
  const ground::Pipeline probe(simulated->pass.settings, options);
  return {[=] {
            ground::Pipeline pipeline(simulated->pass.settings, options);
            ground::replay(simulated->pass, pipeline, [](const StepReport&) {});
          },
          probe.layout().size()};
}

const std::vector<Part>& parts() {
  static const std::vector<Part> its = {
      {"read NetCDF", [] { return reading("pass.nc"); }},
      {"read CSV", [] { return reading("pass"); }},
      {"intake", intake},
      {"prediction", [] { return filter<test::PairEstimator>(events(), false); }},
      {"fixes", fixes},
      {"filter", [] { return filter<test::PairEstimator>(events()); }},
      {"filter of the paper", [] { return filter<PaperEstimator>(events()); }},
      {"on-board step without navigator", [] { return on_board(events(), false); }},
      {"on-board step", [] { return on_board(events(), true); }},
      {"decisions", deciding},
      {"calibrate, all told", [] { return calibration(Estimator::kInvariant, true); }},
      {"calibrate", [] { return calibration(Estimator::kInvariant, false); }},
      {"batch, all told", [] { return calibration(Estimator::kBatch, true); }},
      {"batch, all told, definitive attitude", [] { return calibration(Estimator::kBatch, true, true); }},
      {"batch", [] { return calibration(Estimator::kBatch, false); }},
      {"flight of the filter alone", [] { return filter_flights(1); }},
      {"eight of them side by side", [] { return filter_flights(lanes::kTogether); }},
      {"report", rendering},
      {"write results", [] { return writing(calibrated()); }},
  };
  return its;
}

}  // namespace trihedron::bench
