#include "telemetry_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <utility>

#include "pass_toml.hpp"
#include "schemas.hpp"
#include "series.hpp"
#include "telemetry_table.hpp"
#include "toml_fields.hpp"
#include "trihedron/io/time_text.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

namespace fs = std::filesystem;

using Check = std::function<void(const TomlTable&, const toml::node&)>;

/// A field that is looked at when it has been read.
Field looked_at(Field field, const Check& check) {
  field.read = [read = std::move(field.read), check](const TomlTable& table, const toml::node& node) {
    read(table, node);
    check(table, node);
  };
  return field;
}

/// A name that is not empty.
Field name_of_something(std::string_view key, std::string& target, std::string_view about) {
  return looked_at(text(key, target, about), [key, &target](const TomlTable& table, const toml::node& node) {
    if (target.empty()) {
      table.refuse(node, fmt::format("\"{}\" is empty", key), "give the name");
    }
  });
}

/// Without the sign that it is taken with.
std::string column_of(const std::string& name) { return name.starts_with('-') ? name.substr(1) : name; }

/// So many names.
Field column_names(std::string_view key, std::vector<std::string>& target, std::size_t count, std::string_view about) {
  const auto schema = [count] {
    Json array = array_of(text_schema());
    array["minItems"] = count;
    array["maxItems"] = count;
    return array;
  };
  return {key, about, schema, [key, &target, count](const TomlTable& table, const toml::node& node) {
            const toml::array* const array = node.as_array();
            if (array == nullptr || array->size() != count) {
              table.refuse(node, fmt::format("\"{}\" is not a list of {} names", key, count),
                           "name the columns in quotes; \"-NAME\" changes the sign of one");
            }
            target.clear();
            for (const toml::node& element : *array) {
              std::string name = table.text(element, key);
              const std::string bare = column_of(name);
              if (bare.empty()) {
                table.refuse(element, fmt::format("\"{}\" has a name that is empty", key), "give the name");
              }
              const auto same = [&](const std::string& other) { return other == bare || other == "-" + bare; };
              if (std::ranges::any_of(target, same)) {
                table.refuse(element, fmt::format("\"{}\" has {} twice", key, in_quotes(bare)),
                             "name each column once");
              }
              target.push_back(std::move(name));
            }
          }};
}

// ---- Time

/// What the clock of the scale shows, without time zone.
Field clock_reading(std::string_view key, std::optional<Time>& target, std::string_view about) {
  return {key, about, text_schema, [key, &target](const TomlTable& table, const toml::node& node) {
            target = parse_epoch(table.text(node, key));
            if (!target) {
              table.refuse(node,
                           fmt::format("\"{}\" is {}, not an ISO date and time", key, in_quotes(table.text(node, key))),
                           "write it like \"1970-01-01T00:00:00\", as the clock of the scale shows it, years 1958 to "
                           "2200, without time zone");
            }
          }};
}

struct FormatWord {
  std::string_view word;
  Stamps::Format format;
  double unit_s;
};
constexpr std::array kFormatWords = {
    FormatWord{"iso", Stamps::Format::kIso, 1},      FormatWord{"s", Stamps::Format::kNumber, 1},
    FormatWord{"ms", Stamps::Format::kNumber, 1e-3}, FormatWord{"us", Stamps::Format::kNumber, 1e-6},
    FormatWord{"ns", Stamps::Format::kNumber, 1e-9}, FormatWord{"min", Stamps::Format::kNumber, 60},
    FormatWord{"h", Stamps::Format::kNumber, 3600},  FormatWord{"days", Stamps::Format::kNumber, 86400},
    FormatWord{"mjd", Stamps::Format::kMjd, 86400},  FormatWord{"jd", Stamps::Format::kJd, 86400}};

Field format_of_stamps(Stamps& stamps) {
  std::vector<std::string_view> known;
  for (const FormatWord& word : kFormatWords) {
    known.push_back(word.word);
  }
  return {"format", "iso: dates and times; a unit: numbers since `since`; mjd, jd: days of the (modified) Julian date",
          [known] { return one_of(known); },
          [known, &stamps](const TomlTable& table, const toml::node& node) {
            const std::string given = table.text(node, "format");
            const auto* const word = std::ranges::find(kFormatWords, given, &FormatWord::word);
            if (word == kFormatWords.end()) {
              refuse_word(table, node, "format", known);
            }
            stamps.format = word->format;
            stamps.unit_s = word->unit_s;
          }};
}

Field scale_of(Stamps& stamps) {
  const std::vector<std::string_view> known(kTimeScales.begin(), kTimeScales.end());
  return {"scale", "time scale of the clock", [known] { return one_of(known); },
          [known, &stamps](const TomlTable& table, const toml::node& node) {
            const std::string given = table.text(node, "scale");
            const auto* const found = std::ranges::find(kTimeScales, given);
            if (found == kTimeScales.end()) {
              refuse_word(table, node, "scale", known);
            }
            stamps.scale = static_cast<TimeScale>(found - kTimeScales.begin());
          }};
}

Field leap_seconds_of(Stamps& stamps) {
  return {"leap_seconds", "whether numbers in UTC count leap seconds; Unix time leaves them out",
          [] {
            return one_of(std::array<std::string_view, 2>{"counted", "left-out"});
          },
          [&stamps](const TomlTable& table, const toml::node& node) {
            bool is_counted = false;
            choice("leap_seconds", is_counted, "", {{"counted", true}, {"left-out", false}}).read(table, node);
            stamps.leap_seconds_counted = is_counted;
          }};
}

void check_stamps(const Stamps& stamps, const TomlTable& table, const toml::node& node) {
  const bool are_numbers = stamps.format == Stamps::Format::kNumber;
  if (are_numbers && !stamps.since) {
    table.refuse(node, "\"time\" has numbers, and does not say since when they count",
                 "give since = \"1970-01-01T00:00:00\" or what it is, as the clock of the scale shows it");
  }
  if (!are_numbers && stamps.since) {
    table.refuse(node, "\"time\" has \"since\", but its format is not a number of a unit",
                 "take it out, or give format = \"s\" or another unit");
  }
  const bool has_choice = are_numbers && stamps.scale == TimeScale::kUtc;
  if (has_choice && !stamps.leap_seconds_counted) {
    table.refuse(node, "\"time\" has numbers in UTC, and does not say whether they count leap seconds",
                 "give leap_seconds = \"left-out\" (Unix time) or \"counted\"");
  }
  if (!has_choice && stamps.leap_seconds_counted) {
    table.refuse(node, "\"time\" has \"leap_seconds\", which only numbers in UTC can count or leave out",
                 "take it out");
  }
  if (stamps.leap_seconds_counted.value_or(false) && !TimeText(TimeScale::kUtc).tai_of(*stamps.since)) {
    table.refuse(node, "\"since\" is a time of UTC for which leap seconds are not known, and they are counted from it",
                 "give a time from 1972 on, or leap_seconds = \"left-out\"");
  }
}

Field time_of_table(Stamps& stamps, const fs::path& file) {
  Field field = section("time", file, "time", "how instants are written", [&stamps] {
    stamps = Stamps{};
    return Fields{required(scale_of(stamps)), required(format_of_stamps(stamps)),
                  clock_reading("since", stamps.since, "when numbers are 0, as the clock of the scale shows it"),
                  leap_seconds_of(stamps)};
  });
  return looked_at(std::move(field),
                   [&stamps](const TomlTable& table, const toml::node& node) { check_stamps(stamps, table, node); });
}

// ---- Tables

Fields table_fields(TableMap& map, const fs::path& file) {
  Field name = required(name_of_something("file", map.file, "with the columns, CSV, or NetCDF where it ends in .nc"));
  Field time = time_of_table(map.stamps, file);
  Field separator = looked_at(
      text("separator", map.separator, "between fields of CSV, one character; a blank is any number of them"),
      [&map](const TomlTable& table, const toml::node& node) {
        constexpr std::string_view kNone = "\"\r\n-+.0123456789";
        if (map.separator.size() != 1 || kNone.find(map.separator.front()) != std::string_view::npos) {
          table.refuse(node,
                       fmt::format("\"separator\" is {}, not a character that separates", in_quotes(map.separator)),
                       "give one character: \",\", \";\", \"\\t\" or \" \"");
        }
      });
  Field header = whole("header_line", map.header_line, limits::kHeaderLine,
                       "of CSV, with the names of the columns; 0: none, they are called \"1\", \"2\" …");
  Field comment = text("comment", map.comment, "with which lines of CSV begin that are skipped");
  Field missing = list_of_texts("missing", map.missing, "that stand for no value, besides an empty field and nan");
  return {std::move(name),   std::move(time),    std::move(separator),
          std::move(header), std::move(comment), std::move(missing)};
}

Field time_column(TableMap& map) {
  return required(name_of_something("time_column", map.time_column, "of the stamps"));
}

Fields flag_fields(FlagMap& flag) {
  Field column = name_of_something("flag", flag.column, "column that says whether a row is good");
  Field good = list_of_numbers("good", flag.good, "values of the flag that are good");
  return {std::move(column), std::move(good)};
}

void check_flag(const FlagMap& flag, const TomlTable& table, const toml::node& node) {
  if (flag.column.empty() != flag.good.empty()) {
    table.refuse(node, "\"flag\" and \"good\" belong together", "give both: flag = \"STATUS\", good = [0]");
  }
}

Field counts(double& target) {
  return one_number("counts_per_unit", target, limits::kCountsPerUnit, "by which the values are divided: 32768 …");
}

Field unit_of_direction(double& angle_unit_rad) {
  return choice("unit", angle_unit_rad,
                "1: direction cosines; a unit of angle: the angles between the momentum and each axis",
                {{"1", 0},
                 {"deg", units::kDegree},
                 {"arcmin", units::kArcMinute},
                 {"arcsec", units::kArcSecond},
                 {"mrad", 1e-3},
                 {"rad", 1}});
}

Fields direction_fields(DirectionMap& map) {
  return Fields{required(column_names(
                    "direction", map.columns, 3,
                    "columns of the momentum along the axes x, y, z of the case; \"-NAME\" changes the sign")),
                counts(map.counts_per_unit), unit_of_direction(map.angle_unit_rad)} +
         flag_fields(map.flag);
}

/// Each element is looked at when it has been read.
template <class T, class FieldsOf, class CheckOf>
Field looked_at_list(std::string_view key, const fs::path& file, std::vector<T>& target, std::string_view about,
                     FieldsOf fields, CheckOf check) {
  return looked_at(list(key, file, target, about, fields),
                   [&target, check](const TomlTable& table, const toml::node& node) {
                     const toml::array& array = *node.as_array();
                     for (std::size_t i = 0; i < target.size(); ++i) {
                       check(target[i], table, array[i]);
                     }
                   });
}

Fields gyro_fields(GyroMap& map, const fs::path& file) {
  Field units = looked_at_list("unit", file, map.units, "one per gyro", direction_fields,
                               [](const DirectionMap& unit, const TomlTable& table, const toml::node& node) {
                                 check_flag(unit.flag, table, node);
                               });
  units = looked_at(std::move(units), [&map](const TomlTable& table, const toml::node& node) {
    if (map.units.size() < 2 || map.units.size() > std::size_t{kMaxGyros}) {
      table.refuse(node, fmt::format("[[telemetry.gyro.unit]] is there {} times", map.units.size()),
                   fmt::format("attitude needs two gyros, and at most {} are handled", kMaxGyros));
    }
    std::map<std::string, std::size_t> gyro_of;
    for (std::size_t k = 0; k < map.units.size(); ++k) {
      for (const std::string& name : map.units[k].columns) {
        if (const auto [its, is_new] = gyro_of.try_emplace(column_of(name), k); !is_new) {
          table.refuse(
              (*node.as_array())[k],
              fmt::format("column {} is that of gyro {} and of gyro {}", in_quotes(its->first), its->second + 1, k + 1),
              "name for each gyro the columns that it has for itself");
        }
      }
    }
  });
  return table_fields(map, file) + Fields{time_column(map), required(std::move(units))};
}

Field unit_of_sigma(double& unit_rad) {
  return choice("sigma_unit", unit_rad, "of sigma; variances and covariances are in its square",
                {{"deg", units::kDegree},
                 {"arcmin", units::kArcMinute},
                 {"arcsec", units::kArcSecond},
                 {"mrad", 1e-3},
                 {"urad", 1e-6},
                 {"rad", 1}});
}

Fields star_tracker_fields(StarTrackerMap& map, const fs::path& file) {
  return table_fields(map, file) +
         Fields{time_column(map),
                required(column_names(
                    "quaternion", map.quaternion, 4,
                    "columns in the order of the file (see scalar), Hamilton; \"-NAME\" changes the sign")),
                required(choice("scalar", map.scalar_first, "whether the scalar is the first or the last of the four",
                                {{"first", true}, {"last", false}})),
                required(choice("maps", map.is_inverse,
                                "components of which axes it takes to which: v_to = q ⊗ v_from ⊗ q*",
                                {{"tracker-to-inertial", false}, {"inertial-to-tracker", true}})),
                counts(map.counts_per_unit),
                column_names("sigma", map.sigma, 3, "columns of each fix's 1-sigma about the axes x, y, z of the head"),
                column_names("covariance", map.covariance, 6,
                             "columns of each fix's covariance about the axes of the head: xx, yy, zz, xy, xz, yz"),
                choice("sigma_is", map.is_variance, "what these columns hold", {{"sigma", false}, {"variance", true}}),
                unit_of_sigma(map.sigma_unit_rad),
                {"largest_sigma_rad", "fixes with a larger one are left out",
                 [] { return number_schema(limits::kStarTrackerNoise_rad); },
                 [&map](const TomlTable& table, const toml::node& node) {
                   map.largest_sigma_rad = table.number(node, "largest_sigma_rad", limits::kStarTrackerNoise_rad);
                 }}} +
         flag_fields(map.flag);
}

void check_star_tracker(const StarTrackerMap& map, const TomlTable& table, const toml::node& node) {
  check_flag(map.flag, table, node);
  const toml::table& own = *node.as_table();
  if (!map.sigma.empty() && !map.covariance.empty()) {
    table.refuse(*own.get("sigma"), "\"sigma\" and \"covariance\" are both there", "name the columns of one of them");
  }
  const bool has_noise = !map.sigma.empty() || !map.covariance.empty();
  if (has_noise != own.contains("sigma_unit")) {
    table.refuse(node, "\"sigma\" or \"covariance\", and \"sigma_unit\" belong together", "give both, or none");
  }
  if (map.sigma.empty() && own.contains("sigma_is")) {
    table.refuse(*own.get("sigma_is"), "\"sigma_is\" is there without \"sigma\"", "name the columns of the sigmas");
  }
  if (!has_noise && own.contains("largest_sigma_rad")) {
    table.refuse(*own.get("largest_sigma_rad"), "\"largest_sigma_rad\" is there without \"sigma\" or \"covariance\"",
                 "name the columns of the sigmas");
  }
}

Fields interval_fields(IntervalMap& map, const fs::path& file) {
  Field of{"of", "what is left out: gyros, star-trackers or both",
           [] {
             return one_of(std::array<std::string_view, 3>{"gyros", "star-trackers", "both"});
           },
           [&map](const TomlTable& table, const toml::node& node) {
             std::pair<bool, bool> chosen;
             choice("of", chosen, "",
                    {{"gyros", std::pair(true, false)},
                     {"star-trackers", std::pair(false, true)},
                     {"both", std::pair(true, true)}})
                 .read(table, node);
             map.gyros = chosen.first;
             map.star_trackers = chosen.second;
           }};
  return table_fields(map, file) +
         Fields{required(name_of_something("begin_column", map.time_column, "of the beginnings")),
                required(name_of_something("end_column", map.end_column, "of the ends")), std::move(of)};
}

/// An instant in the common scale.
Field instant(std::string_view key, std::optional<Time>& target, const Stamps& stamps, std::string_view about) {
  return {key, about, text_schema, [key, &target, &stamps](const TomlTable& table, const toml::node& node) {
            TimeText::Fault fault;
            target = StampReader(stamps).of_text(table.text(node, key), fault);
            if (!target) {
              table.refuse(node, fmt::format("\"{}\": {}", key, fault.reason), fault.cure);
            }
          }};
}

/// `time` of the map comes first in the list, so that the others have it where they tell none.
Fields telemetry_fields(TelemetryMap& map, const fs::path& file) {
  map.star_trackers.resize(1);
  const auto further = [&map, &file](StarTrackerMap& head) {
    head.stamps = map.stamps;
    return star_tracker_fields(head, file);
  };
  const auto interval = [&map, &file](IntervalMap& intervals) {
    intervals.stamps = map.stamps;
    return interval_fields(intervals, file);
  };
  const auto heads = std::make_shared<std::vector<StarTrackerMap>>();
  return {
      required(time_of_table(map.stamps, file)),
      required(section("gyro", file, "[telemetry.gyro]", "the table of the gyros",
                       [&map, &file] {
                         map.gyro.stamps = map.stamps;
                         return gyro_fields(map.gyro, file);
                       })),
      looked_at(required(section("star_tracker", file, "[telemetry.star_tracker]", "the table of the first head",
                                 [&map, &file] {
                                   map.star_trackers.front().stamps = map.stamps;
                                   return star_tracker_fields(map.star_trackers.front(), file);
                                 })),
                [&map](const TomlTable& table, const toml::node& node) {
                  check_star_tracker(map.star_trackers.front(), table, node);
                }),
      looked_at(looked_at_list("further_star_tracker", file, *heads, "the table of each further head", further,
                               check_star_tracker),
                [&map, heads](const TomlTable& /*table*/, const toml::node& /*node*/) {
                  map.star_trackers.insert(map.star_trackers.end(), heads->begin(), heads->end());
                }),
      list("exclude", file, map.exclude, "files of intervals that are left out: manoeuvres, eclipses, tests", interval),
      instant("from", map.from, map.stamps, "what is earlier is left out; in the scale of [telemetry.time]"),
      instant("to", map.to, map.stamps, "what is later is left out")};
}

Fields packet_fields(TelemetryMap& map, const fs::path& file) {
  PacketMap& packets = map.packets.emplace();
  const auto interval = [&map, &file](IntervalMap& intervals) {
    intervals.stamps = map.stamps;
    return interval_fields(intervals, file);
  };
  Field time = time_of_table(map.stamps, file);
  time.about = "how instants are written in from, to and files of intervals; TAI, iso where it is left out";
  return {std::move(time),
          required(section(
              "packets", file, "[telemetry.packets]", "space packets",
              [&packets] {
                return Fields{required(name_of_something("file", packets.file, "space packets, one after the other")),
                              whole("apid", packets.apid, limits::kApid,
                                    "APID of the gyros; the star trackers have the following ones"),
                              whole("gyros", packets.gyros, limits::kGyrosOfPackets, "how many gyros there are")};
              })),
          list("exclude", file, map.exclude, "files of intervals that are left out", interval),
          instant("from", map.from, map.stamps, "what is earlier is left out; in the scale of [telemetry.time]"),
          instant("to", map.to, map.stamps, "what is later is left out")};
}

/// What parse_packets() gives for the columns.
void map_packets(TelemetryMap& map, std::size_t star_trackers) {
  map.gyro.units.clear();
  const std::vector<std::string> names = direction_names(map.packets->gyros);
  for (auto name = names.begin(); name != names.end(); name += 3) {
    map.gyro.units.emplace_back().columns.assign(name, name + 3);
  }
  map.star_trackers.assign(star_trackers, {});
  for (StarTrackerMap& head : map.star_trackers) {
    head.quaternion = {"q_x", "q_y", "q_z", "q_w"};
  }
}

/// Columns of tables, or space packets.
Field telemetry(TelemetryMap& map, const fs::path& file) {
  return required({"telemetry", "where the columns are, and what they mean; or the file of space packets",
                   [&map, &file] {
                     return any_of({schema_of(telemetry_fields(map, file)), schema_of(packet_fields(map, file))});
                   },
                   [&map, &file](const TomlTable& table, const toml::node& node) {
                     const toml::table& own = table.as_table(node, "telemetry");
                     read_fields(own, file, "[telemetry]",
                                 own.contains("packets") ? packet_fields(map, file) : telemetry_fields(map, file));
                   }});
}

/// Says what was given in place of a telemetry.toml.
[[noreturn]] void refuse_other_toml(const toml::table& document, const fs::path& file) {
  if (document.contains("scenario")) {
    throw InputRefused(file, {}, "is a scenario, not a pass",
                       "make a pass of it by `trihedron simulate`, and give that");
  }
  if (document.contains("pass")) {
    throw InputRefused(file, {}, "says what a pass is, and has no table [telemetry] that says where its columns are",
                       "give the directory in which it stands with gyro.csv and star_tracker.csv, or add the table");
  }
  throw InputRefused(file, {}, "is no telemetry.toml: it has no table [telemetry]", kGiveAPass);
}

}  // namespace

TelemetryToml parse_telemetry_toml(std::string_view text, const fs::path& file, const fs::path& directory) {
  const toml::table document = parse_toml(text, file);
  if (!document.contains("telemetry")) {
    refuse_other_toml(document, file);
  }
  TelemetryToml result;
  Field field = telemetry(result.map, file);
  const TomlTable root(document, file, "the file");
  field.read(root, root.at("telemetry"));  // before the rest: it says how many gyros there are
  field.read = [](const TomlTable&, const toml::node&) {};
  const int gyros = result.map.packets ? result.map.packets->gyros : static_cast<int>(result.map.gyro.units.size());
  SettingsOfTelemetry told = read_telemetry_settings(document, file, directory, gyros, field);
  const std::size_t heads = told.settings.further_star_trackers.size() + 1;
  if (result.map.packets) {
    map_packets(result.map, heads);
    if (result.map.packets->apid + static_cast<int>(heads) > kLastApid) {
      throw InputRefused(file, {},
                         fmt::format("\"apid\" {} leaves no room for {} star trackers up to {}",
                                     result.map.packets->apid, heads, kLastApid),
                         "give a smaller one");
    }
  }
  if (heads != result.map.star_trackers.size()) {
    throw InputRefused(file, {},
                       fmt::format("[[star_tracker.further]] is there {} times, [[telemetry.further_star_tracker]] {}",
                                   heads - 1, result.map.star_trackers.size() - 1),
                       "give one of each per further head, in the same order");
  }
  if (told.settings.star_tracker_noise_rad.isZero(0) && result.map.star_trackers.front().sigma.empty() &&
      result.map.star_trackers.front().covariance.empty()) {
    root.refuse(
        root.table_at("star_tracker"), "key \"noise_rad\" is missing in [star_tracker]",
        result.map.packets ? "add it" : "add it, or name the columns of each fix's sigma in [telemetry.star_tracker]");
  }
  result.settings = std::move(told.settings);
  result.prior_file = std::move(told.prior_file);
  return result;
}

Json telemetry_schema() {
  TelemetryMap map;
  PassSettings settings;
  std::optional<std::string> prior_name;
  const fs::path file;
  return toml_file_schema(
      "Telemetry", "telemetry.toml: where the columns of a pass are and what they mean, beside what pass.toml says.",
      schema_of(telemetry_settings_fields(settings, prior_name, file) + Fields{telemetry(map, file)}));
}

}  // namespace trihedron::io
