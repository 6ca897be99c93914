/// Writes the reports that browser_test.mjs opens: report_samples DIRECTORY

#include <filesystem>
#include <fstream>

#include "synthetic_run.hpp"
#include "trihedron/campaign/summary.hpp"
#include "trihedron/report/campaign.hpp"
#include "trihedron/report/history.hpp"

int main(int argc, char** argv) {
  using namespace trihedron;
  using namespace trihedron::report;
  if (argc != 2) {
    return 2;
  }
  const std::filesystem::path directory = argv[1];
  std::filesystem::create_directories(directory);
  const auto write = [&](const char* name, const ReportInput& input) {
    std::ofstream(directory / name, std::ios::binary) << render(input);
  };

  const test::SyntheticRun good = test::synthetic_run({});
  write("good.html", good.judged());
  const auto catalogue = test::synthetic_catalogue(good.run.calibration);
  std::ofstream(directory / "history.html", std::ios::binary)
      << render_history(catalogue, ground::compare_start_ups(catalogue));

  const test::SyntheticCampaign campaign = test::synthetic_campaign(900, 20);
  const auto summary = campaign::summarise(campaign.plan, campaign.records);
  std::ofstream(directory / "campaign.html", std::ios::binary) << render_campaign(
      {campaign.plan, campaign.records, summary, "trihedron campaign FILE -o " + std::string(60, 'x')});

  const Finding not_determined{
      FindingCode::kNotDetermined, "The data do not determine gyro2.nu12. Its value and sigma are those of the prior.",
      "posterior sigma above half of the prior sigma", "Fly slews during the calibration, or a longer pass."};
  const Finding rejected{FindingCode::kManyRejected, "1.0 % of the fixes were rejected as outliers.", "101 of 9770",
                         "Look for a clock offset or a wrong noise figure.", Finding::Severity::kNote};
  const test::SyntheticRun troubled =
      test::synthetic_run({.troubled = true, .verdict = {true, {not_determined, rejected}}});
  ReportInput troubled_input = troubled.judged();
  troubled_input.telemetry_notes = {"gyro.csv, line 160231: time stamp goes backward; the row was left out.",
                                    "star_tracker.csv: the last line is cut short; it was left out."};
  write("troubled.html", troubled_input);

  const Finding wrong{FindingCode::kNisOutOfBounds,
                      "The fixes scatter more than the filter expects: its model is incomplete or the noise is "
                      "understated, and its sigmas are too small.",
                      "mean NIS 7.512 over 10800 fixes; 99.9 % of consistent filters lie in 3.911 … 4.090",
                      "Look for a tracker clock offset, an error at orbital period, drift outside the model.",
                      Finding::Severity::kDoNotUse};
  write("alone.html", test::synthetic_run({.duration = std::chrono::hours(2),
                                           .spacecraft = "</script><script>throw 'escaped'</script> \"&' {{x}}",
                                           .verdict = {false, {wrong, not_determined}}})
                          .alone());
}
