#include "html.hpp"

#include <gmock/gmock.h>

#include <limits>
#include <stdexcept>

#include "units.hpp"
#include "wording.hpp"

namespace trihedron::report {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

TEST(Escaped, LeavesNothingThatOpensATagOrEndsAnAttribute) {
  EXPECT_EQ(escaped(R"(<a href="x" id='y'>&)"), "&lt;a href=&quot;x&quot; id=&#39;y&#39;&gt;&amp;");
}

TEST(ScriptSafe, HoldsNoEndOfAScriptAndReadsBackTheSame) {
  const json data = {{"name", "</script><!--<script>"}};
  EXPECT_THAT(script_safe(data), Not(HasSubstr("<")));
  EXPECT_EQ(json::parse(script_safe(data)), data);
}

TEST(ScriptSafe, TakesTextThatIsNoUtf8) { EXPECT_NO_THROW((void)script_safe({{"name", "\xff\xfe"}})); }

TEST(FillIn, EscapesUnlessAskedNotTo) { EXPECT_EQ(fill_in("{{x}} {{{x}}}", {{"x", "<b>"}}), "&lt;b&gt; <b>"); }

TEST(FillIn, DoesNotReadTagsInValues) { EXPECT_EQ(fill_in("{{x}}", {{"x", "{{y}}"}, {"y", "no"}}), "{{y}}"); }

TEST(FillIn, RepeatsASectionForEachElement) {
  const json values = {{"rows", {{{"n", 1}}, {{"n", 2}}}}, {"unit", "m"}};
  EXPECT_EQ(fill_in("{{#rows}}{{n}} {{unit}};{{/rows}}", values), "1 m;2 m;");
}

TEST(FillIn, ShowsPlainElements) { EXPECT_EQ(fill_in("{{#a}}<{{.}}>{{/a}}", {{"a", {"x", "y"}}}), "<x><y>"); }

TEST(FillIn, LeavesOutSectionsOfWhatIsAbsentFalseOrEmpty) {
  const json values = {{"no", false}, {"none", json::array()}, {"nil", nullptr}, {"blank", ""}};
  EXPECT_EQ(
      fill_in("{{#no}}1{{/no}}{{#none}}2{{/none}}{{#nil}}3{{/nil}}{{#blank}}4{{/blank}}{{#absent}}{{x}}{{/absent}}",
              values),
      "");
  EXPECT_EQ(fill_in("{{^no}}1{{/no}}{{^none}}2{{/none}}{{^absent}}3{{/absent}}", values), "123");
}

TEST(FillIn, RefusesAVariableThatIsNowhere) {
  EXPECT_THROW((void)fill_in("{{x}}", json::object()), std::invalid_argument);
}

TEST(FillIn, RefusesSectionsThatDoNotMatch) {
  EXPECT_THROW((void)fill_in("{{#a}}", {{"a", true}}), std::invalid_argument);
  EXPECT_THROW((void)fill_in("{{#a}}{{/b}}", {{"a", true}}), std::invalid_argument);
  EXPECT_THROW((void)fill_in("{{a", {{"a", true}}), std::invalid_argument);
}

TEST(Html, WhatCannotBeShownIsMadePrintable) {
  EXPECT_EQ(escaped("a\x1b[31m\xff<b"), "a\\x1b[31m\\xff&lt;b");
  EXPECT_EQ(escaped("\xE2\x80\xAE"), "\\u{202e}");
}

TEST(Wording, AnglesHaveTheUnitOfTheirSize) {
  EXPECT_EQ(angle(0.048 * kArcminute_rad, 2), "2.9″");
  EXPECT_EQ(angle(30 * kArcminute_rad, 2), "30′");
  EXPECT_EQ(angle(2 * kDegree_rad, 2), "2.0°");
  EXPECT_EQ(angle(std::numeric_limits<double>::infinity(), 2), "—");
  EXPECT_EQ(limit_text(5 * kArcminute_rad), "5′");
  EXPECT_EQ(of_axes(Eigen::Vector3d(0.55, 12, 3) * kArcsecond_rad), "0.55 / 12 / 3.0″");
}

}  // namespace
}  // namespace trihedron::report
