#include "trihedron/ground/tasks/on_all_cores.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "trihedron/records/stop.hpp"

namespace trihedron::ground {
namespace {

using testing::ThrowsMessage;

TEST(OnAllCores, GivesTheResultsInTheirOrder) {
  const std::vector<double> squares = on_all_cores(100, [](std::size_t i) { return static_cast<double>(i * i); });
  ASSERT_EQ(squares.size(), 100U);
  for (std::size_t i = 0; i < squares.size(); ++i) {
    EXPECT_EQ(squares[i], static_cast<double>(i * i));
  }
  EXPECT_TRUE(on_all_cores(0, [](std::size_t) { return 0; }).empty());
}

TEST(OnAllCores, ThrowsWhatTheWorkThrows) {
  const auto work = [](std::size_t i) {
    if (i == 3) {
      throw std::invalid_argument("three");
    }
    return i;
  };
  EXPECT_THROW((void)on_all_cores(10, work), std::invalid_argument);
}

TEST(OnAllCores, BeginsNoMoreAfterAFailure) {
  std::atomic<std::size_t> begun = 0;
  const auto work = [&](std::size_t) {
    ++begun;
    throw std::invalid_argument("at once");
  };
  EXPECT_THROW(for_each_on_all_cores(1000, work), std::invalid_argument);
  EXPECT_LE(begun, std::max(std::thread::hardware_concurrency(), 1U));
  begun = 0;
  EXPECT_THROW(with_cores(1, [&] { for_each_on_all_cores(1000, work); }), std::invalid_argument);
  EXPECT_EQ(begun, 1U);
}

TEST(OnAllCores, ThrowsWhatIsThrownFirstInOrderNotInTime) {
  const auto work = [](std::size_t i) {
    if (i == 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    throw std::invalid_argument(std::to_string(i));
  };
  for (int again = 0; again < 10; ++again) {
    EXPECT_THAT([&] { for_each_on_all_cores(8, work); }, ThrowsMessage<std::invalid_argument>(testing::StrEq("0")));
  }
}

TEST(OnAllCores, UsesNoMoreThreadsThanToldHoweverDeepItIsNested) {
  std::mutex one_at_a_time;
  std::set<std::thread::id> threads;
  const auto look = [&](std::size_t) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const std::scoped_lock lock(one_at_a_time);
    threads.insert(std::this_thread::get_id());
  };
  const auto nest = [&](std::size_t i) { side_by_side([&] { for_each_on_all_cores(4, look); }, [&] { look(i); }); };
  with_cores(2, [&] { for_each_on_all_cores(8, nest); });
  EXPECT_LE(threads.size(), 2U);
  threads.clear();
  for_each_on_all_cores(8, nest);
  EXPECT_LE(threads.size(), std::max(std::thread::hardware_concurrency(), 1U));
}

TEST(OnAllCores, HasNoMoreCallsBegunThanThereAreThreads) {
  std::atomic<unsigned> begun = 0;
  std::atomic<unsigned> most = 0;
  const auto nest = [&](std::size_t) {
    const unsigned now = ++begun;
    for (unsigned before = most; now > before && !most.compare_exchange_weak(before, now);) {
    }
    for_each_on_all_cores(8, [](std::size_t) { std::this_thread::sleep_for(std::chrono::microseconds(100)); });
    --begun;
  };
  for_each_on_all_cores(200, nest);
  EXPECT_LE(most, std::max(std::thread::hardware_concurrency(), 1U));
}

TEST(SideBySide, CallsTheFirstInThisThread) {
  const std::thread::id here = std::this_thread::get_id();
  std::thread::id first;
  bool second = false;
  side_by_side([&] { first = std::this_thread::get_id(); }, [&] { second = true; });
  EXPECT_EQ(first, here);
  EXPECT_TRUE(second);
}

TEST(SideBySide, ThrowsWhatTheFirstThrowsBeforeTheSecond) {
  const auto fail = [](const char* what) { return [what] { throw std::invalid_argument(what); }; };
  EXPECT_THAT([&] { side_by_side(fail("first"), fail("second")); },
              ThrowsMessage<std::invalid_argument>(testing::StrEq("first")));
  EXPECT_THAT([&] { side_by_side([] {}, fail("second")); },
              ThrowsMessage<std::invalid_argument>(testing::StrEq("second")));
}

TEST(Stop, IsSeenByTheWorkOfTheThreadThatAskedForItAlone) {
  StopRequest request;
  {
    const StopScope scope(&request);
    EXPECT_NO_THROW(check_stop());
    request.make();
    EXPECT_THROW(check_stop(), Stopped);
    std::thread([] { EXPECT_NO_THROW(check_stop()); }).join();
    const StopScope other(nullptr);
    EXPECT_NO_THROW(check_stop());
  }
  EXPECT_NO_THROW(check_stop());
}

TEST(Stop, OfAPartIsMadeWithThatOfTheWhole) {
  StopRequest whole;
  StopRequest part(&whole);
  EXPECT_FALSE(part.made());
  whole.make();
  EXPECT_TRUE(part.made());

  StopRequest another;
  StopRequest part_of_it(&another);
  part_of_it.make();
  EXPECT_TRUE(part_of_it.made());
  EXPECT_FALSE(another.made());
}

TEST(Stop, EndsWorkThatIsNestedOnAllCores) {
  StopRequest request;
  const StopScope scope(&request);
  std::atomic<int> turns = 0;
  const auto endless = [&](std::size_t) {
    for (;;) {
      check_stop();
      if (++turns == 1000) {
        request.make();
      }
    }
  };
  EXPECT_THROW(
      for_each_on_all_cores(
          4, [&](std::size_t i) { side_by_side([&] { for_each_on_all_cores(4, endless); }, [&] { endless(i); }); }),
      Stopped);
  EXPECT_GE(turns, 1000);
}

}  // namespace
}  // namespace trihedron::ground
