#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <span>
#include <system_error>
#include <utility>

#include "json_node.hpp"
#include "text_file.hpp"
#include "trihedron/core/crc32.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/campaign.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/records/fnv1a.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kJournalFormat = "trihedron-campaign-journal";
constexpr std::size_t kCrcDigits = 8;

std::uint32_t crc_of(std::string_view text) { return crc32(std::as_bytes(std::span(text))); }

std::string sealed(const Json& json) {
  const std::string text = dump(json);
  return fmt::format("{:08x} {}", crc_of(text), text);
}

/// The JSON of a line; discarded where the line is damaged.
Json opened(std::string_view line) {
  std::uint32_t crc = 0;
  if (line.size() <= kCrcDigits + 1 || line[kCrcDigits] != ' ') {
    return Json::value_t::discarded;
  }
  const std::string_view digits = line.substr(0, kCrcDigits);
  const auto [end, fault] = std::from_chars(digits.data(), digits.data() + digits.size(), crc, 16);
  const std::string_view text = line.substr(kCrcDigits + 1);
  if (fault != std::errc() || end != digits.data() + digits.size() || crc != crc_of(text)) {
    return Json::value_t::discarded;
  }
  return Json::parse(text, nullptr, false);
}

/// null for what is no number.
Json numbers_json(const std::vector<double>& values) {
  Json json = values;
  return json;
}

std::vector<double> numbers_of(const Json& json) {
  std::vector<double> values;
  for (const Json& value : json) {
    values.push_back(value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>());
  }
  return values;
}

Json json_of(const CampaignIdentity& identity) {
  Json lines = Json::array();
  for (const IdentityLine& line : identity) {
    lines.push_back({line.key, line.text});
  }
  return {{"format", kJournalFormat}, {"version", 1}, {"digest", digest_of(identity)}, {"campaign", lines}};
}

/// Of a journal, without the line end.
std::string first_line(const CampaignIdentity& identity) { return sealed(json_of(identity)); }

[[noreturn]] void refuse_journal(const fs::path& file) {
  throw InputRefused(file, {1, 1}, "is no journal of a campaign that this program knows",
                     "give the directory of another campaign, or an empty one");
}

CampaignIdentity identity_of(const Json& json, const fs::path& file) {
  if (!json.is_object() || json.value("format", "") != kJournalFormat || json.value("version", 0) != 1 ||
      !json.contains("campaign")) {
    refuse_journal(file);
  }
  CampaignIdentity identity;
  for (const Json& line : json["campaign"]) {
    if (!line.is_array() || line.size() != 2 || !line[0].is_string() || !line[1].is_string()) {
      refuse_journal(file);
    }
    identity.push_back({line[0].get<std::string>(), line[1].get<std::string>()});
  }
  return identity;
}

}  // namespace

std::string digest_of(const CampaignIdentity& identity) {
  // Nobody makes two campaigns alike on purpose, and the texts themselves are compared.
  std::string text;
  for (const IdentityLine& line : identity) {
    text += line.key + '\0' + line.text + '\0';
  }
  return fmt::format("{:016x}", fnv1a(text));
}

std::string difference_between(const CampaignIdentity& before, const CampaignIdentity& now) {
  std::map<std::string, std::string> old;
  for (const IdentityLine& line : before) {
    old[line.key] = line.text;
  }
  for (const IdentityLine& line : now) {
    const auto found = old.find(line.key);
    if (found == old.end()) {
      return fmt::format("{} is {}, was not there", line.key, in_quotes(line.text));
    }
    if (found->second != line.text) {
      return fmt::format("{} is {}, was {}", line.key, in_quotes(line.text), in_quotes(found->second));
    }
    old.erase(found);
  }
  if (!old.empty()) {
    return fmt::format("{} is not there, was {}", old.begin()->first, in_quotes(old.begin()->second));
  }
  return before == now ? "" : "the order of the keys is another";
}

std::string format_record(const RunRecord& record) {
  Json values = Json::object();
  for (const RunQuantityRow& row : kRunQuantityRows) {
    values[std::string(row.name)] = numbers_json(record[row.quantity]);
  }
  return sealed({{"run", record.run},
                 {"seed", record.seed},
                 {"draws", numbers_json(record.draws)},
                 {"outcome", static_cast<int>(record.outcome)},
                 {"reason", record.reason},
                 {"drift_model", record.drift_model},
                 {"findings", record.findings},
                 {"values", values},
                 {"cpu_s", record.cpu_s},
                 {"elapsed_s", record.elapsed_s}});
}

std::optional<RunRecord> parse_record(std::string_view line) {
  const Json json = opened(line);
  if (json.is_discarded() || !json.contains("run")) {
    return std::nullopt;
  }
  try {
    RunRecord record;
    record.run = json.at("run").get<std::uint64_t>();
    record.seed = json.at("seed").get<std::uint64_t>();
    record.draws = numbers_of(json.at("draws"));
    const int outcome = json.at("outcome").get<int>();
    if (outcome < 0 || outcome > static_cast<int>(RunOutcome::kFailed)) {
      return std::nullopt;
    }
    record.outcome = static_cast<RunOutcome>(outcome);
    record.reason = json.at("reason").get<std::string>();
    record.drift_model = json.at("drift_model").get<std::string>();
    record.findings = json.at("findings").get<std::vector<std::string>>();
    for (const RunQuantityRow& row : kRunQuantityRows) {
      record[row.quantity] = numbers_of(json.at("values").at(std::string(row.name)));
    }
    record.cpu_s = json.at("cpu_s").get<double>();
    record.elapsed_s = json.at("elapsed_s").get<double>();
    return record;
  } catch (const Json::exception&) {
    return std::nullopt;
  }
}

bool is_barely_begun(const fs::path& file, const CampaignIdentity& identity) {
  const std::string line = first_line(identity);
  std::error_code unknown;  // of what is no file, which read_journal() refuses
  const std::uintmax_t size = fs::file_size(file, unknown);
  return !unknown && size <= line.size() && line.starts_with(TextFile(file).text());
}

Journal read_journal(const fs::path& file) {
  const TextFile content(file);
  const std::string_view text = content.text();
  Journal journal;
  std::map<std::uint64_t, RunRecord> records;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string_view::npos) {
      break;  // cut short as it was written: that run is performed again
    }
    const std::string_view line = text.substr(begin, end - begin);
    if (begin == 0) {
      journal.identity = identity_of(opened(line), file);
    } else if (std::optional<RunRecord> record = parse_record(line)) {
      const std::uint64_t run = record->run;
      records.insert_or_assign(run, std::move(*record));
    } else {
      ++journal.damaged;
    }
    begin = end + 1;
    journal.size = begin;
  }
  if (journal.size == 0) {
    static_cast<void>(identity_of(Json(), file));
  }
  journal.crc = crc_of(text.substr(0, journal.size));
  for (auto& [run, record] : records) {
    journal.records.push_back(std::move(record));
  }
  return journal;
}

JournalWriter::JournalWriter(const fs::path& file, const CampaignIdentity& identity) : file_(GrowingFile::begin(file)) {
  file_.append(first_line(identity) + "\n");
  file_.synchronise();
}

JournalWriter::JournalWriter(const fs::path& file, const Journal& journal)
    : file_(GrowingFile::carry_on(file, journal.size, journal.crc)) {}

void JournalWriter::add(std::span<const RunRecord> records) {
  std::string lines;
  for (const RunRecord& record : records) {
    lines += format_record(record) + "\n";
  }
  file_.append(lines);
  file_.synchronise();
}

void write_run_times(const fs::path& file, std::span<const RunRecord> records) {
  std::string text = "run,cpu_s,elapsed_s\n";
  for (const RunRecord& record : records) {
    fmt::format_to(std::back_inserter(text), "{},{:.3f},{:.3f}\n", record.run, record.cpu_s, record.elapsed_s);
  }
  write_file(file, text);
}

}  // namespace trihedron::io
