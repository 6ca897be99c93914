#include "output.hpp"

#include <fmt/core.h>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/sinks/stdout_sinks.h>

#include <filesystem>
#include <fstream>
#include <iomanip>
#include <system_error>
#include <utility>
#include <vector>

#include "terminal.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/standard_input.hpp"
#include "trihedron/records/text.hpp"

namespace trihedron::cli {
namespace {

// Of a line of the log file: what stands first, and second in the first line.
constexpr const char* kLogPattern = "%Y-%m-%dT%H:%M:%S.%e%z %v";
constexpr int kTimeStampLength = 29;
constexpr std::string_view kName = "trihedron";

/// The strings of a JSON text with the controls of U+0080 to U+009F escaped, which some terminals obey; those below are
/// so anyway.
std::string without_controls(std::string text) {
  for (std::size_t at = text.find('\xC2'); at != std::string::npos; at = text.find('\xC2', at + 1)) {
    const auto next = static_cast<unsigned char>(text[at + 1]);
    if (next >= 0x80 && next <= 0x9F) {
      text.replace(at, 2, fmt::format("\\u00{:02x}", next));
    }
  }
  return text;
}

std::string with_coloured_verdict(std::string text) {
  constexpr std::string_view kEnd = "\x1b[0m";
  for (const auto& [words, begin] : {std::pair<std::string_view, std::string_view>{"DO NOT USE", "\x1b[1;31m"},
                                     {"Verdict     trustworthy", "\x1b[1;32m"}}) {
    for (std::size_t at = text.find(words); at != std::string::npos; at = text.find(words, at)) {
      text.insert(at + words.size(), kEnd);
      text.insert(at, begin);
      at += begin.size() + words.size();
    }
  }
  return text;
}

/// Whether a file holds something that the log would spoil: anything but earlier lines of a log, the first of which is
/// `2026-01-31T12:00:00.000+00:00 trihedron 1.2.3: …`.
bool holds_other_than_log(const std::string& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored) || std::filesystem::file_size(file, ignored) == 0) {
    return false;
  }
  std::string time_stamp;
  std::string name;
  std::ifstream(file) >> std::setw(kTimeStampLength + 1) >> time_stamp >> std::setw(kName.size() + 1) >> name;
  return time_stamp.size() != kTimeStampLength || time_stamp[10] != 'T' || name != kName;
}

}  // namespace

void Log::open(bool verbose, const std::string& file) {
  if (holds_other_than_log(file)) {
    throw io::UsageError(
        fmt::format("{}: there is a file that is no log of trihedron; name another for --log-file", file));
  }
  std::vector<spdlog::sink_ptr> sinks;
  if (verbose) {
    sinks.push_back(std::make_shared<spdlog::sinks::stderr_sink_st>());
    sinks.back()->set_pattern("trihedron: %v");
  }
  if (!file.empty()) {
    try {
      sinks.push_back(std::make_shared<spdlog::sinks::basic_file_sink_st>(file));
    } catch (const spdlog::spdlog_ex&) {
      throw io::MachineFailed(file, "the log cannot be written",
                              "check that its directory is there and may be written");
    }
    sinks.back()->set_pattern(kLogPattern);
  }
  if (!sinks.empty()) {
    logger_ = std::make_shared<spdlog::logger>("trihedron", sinks.begin(), sinks.end());
    logger_->flush_on(spdlog::level::info);
    logger_->set_error_handler([file](const std::string& what) {
      throw io::MachineFailed(file.empty() ? "standard error" : file, what, "free some space, or leave out the log");
    });
  }
}

void Log::say(std::string_view text) const {
  while (logger_ != nullptr && !text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    if (end > 0) {
      logger_->info(printable(text.substr(0, end)));
    }
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

std::string source(const std::string& name) { return name == kStandardStream ? std::string(io::kStandardInput) : name; }

Common beside(const std::string& output, const Common& common) {
  Common result = common;
  result.summary = output == kStandardStream ? stderr : common.summary;
  return result;
}

void print_data(std::FILE* stream, std::string_view data) {
  // What is wrong with stdout is told at the end; with stderr there is nobody to tell.
  static_cast<void>(std::fwrite(data.data(), 1, data.size(), stream));
}

void print_text(std::FILE* stream, std::string_view text) {
  const std::string shown = printable_lines(text);
  print_data(stream, is_coloured(stream) ? with_coloured_verdict(shown) : shown);
}

void print_summary(const Common& common, std::string_view summary) {
  common.json ? print_data(common.summary, summary) : print_text(common.summary, summary);
}

std::string json_text(const nlohmann::ordered_json& document) {
  return without_controls(document.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

}  // namespace trihedron::cli
