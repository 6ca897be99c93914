#include "trihedron/io/apart.hpp"

#include <gmock/gmock.h>

#include <string>

#include "fixtures.hpp"

namespace trihedron::io {
namespace {

class Apart : public testing::Test {
 protected:
  Apart() {
    std::filesystem::create_directories(directory_ / "pass/below");
    std::filesystem::create_directories(directory_ / "out");
    for (const char* name : {"pass/gyro.csv", "config.toml", "out/a.csv"}) {
      write_text(directory_ / name, "x");
    }
    std::filesystem::create_symlink("pass", directory_ / "link");
    std::filesystem::create_symlink("pass/gyro.csv", directory_ / "file_link");
    std::filesystem::create_hard_link(directory_ / "pass/gyro.csv", directory_ / "second_name");
  }
  /// Of this output of a command with the pass and the settings as inputs; empty where it is let through.
  [[nodiscard]] std::string refusal_of(const std::filesystem::path& output) const {
    const std::filesystem::path inputs[] = {directory_ / "pass", directory_ / "config.toml", directory_ / "absent.toml",
                                            ""};
    try {
      expect_apart(inputs, {&output, 1});
    } catch (const UsageError& error) {
      return error.what();
    }
    return {};
  }
  TemporaryDirectory directory_;
};

TEST_F(Apart, RefusesAnOutputThatIsAnInput) {
  for (const char* name : {"config.toml", "out/../config.toml", "absent.toml", "pass", "pass/", "link", "link/."}) {
    EXPECT_THAT(refusal_of(directory_ / name),
                testing::AllOf(testing::HasSubstr("is the input"), testing::HasSubstr("as well")))
        << name;
  }
}

TEST_F(Apart, RefusesAnOutputInAnInputDirectory) {
  for (const char* name :
       {"pass/gyro.csv", "pass/new/deep.csv", "link/new", "out/../pass/below/x", "file_link", "second_name"}) {
    EXPECT_THAT(refusal_of(directory_ / name), testing::HasSubstr("lies in the input")) << name;
  }
}

TEST_F(Apart, RefusesTwoOutputsThatAreOne) {
  const auto refusal_of_both = [&](const std::filesystem::path& a, const std::filesystem::path& b) -> std::string {
    const std::filesystem::path outputs[] = {directory_ / "out/other", a, "", b};
    try {
      expect_apart_from_each_other(outputs);
    } catch (const UsageError& error) {
      return error.what();
    }
    return {};
  };
  for (const char* name : {"out/a.csv", "new", "second_name"}) {
    EXPECT_THAT(refusal_of_both(directory_ / name, directory_ / "out/.." / name),
                testing::HasSubstr("is the other output"));
  }
  EXPECT_THAT(refusal_of_both(directory_ / "out/new", directory_ / "out"),
              testing::HasSubstr("lies in the other output"));
  EXPECT_THAT(refusal_of_both(directory_ / "pass/gyro.csv", directory_ / "second_name"),
              testing::HasSubstr("is the other output"));
  EXPECT_EQ(refusal_of_both(directory_ / "out/new", directory_ / "out/newer"), "");
  EXPECT_EQ(refusal_of_both("/dev/null", "/dev/null"), "");
}

TEST_F(Apart, LetsThroughWhatReplacesNoInput) {
  for (const char* name : {"out", "out/a.csv", "out/new", "new/deep/x", "passage", "pass2"}) {
    EXPECT_EQ(refusal_of(directory_ / name), "") << name;
  }
  EXPECT_EQ(refusal_of(""), "");
  EXPECT_EQ(refusal_of("/dev/null"), "");
  EXPECT_EQ(refusal_of(directory_.path()), "");  // holds the inputs, but is none
}

}  // namespace
}  // namespace trihedron::io
