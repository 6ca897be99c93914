#include "trihedron/report/report.hpp"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <regex>
#include <vector>

#include "synthetic_run.hpp"
#include "wording.hpp"

namespace trihedron::report {
namespace {

using testing::HasSubstr;
using testing::Not;

std::size_t occurrences(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

const test::SyntheticRun& nine_hours() {
  static const test::SyntheticRun run = test::synthetic_run({});
  return run;
}

test::SyntheticRun short_run() { return test::synthetic_run({.duration = std::chrono::minutes(30)}); }

TEST(Report, NamesTheDriftModelThatIsFlownOnBoard) {
  test::SyntheticRun run = short_run();
  run.run.calibration.on_board_drift = OnBoardDrift{.drift_model = kEsg20};
  EXPECT_EQ(occurrences(render(run.judged()), "esg7; on board esg20, whose coefficients"), 2U);
}

TEST(Report, OfNineHoursStaysBelow6MB) { EXPECT_LT(render(nine_hours().judged()).size(), 6'000'000U); }

TEST(Report, IsTheSameForTheSameInput) { EXPECT_EQ(render(short_run().judged()), render(short_run().judged())); }

TEST(Report, RefersToNothingOutsideItself) {
  const std::string html = render(short_run().judged());
  // The plotting library holds addresses it could be told to use; the page must load none.
  const std::string page = html.substr(0, html.find("id=\"data\""));
  EXPECT_FALSE(std::regex_search(page, std::regex("https?:")));
  EXPECT_EQ(occurrences(html, "<script src"), 0U);
  EXPECT_EQ(occurrences(html, "@import"), 0U);
}

TEST(Report, ClosesEachScriptOnce) {
  const std::string html = render(short_run().judged());
  EXPECT_EQ(occurrences(html, "</script"), 4U);
  EXPECT_EQ(occurrences(html, "</style"), 1U);
}

TEST(Report, IsNotBrokenByTheNameOfTheSpacecraft) {
  test::SyntheticRun run = short_run();
  run.pass.settings.spacecraft = "</script><img src=x onerror=alert(1)>\xff{{x}}";
  const std::string html = render(run.judged());
  EXPECT_THAT(html, Not(HasSubstr("<img")));
  EXPECT_EQ(occurrences(html, "</script"), 4U);
}

TEST(Report, EscapesFindingsAndNotes) {
  test::SyntheticRun run = short_run();
  run.run.calibration.verdict.findings.push_back({FindingCode::kShortPass, "<t>", "<e>", "<u>"});
  ReportInput input = run.judged();
  input.telemetry_notes = {"<n>"};
  const std::string html = render(input);
  for (const char* tag : {"<t>", "<e>", "<u>", "<n>"}) {
    EXPECT_THAT(html, Not(HasSubstr(tag)));
  }
  EXPECT_THAT(html, HasSubstr("&lt;n&gt;"));
}

TEST(Report, ListsWhatToDoOfNotesAsWell) {
  test::SyntheticRun run = short_run();
  run.run.calibration.verdict = {true, {{FindingCode::kClockOffsetFound, "late", "by 2 s", "tell the offset"}}};
  EXPECT_THAT(render(run.judged()), HasSubstr("<li>tell the offset</li>"));
  run.run.calibration.verdict.findings.front().cure.clear();
  EXPECT_THAT(render(run.judged()), HasSubstr("<li>Nothing. Use it until the rotors are started anew.</li>"));
}

TEST(Report, ListsAWeakAxisWhereEachParameterIsDetermined) {
  test::SyntheticRun run = short_run();
  run.run.calibration.verdict = {false, {{FindingCode::kWeakAlignmentAxis, "no axis", "", "slew"}}};
  EXPECT_THAT(render(run.judged()), HasSubstr("<li>Alignment of each gyro about the axis that is fixed"));
  EXPECT_THAT(render(run.judged()), Not(HasSubstr("Nothing: every parameter")));
}

TEST(Report, InterruptsTheMeanNisWhereFixesAreMissing) {
  test::SyntheticRun run = short_run();
  const Time epoch = run.pass.settings.epoch;
  const Time from = epoch + std::chrono::minutes(12);
  const Time to = epoch + std::chrono::minutes(18);
  std::erase_if(run.run.fixes, [&](const FixRecord& fix) { return fix.t > from && fix.t < to; });
  const std::string html = render(run.judged());
  const std::string opening = R"(<script type="application/json" id="data">)";
  const std::size_t begin = html.find(opening) + opening.size();
  const auto mean = nlohmann::json::parse(html.substr(begin, html.find("</script>", begin) - begin))["nis"]["mean"];
  std::vector<nlohmann::json> within;
  for (std::size_t i = 0; i < mean["t"].size(); ++i) {
    if (mean["t"][i] > 12.01 && mean["t"][i] < 17.99) {
      within.push_back(mean["y"][0][i]);
    }
  }
  ASSERT_EQ(within.size(), 1U);
  EXPECT_TRUE(within.front().is_null());
}

TEST(Report, ExpectsTheNisOfAsManyGyrosAsThereAre) {
  test::SyntheticRun run = short_run();
  run.run.calibration.statistics.nis_degrees_of_freedom = 6;
  EXPECT_THAT(render(run.judged()), HasSubstr("6 is expected"));
}

TEST(Report, SaysOfWhichMinutesItsErrorsAre) {
  EXPECT_THAT(render(nine_hours().judged()), HasSubstr("rms in minutes 450–540 against"));
}

TEST(Report, SaysWhichErrorsAreByParametersKnownBeforeTheCalibration) {
  EXPECT_THAT(render(short_run().judged()),
              HasSubstr("open loop, total angle, by the parameters known before the calibration"));
  EXPECT_THAT(render(nine_hours().judged()),
              HasSubstr("minutes 0–90, by the parameters known before the calibration, and in minutes 450–540"));
  const test::SyntheticRun run = short_run();
  ground::CalibrationEvaluation evaluation = run.evaluation;
  evaluation.navigation.intervals.front().max_total_rad = 0;
  EXPECT_THAT(render({run.pass, run.run, &run.truth, {}, &evaluation}),
              Not(HasSubstr("by the parameters known before")));
}

TEST(Report, SaysFirstWhetherTheResultCanBeTrusted) {
  test::SyntheticRun run = short_run();
  EXPECT_THAT(render(run.judged()), HasSubstr("<p class=\"word\">Trustworthy</p>"));
  run.run.calibration.verdict.findings = {{FindingCode::kShortPass, "weak", "", "cure A"}};
  EXPECT_THAT(render(run.judged()), HasSubstr("<p class=\"word\">Trustworthy, with 1 warning</p>"));
  run.run.calibration.verdict = {false, {{FindingCode::kTooFewFixes, "broken", "", "cure B"}}};
  const std::string html = render(run.judged());
  EXPECT_THAT(html, HasSubstr("<p class=\"word\">Do not use</p>"));
  EXPECT_THAT(html, HasSubstr("<li>cure B</li>"));
}

TEST(Report, PutsTheWorstFindingFirst) {
  test::SyntheticRun run = short_run();
  run.run.calibration.verdict = {
      false, {{FindingCode::kGyrosNotUsed, "mild", "", ""}, {FindingCode::kTooFewFixes, "grave", "", ""}}};
  const std::string html = render(run.judged());
  EXPECT_LT(html.find("<code>too-few-fixes"), html.find("<code>gyros-not-used"));
  EXPECT_THAT(html, HasSubstr("<p class=\"lead\">grave</p>"));
}

TEST(Report, ShowsEverySectionWhereThereAreData) {
  const std::string html = render(nine_hours().judged());
  for (const char* id : {"verdict", "parameters", "coefficients", "alignment", "attitude", "innovations", "correlation",
                         "momenta", "angle", "telemetry", "settings"}) {
    EXPECT_THAT(html, HasSubstr("<section id=\"" + std::string(id) + "\"")) << id;
    EXPECT_THAT(html, HasSubstr("href=\"#" + std::string(id) + "\"")) << id;
  }
}

TEST(Report, LeavesOutWhatHasNoData) {
  test::SyntheticRun run = short_run();
  run.run.fixes.clear();
  run.run.angle_t.clear();
  run.run.parameters = {};
  const std::string html = render(run.alone());
  for (const char* id : {"coefficients", "alignment", "attitude", "innovations", "angle"}) {
    EXPECT_THAT(html, Not(HasSubstr("<section id=\"" + std::string(id) + "\""))) << id;
    EXPECT_THAT(html, Not(HasSubstr("href=\"#" + std::string(id) + "\""))) << id;
  }
}

TEST(Report, SpeaksOfTruthOnlyWhereItIsKnown) {
  const test::SyntheticRun run = short_run();
  const std::string alone = render(run.alone());
  EXPECT_THAT(alone, Not(HasSubstr("Against the truth")));
  EXPECT_THAT(alone, HasSubstr("final value"));
  EXPECT_THAT(render(run.judged()), HasSubstr("Against the truth"));
}

TEST(Report, ListsTheSimulatedDriftOutsideTheModelInOneSentence) {
  test::SyntheticRun run = short_run();
  run.truth.gyros[0].unmodelled_rad_s = {{"W(1,0)", 1e-8}, {"D(2,1)", -2.5e-9}};
  run.truth.gyros[1].unmodelled_rad_s.clear();
  const std::string html = render(run.judged());
  const std::string sentence = "Simulated drift beside eq. (1), 10⁻⁶ rad/s: W(1,0) +0.0100, D(2,1) −0.0025.";
  EXPECT_NE(html.find(sentence), std::string::npos);
  EXPECT_EQ(html.find("Simulated drift beside", html.find(sentence) + 1), std::string::npos);
}

TEST(Report, GivesTheExtensionOfTheCorrectionInterval) {
  // 5′ at 2e-6 and 1e-7 rad/s: a ratio of 20; the late corrections outlast the pass.
  const std::string html = render(nine_hours().judged());
  EXPECT_THAT(html, HasSubstr("Correction interval extended"));
  EXPECT_THAT(html, HasSubstr("<strong>≥ 19<span class=\"unit\"> ×</span></strong>"));
}

TEST(Report, GivesALowerBoundWhereTheLimitIsNotPassedAnyMore) {
  test::SyntheticRun run = short_run();
  const Time start = run.pass.settings.epoch;
  using std::chrono::minutes;
  const auto interval = [&](std::optional<Duration> passed) {
    return ground::CorrectionInterval{start + minutes(90), minutes(90), passed, 0};
  };
  ground::IntervalExtension& extension = run.evaluation.extension;
  extension.pairs = {{interval(minutes(20)), interval({})}};
  extension.median = ground::median_extension(extension.pairs);
  const std::string html = render(run.judged());
  EXPECT_THAT(html, HasSubstr("<strong>≥ 4.5<span class=\"unit\"> ×</span></strong>"));
  EXPECT_THAT(html, HasSubstr("<td>20.0</td><td>&gt; 90</td><td>≥ 4.5</td>"));
}

TEST(Report, TellsWhatWasRejected) {
  const std::string html = render(test::synthetic_run({.duration = std::chrono::hours(2), .troubled = true}).judged());
  EXPECT_TRUE(std::regex_search(html, std::regex("<li>[0-9]+ fixes rejected: outlier</li>")));
  EXPECT_TRUE(std::regex_search(html, std::regex("<li>[0-9]+ gyro samples rejected: not a direction</li>")));
}

TEST(Report, ListsTheOutageOfTheTracker) {
  const std::string html = render(test::synthetic_run({.duration = std::chrono::hours(5), .troubled = true}).judged());
  EXPECT_TRUE(std::regex_search(html, std::regex("star tracker</th><td>[0-9.]+</td><td>42 min")));
}

TEST(Wording, UsesTypographicSignsAndThousands) {
  EXPECT_EQ(number(-1234567.25, 1), "\u22121\u202f234\u202f567.2");
  EXPECT_EQ(signed_number(2.5, 1), "+2.5");
  EXPECT_EQ(number(std::nan(""), 1), "—");
}

TEST(Wording, ShowsTwoDigitsOfASigma) {
  EXPECT_EQ(decimals_for(0.0123), 3);
  EXPECT_EQ(decimals_for(123.0), 0);
}

TEST(Wording, WritesTaiAsACalendarDate) {
  EXPECT_EQ(calendar(Time{} + std::chrono::hours(25)), "1958-01-02 01:00:00 TAI");
}

}  // namespace
}  // namespace trihedron::report
