#include "trihedron/core/result.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

namespace trihedron {
namespace {

enum class Fault { kFirst, kSecond };

TEST(Result, HoldsAValueOrNamesAFault) {
  const Result<int, Fault> value = 3;
  EXPECT_TRUE(value.ok());
  EXPECT_EQ(value.value(), 3);
  const Result<int, Fault> fault = Fault::kSecond;
  EXPECT_FALSE(fault);
  EXPECT_EQ(fault.fault(), Fault::kSecond);
}

TEST(Assert, CallsTheHandlerWithItsPlace) {
  const AssertHandler previous = set_assert_handler([](const char* expression, const char* file, int line) {
    throw std::logic_error(std::string(expression) + " in " + file + ":" + std::to_string(line));
  });
  const Result<int, Fault> fault = Fault::kFirst;
  try {
    static_cast<void>(fault.value());
    ADD_FAILURE() << "the assertion let a missing value pass";
  } catch (const std::logic_error& error) {
    EXPECT_NE(std::string(error.what()).find("ok_ in "), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("result.hpp:"), std::string::npos);
  }
  const Result<int, Fault> value = 3;
  EXPECT_THROW(static_cast<void>(value.fault()), std::logic_error);
  EXPECT_NE(set_assert_handler(previous), nullptr);
}

TEST(AssertDeathTest, AbortsByDefault) {
  const Result<int, Fault> fault = Fault::kFirst;
  EXPECT_DEATH(static_cast<void>(fault.value()), "");
}

}  // namespace
}  // namespace trihedron
