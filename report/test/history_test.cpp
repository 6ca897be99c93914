#include "trihedron/report/history.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "synthetic_run.hpp"

namespace trihedron::report {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

const std::vector<CatalogueEntry>& catalogue() {
  static const auto made =
      test::synthetic_catalogue(test::synthetic_run({.duration = std::chrono::minutes(30)}).run.calibration);
  return made;
}

std::string rendered(const std::vector<CatalogueEntry>& entries) {
  return render_history(entries, ground::compare_start_ups(entries));
}

json data_of(const std::string& html) {
  const std::string opening = R"(<script type="application/json" id="data">)";
  const std::size_t begin = html.find(opening) + opening.size();
  return json::parse(html.substr(begin, html.find("</script>", begin) - begin));
}

TEST(HistoryReport, HoldsEachParameterOfEachCalibration) {
  const json data = data_of(rendered(catalogue()));
  EXPECT_EQ(data["calibrations"].size(), 9U);
  EXPECT_EQ(data["calibrations"][2]["passes"], 2);
  EXPECT_EQ(data["calibrations"][0]["trustworthy"], false);
  ASSERT_EQ(data["trends"].size(), 21U);
  const Calibration& last = catalogue().back().calibration;
  const json& k0 = data["trends"][0];
  EXPECT_EQ(k0["symbol"], "k₀");
  EXPECT_NEAR(k0["value"][8].get<double>(), last.gyros[0].drift_rad_s[0] / 1e-6, 1e-9);
  EXPECT_NEAR(k0["sigma"][8].get<double>(), std::sqrt(last.covariance(0, 0)) / 1e-6, 1e-9);
}

TEST(HistoryReport, LeavesOutWhatACalibrationDoesNotHave) {
  const json outside = data_of(rendered(catalogue()))["trends"].back();
  EXPECT_EQ(outside["name"], "W(1,0)");
  EXPECT_TRUE(outside["value"][7].is_null());
  EXPECT_NEAR(outside["value"][8].get<double>(), 0.01, 1e-12);
}

TEST(HistoryReport, DrawsAlignmentsFromTheirMean) {
  const auto history = ground::compare_start_ups(catalogue());
  const json align_x = data_of(rendered(catalogue()))["trends"][7];
  EXPECT_EQ(align_x["name"], "align_x");
  const auto mean = std::ranges::find(history.spreads, ParameterId::alignment(0, 0), &ground::Spread::state)->mean;
  EXPECT_NEAR(align_x["value"][8].get<double>(),
              (catalogue().back().calibration.gyros[0].alignment_rotation_vector_rad.x() - mean) / 4.8481368e-6, 1e-3);
}

TEST(HistoryReport, TellsWhetherAlignmentsMoved) {
  EXPECT_EQ(rendered(catalogue()).find("<code>alignment-moved"), std::string::npos);
  EXPECT_NE(rendered(catalogue()).find("No alignment changed"), std::string::npos);
  std::vector<CatalogueEntry> moved = catalogue();
  moved.back().calibration.gyros[1].alignment_rotation_vector_rad.y() += 1e-2;
  const std::string html = rendered(moved);
  EXPECT_NE(html.find("<code>alignment-moved"), std::string::npos);
  EXPECT_EQ(html.find("No alignment changed"), std::string::npos);
}

TEST(HistoryReport, SaysThatThereIsNothingToCompareYet) {
  EXPECT_THAT(rendered({catalogue()[1]}), HasSubstr("There is nothing to compare yet"));
  EXPECT_THAT(rendered({}), HasSubstr("Empty catalogue"));
}

TEST(HistoryReport, IsNotBrokenByNamesFromTelemetry) {
  std::vector<CatalogueEntry> entries = catalogue();
  for (CatalogueEntry& entry : entries) {
    entry.spacecraft = entry.pass = entry.start_up = "</script><img src=x>{{x}}\xff";
  }
  const std::string html = rendered(entries);
  EXPECT_THAT(html, Not(HasSubstr("<img")));
  EXPECT_THAT(html, HasSubstr("&lt;img"));
}

}  // namespace
}  // namespace trihedron::report
