#include "trihedron/io/pass.hpp"

#include <nanobind/nanobind.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "trihedron/io/config.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/scenario.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/sim/simulate.hpp"
#include "work.hpp"

namespace trihedron::python {
namespace nb = nanobind;
using nb::literals::operator""_a;
namespace {

io::TableInMemory table_of(const std::string& name, const GivenVector& t_s, const GivenMatrix& values) {
  return {name, {t_s.data(), t_s.data() + t_s.size()}, {values.data(), values.data() + values.size()}, false};
}

struct Simulated {
  io::PassInMemory pass;
  io::TruthInMemory truth;
  double direction_step = 0;
};

Simulated simulated(const Scenario& scenario, const std::string& name) {
  try {
    const sim::SimulatedPass made = sim::simulate(scenario);
    Simulated its;
    its.direction_step = io::format_for(scenario).direction_step;
    its.pass = io::tables_of(made.pass, its.direction_step);
    its.truth = io::tables_of(made.truth, made.pass.settings.epoch);
    return its;
  } catch (const std::invalid_argument& error) {
    throw io::InputRefused(name, {}, error.what(), "correct the scenario");
  }
}

Scenario scenario_of(const std::string& text, const std::string& name) { return io::parse_scenario(text, name); }

template <class Table>
void bind_table(nb::class_<Table>& its) {
  its.def_prop_ro(
         "t_s", [](nb::pointer_and_handle<Table> self) { return view(self.p->t_s, self.h); },
         "Seconds since the epoch of the pass, shape (rows,)")
      .def_ro("name", &Table::name);
}

}  // namespace

CalibrationOptions options_of(const std::string& settings) { return io::parse_config(settings, "settings"); }

void bind_pass(nb::module_& module) {
  nb::class_<io::TableInMemory> table(module, "Table", "A table of a pass, row by row");
  bind_table(table);
  table.def(
      "values",
      [](nb::pointer_and_handle<io::TableInMemory> self, std::size_t columns) {
        return view(self.p->values, columns, self.h);
      },
      "columns"_a, "Shape (rows, columns)");
  table.def_ro("has_covariances", &io::TableInMemory::has_covariances, "Whether its fixes have six more columns");

  nb::class_<io::PassInMemory>(module, "Tables", "Settings and tables of a pass as a file has them")
      .def(
          "__init__",
          [](io::PassInMemory* self, const std::string& name, const std::string& settings, const std::string& prior,
             int gyros, const GivenVector& t_s, const GivenMatrix& directions) {
            new (self) io::PassInMemory{name, settings, prior, gyros, table_of("gyro", t_s, directions), {}};
          },
          "name"_a, "settings"_a, "prior"_a, "gyros"_a, "t_s"_a, "directions"_a)
      .def(
          "add_star_tracker",
          [](io::PassInMemory& self, const std::string& name, const GivenVector& t_s, const GivenMatrix& fixes) {
            self.star_trackers.push_back(table_of(name, t_s, fixes));
            self.star_trackers.back().has_covariances = fixes.shape(1) > 4;
          },
          "name"_a, "t_s"_a, "fixes"_a, "Rows of q_in_c, or of q_in_c and a covariance: 4 or 10 columns")
      .def_ro("settings", &io::PassInMemory::settings, "Text of a pass.toml")
      .def_ro("prior", &io::PassInMemory::prior, "Text of a calibration.json, or empty")
      .def_ro("gyros", &io::PassInMemory::gyros)
      .def_ro("gyro", &io::PassInMemory::gyro)
      .def_prop_ro("star_trackers", [](nb::pointer_and_handle<io::PassInMemory> self) {
        nb::typed<nb::list, io::TableInMemory> tables;
        for (io::TableInMemory& its : self.p->star_trackers) {
          tables.append(nb::cast(&its, nb::rv_policy::reference_internal, self.h));
        }
        return tables;
      });

  nb::class_<io::TruthInMemory>(module, "TruthTable", "The truth of a simulated pass")
      .def(
          "__init__",
          [](io::TruthInMemory* self, const std::string& parameters, int gyros, const GivenVector& t_s,
             const GivenMatrix& values) {
            new (self) io::TruthInMemory{parameters, gyros, table_of("truth", t_s, values)};
          },
          "parameters"_a, "gyros"_a, "t_s"_a, "values"_a)
      .def_ro("parameters", &io::TruthInMemory::parameters, "Text of a truth.json")
      .def_ro("gyros", &io::TruthInMemory::gyros)
      .def_ro("table", &io::TruthInMemory::table);

  nb::class_<Simulated>(module, "Simulated")
      .def_ro("tables", &Simulated::pass)
      .def_ro("truth", &Simulated::truth)
      .def_ro("direction_step", &Simulated::direction_step, "Of the direction cosines, as a file keeps them");

  nb::class_<io::Defect>(module, "Defect", "One kind of defect of a table of telemetry")
      .def_prop_ro("kind", [](const io::Defect& its) { return std::string(io::name_of(its.kind)); })
      .def_ro("where", &io::Defect::where)
      .def_ro("count", &io::Defect::count)
      .def_prop_ro("text", &io::Defect::text, "One sentence for a person")
      .def("__repr__", &io::Defect::text);

  nb::class_<ScreenedPass>(module, "ScreenedPass", "A pass as an estimator takes it")
      .def_prop_ro(
          "defects", [](const ScreenedPass& its) { return its.loaded.defects; }, "What was wrong with its telemetry")
      .def_prop_ro("epoch_ns",
                   [](const ScreenedPass& its) { return its.pass().settings.epoch.time_since_epoch().count(); })
      .def_prop_ro("gyros", [](const ScreenedPass& its) { return its.pass().gyro.gyros; })
      .def_prop_ro("heads", [](const ScreenedPass& its) { return 1 + its.pass().further_star_trackers.size(); })
      .def_prop_ro("gyro_ns",
                   [](nb::pointer_and_handle<ScreenedPass> self) { return view(self.p->pass().gyro.t, self.h); })
      .def_prop_ro("directions",
                   [](nb::pointer_and_handle<ScreenedPass> self) {
                     const GyroTelemetry& gyro = self.p->pass().gyro;
                     return Doubles(gyro.h.data(), {gyro.size(), static_cast<std::size_t>(gyro.gyros), 3}, self.h);
                   })
      .def(
          "fix_ns",
          [](nb::pointer_and_handle<ScreenedPass> self, std::size_t head) {
            const Pass& pass = self.p->pass();
            return view(head == 0 ? pass.star_tracker.t : pass.further_star_trackers.at(head - 1).t, self.h);
          },
          "head"_a)
      .def(
          "q_in_c",
          [](nb::pointer_and_handle<ScreenedPass> self, std::size_t head) {
            const Pass& pass = self.p->pass();
            return view(head == 0 ? pass.star_tracker.q_in_c : pass.further_star_trackers.at(head - 1).q_in_c, self.h);
          },
          "head"_a)
      .def(
          "covariances_rad2",
          [](nb::pointer_and_handle<ScreenedPass> self, std::size_t head) -> std::optional<Doubles> {
            const Pass& pass = self.p->pass();
            const StarTrackerTelemetry& fixes = head == 0 ? pass.star_tracker : pass.further_star_trackers.at(head - 1);
            static_assert(sizeof(FixCovariance) == 6 * sizeof(double));
            return fixes.covariances.empty()
                       ? std::nullopt
                       : std::optional(Doubles(fixes.covariances.front().rad2.data(), {fixes.size(), 6}, self.h));
          },
          "head"_a, "xx, yy, zz, xy, xz, yz; zeros where a fix has none");

  module.def(
      "read_telemetry",
      [](const std::string& file, const std::function<std::string(std::string, std::vector<std::string>)>& others) {
        const io::LoadedPass loaded =
            io::read_telemetry(file, [&](const std::filesystem::path& path, const std::vector<std::string>& columns) {
              return others(path.string(), columns);
            });
        io::PassInMemory tables = io::tables_of(loaded.pass, io::PassFormat{}.direction_step);
        tables.name = file;
        return std::pair(std::move(tables), loaded.defects);
      },
      "file"_a, "others"_a,
      "The pass of a telemetry.toml, screened, and what was wrong with it. others: gives columns of a Parquet or "
      "NetCDF "
      "file as CSV");
  module.def(
      "read_tables", [](const std::string& directory) { return io::read_tables(directory); }, "directory"_a,
      nb::call_guard<nb::gil_scoped_release>(), "The tables of a pass directory");
  module.def(
      "read_truth",
      [](const std::string& directory, std::int64_t epoch_ns) -> std::optional<io::TruthInMemory> {
        const std::optional<Truth> truth = io::read_truth(directory);
        return truth ? std::optional(io::tables_of(*truth, Time(Duration(epoch_ns)))) : std::nullopt;
      },
      "directory"_a, "epoch_ns"_a, nb::call_guard<nb::gil_scoped_release>(), "The truth of a pass directory");
  module.def(
      "screened", [](const io::PassInMemory& tables) { return std::make_shared<ScreenedPass>(io::screened(tables)); },
      "tables"_a, nb::call_guard<nb::gil_scoped_release>(),
      "The pass as an estimator takes it, and what was wrong with it");
  module.def(
      "simulate",
      [](const std::string& scenario, const std::string& name, const nb::object& progress) {
        const Scenario its = scenario_of(scenario, name);
        return interruptible_result(progress, [&](const Progress& /*meter*/) { return simulated(its, name); });
      },
      "scenario"_a, "name"_a, "progress"_a.none(), "The pass of a scenario, the text of a TOML file");
  module.def(
      "parse_epoch",
      [](const std::string& iso) -> std::optional<std::int64_t> {
        const std::optional<Time> epoch = io::parse_epoch(iso);
        return epoch ? std::optional(epoch->time_since_epoch().count()) : std::nullopt;
      },
      "iso"_a, "Nanoseconds TAI since 1958");
  module.def(
      "format_epoch", [](std::int64_t ns) { return io::format_epoch(Time(Duration(ns))); }, "ns"_a);
  module.def(
      "effective_settings", [](const std::string& settings) { return io::format_config(options_of(settings)); },
      "settings"_a, "All settings, as effective-config.toml has them");
}

}  // namespace trihedron::python
