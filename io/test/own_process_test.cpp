#include "own_process.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <new>
#include <string>
#include <thread>

#include "fixtures.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::io {
namespace {

using testing::AnyOf;
using testing::HasSubstr;

void work_apart(const std::function<void(Sink&)>& work) {
  in_own_process("pass.nc", work, [](Source& source) { static_cast<void>(source.number()); });
}

TEST(OwnProcess, GivesBackWhatWasRead) {
  const std::vector<double> many(3'000'000, 0.5);
  std::vector<double> got;
  std::string text;
  in_own_process(
      "pass.nc",
      [&](Sink& sink) {
        sink.put(many);
        sink.put("words");
      },
      [&](Source& source) {
        got = source.numbers();
        text = source.text();
      });
  EXPECT_EQ(got, many);
  EXPECT_EQ(text, "words");
}

TEST(OwnProcess, ThrowsHereWhatIsThrownThere) {
  EXPECT_EQ(refusal([] { work_apart([](Sink&) {
                           throw InputRefused("a.csv", {2, 3}, "is bad", "mend it");
                         }); }),
            "a.csv:2:3: is bad; mend it");
  EXPECT_THROW(work_apart([](Sink&) { throw MachineFailed("a.csv", "is gone", "look for it"); }), MachineFailed);
}

TEST(OwnProcess, RefusesAFileThatTakesMoreMemoryThanItsSizeExplains) {
  const auto with_bytes = [](std::size_t bytes) {
    return [bytes](Sink& sink) { sink.put(std::int64_t{std::string(bytes, 'x').back()}); };
  };
  EXPECT_NO_THROW(work_apart(with_bytes(100 << 20)));
  EXPECT_THAT(
      refusal([&] { work_apart(with_bytes(700 << 20)); }),
      AnyOf(HasSubstr("takes more memory than its size explains"), HasSubstr("is damaged")));  // by its sanitizer
}

TEST(OwnProcess, HasTwoSecondsForASmallFileAndOneForEachMegabyte) {
  const TemporaryDirectory directory;
  for (const std::int64_t megabytes : {0, 3}) {
    write_text(directory / "pass.nc", std::string(static_cast<std::size_t>(megabytes) << 20, ' '));
    std::int64_t most_s = 0;
    in_own_process(
        directory / "pass.nc",
        [](Sink& sink) {
          rlimit limit{};
          ::getrlimit(RLIMIT_CPU, &limit);
          sink.put(static_cast<std::int64_t>(limit.rlim_cur));
        },
        [&](Source& source) { most_s = source.number(); });
    EXPECT_EQ(most_s, 2 + megabytes);
  }
}

TEST(OwnProcess, RefusesAFileThatEndsIt) {
  const auto refused = [](const auto& end) { return refusal([&] { work_apart([&](Sink&) { end(); }); }); };
  for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGBUS}) {
    EXPECT_THAT(refused([=] { std::raise(signal); }),
                HasSubstr("pass.nc: is damaged in a way that the NetCDF library"));
  }
  EXPECT_THAT(refused([] { ::_exit(0); }), HasSubstr("is damaged"));
  EXPECT_THAT(refused([] { std::raise(SIGXCPU); }), HasSubstr("busy for more than 2 s"));
}

TEST(OwnProcess, RefusesHalfAResult) {
  EXPECT_THAT(refusal([] {
                in_own_process(
                    "pass.nc", [](Sink& sink) { sink.put(std::int64_t{1'000'000'000'000}); },  // a length and no more
                    [](Source& source) { static_cast<void>(source.numbers()); });
              }),
              HasSubstr("is damaged"));
  EXPECT_THAT(refusal([] {
                work_apart([](Sink& sink) {
                  sink.put("begun");
                  throw std::bad_alloc();
                });
                in_own_process(
                    "pass.nc",
                    [](Sink& sink) {
                      sink.put(std::int64_t{1});
                      throw std::bad_alloc();
                    },
                    [](Source& source) { static_cast<void>(source.number() + source.number()); });
              }),
              HasSubstr("is damaged"));
}

TEST(OwnProcess, EndsWhenAskedToStop) {
  StopRequest request;
  const StopScope scope(&request);
  std::jthread other([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    request.make();
  });
  const auto begun = std::chrono::steady_clock::now();
  EXPECT_THROW(work_apart([](Sink&) { ::sleep(60); }), Stopped);
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(5));
}

}  // namespace
}  // namespace trihedron::io
