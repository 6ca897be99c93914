#include "toml_fields.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <functional>
#include <map>
#include <ranges>
#include <sstream>
#include <vector>

#include "trihedron/io/quantity.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/text.hpp"
#include "wording.hpp"

namespace trihedron::io {

namespace fs = std::filesystem;

namespace {

const toml::array& elements_of(const TomlTable& table, const toml::node& node, std::string_view key) {
  const toml::array* const array = node.as_array();
  if (array == nullptr) {
    table.refuse(node, fmt::format("\"{}\" is no list", key), "give a list in brackets");
  }
  return *array;
}

/// Where keys stand: the tables in which one is known.
struct Places {
  using OfKeys = std::map<std::string, std::vector<std::string>, std::less<>>;
  OfKeys single;
  OfKeys in_arrays;  ///< in elements of arrays

  /// Adds the keys of the tables in a table of this schema. `path`: of that table, as "gyro.drift".
  void add(const Json& schema, const std::string& path, bool is_element, bool in_array) {
    for (const Json& one : schema.value("anyOf", Json::array())) {
      add(one, path, is_element, in_array);
    }
    if (schema.contains("items")) {
      add(schema["items"], path, true, true);
    }
    const Json properties = schema.value("properties", Json::object());
    for (const auto& [key, its] : properties.items()) {
      (in_array ? in_arrays : single)[key].push_back(is_element ? fmt::format("[[{}]]", path)
                                                                : fmt::format("[{}]", path));
      add(its, fmt::format("{}.{}", path, key), false, in_array);
    }
  }
};

/// The cure where a key that a table does not know is one of another table of the document; empty where it is none.
/// `fields`: of the document, or of a table in it that is called `name`.
std::string belongs_into(const UnknownKey& unknown, const std::string& name, const Fields& fields) {
  if (name.starts_with("[[") || name.starts_with('"')) {  // what it holds, the document tells better
    return "";
  }
  const std::string path = name.starts_with('[') ? name.substr(1, name.size() - 2) : "";
  Places places;
  for (const Field& field : fields) {
    places.add(field.schema(), path.empty() ? std::string(field.key) : fmt::format("{}.{}", path, field.key), false,
               false);
  }
  for (const Places::OfKeys* tables : {&places.single, &places.in_arrays}) {
    if (const auto found = tables->find(unknown.key()); found != tables->end()) {
      return fmt::format("it belongs into {}", fmt::join(found->second, " or "));
    }
  }
  if (unknown.is_like_another()) {
    return "";
  }
  const std::vector<std::string_view> keys(std::views::keys(places.single).begin(),
                                           std::views::keys(places.single).end());
  const std::string_view meant = nearest(unknown.key(), keys);
  return meant.empty() ? ""
                       : fmt::format("did you mean \"{}\", which belongs into {}?", meant,
                                     fmt::join(places.single.find(meant)->second, " or "));
}

void read_each(const TomlTable& reader, const std::string& name, const Fields& fields) {
  for (const Field& field : fields) {
    const toml::node* node = field.is_required ? &reader.at(field.key) : reader.find(field.key);
    if (node == nullptr) {
      continue;
    }
    try {
      field.read(reader, *node);
    } catch (const UsageOutsideRange& error) {
      reader.refuse<InputOutsideRange>(*node, fmt::format("\"{}\" in {}: {}", field.key, name, error.what()),
                                       "correct the value");
    } catch (const UsageError& error) {
      reader.refuse(*node, fmt::format("\"{}\" in {}: {}", field.key, name, error.what()), "correct the value");
    }
  }
}

}  // namespace

Fields operator+(Fields a, const Fields& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

void read_fields(const toml::table& table, const fs::path& file, const std::string& name, const Fields& fields) {
  std::vector<std::string_view> known;
  for (const Field& field : fields) {
    known.push_back(field.key);
  }
  const TomlTable reader(table, file, name);
  try {
    reader.expect_known(known);
    read_each(reader, name, fields);
  } catch (const UnknownKey& unknown) {
    const std::string cure = belongs_into(unknown, name, fields);
    if (cure.empty()) {
      throw;
    }
    throw UnknownKey(unknown, cure);
  }
}

Json schema_of(const Fields& fields) {
  Json schema = object_of({});
  for (const Field& field : fields) {
    Json property = field.schema();
    if (!field.about.empty()) {
      property["description"] = field.about;
    }
    schema["properties"][std::string(field.key)] = std::move(property);
    if (field.is_required) {
      schema["required"].push_back(field.key);
    }
  }
  return schema;
}

Json toml_file_schema(std::string_view title, std::string_view about, const Json& schema) {
  Json document = document_schema(title, about, schema);
  document["properties"][std::string(kVersionKey)] = {{"const", kTomlVersion},
                                                      {"description", "of the format; before all tables"}};
  return document;
}

Field required(Field field) {
  field.is_required = true;
  return field;
}

Field text(std::string_view key, std::string& target, std::string_view about) {
  return {key, about, text_schema,
          [key, &target](const TomlTable& table, const toml::node& node) { target = table.text(node, key); }};
}

Field one_number(std::string_view key, double& target, const Range& range, std::string_view about) {
  return {key, about, [range] { return number_schema(range); },
          [key, &target, range](const TomlTable& table, const toml::node& node) {
            target = table.number(node, key, range);
          }};
}

Field number_of_seconds(std::string_view key, Duration& target, const Range& range, std::string_view about) {
  return {key, about, [range] { return number_schema(range); },
          [key, &target, range](const TomlTable& table, const toml::node& node) {
            target = from_seconds(table.number(node, key, range));
          }};
}

Field whole(std::string_view key, int& target, const Range& range, std::string_view about) {
  return {key, about, [range] { return whole_schema(static_cast<int>(range.least), static_cast<int>(range.most)); },
          [key, &target, range](const TomlTable& table, const toml::node& node) {
            if (!node.is_integer()) {
              table.refuse(node, fmt::format("\"{}\" is not a whole number", key), std::string(range.why));
            }
            target = static_cast<int>(table.number(node, key, range));
          }};
}

Field epoch(std::string_view key, Time& target, std::string_view about) {
  return {key, about, epoch_schema, [key, &target](const TomlTable& table, const toml::node& node) {
            std::string iso;
            if (const auto* local = node.as_date_time(); local != nullptr && !local->get().offset) {
              std::ostringstream stream;
              stream << local->get();
              iso = stream.str();
            } else {
              iso = table.text(node, key);
            }
            const std::optional<Time> time = parse_epoch(iso);
            if (!time) {
              table.refuse(node, fmt::format("\"{}\" is {}, not an ISO date and time", key, in_quotes(iso)),
                           "write it like \"2009-05-20T00:00:00\", TAI, years 1958 to 2200, without time zone");
            }
            target = *time;
          }};
}

Field three_numbers(std::string_view key, Eigen::Vector3d& target, const Range& range, std::string_view about) {
  return {key, about, [range] { return three_of(number_schema(range)); },
          [key, &target, range](const TomlTable& table, const toml::node& node) {
            target = table.three_numbers(node, key, range);
          }};
}

Field three_numbers(std::string_view key, std::optional<Eigen::Vector3d>& target, const Range& range,
                    std::string_view about) {
  return {key, about, [range] { return three_of(number_schema(range)); },
          [key, &target, range](const TomlTable& table, const toml::node& node) {
            target = table.three_numbers(node, key, range);
          }};
}

Field list_of_texts(std::string_view key, std::vector<std::string>& target, std::string_view about) {
  return {key, about, [] { return array_of(text_schema()); },
          [key, &target](const TomlTable& table, const toml::node& node) {
            target.clear();
            for (const toml::node& element : elements_of(table, node, key)) {
              target.push_back(table.text(element, key));
            }
          }};
}

Field list_of_numbers(std::string_view key, std::vector<double>& target, std::string_view about) {
  return {key, about, [] { return array_of(number_schema()); },
          [key, &target](const TomlTable& table, const toml::node& node) {
            target.clear();
            for (const toml::node& element : elements_of(table, node, key)) {
              target.push_back(table.number(element, key));
            }
          }};
}

std::string quantity_text(const TomlTable& table, const toml::node& node, std::string_view key) {
  if (!node.is_string()) {
    table.refuse(node, fmt::format("\"{}\" must be a string with a number and its unit", key),
                 "write the value in quotes with its unit, like \"30deg\", \"3s\" or \"2arcsec\"");
  }
  return table.text(node, key);
}

namespace {

double quantity_value(const TomlTable& table, const toml::node& node, std::string_view key, const QuantityKind& kind,
                      const Range& range) {
  return parse_quantity(quantity_text(table, node, key), kind, range);
}

template <class T>
Field one_quantity(std::string_view key, T& target, const QuantityKind& kind, std::string_view about,
                   const Range& range) {
  return {key, about, [&kind] { return quantity_schema(kind); },
          [key, &target, &kind, range](const TomlTable& table, const toml::node& node) {
            target = quantity_value(table, node, key, kind, range);
          }};
}

template <class T>
Field vector_of_quantities(std::string_view key, T& target, const QuantityKind& kind, const Range& range,
                           std::string_view about) {
  return {key, about, [&kind] { return three_of(quantity_schema(kind)); },
          [key, &target, &kind, range](const TomlTable& table, const toml::node& node) {
            const toml::array* array = node.as_array();
            if (array == nullptr || array->size() != 3) {
              table.refuse(node, fmt::format("\"{}\" is not a list of three", key), "give [x, y, z]");
            }
            Eigen::Vector3d values;
            for (int i = 0; i < 3; ++i) {
              values(i) = quantity_value(table, (*array)[static_cast<std::size_t>(i)], key, kind, range);
            }
            target = values;
          }};
}

}  // namespace

Field quantity(std::string_view key, double& target, const QuantityKind& kind, std::string_view about) {
  return one_quantity(key, target, kind, about, kind.range);
}

Field quantity(std::string_view key, double& target, const QuantityKind& kind, const Range& range,
               std::string_view about) {
  return one_quantity(key, target, kind, about, range);
}

Field quantity(std::string_view key, std::optional<double>& target, const QuantityKind& kind, std::string_view about) {
  return one_quantity(key, target, kind, about, kind.range);
}

Field quantity(std::string_view key, std::optional<double>& target, const QuantityKind& kind, const Range& range,
               std::string_view about) {
  return one_quantity(key, target, kind, about, range);
}

Field duration(std::string_view key, Duration& target, const Range& range_s, std::string_view about) {
  return {key, about, [] { return quantity_schema(kDuration); },
          [key, &target, range_s](const TomlTable& table, const toml::node& node) {
            target = parse_duration(quantity_text(table, node, key), range_s);
          }};
}

Field signed_duration(std::string_view key, double& target_s, const Range& range_s, std::string_view about) {
  return {key, about, [] { return quantity_schema(kDuration); },
          [key, &target_s, range_s](const TomlTable& table, const toml::node& node) {
            target_s = to_seconds(parse_signed_duration(quantity_text(table, node, key), range_s));
          }};
}

Field signed_duration(std::string_view key, double& target_s, std::string_view about) {
  return signed_duration(key, target_s, kDuration.range, about);
}

Field three_quantities(std::string_view key, Eigen::Vector3d& target, const QuantityKind& kind,
                       std::string_view about) {
  return vector_of_quantities(key, target, kind, kind.range, about);
}

Field three_quantities(std::string_view key, Eigen::Vector3d& target, const QuantityKind& kind, const Range& range,
                       std::string_view about) {
  return vector_of_quantities(key, target, kind, range, about);
}

Field three_quantities(std::string_view key, std::optional<Eigen::Vector3d>& target, const QuantityKind& kind,
                       std::string_view about) {
  return vector_of_quantities(key, target, kind, kind.range, about);
}

void refuse_word(const TomlTable& table, const toml::node& node, std::string_view key,
                 std::span<const std::string_view> words) {
  const std::string given = table.text(node, key);
  table.refuse(node, fmt::format("\"{}\" cannot be {}", key, in_quotes(given)), suggestion(given, words));
}

Field section(std::string_view key, const fs::path& file, std::string name, std::string_view about,
              const std::function<Fields()>& fields) {
  return {key, about, [fields] { return schema_of(fields()); },
          [key, &file, name = std::move(name), fields](const TomlTable& table, const toml::node& node) {
            read_fields(table.as_table(node, key), file, name, fields());
          }};
}

std::vector<const toml::table*> tables_of(const TomlTable& table, const toml::node& node, std::string_view key,
                                          const std::string& cure) {
  const toml::array* array = node.as_array();
  if (array == nullptr || !(array->empty() || array->is_array_of_tables())) {
    table.refuse(node, fmt::format("\"{}\" is not an array of tables", key), cure);
  }
  std::vector<const toml::table*> tables;
  for (const toml::node& element : *array) {
    tables.push_back(element.as_table());
  }
  return tables;
}

}  // namespace trihedron::io
