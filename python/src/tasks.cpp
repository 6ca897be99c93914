#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "bindings.hpp"
#include "results.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/evaluate/calibration_evaluation.hpp"
#include "trihedron/ground/observe/observe.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/residuals.hpp"
#include "work.hpp"

namespace trihedron::python {
namespace nb = nanobind;
using nb::literals::operator""_a;
namespace {

using SharedPass = std::shared_ptr<ScreenedPass>;

}  // namespace

void bind_work(nb::module_& module) {
  module.def(
      "calibrate",
      [](const SharedPass& pass, const std::string& settings, bool definitive, const nb::object& progress) {
        CalibrationOptions options = options_of(settings);
        options.definitive_attitude = definitive;
        return interruptible_result(progress, [&](const Progress& meter) {
          auto result = std::make_shared<CalibrationResult>();
          result->pass = pass;
          result->run = ground::calibrate(pass->pass(), options, meter);
          result->tables = io::residual_tables(result->run);
          return result;
        });
      },
      "screened"_a, "settings"_a, "definitive"_a, "progress"_a.none());

  module.def(
      "navigate",
      [](const SharedPass& pass, const std::string& settings, bool online,
         const std::optional<std::string>& calibration, const nb::object& progress) {
        CalibrationOptions options = options_of(settings);
        options.corrections.take_parameters = online;
        std::optional<Calibration> held;
        if (calibration) {
          held = io::parse_calibration(*calibration, "calibration");
        }
        return interruptible_result(progress, [&](const Progress& meter) {
          auto result = std::make_shared<NavigationResult>();
          auto its = std::make_shared<ScreenedPass>(*pass);
          if (held) {
            its->loaded.pass.settings.prior = std::move(held);
          }
          result->run = ground::navigate(its->pass(), options, meter);
          result->pass = std::move(its);
          return result;
        });
      },
      "screened"_a, "settings"_a, "online"_a, "calibration"_a.none(), "progress"_a.none());

  module.def(
      "observe",
      [](const SharedPass& pass, const std::string& settings, const nb::object& progress) {
        const CalibrationOptions options = options_of(settings);
        return interruptible_result(progress, [&](const Progress& /*meter*/) {
          return std::make_shared<ObservationResult>(ObservationResult{pass, ground::observe(pass->pass(), options)});
        });
      },
      "screened"_a, "settings"_a, "progress"_a.none());

  module.def(
      "evaluate",
      [](const std::shared_ptr<CalibrationResult>& result, const std::optional<io::TruthInMemory>& truth) {
        return interruptible_result(nb::none(), [&](const Progress& /*meter*/) {
          const Pass& pass = result->pass->pass();
          const std::optional<Truth> its =
              truth ? std::optional(io::truth_of(*truth, "truth", pass.settings.epoch)) : std::nullopt;
          return std::make_shared<EvaluationResult>(EvaluationResult{
              pass.settings.epoch, ground::evaluate_calibration(pass, result->run, its ? &*its : nullptr)});
        });
      },
      "result"_a, "truth"_a.none());
}

}  // namespace trihedron::python
