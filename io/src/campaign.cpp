#include "trihedron/io/campaign.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "quantity_kind.hpp"
#include "schemas.hpp"
#include "settings_tables.hpp"
#include "text_file.hpp"
#include "toml_fields.hpp"
#include "trihedron/core/crc32.hpp"
#include "trihedron/io/config.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/quantity.hpp"
#include "wording.hpp"

namespace trihedron::io {

/// An input, and what is needed to put its draws into a scenario or settings.
struct Varied {  // NOLINT(misc-use-internal-linkage): a member of CampaignFile has vectors of it
  CampaignInput input;
  std::vector<std::string> path;      ///< of a setting without the first part
  std::vector<toml::array> options;   ///< each an array of the one value
  toml::table as_given;               ///< the distribution
  const toml::node* place = nullptr;  ///< in the document
  std::string followed;               ///< key of the input that it follows
};

namespace {

namespace fs = std::filesystem;
using Kind = Distribution::Kind;

/// A normal is cut here, so that all it can draw can be tried before the work; beyond lie 2e-9 of it.
constexpr double kMostSigmas = 6;

constexpr std::array<std::pair<std::string_view, Kind>, 7> kKinds = {{{"uniform", Kind::kUniform},
                                                                      {"loguniform", Kind::kLoguniform},
                                                                      {"normal", Kind::kNormal},
                                                                      {"lognormal", Kind::kLognormal},
                                                                      {"choice", Kind::kChoice},
                                                                      {"grid", Kind::kGrid},
                                                                      {"of", Kind::kFollows}}};
constexpr std::array<std::string_view, 12> kDistributionKeys = {
    "uniform", "loguniform", "normal", "lognormal", "choice", "grid", "of", "weights", "names", "times", "min", "max"};
constexpr std::string_view kForms =
    "write one of {uniform = [from, to]}, {loguniform = [from, to]}, {normal = [mean, sigma]}, "
    "{lognormal = [median, factor]}, {choice = [a, b]}, {grid = [a, b]}, {of = \"another.key\", times = factor}";

std::vector<std::string> parts_of(std::string_view path) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= path.size();) {
    const std::size_t end = std::min(path.find('.', begin), path.size());
    parts.emplace_back(path.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

/// From 1; nothing for what is no number.
std::optional<std::size_t> number_of(std::string_view part) {
  std::size_t number = 0;
  const auto [end, fault] = std::from_chars(part.data(), part.data() + part.size(), number);
  return fault == std::errc() && end == part.data() + part.size() && number > 0 ? std::optional(number) : std::nullopt;
}

/// Why a value has no place in a scenario.
struct NoPlace : std::exception {
  NoPlace(std::string why, std::string what_to_do) : reason(std::move(why)), cure(std::move(what_to_do)) {}
  std::string reason;
  std::string cure;
};

/// Puts a copy of `value` where the path leads: through tables, which are made, and elements of arrays, counted from 1,
/// which have to be there.
void put(toml::table& scenario, const std::vector<std::string>& path, const toml::node& value) {
  toml::node* at = &scenario;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const bool is_last = i + 1 == path.size();
    if (toml::array* array = at->as_array()) {
      const std::optional<std::size_t> number = number_of(path[i]);
      if (!number || *number > array->size()) {
        throw NoPlace{fmt::format("{} is no element of a list of {}", in_quotes(path[i]), array->size()),
                      "elements are counted from 1; the base scenario must have the list"};
      }
      if (is_last) {
        array->replace(array->cbegin() + static_cast<std::ptrdiff_t>(*number - 1), value);
      } else {
        at = array->get(*number - 1);
      }
    } else if (toml::table* table = at->as_table()) {
      if (is_last) {
        table->insert_or_assign(path[i], value);
      } else {
        if (path[i + 1] == "0") {
          throw NoPlace{fmt::format("there is no element 0 of {}", in_quotes(path[i])), "elements are counted from 1"};
        }
        if (!table->contains(path[i])) {
          if (number_of(path[i + 1])) {
            throw NoPlace{fmt::format("the base scenario has no list {}", in_quotes(path[i])),
                          "write the list in the base scenario, so that one of its elements can vary"};
          }
          table->insert(path[i], toml::table{});
        }
        at = table->get(path[i]);
      }
    } else {
      throw NoPlace{fmt::format("{} is one value in the base scenario, nothing lies in it", in_quotes(path[i - 1])),
                    "leave out the rest of the key"};
    }
  }
}

/// A number and the unit behind it.
struct Amount {
  double value = 0;
  std::string unit;
};

std::optional<Amount> amount_of(const toml::node& node) {
  if (node.is_number()) {
    return Amount{*node.value<double>(), ""};
  }
  const auto* text = node.as_string();
  if (text == nullptr) {
    return std::nullopt;
  }
  const std::string_view given = trimmed(text->get());
  Amount amount;
  const auto [end, fault] = std::from_chars(given.data(), given.data() + given.size(), amount.value);
  amount.unit = std::string(trimmed(given.substr(static_cast<std::size_t>(end - given.data()))));
  return fault == std::errc() && std::isfinite(amount.value) ? std::optional(amount) : std::nullopt;
}

std::string text_of(const toml::node& node) {
  if (const auto* text = node.as_string()) {
    return text->get();
  }
  std::ostringstream stream;
  stream << toml::node_view<const toml::node>(node);
  return stream.str();
}

void flatten(const toml::node& node, const std::string& key, CampaignIdentity& lines) {
  if (const toml::table* table = node.as_table()) {
    for (const auto& [name, value] : *table) {
      flatten(value, fmt::format("{}{}{}", key, key.empty() ? "" : ".", name.str()), lines);
    }
  } else {
    lines.push_back({key, text_of(node)});
  }
}

/// Reads one distribution.
class DistributionReader {
 public:
  DistributionReader(const toml::table& table, const fs::path& file, const std::string& key)
      : table_(table), reader_(table, file, fmt::format("the distribution of {}", in_quotes(key))) {
    varied_.input.key = key;
    varied_.path = parts_of(key);
    if (varied_.input.is_setting()) {
      varied_.path.erase(varied_.path.begin());
    }
    varied_.as_given = table;
    varied_.place = &table;
  }

  [[nodiscard]] Varied read() && {
    reader_.expect_known({kDistributionKeys.begin(), kDistributionKeys.end()});
    const toml::node* parameters = nullptr;
    Distribution& distribution = varied_.input.distribution;
    for (const auto& [word, kind] : kKinds) {
      if (const toml::node* node = table_.get(word)) {
        if (parameters != nullptr) {
          refuse(*node, "there are two distributions", "keep one of them");
        }
        parameters = node;
        distribution.kind = kind;
        word_ = word;
      }
    }
    if (parameters == nullptr) {
      refuse(table_, "there is no distribution", std::string(kForms));
    }
    for (const auto& [key, needs] :
         {std::pair{"weights", distribution.kind == Kind::kChoice}, std::pair{"names", distribution.has_options()},
          std::pair{"times", distribution.kind == Kind::kFollows}, std::pair{"min", is_unbounded()},
          std::pair{"max", is_unbounded()}}) {
      if (const toml::node* node = table_.get(key); node != nullptr && !needs) {
        refuse(*node, fmt::format("\"{}\" has no meaning beside \"{}\"", key, word_), "leave it out");
      }
    }
    if (distribution.kind == Kind::kFollows) {
      varied_.followed = reader_.text(*parameters, "of");
      const toml::node* times = table_.get("times");
      distribution.a = times != nullptr ? reader_.number(*times, "times") : 1;
      return std::move(varied_);
    }
    const toml::array* list = parameters->as_array();
    if (list == nullptr || list->empty()) {
      refuse(*parameters, fmt::format("\"{}\" is {}", word_, list == nullptr ? "not a list" : "an empty list"),
             std::string(kForms));
    }
    if (distribution.has_options()) {
      read_options(*list);
    } else {
      read_two_numbers(*list);
    }
    return std::move(varied_);
  }

 private:
  [[noreturn]] void refuse(const toml::node& node, const std::string& reason, const std::string& cure) const {
    reader_.refuse(node, fmt::format("{}: {}", in_quotes(varied_.input.key), reason), cure);
  }

  [[nodiscard]] bool is_unbounded() const {
    return varied_.input.distribution.kind == Kind::kNormal || varied_.input.distribution.kind == Kind::kLognormal;
  }

  [[nodiscard]] Amount amount(const toml::node& node) const {
    const std::optional<Amount> found = amount_of(node);
    if (!found || !std::isfinite(found->value)) {
      refuse(node, fmt::format("{} is no {}number", in_quotes(text_of(node)), found ? "finite " : ""),
             "give a number, with its unit where the key has one, like \"2arcsec\"; words go into {choice = [a, b]}");
    }
    return *found;
  }

  /// In the unit of the others.
  [[nodiscard]] double like_others(const toml::node& node) const {
    const Amount found = amount(node);
    if (found.unit != varied_.input.unit) {
      refuse(node,
             fmt::format("{} is not in {}, as the number before", in_quotes(text_of(node)),
                         varied_.input.unit.empty() ? "no unit" : varied_.input.unit),
             "write all numbers of a distribution in one unit");
    }
    return found.value;
  }

  void read_two_numbers(const toml::array& list) {
    CampaignInput& input = varied_.input;
    Distribution& distribution = input.distribution;
    if (list.size() != 2) {
      refuse(list, fmt::format("\"{}\" has {} numbers", word_, list.size()), std::string(kForms));
    }
    const Amount first = amount(list[0]);
    input.unit = first.unit;
    distribution.a = first.value;
    if (distribution.kind == Kind::kLognormal) {
      const Amount factor = amount(list[1]);
      if (!factor.unit.empty() || !(factor.value > 1)) {
        refuse(list[1], fmt::format("{} is no factor", in_quotes(text_of(list[1]))),
               "the second number of lognormal is the factor of one sigma, above 1 and without unit");
      }
      distribution.b = factor.value;
    } else {
      distribution.b = like_others(list[1]);
    }
    const double a = distribution.a;
    const double b = distribution.b;
    if (const bool is_by_logarithm = distribution.kind == Kind::kLoguniform || distribution.kind == Kind::kLognormal;
        is_by_logarithm && !(a > 0)) {
      refuse(list[0], fmt::format("{} has no logarithm", in_quotes(text_of(list[0]))), "give a number above zero");
    }
    if (distribution.kind == Kind::kNormal && !(b > 0)) {
      refuse(list[1], fmt::format("{} is no sigma", in_quotes(text_of(list[1]))), "give a sigma above zero");
    }
    if (!is_unbounded() && !(a < b)) {
      refuse(list, fmt::format("{} is not below {}", text_of(list[0]), text_of(list[1])),
             "give the smaller number first");
    }
    switch (distribution.kind) {
      case Kind::kNormal:
        distribution.least = a - kMostSigmas * b;
        distribution.most = a + kMostSigmas * b;
        break;
      case Kind::kLognormal:
        distribution.least = a * std::pow(b, -kMostSigmas);
        distribution.most = a * std::pow(b, kMostSigmas);
        break;
      default:
        distribution.least = a;
        distribution.most = b;
    }
    if (const toml::node* least = table_.get("min")) {
      distribution.least = std::max(distribution.least, like_others(*least));
    }
    if (const toml::node* most = table_.get("max")) {
      distribution.most = std::min(distribution.most, like_others(*most));
    }
    if (!(distribution.least < distribution.most) || !std::isfinite(distribution.most - distribution.least)) {
      refuse(table_, "nothing can be drawn between its limits",
             fmt::format("give a min below max, both within {} sigma", kMostSigmas));
    }
  }

  void read_options(const toml::array& list) {
    CampaignInput& input = varied_.input;
    bool all_numbers = true;
    const toml::node* of_another_unit = nullptr;
    for (const toml::node& node : list) {
      std::optional<Amount> found = amount_of(node);
      if (found && !found->unit.empty() && !is_unit(found->unit)) {
        found.reset();  // a date, or a word that begins with a digit
      }
      if (input.options.empty() && found) {
        input.unit = found->unit;
      }
      all_numbers = all_numbers && found;
      if (found) {
        input.numbers.push_back(found->value);
        of_another_unit = found->unit == input.unit ? of_another_unit : &node;
      }
      input.options.push_back(text_of(node));
      varied_.options.emplace_back().push_back(node);
    }
    if (all_numbers && of_another_unit != nullptr && !table_.contains("names")) {
      static_cast<void>(like_others(*of_another_unit));  // refuses it: numbers in several units have no order
    }
    if (!all_numbers) {
      input.numbers.clear();
      input.unit.clear();
    }
    input.distribution.options = list.size();
    if (const toml::node* names = table_.get("names")) {
      read_names(*names);
    }
    for (std::size_t i = 1; i < list.size() && input.numbers.empty(); ++i) {
      if (std::ranges::find(input.options.begin(), input.options.begin() + static_cast<std::ptrdiff_t>(i),
                            input.options[i]) != input.options.begin() + static_cast<std::ptrdiff_t>(i)) {
        refuse(list[i], fmt::format("{} is there twice", in_quotes(input.options[i])),
               "give each value once, under a name of its own; a choice has weights");
      }
    }
    if (input.distribution.kind == Kind::kChoice) {
      read_weights();
    }
    input.distribution.most = static_cast<double>(list.size() - 1);
  }

  /// What people call the options, in place of their values.
  void read_names(const toml::node& node) {
    const toml::array* names = node.as_array();
    if (names == nullptr || names->size() != varied_.options.size()) {
      refuse(node, "\"names\" is not a list as long as that of the values", "give one name per value, or leave it out");
    }
    CampaignInput& input = varied_.input;
    input.numbers.clear();
    input.unit.clear();
    for (std::size_t i = 0; i < names->size(); ++i) {
      input.options[i] = reader_.text((*names)[i], "names");
    }
  }

  void read_weights() {
    Distribution& distribution = varied_.input.distribution;
    distribution.weights.assign(distribution.options, 1);
    const toml::node* node = table_.get("weights");
    if (node == nullptr) {
      return;
    }
    const toml::array* weights = node->as_array();
    if (weights == nullptr || weights->size() != distribution.options) {
      refuse(*node, "\"weights\" is not a list as long as the choice", "give one number above zero per choice");
    }
    for (std::size_t i = 0; i < distribution.options; ++i) {
      distribution.weights[i] = reader_.number((*weights)[i], "weights");
      if (!(distribution.weights[i] > 0)) {
        refuse((*weights)[i], "a weight is not above zero", "give a positive weight, or leave out that choice");
      }
    }
  }

  const toml::table& table_;
  TomlTable reader_;
  std::string_view word_;
  Varied varied_;
};

bool is_distribution(const toml::table& table) {
  return std::ranges::any_of(kKinds, [&](const auto& row) { return table.contains(row.first); });
}

/// Keys may be quoted paths or tables in each other: all the same.
void read_varied(const toml::table& table, const fs::path& file, const std::string& above, std::vector<Varied>& all) {
  for (const auto& [name, node] : table) {
    const std::string key = fmt::format("{}{}{}", above, above.empty() ? "" : ".", name.str());
    const toml::table* below = node.as_table();
    if (below == nullptr || below->empty()) {
      std::vector<std::string_view> words;
      for (const auto& [word, kind] : kKinds) {
        words.push_back(word);
      }
      const std::string cure = node.is_array() ? suggestion(name.str(), words) : std::string(kForms);
      TomlTable(table, file, "[vary]").refuse(node, fmt::format("{} has no distribution", in_quotes(key)), cure);
    }
    if (is_distribution(*below)) {
      all.push_back(DistributionReader(*below, file, key).read());
    } else {
      read_varied(*below, file, key, all);
    }
  }
}

// Of work = "filter".
constexpr std::string_view kNoFilter = "estimator batch is no filter, and with work = \"filter\" nothing else is flown";
constexpr std::string_view kTakeAFilter = "take estimator invariant or paper, or work = \"calibrate\"";

/// Of [campaign].
struct Head {
  std::string name = "Campaign";
  std::uint64_t runs = 0;
  std::uint64_t seed = 0;
  std::uint64_t repeats = 0;
  enum class Sampling { kRandom, kLatinHypercube } sampling = Sampling::kRandom;
  CampaignWork work = CampaignWork::kCalibrate;
  double limit_rad = CampaignPlan{}.limit_rad;
  bool keeps_covariance = false;
};

Field count(std::string_view key, std::uint64_t& target, std::string_view about) {
  const Range& range = limits::kCampaignRuns;
  return {key, about,
          [] { return whole_schema(static_cast<std::int64_t>(range.least), static_cast<std::int64_t>(range.most)); },
          [key, &target](const TomlTable& table, const toml::node& node) {
            if (!node.is_integer()) {
              table.refuse(node, fmt::format("\"{}\" is not a whole number", key), std::string(range.why));
            }
            target = static_cast<std::uint64_t>(table.number(node, key, range));
          }};
}

Field limit(double& target) {
  return quantity("limit", target, kAngle, limits::kAttitudeLimit_rad,
                  "attitude error that ends a correction interval");
}

Fields head_fields(Head& head) {
  using Sampling = Head::Sampling;
  return {text("name", head.name, "for the report"),
          count("runs", head.runs, "how many; without a grid"),
          whole("seed", head.seed, "every draw depends on it, the number of the run and the key alone"),
          count("repeats", head.repeats, "runs at each point of the grid, 1 without it"),
          choice<Sampling>("sampling", head.sampling,
                           "of the distributions: each run for itself, or each key in as many equal parts as there are "
                           "runs, one run in each",
                           {{"random", Sampling::kRandom}, {"latin-hypercube", Sampling::kLatinHypercube}}),
          choice<CampaignWork>("work", head.work,
                               "calibrate: each run does all that the command does; filter: the filter alone, with eq. "
                               "(1) and the noise as told, whose parameters and attitude are compared with the truth",
                               {{"calibrate", CampaignWork::kCalibrate}, {"filter", CampaignWork::kFilter}}),
          limit(head.limit_rad),
          choice<bool>("covariance", head.keeps_covariance, "of the parameters of each run: whether the table has it",
                       {{"left-out", false}, {"kept", true}})};
}

/// A table, or the name of a file beside the campaign's.
struct Origin {
  const toml::table* table = nullptr;
  std::string file;
  const toml::node* place = nullptr;
};

Field origin(std::string_view key, Origin& target, std::string_view about, const std::function<Json()>& table_schema) {
  return {key, about,
          [table_schema] {
            return any_of({text_schema(), table_schema()});
          },
          [key, &target](const TomlTable& table, const toml::node& node) {
            target.place = &node;
            if (node.is_table()) {
              target.table = node.as_table();
            } else {
              target.file = table.text(node, key);
            }
          }};
}

Fields campaign_fields(Head& head, Origin& base, Origin& calibration, const toml::table*& vary, const fs::path& file) {
  const auto vary_schema = [] { return Json{{"type", "object"}}; };
  return {
      section("campaign", file, "[campaign]", "how many runs, and how they are drawn",
              [&head] { return head_fields(head); }),
      origin("base", base, "the scenario: a file, or its tables; without it the paper's experiment",
             scenario_table_schema),
      origin("calibration", calibration, "the settings: a file, or its tables; without it those of the program",
             config_table_schema),
      {"vary",
       "by the path of a key of the scenario, or after \"calibration.\" of the settings, parts joined by points, "
       "elements of lists counted from 1: a table with one of uniform, loguniform, normal, lognormal, choice, grid, of",
       vary_schema, [&vary](const TomlTable& table, const toml::node& node) { vary = &table.as_table(node, "vary"); }}};
}

}  // namespace

struct CampaignFile::Content {
  fs::path file;
  toml::table document;
  fs::path scenario_file;  ///< that positions and a recorded attitude of the base are of
  toml::table base;
  std::vector<fs::path> inputs;
  CalibrationOptions options;  ///< before any is drawn
  fs::path settings_file;      ///< that positions of the settings are of
  std::string settings_name;
  toml::table settings;
  CampaignPlan plan;
  std::vector<Varied> varied;
  std::string recorded;  ///< attitude that the base flies, as text

  [[nodiscard]] toml::table table_of(std::uint64_t seed, std::span<const double> draws) const {
    toml::table scenario = base;
    put(scenario, {"scenario", "seed"}, toml::value<std::int64_t>(static_cast<std::int64_t>(seed)));
    put_draws(scenario, draws, false);
    return scenario;
  }

  [[nodiscard]] CalibrationOptions options_of(std::span<const double> draws) const {
    toml::table drawn = settings;
    put_draws(drawn, draws, true);
    return config_of_table(drawn, settings_file, settings_name);
  }

  void put_draws(toml::table& table, std::span<const double> draws, bool of_settings) const {
    for (std::size_t i = 0; i < varied.size(); ++i) {
      if (varied[i].input.is_setting() == of_settings) {
        put_draw(table, varied[i], draws[i]);
      }
    }
  }

  static void put_draw(toml::table& scenario, const Varied& varied, double draw) {
    const CampaignInput& input = varied.input;
    if (input.distribution.has_options()) {
      put(scenario, varied.path, *varied.options[static_cast<std::size_t>(draw)].get(0));
    } else if (input.unit.empty()) {
      put(scenario, varied.path, toml::value<double>(draw));
    } else {
      put(scenario, varied.path, toml::value<std::string>(fmt::format("{}{}", draw, input.unit)));
    }
  }

  [[noreturn]] void refuse(const toml::node& place, std::string reason, std::string cure) const {
    TomlTable(document, file, "the file").refuse(place, std::move(reason), std::move(cure));
  }

  static constexpr const char* kNarrow = "narrow the distribution, by min and max where it has no ends";

  /// Whether there is what the campaign is to fly.
  [[nodiscard]] bool has_filter(const CalibrationOptions& of) const {
    return plan.work != CampaignWork::kFilter || of.estimator != Estimator::kBatch;
  }

  /// Scenario or settings with one input drawn.
  [[nodiscard]] toml::table drawn_alone(const Varied& one, double draw) const {
    toml::table drawn_into = one.input.is_setting() ? settings : base;
    put_draw(drawn_into, one, draw);
    return drawn_into;
  }

  /// The scenario with all its inputs drawn, the others in the middle of their numbers or the first of their words.
  [[nodiscard]] toml::table drawn_among_others(std::size_t one, double draw) const {
    std::vector<double> draws;
    for (std::size_t i = 0; i < varied.size(); ++i) {
      const Distribution& its = varied[i].input.distribution;
      draws.push_back(i == one ? draw : its.has_options() ? 0 : (its.least + its.most) / 2);
    }
    for (std::size_t i = 0; i < varied.size(); ++i) {
      if (const CampaignInput& input = varied[i].input; input.distribution.kind == Kind::kFollows) {
        draws[i] = following(input, draws[input.followed]);
      }
    }
    toml::table drawn_into = base;
    put_draws(drawn_into, draws, false);
    return drawn_into;
  }

  /// Throws what says why these cannot be flown.
  void expect_possible(const Varied& one, const toml::table& drawn_into, const ScenarioCheck& check) const {
    if (!one.input.is_setting()) {
      check(scenario_of_table(drawn_into, scenario_file, "the scenario"));
    } else if (!has_filter(config_of_table(drawn_into, settings_file, settings_name))) {
      throw InputRefused(file, {}, std::string(kNoFilter), std::string(kTakeAFilter));
    }
  }

  /// Whether a draw that is impossible in the base scenario is possible among others; `root`: the input itself, or the
  /// one that it follows.
  [[nodiscard]] bool is_possible_among_others(const Varied& one, std::size_t root, double draw_of_root,
                                              const ScenarioCheck& check) const {
    try {
      expect_possible(one, drawn_among_others(root, draw_of_root), check);
      return true;
    } catch (const std::exception&) {
      return false;
    }
  }

  void try_draw(const Varied& one, double draw, const ScenarioCheck& check) const {
    const std::string what = one.input.distribution.has_options() ? one.input.options[static_cast<std::size_t>(draw)]
                                                                  : fmt::format("{}{}", draw, one.input.unit);
    const std::string drawn = fmt::format("{} = {}", one.input.key, in_quotes(what));
    try {
      expect_possible(one, drawn_alone(one, draw), check);
    } catch (const NoPlace& none) {
      refuse(*one.place, fmt::format("{}: {}", drawn, none.reason), none.cure);
    } catch (const InputOutsideRange& refused) {
      refuse(*one.place, fmt::format("{} can be drawn: {}", drawn, refused.reason()), kNarrow);
    } catch (const InputRefused& refused) {
      refuse(*one.place, fmt::format("{} can be drawn: {}", drawn, refused.reason()), refused.cure());
    } catch (const std::invalid_argument& refused) {
      refuse(*one.place, fmt::format("{} can be drawn: {}", drawn, refused.what()), kNarrow);
    }
  }

  void read_base(const Origin& origin, const ScenarioCheck& check) {
    scenario_file = file;
    if (origin.table != nullptr) {
      base = *origin.table;
    } else if (!origin.file.empty()) {
      scenario_file = file.parent_path() / origin.file;
      inputs.push_back(scenario_file);
    }
    toml::table parsed;
    const toml::table* table = origin.table != nullptr ? origin.table : &parsed;
    if (origin.table == nullptr && !origin.file.empty()) {
      parsed = parse_toml(TextFile(scenario_file).text(), scenario_file);
      base = parsed;
    }
    const Scenario scenario = scenario_of_table(*table, scenario_file, origin.table != nullptr ? "[base]" : "the file");
    try {
      check(scenario);
    } catch (const std::invalid_argument& error) {
      throw InputRefused(scenario_file, {}, error.what(), "correct the base scenario");
    }
    plan.gyros = scenario.gyros.size();
    if (const auto name = base["attitude"]["recorded"].value<std::string>()) {
      // Wherever a scenario of a run is written, it leads there.
      const fs::path attitude = fs::absolute(scenario_file.parent_path() / *name);
      inputs.push_back(attitude);
      recorded = std::string(TextFile(attitude).text());
      put(base, {"attitude", "recorded"}, toml::value<std::string>(attitude.string()));
    }
  }

  void read_options(const Origin& origin) {
    settings_file = file;
    settings_name = "[calibration]";
    toml::table parsed;
    if (origin.table == nullptr && !origin.file.empty()) {
      settings_file = file.parent_path() / origin.file;
      settings_name = "the file";
      inputs.push_back(settings_file);
      parsed = parse_toml(TextFile(settings_file).text(), settings_file);
    }
    const toml::table& read = origin.table != nullptr ? *origin.table : parsed;
    options = config_of_table(read, settings_file, settings_name);
    settings = read;  // a copy does not know its place in the file
  }

  /// Finds what an input follows, and where its draws end.
  void follow(Varied& one) const {
    CampaignInput& input = one.input;
    const auto its = std::ranges::find(varied, one.followed, [](const Varied& other) { return other.input.key; });
    if (its == varied.end() || its->input.distribution.kind == Kind::kFollows || !its->input.is_number()) {
      refuse(
          *one.place,
          fmt::format("{} follows {}, for which no numbers are drawn", in_quotes(input.key), in_quotes(one.followed)),
          "name a key in [vary] that has a distribution of numbers");
    }
    if (its->input.is_setting() && !input.is_setting()) {
      refuse(*one.place, fmt::format("{} of the scenario follows a setting", in_quotes(input.key)),
             "let the setting follow it: each flight is calibrated by all settings");
    }
    input.followed = static_cast<std::size_t>(its - varied.begin());
    input.unit = its->input.unit;
  }

  /// Least and most that can be drawn, or each option, of an input that follows no other.
  [[nodiscard]] static std::vector<double> ends_of(const Varied& one) {
    const Distribution& its = one.input.distribution;
    std::vector<double> ends;
    if (its.has_options()) {
      for (std::size_t option = 0; option < its.options; ++option) {
        ends.push_back(static_cast<double>(option));
      }
    } else {
      ends = {its.least, its.most};
    }
    return ends;
  }

  /// The draw of an input that follows another, by that of the other.
  [[nodiscard]] double following(const CampaignInput& input, double draw) const {
    return input.distribution.a * varied[input.followed].input.shown(draw);
  }

  /// Refuses an input that can draw what nothing can be flown with.
  void try_ends(std::size_t one, const ScenarioCheck& check) const {
    const CampaignInput& input = varied[one].input;
    const bool follows = input.distribution.kind == Kind::kFollows;
    const std::size_t root = follows ? input.followed : one;
    for (const double end : ends_of(varied[root])) {
      try {
        try_draw(varied[one], follows ? following(input, end) : end, check);
      } catch (const InputRefused&) {
        if (input.is_setting() || !is_possible_among_others(varied[one], root, end, check)) {
          throw;
        }
      }
    }
  }

  void expect_different_keys() const {
    for (const Varied& one : varied) {
      for (const Varied& other : varied) {
        if (&one != &other && (one.input.key == other.input.key || one.input.key.starts_with(other.input.key + "."))) {
          refuse(*one.place,
                 fmt::format("{} and {} draw the same value", in_quotes(other.input.key), in_quotes(one.input.key)),
                 "keep one of them");
        }
      }
      if (one.input.key == "scenario.seed") {
        refuse(*one.place, "\"scenario.seed\" cannot vary by a distribution",
               "leave it out: each run has a seed of its own, which follows from that of the campaign");
      }
    }
  }

  /// Of [campaign], or of the file where that is missing.
  void count_runs(const Head& head) {
    const toml::node* table = document.get("campaign");
    const toml::node& place = table != nullptr ? *table : static_cast<const toml::node&>(document);
    const auto place_of = [&](const char* key) -> const toml::node& {
      const toml::node* node = document["campaign"][key].node();
      return node != nullptr ? *node : place;
    };
    double points = 1;
    bool is_grid = false;
    for (const Varied& one : varied) {
      if (one.input.distribution.kind == Kind::kGrid) {
        is_grid = true;
        points *= static_cast<double>(one.input.distribution.options);
      }
    }
    if (!is_grid) {
      if (head.repeats != 0) {
        refuse(place_of("repeats"), "\"repeats\" has no meaning without a grid", "give \"runs\" in its place");
      }
      if (head.runs == 0) {
        refuse(place, "\"runs\" is missing in [campaign]", "say how many runs there are to be: runs = 1000");
      }
      plan.runs = head.runs;
      return;
    }
    if (head.runs != 0) {
      refuse(
          place_of("runs"),
          fmt::format("\"runs\" has no meaning with a grid: there is one run at each of its points, {} in all", points),
          "leave \"runs\" out; for several runs at each point give their number as \"repeats\"");
    }
    plan.repeats = std::max<std::uint64_t>(head.repeats, 1);
    const double runs = points * static_cast<double>(plan.repeats);
    if (!limits::kCampaignRuns.holds(runs)) {
      refuse(place,
             fmt::format("the grid has {:.6g} points, with repeats {:.6g} runs, more than {:.0f}", points, runs,
                         limits::kCampaignRuns.most),
             "give shorter lists, or distributions with runs and sampling = \"latin-hypercube\"");
    }
    plan.runs = static_cast<std::uint64_t>(runs);
  }
};

CampaignFile::CampaignFile(const fs::path& file, const ScenarioCheck& check) {
  auto content = std::make_unique<Content>();
  content->file = file;
  content->inputs.push_back(file);
  content->document = parse_toml(TextFile(file).text(), file);
  Head head;
  Origin base;
  Origin calibration;
  const toml::table* vary = nullptr;
  read_fields(content->document, file, "the file", campaign_fields(head, base, calibration, vary, file));
  content->read_base(base, check);
  content->read_options(calibration);
  if (vary != nullptr) {
    read_varied(*vary, file, "", content->varied);
  }
  content->expect_different_keys();
  content->count_runs(head);
  content->plan.name = head.name;
  content->plan.seed = head.seed;
  content->plan.work = head.work;
  content->plan.limit_rad = head.limit_rad;
  content->plan.keeps_covariance = head.keeps_covariance;
  content->plan.latin_hypercube = head.sampling == Head::Sampling::kLatinHypercube;
  if (!content->has_filter(content->options)) {
    throw InputRefused(file, {}, std::string(kNoFilter), std::string(kTakeAFilter));
  }
  for (Varied& one : content->varied) {
    if (one.input.distribution.kind == Kind::kFollows) {
      content->follow(one);
    }
  }
  for (std::size_t i = 0; i < content->varied.size(); ++i) {
    content->try_ends(i, check);
    content->plan.inputs.push_back(content->varied[i].input);
  }
  content_ = std::move(content);
}

CampaignFile::~CampaignFile() = default;

const CampaignPlan& CampaignFile::plan() const { return content_->plan; }
std::vector<fs::path> CampaignFile::inputs() const { return content_->inputs; }

CampaignIdentity CampaignFile::identity(std::string_view version) const {
  const CampaignPlan& plan = content_->plan;
  CampaignIdentity lines = {{"version", std::string(version)},
                            {"campaign.name", plan.name},
                            {"campaign.seed", std::to_string(plan.seed)},
                            {"campaign.runs", std::to_string(plan.runs)},
                            {"campaign.repeats", std::to_string(plan.repeats)},
                            {"campaign.sampling", plan.latin_hypercube ? "latin-hypercube" : "random"},
                            {"campaign.work", plan.work == CampaignWork::kFilter ? "filter" : "calibrate"},
                            {"campaign.limit", format_angle(plan.limit_rad)},
                            {"campaign.covariance", plan.keeps_covariance ? "kept" : "left-out"}};
  for (const Varied& one : content_->varied) {
    lines.push_back({"vary." + one.input.key, text_of(one.as_given)});
  }
  flatten(content_->base, "base", lines);
  if (!content_->recorded.empty()) {
    lines.push_back(
        {"base.attitude.recorded, its content", fmt::format("{} bytes, CRC-32 {:08x}", content_->recorded.size(),
                                                            crc32(std::as_bytes(std::span(content_->recorded))))});
  }
  flatten(parse_toml(format_config(content_->options), "settings"), "calibration", lines);
  return lines;
}

Scenario CampaignFile::scenario(std::uint64_t seed, std::span<const double> draws) const {
  return scenario_of_table(content_->table_of(seed, draws), content_->scenario_file, "the scenario");
}

CalibrationOptions CampaignFile::options(std::span<const double> draws) const { return content_->options_of(draws); }

std::string CampaignFile::scenario_text(std::uint64_t seed, std::span<const double> draws) const {
  std::ostringstream stream;
  stream << toml::toml_formatter(content_->table_of(seed, draws)) << "\n";
  return stream.str();
}

Json campaign_schema() {
  Head head;
  Origin base;
  Origin calibration;
  const toml::table* vary = nullptr;
  const fs::path file;
  return toml_file_schema("Campaign", "Monte Carlo over scenarios: what is drawn for each run (TOML).",
                          schema_of(campaign_fields(head, base, calibration, vary, file)));
}

}  // namespace trihedron::io
