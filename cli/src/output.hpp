#pragma once
/// What the commands print: summaries for people or for programs, data where the output is "-", the log.

#include <spdlog/logger.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace trihedron::cli {

/// What was decided and why: with --verbose on stderr, and with --log-file in a file, there with time stamps.
class Log {
 public:
  /// Throws MachineFailed when the file cannot be made.
  void open(bool verbose, const std::string& file);
  /// Throws MachineFailed when the file cannot be written. A text of several lines is one entry per line.
  void say(std::string_view text) const;

 private:
  std::shared_ptr<spdlog::logger> logger_;
};

/// What every command is told.
struct Common {
  bool quiet = false;
  bool json = false;
  Log log;
  std::FILE* summary = stdout;  ///< stderr where stdout takes the data of the command
};

/// The name of a file for stdin or stdout.
inline constexpr std::string_view kStandardStream = "-";

/// The path to read from: that of standard input for "-".
[[nodiscard]] std::string source(const std::string& name);

/// `common` for a command that writes to `output`.
[[nodiscard]] Common beside(const std::string& output, const Common& common);

/// As it is: data, JSON.
void print_data(std::FILE* stream, std::string_view data);

/// Of several lines; whatever is in the names, it cannot steer the terminal. A verdict is coloured on a terminal,
/// unless NO_COLOR is set.
void print_text(std::FILE* stream, std::string_view text);

/// Of one document. What is no number becomes null, a byte that is no UTF-8 U+FFFD.
[[nodiscard]] std::string json_text(const nlohmann::ordered_json& document);

/// A summary that was made earlier, of the kind that the user asked for.
void print_summary(const Common& common, std::string_view summary);

/// The summary that the user asked for, if any.
template <class Json, class Text>
void show(const Common& common, const Json& json, const Text& text) {
  if (common.json) {
    print_data(common.summary, json_text(json()) + "\n");
  } else if (!common.quiet) {
    print_text(common.summary, text());
  }
}

}  // namespace trihedron::cli
