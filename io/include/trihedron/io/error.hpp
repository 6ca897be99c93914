#pragma once
/// What can go wrong with files and options. Each message is one line that names the place, the reason and the cure.

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace trihedron::io {

/// A place in a text file, counted from 1; 0 where there is none.
struct Position {
  std::int64_t line = 0;
  std::int64_t column = 0;
};

/// A file that cannot be understood. what() is `file:line:column: reason; cure`.
class InputRefused : public std::runtime_error {
 public:
  InputRefused(std::filesystem::path file, Position position, std::string reason, std::string cure);

  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  [[nodiscard]] Position position() const { return position_; }
  [[nodiscard]] const std::string& reason() const { return reason_; }
  [[nodiscard]] const std::string& cure() const { return cure_; }

 private:
  std::filesystem::path file_;
  Position position_;
  std::string reason_;
  std::string cure_;
};

/// A file that lacks what it has to have: a column, a key, another file beside it.
class InputIncomplete : public InputRefused {
 public:
  using InputRefused::InputRefused;
};

/// A value in a file that is outside its range.
class InputOutsideRange : public InputRefused {
 public:
  using InputRefused::InputRefused;
};

/// The disk or the system failed while a file was read or written. what() is `file: reason; cure`.
class MachineFailed : public std::runtime_error {
 public:
  MachineFailed(std::filesystem::path file, std::string reason, std::string cure);

  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  [[nodiscard]] const std::string& reason() const { return reason_; }
  [[nodiscard]] const std::string& cure() const { return cure_; }

 private:
  std::filesystem::path file_;
  std::string reason_;
  std::string cure_;
};

/// A wrong value in an option; what() is one line that says what is accepted.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// One that is outside its range.
class UsageOutsideRange : public UsageError {
 public:
  using UsageError::UsageError;
};

}  // namespace trihedron::io
