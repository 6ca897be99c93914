#include "trihedron/report/campaign.hpp"

#include <gmock/gmock.h>

#include "synthetic_run.hpp"
#include "trihedron/campaign/summary.hpp"

namespace trihedron::report {
namespace {

using testing::HasSubstr;
using testing::Not;

std::string report_of(const test::SyntheticCampaign& made) {
  return render_campaign(
      {made.plan, made.records, campaign::summarise(made.plan, made.records), "trihedron campaign FILE -o OUT"});
}

TEST(CampaignReport, SaysThatSigmasAreAsLargeAsTheErrorsOnlyWhereTheyAre) {
  const std::string honest = "All runs came to their end. The sigmas of the parameters are as large as the errors.";
  const std::string cautious =
      "All runs came to their end. The sigmas of the parameters are larger than the errors, by a factor of";
  const std::string of_honest = report_of(test::synthetic_campaign(800, 20));
  EXPECT_THAT(of_honest, HasSubstr(honest));
  EXPECT_THAT(of_honest, Not(HasSubstr(cautious)));
  const std::string of_cautious = report_of(test::synthetic_campaign(800, 15));
  EXPECT_THAT(of_cautious, HasSubstr(cautious));
  EXPECT_THAT(of_cautious, Not(HasSubstr(honest)));
}

TEST(CampaignReport, SaysNothingOfSigmasWhereNoParameterCouldBeCompared) {
  test::SyntheticCampaign made = test::synthetic_campaign(800, 20);
  for (RunRecord& record : made.records) {
    record[RunQuantity::kNees] = record[RunQuantity::kNeesFreedom] = {0};
  }
  EXPECT_THAT(report_of(made), HasSubstr(R"(<p class="lead">All runs came to their end.</p>)"));
}

TEST(CampaignReport, SaysWhatThePassIsTooShortFor) {
  const std::string html = report_of(test::synthetic_campaign(800, 20));
  EXPECT_THAT(html, HasSubstr("In 200 of the 800 trustworthy runs the attitude error was within 5′"));
  // Four runs of 800 have not settled: more than 0.3 %.
  EXPECT_THAT(html, HasSubstr("not in the pass"));
}

TEST(CampaignReport, ShowsNumbersAsPeopleWriteThem) {
  const std::string html = report_of(test::synthetic_campaign(100, 20));
  EXPECT_THAT(html, HasSubstr("one of 0, 0.05, 0.2<"));
  EXPECT_THAT(html, HasSubstr("one of orbital, yaw-steered<"));
  EXPECT_THAT(html, HasSubstr(" · 10⁻⁹ rad/s"));
}

TEST(CampaignReport, HasARowForEachPointOfAGrid) {
  test::SyntheticCampaign made = test::synthetic_campaign(800, 20);
  EXPECT_THAT(report_of(made), Not(HasSubstr("By the grid")));
  CampaignInput& grid = made.plan.inputs[2];
  grid.key = "calibration.estimator";
  grid.distribution.kind = Distribution::Kind::kGrid;
  grid.options = {"paper", "invariant"};
  made.plan.repeats = 400;
  CampaignInput follows{"gyro.alignment_prior_sigma", {.kind = Distribution::Kind::kFollows, .a = 0.5}, "", {}, {}};
  made.plan.inputs.push_back(follows);
  for (RunRecord& record : made.records) {
    record.draws[2] = record.run < 400 ? 0 : 1;
    record.draws.push_back(record.draws[0] / 2);
    if (record.run < 400) {
      record[RunQuantity::kNees] = {30};
    }
  }
  const std::string html = report_of(made);
  EXPECT_THAT(html, HasSubstr("By the grid"));
  // 8000 degrees of freedom: ± 1.96 √(2/8000) of 20.
  EXPECT_THAT(
      html,
      HasSubstr(
          R"(<td>paper</td><td>400 of 400</td><td>30.0 <span class="flag">outside</span></td><td>19.4 … 20.6</td>)"));
  EXPECT_THAT(html, testing::ContainsRegex(R"(<td>invariant</td><td>400 of 400</td><td>(19|20)\.[0-9]</td>)"));
  EXPECT_THAT(html, HasSubstr("0.5 times gyro.readout.noise"));
}

}  // namespace
}  // namespace trihedron::report
