/// fuzz_seeds DIRECTORY EXAMPLES: writes the inputs that the targets begin with, each in the directory of its target,
/// from the fixtures of the tests and the scenarios of EXAMPLES.
#include <fmt/core.h>

#include <cstdlib>
#include <string>

#include "fixtures.hpp"
#include "trihedron/io/attitude.hpp"
#include "trihedron/io/attitude_message.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/catalogue.hpp"
#include "trihedron/io/config.hpp"
#include "trihedron/io/packets.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/io/spice_kernels.hpp"

namespace {

using namespace trihedron;
namespace fs = std::filesystem;

void write_seeds(const fs::path& directory, const fs::path& examples) {
  const auto at = [&](const char* target, const char* name) {
    fs::create_directories(directory / target);
    return directory / target / name;
  };
  const io::RawPass raw = io::clean_pass();
  const io::TemporaryDirectory work;
  raw.save_netcdf(work / "raw.nc");
  Pass pass = io::read_pass(work / "raw.nc").pass;
  pass.settings.start_up = "2009-05-20";
  const Truth truth = io::clean_truth();
  io::write_pass(work / "known", pass, &truth);
  pass.settings.prior = io::sample_calibration();
  io::write_pass(at("netcdf", "known.nc"), pass, &truth);
  fs::copy_file(work / "raw.nc", at("netcdf", "raw.nc"), fs::copy_options::overwrite_existing);

  Pass beginning = pass;
  beginning.gyro.t.resize(20);
  beginning.star_tracker.t.resize(4);
  const std::string packets = io::format_packets(beginning, io::kDefaultApid, "", "").packets;
  io::write_text(at("packets", "as-they-are"), '\0' + packets);
  io::write_text(at("packets", "sealed"), '\1' + packets);

  io::write_text(at("csv", "gyro.csv"), raw.gyro.csv().substr(0, 3000));
  io::write_text(at("csv", "star_tracker.csv"), raw.star_tracker.csv());
  io::write_text(at("csv", "truth.csv"), io::read_text(work / "known/truth.csv"));
  io::write_text(at("truth", "truth"),
                 io::read_text(work / "known/truth.json") + '\0' + io::read_text(work / "known/truth.csv"));
  io::write_text(at("pass_toml", "clean.toml"), raw.toml);
  io::write_text(at("pass_toml", "full.toml"), io::read_text(work / "known/pass.toml"));
  const fs::path others = examples / "telemetry";
  io::write_text(at("telemetry", "example"),
                 io::read_text(others / "telemetry.toml") + '\0' + io::read_text(others / "gyros.csv").substr(0, 1000));
  const fs::path calibration = at("calibration", "calibration.json");
  io::write_calibration(calibration, io::sample_calibration());
  io::write_calibration(at("calibration", "drift-that-comes-back.json"), io::sample_with_drift_that_comes_back());

  AttitudeHistory attitude;
  for (const Time t : truth.t) {
    attitude.t.push_back(t);
    attitude.q_in_c.push_back(truth.q_in_c[attitude.q_in_c.size()]);
  }
  io::write_attitude(at("attitude", "short.csv"), truth.t.front(), attitude);
  attitude.sigma_rad.assign(attitude.size(), {1e-5, 1e-5, 1e-4});
  attitude.age_s.assign(attitude.size(), 1.5);
  io::write_attitude(at("attitude", "full.csv"), truth.t.front(), attitude);

  io::MessageDescription description;
  description.created_utc = "2026-01-02T03:04:05";
  const std::vector<Eigen::Vector3d> rates(attitude.size(), {1e-3, 2e-3, 3e-3});
  for (const bool with_rates : {false, true}) {
    const std::span<const Eigen::Vector3d> given = with_rates ? rates : std::span<const Eigen::Vector3d>();
    io::write_text(
        at("attitude_message", with_rates ? "rates.aem" : "quaternions.aem"),
        io::format_aem(attitude, given, truth.t.front(), description, Duration::max(), io::MessageSyntax::kKvn));
    io::write_text(
        at("attitude_message", with_rates ? "rates.xml" : "quaternions.xml"),
        io::format_aem(attitude, given, truth.t.front(), description, Duration::max(), io::MessageSyntax::kXml));
  }

  io::AttitudeMessage message;
  message.attitude = attitude;
  message.rate_rad_s = rates;
  for (const bool xml : {false, true}) {
    io::write_text(at("attitude_message", xml ? "one.xml" : "one.apm"),
                   io::format_apm(message, 0, truth.t.front(), description,
                                  xml ? io::MessageSyntax::kXml : io::MessageSyntax::kKvn));
  }

  const io::SpiceClock clock = io::SpiceClock::of(attitude);
  const io::SpiceObject object{-28380, "TEST"};
  io::write_text(at("c_kernel", "short"),
                 io::format_sclk(clock, object) + '\0' +
                     io::format_ck(attitude, rates, clock, object, io::stretches(attitude, std::chrono::seconds(4))));
  for (const bool xml : {false, true}) {
    io::write_text(at("orbit_message", xml ? "round.xml" : "round.oem"), io::orbit_message(xml));
  }

  const CatalogueEntry entry{"Resurs-DK1", "pass-a", "2009-05-20", 1, io::sample_calibration()};
  fs::remove(at("catalogue", "one.db"));
  io::add_to_catalogue(at("catalogue", "one.db"), {&entry, 1});
  int number = 0;
  for (const char* statement :
       {"CREATE VIEW v AS WITH RECURSIVE r (i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM r) SELECT i FROM r",
        "DROP TABLE calibration; CREATE VIEW calibration AS SELECT 1 AS id, '' AS json",
        "CREATE TRIGGER t AFTER INSERT ON calibration BEGIN DELETE FROM finding; END",
        "UPDATE calibration SET json = replace(json, '1', '9e99'), pass = x'ff', passes = -1",
        "UPDATE sqlite_schema SET sql = replace(sql, 'STRICT', ''), rootpage = 3 WHERE name = 'parameter'",
        "INSERT INTO parameter SELECT calibration, state || '2', value, sigma FROM parameter; DELETE FROM finding",
        "PRAGMA user_version = 2; PRAGMA application_id = 1; PRAGMA encoding = 'UTF-16'; VACUUM; PRAGMA journal_mode = "
        "WAL",
        "ALTER TABLE finding ADD COLUMN c AS (hex(zeroblob(1000))); CREATE INDEX i ON finding (code) WHERE code > 1",
        "UPDATE calibration SET epoch_tai = CAST(x'00' AS TEXT), json = hex(zeroblob(9999)), t_s = -9e999"}) {
    io::write_text(at("catalogue_sql", fmt::format("{}.sql", ++number).c_str()), statement);
  }

  io::write_text(at("settings", "default.toml"), io::format_config({}));
  CalibrationOptions options;
  options.drift_model = DriftModelId{};
  options.find_noise = false;
  options.student_t_freedom = 5;
  options.angles_after = Duration::max();
  options.corrections.when = CorrectionOptions::When::kEachFix;
  io::write_text(at("settings", "other.toml"), io::format_config(options));
  for (const auto& example : fs::directory_iterator(examples)) {
    if (example.path().extension() == ".toml") {
      fs::copy_file(example, at("scenario", example.path().filename().c_str()), fs::copy_options::overwrite_existing);
    }
  }
  io::write_text(at("netcdf_layout", "none"), std::string(64, '\1'));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    fmt::print(stderr, "usage: trihedron_fuzz_seeds DIRECTORY EXAMPLES\n");
    return EXIT_FAILURE;
  }
  write_seeds(argv[1], argv[2]);
  return EXIT_SUCCESS;
}
