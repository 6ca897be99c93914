#include "trihedron/ground/onboard/pipeline.hpp"

#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "trihedron/ground/choose/settled.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/config.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/records/status.hpp"

namespace trihedron::python {
namespace nb = nanobind;
using nb::literals::operator""_a;
namespace {

/// An attitude with its covariance, c axes.
struct Attitude {
  Time t{};
  Eigen::VectorXd q_in_c;
  Eigen::MatrixXd covariance_rad2;
};

/// What was done at one event.
struct Report {
  Time t{};
  std::string sample;
  std::string fix;
  std::optional<Time> fix_t;
  int head = 0;
  bool corrected = false;
  double nis = 0;
  Eigen::VectorXd innovation_rad;
  std::vector<std::string> gyros;
  double angle_residual = 0;
};

Report report_of(const StepReport& report, int gyros) {
  Report its;
  its.t = report.t;
  its.sample = report.sample == SampleStatus::kNone ? "" : std::string(name_of(report.sample));
  its.fix = report.fix.status == FixStatus::kNone ? "" : std::string(name_of(report.fix.status));
  if (report.fix.status != FixStatus::kNone) {
    its.fix_t = report.fix.t;
  }
  its.head = report.fix.head;
  its.corrected = report.corrected;
  its.nis = report.fix.nis;
  its.innovation_rad = report.fix.innovation;
  for (int k = 0; k < gyros; ++k) {
    const GyroState state = report.gyros[k];
    its.gyros.emplace_back(state == GyroState::kUsed ? "used" : name_of(state));
  }
  its.angle_residual = report.angle_residual;
  return its;
}

/// The on-board step with what a pass's settings say of it.
class PipelineOfPass {
 public:
  PipelineOfPass(const PassSettings& settings, const CalibrationOptions& options)
      : pipeline_(settings, ground::settled_for_flight(settings, options)) {}

  std::vector<Report> push_gyro(Time t, const GivenMatrix& directions) {
    GyroSample sample;
    sample.t = t;
    for (std::size_t k = 0; k < directions.shape(0) && k < std::size_t{kMaxGyros}; ++k) {
      sample.h_b[static_cast<int>(k)] = Eigen::Vector3d(directions(k, 0), directions(k, 1), directions(k, 2));
    }
    return reports_of(pipeline_.feed(sample));
  }
  std::vector<Report> push_fix(Time t, const GivenVector& q, int head, const std::optional<GivenMatrix>& covariance) {
    StarFix fix;
    fix.t = t;
    fix.q_in_c = Eigen::Quaterniond(q(3), q(0), q(1), q(2));
    fix.head = head;
    if (covariance) {
      const GivenMatrix& its = *covariance;
      fix.covariance.rad2 = {its(0, 0), its(1, 1), its(2, 2), its(0, 1), its(0, 2), its(1, 2)};
    }
    return reports_of(pipeline_.feed(fix));
  }
  std::vector<Report> finish() { return reports_of(pipeline_.finish()); }

  [[nodiscard]] std::optional<Attitude> attitude() const {
    const std::optional<AttitudeSolution> solution = pipeline_.navigation_attitude();
    if (!solution) {
      return std::nullopt;
    }
    return Attitude{pipeline_.t(), Eigen::VectorXd(solution->C_in_c.quaternion().coeffs()),
                    Eigen::MatrixXd(solution->covariance_rad2)};
  }
  [[nodiscard]] const ground::Pipeline& pipeline() const { return pipeline_; }

 private:
  [[nodiscard]] std::vector<Report> reports_of(std::span<const StepReport> reports) const {
    std::vector<Report> its;
    for (const StepReport& report : reports) {
      its.push_back(report_of(report, pipeline_.layout().gyros));
    }
    return its;
  }

  ground::Pipeline pipeline_;
};

}  // namespace

void bind_pipeline(nb::module_& module) {
  nb::class_<Attitude>(module, "Attitude", "An attitude with its covariance")
      .def_prop_ro(
          "t_ns", [](const Attitude& its) { return its.t.time_since_epoch().count(); }, "Nanoseconds TAI since 1958")
      .def_prop_ro(
          "q_in_c", [](nb::pointer_and_handle<Attitude> self) { return view(self.p->q_in_c, self.h); },
          "x, y, z, w, Hamilton")
      .def_prop_ro(
          "covariance_rad2",
          [](nb::pointer_and_handle<Attitude> self) { return view(self.p->covariance_rad2, self.h); },
          "Of the small rotation about c x, y, z; shape (3, 3)");

  nb::class_<Report>(module, "StepReport", "What was done at one event")
      .def_prop_ro(
          "t_ns", [](const Report& its) { return its.t.time_since_epoch().count(); },
          "Of the event: nanoseconds TAI since 1958")
      .def_ro("sample", &Report::sample, "What was done with the gyro sample; empty where the event was none")
      .def_ro("fix", &Report::fix, "What was done with the fix that was dealt with; empty where none was")
      .def_prop_ro(
          "fix_t_ns",
          [](const Report& its) {
            return its.fix_t ? std::optional(its.fix_t->time_since_epoch().count()) : std::nullopt;
          },
          "Of that fix")
      .def_ro("head", &Report::head, "The star tracker that it is of, from 0")
      .def_ro("corrected", &Report::corrected, "The navigator was corrected at that fix")
      .def_ro("nis", &Report::nis, "Normalised innovation squared")
      .def_prop_ro(
          "innovation_rad", [](nb::pointer_and_handle<Report> self) { return view(self.p->innovation_rad, self.h); },
          "Two components for each gyro; empty where the fix was not compared")
      .def_ro("gyros", &Report::gyros, "State of each gyro after this event")
      .def_ro("angle_residual", &Report::angle_residual,
              "Cosine of the angle between the momenta, predicted minus measured")
      .def("__repr__", [](const Report& its) {
        return "<StepReport: sample " + (its.sample.empty() ? "none" : its.sample) + ", fix " +
               (its.fix.empty() ? "none" : its.fix) + (its.corrected ? ", corrected>" : ">");
      });

  nb::class_<PipelineOfPass>(module, "Pipeline", "The on-board step, event by event")
      .def(
          "__init__",
          [](PipelineOfPass* self, const std::string& pass_settings, const std::string& prior, int gyros,
             const std::string& settings, bool online) {
            CalibrationOptions options = options_of(settings);
            options.corrections.take_parameters = online;
            new (self) PipelineOfPass(io::parse_settings(pass_settings, prior, "settings", gyros), options);
          },
          "pass_settings"_a, "prior"_a, "gyros"_a, "settings"_a, "online"_a)
      .def(
          "push_gyro",
          [](PipelineOfPass& self, std::int64_t t_ns, const GivenMatrix& directions) {
            return self.push_gyro(Time(Duration(t_ns)), directions);
          },
          "t_ns"_a, "directions"_a)
      .def(
          "push_fix",
          [](PipelineOfPass& self, std::int64_t t_ns, const GivenVector& q_in_c, int head,
             const std::optional<GivenMatrix>& covariance_rad2) {
            return self.push_fix(Time(Duration(t_ns)), q_in_c, head, covariance_rad2);
          },
          "t_ns"_a, "q_in_c"_a, "head"_a, "covariance_rad2"_a.none())
      .def("finish", &PipelineOfPass::finish)
      .def_prop_ro("attitude", &PipelineOfPass::attitude)
      .def_prop_ro("started", [](const PipelineOfPass& its) { return its.pipeline().started(); })
      .def_prop_ro("gyros", [](const PipelineOfPass& its) { return its.pipeline().layout().gyros; })
      .def_prop_ro("star_trackers", [](const PipelineOfPass& its) { return its.pipeline().layout().star_trackers; })
      .def_prop_ro("settings", [](const PipelineOfPass& its) { return io::format_config(its.pipeline().options()); })
      .def_prop_ro(
          "calibration",
          [](const PipelineOfPass& its) -> std::optional<std::string> {
            return its.pipeline().started() ? std::optional(io::format_calibration(its.pipeline().calibration()))
                                            : std::nullopt;
          },
          "The text of a calibration.json as of the latest sample, without verdict; None before the first fix");
}

}  // namespace trihedron::python
