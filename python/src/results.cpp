#include "results.hpp"

#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "trihedron/io/attitude.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/config.hpp"
#include "trihedron/records/drift_models.hpp"
#include "trihedron/records/status.hpp"

namespace trihedron::python {
namespace nb = nanobind;
using nb::literals::operator""_a;
namespace {

/// Of an array whose owner is another than the object that it is a property of.
constexpr auto kOwned = nb::rv_policy::reference;

std::string severity_of(const Finding& finding) { return std::string(name_of(finding.severity)); }

std::vector<std::string> names_of(const std::vector<ParameterId>& parameters) {
  std::vector<std::string> names;
  for (const ParameterId& its : parameters) {
    names.push_back(name_of(its));
  }
  return names;
}

nb::typed<nb::dict, std::string, long> dict_of(const std::vector<NamedCount>& counts) {
  nb::typed<nb::dict, std::string, long> dict;
  for (const NamedCount& its : counts) {
    dict[nb::str(its.name.data(), its.name.size())] = its.count;
  }
  return dict;
}

nb::typed<nb::dict, std::string, double> dict_of(const Statistics& statistics) {
  nb::typed<nb::dict, std::string, double> dict;
  for (const auto& [name, value] : named_values(statistics)) {
    dict[nb::str(name.data(), name.size())] = value;
  }
  return dict;
}

/// An attitude as arrays that keep `owner` alive.
struct AttitudeView {
  const AttitudeHistory* its;
  nb::object owner;
};

void bind_attitude(nb::module_& module) {
  nb::class_<AttitudeView>(module, "AttitudeArrays", "An attitude: arrays of one row for each epoch, without copies")
      .def_prop_ro(
          "t_ns", [](const AttitudeView& v) { return view(v.its->t, v.owner); }, kOwned,
          "Nanoseconds TAI since 1958, shape (n,)")
      .def_prop_ro(
          "q_in_c", [](const AttitudeView& v) { return view(v.its->q_in_c, v.owner); }, kOwned,
          "x, y, z, w, Hamilton; shape (n, 4)")
      .def_prop_ro(
          "sigma_rad", [](const AttitudeView& v) { return view(v.its->sigma_rad, v.owner); }, kOwned,
          "1-sigma about c x, y, z; shape (n, 3), or (0, 3) where it is not known")
      .def_prop_ro(
          "age_s", [](const AttitudeView& v) { return view(std::span(v.its->age_s), v.owner); }, kOwned,
          "Since the last astro-correction; shape (n,), or (0,) where it is not known");
}

AttitudeView attitude_view(const AttitudeHistory& attitude, nb::handle owner) { return {&attitude, nb::borrow(owner)}; }

void bind_verdict(nb::module_& module) {
  nb::class_<Finding>(module, "Finding", "One thing that a user of a result must know")
      .def_prop_ro(
          "code", [](const Finding& its) { return std::string(name_of(its.code)); }, "Stable, for programs")
      .def_ro("text", &Finding::text, "What was seen")
      .def_ro("evidence", &Finding::evidence, "The numbers behind it")
      .def_ro("cure", &Finding::cure, "What to do about it")
      .def_prop_ro("severity", severity_of, "note, warning or do-not-use")
      .def("__repr__", [](const Finding& its) { return severity_of(its) + ": " + its.text; });
  nb::class_<Verdict>(module, "Verdict", "Whether a result may be used, and everything that was found")
      .def_ro("trustworthy", &Verdict::trustworthy)
      .def_ro("findings", &Verdict::findings)
      .def("__bool__", [](const Verdict& its) { return its.trustworthy; })
      .def("__repr__", [](const Verdict& its) {
        return std::string(its.trustworthy ? "trustworthy" : "do not use") + ", " +
               std::to_string(its.findings.size()) + (its.findings.size() == 1 ? " finding" : " findings");
      });
}

void bind_forecast(nb::module_& module) {
  nb::class_<ForecastColumns>(module, "PredictedErrors",
                              "Attitude error predicted for an open loop, by the time since the astro-correction")
      .def_prop_ro(
          "after_s",
          [](nb::pointer_and_handle<ForecastColumns> self) { return view(std::span(self.p->after_s), self.h); })
      .def_prop_ro(
          "sigma_rad", [](nb::pointer_and_handle<ForecastColumns> self) { return view(self.p->sigma_rad, self.h); },
          "1-sigma about c x, y, z; shape (n, 3)")
      .def_prop_ro(
          "error_68_rad",
          [](nb::pointer_and_handle<ForecastColumns> self) { return view(std::span(self.p->error_68_rad), self.h); },
          "Total error that is not exceeded in 68 % of cases")
      .def_prop_ro(
          "error_95_rad",
          [](nb::pointer_and_handle<ForecastColumns> self) { return view(std::span(self.p->error_95_rad), self.h); },
          "In 95 %")
      .def_prop_ro(
          "error_997_rad",
          [](nb::pointer_and_handle<ForecastColumns> self) { return view(std::span(self.p->error_997_rad), self.h); },
          "In 99.7 %");
  nb::class_<AccuracyForecast>(module, "AccuracyForecast", "How long an accuracy is predicted to be kept")
      .def_ro("limit_rad", &AccuracyForecast::limit_rad)
      .def_prop_ro(
          "within_s", [](const AccuracyForecast& its) { return to_seconds(its.within); },
          "Until the 99.7 % error first passes the limit")
      .def_ro("is_lower_bound", &AccuracyForecast::is_lower_bound, "The limit was not passed")
      .def("__repr__", [](const AccuracyForecast& its) { return in_words(its); });
  nb::class_<NeedForecast>(module, "NeedForecast", "A need, and whether it is predicted to be met")
      .def_ro("met", &NeedForecast::met)
      .def("__repr__", [](const NeedForecast& its) { return in_words(its.need) + (its.met ? ": met" : ": not met"); })
      .def_ro("error_997_rad", &NeedForecast::error_997_rad)
      .def_ro("accuracy", &NeedForecast::accuracy);
  nb::class_<OpenLoopForecast>(module, "Forecast", "Of an open loop from an astro-correction at the end of the pass")
      .def_prop_ro("errors", [](const OpenLoopForecast& its) { return ForecastColumns(its.errors); })
      .def_ro("usual", &OpenLoopForecast::usual, "For the usual limit, 5 arcminutes")
      .def_ro("need", &OpenLoopForecast::need, "Where one was stated")
      .def("__repr__", [](const OpenLoopForecast& its) { return in_words(its.usual); });
}

void bind_residuals(nb::module_& module) {
  nb::class_<io::Column>(module, "Column", "One variable of a table of residuals")
      .def_ro("name", &io::Column::name)
      .def_ro("units", &io::Column::units)
      .def_ro("long_name", &io::Column::long_name)
      .def_prop_ro("values",
                   [](nb::pointer_and_handle<io::Column> self) { return view(std::span(self.p->values), self.h); });
  nb::class_<io::Table>(module, "ResidualTable", "Columns over common times, as a group of residuals.nc")
      .def_ro("group", &io::Table::group)
      .def_prop_ro("t_ns", [](nb::pointer_and_handle<io::Table> self) { return view(self.p->t, self.h); })
      .def_prop_ro("columns", [](nb::pointer_and_handle<io::Table> self) {
        nb::typed<nb::list, io::Column> columns;
        for (io::Column& its : self.p->columns) {
          columns.append(nb::cast(&its, nb::rv_policy::reference_internal, self.h));
        }
        return columns;
      });
}

void bind_calibration(nb::module_& module) {
  using Self = nb::pointer_and_handle<CalibrationResult>;
  nb::class_<CalibrationResult>(module, "CalibrationResult", "A calibration of a pass")
      .def_prop_ro(
          "json", [](const CalibrationResult& its) { return io::format_calibration(its.run.calibration); },
          "The text of calibration.json")
      .def_prop_ro("states", [](const CalibrationResult& its) { return names_of(its.run.calibration.states); })
      .def_prop_ro(
          "values",
          [](const CalibrationResult& its) {
            Eigen::VectorXd values(static_cast<Eigen::Index>(its.run.calibration.states.size()));
            for (Eigen::Index i = 0; i < values.size(); ++i) {
              values(i) = value_of(its.run.calibration, its.run.calibration.states[static_cast<std::size_t>(i)]);
            }
            return owned(values);
          },
          kOwned, "Of the states: rad/s; components of the rotation vector, rad")
      .def_prop_ro(
          "covariance", [](Self self) { return view(self.p->run.calibration.covariance, self.h); },
          "Of the errors of the states, estimate - truth: rad/s, rad; shape (n, n)")
      .def_prop_ro("verdict",
                   [](const CalibrationResult& its) -> const Verdict& { return its.run.calibration.verdict; })
      .def_prop_ro("forecast",
                   [](const CalibrationResult& its) -> const std::optional<OpenLoopForecast>& {
                     return its.run.calibration.forecast;
                   })
      .def_prop_ro("statistics", [](const CalibrationResult& its) { return dict_of(its.run.calibration.statistics); })
      .def_prop_ro("fix_counts", [](const CalibrationResult& its) { return dict_of(named_counts(its.run.fix_counts)); })
      .def_prop_ro("sample_counts", [](const CalibrationResult& its) { return dict_of(named_counts(its.run.samples)); })
      .def_prop_ro(
          "settings", [](const CalibrationResult& its) { return io::format_config(its.run.options); },
          "As decided: the text of a settings file")
      .def_prop_ro(
          "drift_models",
          [](const CalibrationResult& its) {
            std::vector<std::tuple<std::string, int, double, double>> models;
            for (const DriftModelForecast& model : its.run.drift_models) {
              models.emplace_back(name_of(model.drift_model), model.drift_model.size(), model.open_loop_rms_rad,
                                  model.log_likelihood);
            }
            return models;
          },
          "That were compared: name, coefficients of each gyro, forecast error in rad, ln likelihood")
      .def_prop_ro("attitude", [](Self self) { return attitude_view(self.p->run.attitude, self.h); })
      .def_prop_ro("definitive_attitude",
                   [](Self self) { return attitude_view(self.p->run.definitive_attitude, self.h); })
      .def_prop_ro("navigation", [](Self self) { return attitude_view(self.p->run.navigation, self.h); })
      .def_prop_ro(
          "tables",
          [](Self self) {
            nb::typed<nb::list, io::Table> tables;
            for (io::Table& its : self.p->tables) {
              tables.append(nb::cast(&its, nb::rv_policy::reference_internal, self.h));
            }
            return tables;
          },
          "Residuals and the estimates along the pass")
      .def_prop_ro("epoch_ns",
                   [](const CalibrationResult& its) { return its.run.calibration.epoch.time_since_epoch().count(); })
      .def(
          "format_attitude",
          [](const CalibrationResult& its, bool definitive) {
            const PassSettings& settings = its.pass->pass().settings;
            return io::format_attitude(
                its.run.calibration.epoch, definitive ? its.run.definitive_attitude : its.run.attitude,
                io::AttitudeDigits::kTwelveDecimals, {}, settings.star_tracker_mounting_rotation_vector_rad);
          },
          "definitive"_a, "The text of attitude.csv");
}

void bind_navigation(nb::module_& module) {
  using Self = nb::pointer_and_handle<NavigationResult>;
  nb::class_<NavigationResult>(module, "NavigationResult", "The attitude of a pass by the open-loop navigator")
      .def_prop_ro("attitude", [](Self self) { return attitude_view(self.p->run.attitude, self.h); })
      .def_prop_ro("verdict", [](const NavigationResult& its) -> const Verdict& { return its.run.verdict; })
      .def_prop_ro(
          "forecast",
          [](const NavigationResult& its) -> const std::optional<OpenLoopForecast>& { return its.run.forecast; })
      .def_prop_ro("statistics", [](const NavigationResult& its) { return dict_of(its.run.statistics); })
      .def_prop_ro(
          "corrections", [](const NavigationResult& its) { return its.run.corrections; }, "Astro-corrections made")
      .def_prop_ro(
          "epoch_ns",
          [](const NavigationResult& its) { return its.pass->pass().settings.epoch.time_since_epoch().count(); })
      .def(
          "format_attitude",
          [](const NavigationResult& its) {
            const PassSettings& settings = its.pass->pass().settings;
            return io::format_attitude(settings.epoch, its.run.attitude, io::AttitudeDigits::kTwelveDecimals, {},
                                       settings.star_tracker_mounting_rotation_vector_rad);
          },
          "The text of an attitude file");
}

void bind_observation(nb::module_& module) {
  using ground::Combination;
  using Self = nb::pointer_and_handle<ObservationResult>;
  nb::class_<Combination>(module, "Combination", "Parameters that only move together")
      .def_ro("text", &Combination::text)
      .def_prop_ro(
          "direction", [](nb::pointer_and_handle<Combination> self) { return view(self.p->direction, self.h); },
          "By parameter, each in its prior sigma")
      .def_ro("singular_value", &Combination::singular_value)
      .def_ro("attitude_error_rad", &Combination::attitude_error_rad)
      .def_ro("is_unobservable", &Combination::is_unobservable)
      .def_ro("is_harmful", &Combination::is_harmful)
      .def("__repr__", [](const Combination& its) { return its.text; });
  nb::class_<ObservationResult>(module, "ObservationResult", "What a pass can tell of the parameters")
      .def_prop_ro("parameters", [](const ObservationResult& its) { return names_of(its.its.parameters); })
      .def_prop_ro(
          "prior_sigma", [](Self self) { return view(self.p->its.prior_sigma, self.h); },
          "rad/s, rad, or the unit of the further state")
      .def_prop_ro(
          "sigma", [](Self self) { return view(self.p->its.sigma, self.h); }, "By prior and measurements")
      .def_prop_ro("covariance", [](Self self) { return view(self.p->its.covariance, self.h); })
      .def_prop_ro(
          "singular_values", [](Self self) { return view(self.p->its.singular_values, self.h); },
          "Prior sigma over that by the measurements alone, largest first")
      .def_prop_ro("t_ns", [](Self self) { return view(self.p->its.t, self.h); })
      .def_prop_ro(
          "sigma_until",
          [](const ObservationResult& its) {
            Eigen::MatrixXd sigmas(static_cast<Eigen::Index>(its.its.parameters.size()),
                                   static_cast<Eigen::Index>(its.its.sigma_until.size()));
            for (Eigen::Index i = 0; i < sigmas.cols(); ++i) {
              sigmas.col(i) = its.its.sigma_until[static_cast<std::size_t>(i)];
            }
            return owned(sigmas);
          },
          kOwned, "sigma by the measurements up to each of t; shape (parameters, times)")
      .def_prop_ro("rank", [](const ObservationResult& its) { return its.its.rank; })
      .def_prop_ro(
          "attitude_error_rad", [](const ObservationResult& its) { return its.its.attitude_error_rad; },
          "rms per axis by what the parameters leave, between corrections and slewing")
      .def_prop_ro("is_harmful", [](const ObservationResult& its) { return its.its.is_harmful(); })
      .def_prop_ro("weak",
                   [](Self self) {
                     nb::typed<nb::list, Combination> weak;
                     for (Combination& its : self.p->its.weak) {
                       weak.append(nb::cast(&its, nb::rv_policy::reference_internal, self.h));
                     }
                     return weak;
                   })
      .def_prop_ro("epoch_ns", [](const ObservationResult& its) {
        return its.pass->pass().settings.epoch.time_since_epoch().count();
      });
}

void bind_evaluation(nb::module_& module) {
  using ground::AttitudeErrors;
  using ground::AttitudeEvaluation;
  using ground::OpenLoops;
  using Self = nb::pointer_and_handle<AttitudeErrors>;
  nb::class_<AttitudeErrors>(module, "AttitudeErrors", "Errors of an attitude, solution - reference, about c x, y, z")
      .def_prop_ro("t_ns", [](Self self) { return view(self.p->t, self.h); })
      .def_prop_ro(
          "error_rad", [](Self self) { return view(self.p->error_rad, self.h); }, "Shape (n, 3)")
      .def_prop_ro(
          "sigma_rad", [](Self self) { return view(self.p->sigma_rad, self.h); },
          "As the solution claims, with the noise of fixes where they are the reference; shape (n, 3)");
  nb::class_<AttitudeEvaluation>(module, "AttitudeEvaluation", "Errors of an attitude against a reference")
      .def_prop_ro(
          "reference", [](const AttitudeEvaluation& its) { return std::string(name_of(its.reference)); },
          "truth or star tracker")
      .def_ro("errors", &AttitudeEvaluation::errors)
      .def_prop_ro(
          "rms_rad", [](const AttitudeEvaluation& its) { return owned(Eigen::VectorXd(its.whole.rms_rad)); }, kOwned,
          "About c x, y, z")
      .def_prop_ro("max_total_rad", [](const AttitudeEvaluation& its) { return its.whole.max_total_rad; });
  nb::class_<OpenLoops>(module, "OpenLoops", "Both open loops from one astro-correction to the end of the pass")
      .def_prop_ro("corrected_ns",
                   [](const OpenLoops& its) { return its.intervals.calibrated.corrected.time_since_epoch().count(); })
      .def_ro("known_before", &OpenLoops::known_before, "With the parameters known before the pass")
      .def_ro("calibrated", &OpenLoops::calibrated, "With those calibrated until the correction")
      .def_prop_ro("predicted", [](const OpenLoops& its) { return ForecastColumns(its.predicted); });
  nb::class_<EvaluationResult>(module, "EvaluationResult", "How a calibration compares with a reference")
      .def_prop_ro("epoch_ns", [](const EvaluationResult& its) { return its.epoch.time_since_epoch().count(); })
      .def_prop_ro(
          "attitude", [](const EvaluationResult& its) -> const AttitudeEvaluation& { return its.its.attitude; },
          "Of the calibration itself")
      .def_prop_ro(
          "navigation", [](const EvaluationResult& its) -> const AttitudeEvaluation& { return its.its.navigation; },
          "Of the navigator, corrected now and then")
      .def_prop_ro("open_loops",
                   [](nb::pointer_and_handle<EvaluationResult> self) {
                     nb::typed<nb::list, OpenLoops> loops;
                     for (OpenLoops& its : self.p->its.open_loops) {
                       loops.append(nb::cast(&its, nb::rv_policy::reference_internal, self.h));
                     }
                     return loops;
                   })
      .def_prop_ro(
          "estimate_minus_truth",
          [](nb::pointer_and_handle<EvaluationResult> self) { return view(self.p->its.estimate_minus_truth, self.h); },
          "By state; empty without a truth");
}

}  // namespace

ForecastColumns::ForecastColumns(const std::vector<PredictedError>& errors) {
  for (const PredictedError& its : errors) {
    after_s.push_back(to_seconds(its.after));
    sigma_rad.emplace_back(its.covariance_rad2.diagonal().cwiseSqrt());
    error_68_rad.push_back(its.error_68_rad);
    error_95_rad.push_back(its.error_95_rad);
    error_997_rad.push_back(its.error_997_rad);
  }
}

void bind_results(nb::module_& module) {
  bind_attitude(module);
  bind_verdict(module);
  bind_forecast(module);
  bind_residuals(module);
  bind_calibration(module);
  bind_navigation(module);
  bind_observation(module);
  bind_evaluation(module);
}

}  // namespace trihedron::python
