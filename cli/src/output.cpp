#include "output.hpp"

#include <fmt/core.h>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <unistd.h>

#include <cstdlib>
#include <utility>
#include <vector>

#include "trihedron/io/error.hpp"
#include "trihedron/io/standard_input.hpp"
#include "trihedron/records/text.hpp"

namespace trihedron::cli {
namespace {

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

bool is_coloured(std::FILE* stream) {
  const char* const no_color = std::getenv("NO_COLOR");  // NOLINT(concurrency-mt-unsafe): nothing sets it
  const char* const terminal = std::getenv("TERM");      // NOLINT(concurrency-mt-unsafe)
  return (no_color == nullptr || *no_color == '\0') && terminal != nullptr && std::string_view(terminal) != "dumb" &&
         isatty(fileno(stream)) == 1;
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

}  // namespace

void Log::open(bool verbose, const std::string& file) {
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
    sinks.back()->set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %v");
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
