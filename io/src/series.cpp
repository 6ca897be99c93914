#include "series.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "trihedron/core/per_gyro.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

namespace fs = std::filesystem;

constexpr int kFewestGyros = 2;

/// K of "hK_x", "hK_y", "hK_z"; 0 for any other name.
int gyro_number(std::string_view name) {
  if (name.size() < 4 || name.front() != 'h' || name[name.size() - 2] != '_' || name.back() < 'x' ||
      name.back() > 'z') {
    return 0;
  }
  int number = 0;
  const char* end = name.data() + name.size() - 2;
  return std::from_chars(name.data() + 1, end, number).ptr == end ? number : 0;
}

/// The highest gyro number among the columns.
int count_gyros(const fs::path& file, std::span<const ColumnName> present) {
  int gyros = 0;
  for (const ColumnName& column : present) {
    gyros = std::max(gyros, gyro_number(column.name));
    if (gyros > kMaxGyros) {
      throw InputRefused(file, column.position, fmt::format("{} is of a fifth or later gyro", in_quotes(column.name)),
                         fmt::format("at most {} gyros are handled", kMaxGyros));
    }
  }
  if (gyros == 1) {
    throw InputRefused(file, {}, "has one gyro only", "attitude needs the columns of two gyros, h1_x … h2_z");
  }
  return std::max(gyros, kFewestGyros);
}

const std::vector<std::string> kQuaternion = {"q_x", "q_y", "q_z", "q_w"};
const std::vector<std::string> kSigmas = {"sigma_x_rad", "sigma_y_rad", "sigma_z_rad"};

}  // namespace

std::vector<std::string> direction_names(int gyros) {
  std::vector<std::string> names;
  for (int gyro = 1; gyro <= gyros; ++gyro) {
    for (const char axis : {'x', 'y', 'z'}) {
      names.push_back(fmt::format("h{}_{}", gyro, axis));
    }
  }
  return names;
}

ColumnRules gyro_columns(const fs::path& file, std::span<const ColumnName> present) {
  return {direction_names(count_gyros(file, present)), {}};
}

const std::vector<std::string>& covariance_names() {
  static const std::vector<std::string> names = {"cov_xx_rad2", "cov_yy_rad2", "cov_zz_rad2",
                                                 "cov_xy_rad2", "cov_xz_rad2", "cov_yz_rad2"};
  return names;
}

ColumnRules star_tracker_columns(const fs::path& /*file*/, std::span<const ColumnName> present) {
  const std::vector<std::string>& names = covariance_names();
  std::size_t needed = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (std::ranges::count(present, names[i], &ColumnName::name) > 0) {
      needed = i < kVariances ? std::max(needed, kVariances) : names.size();
    }
  }
  ColumnRules rules{kQuaternion, {}};
  rules.required.insert(rules.required.end(), names.begin(), names.begin() + static_cast<std::ptrdiff_t>(needed));
  return rules;
}

ColumnRules truth_columns(const fs::path& file, std::span<const ColumnName> present) {
  ColumnRules rules{kQuaternion, {}};
  std::ranges::move(direction_names(count_gyros(file, present)), std::back_inserter(rules.required));
  return rules;
}

ColumnRules attitude_columns(const fs::path& /*file*/, std::span<const ColumnName> present) {
  ColumnRules rules{kQuaternion, {"age_s"}, true};
  const std::vector<std::string> rates = {"rate_x_rad_s", "rate_y_rad_s", "rate_z_rad_s"};
  for (const std::vector<std::string>* names : {&kSigmas, &rates}) {
    // All three or none: one alone would be taken for something else.
    const bool any =
        std::ranges::any_of(present, [&](const ColumnName& c) { return std::ranges::count(*names, c.name) > 0; });
    if (any) {
      std::ranges::copy(*names, std::back_inserter(rules.required));
    }
  }
  return rules;
}

std::string header_for(const fs::path& file, ChooseRules choose, std::size_t columns) {
  const std::vector<std::string>& covariances = covariance_names();
  std::vector<std::vector<std::string>> further = {{}, kSigmas, kSigmas, covariances};
  further[2].emplace_back("age_s");
  further.emplace_back(covariances.begin(), covariances.begin() + static_cast<std::ptrdiff_t>(kVariances));
  for (int gyros = kFewestGyros + 1; gyros <= kMaxGyros; ++gyros) {
    further.push_back(direction_names(gyros));
  }
  for (const std::vector<std::string>& names : further) {
    std::vector<ColumnName> present;
    for (const std::string& name : names) {
      present.push_back({name, {}});
    }
    ColumnRules rules = choose(file, present);
    std::ranges::copy_if(rules.optional, std::back_inserter(rules.required),
                         [&](const std::string& name) { return std::ranges::find(names, name) != names.end(); });
    if (rules.required.size() + 1 == columns) {
      return fmt::format("t_s,{}", fmt::join(rules.required, ","));
    }
  }
  return "";
}

ColumnPlan plan_columns(const fs::path& file, std::span<const ColumnName> present, ChooseRules choose) {
  const ColumnRules rules = choose(file, present);
  const auto is_present = [&](const std::string& name) {
    return std::ranges::count(present, name, &ColumnName::name) > 0;
  };

  ColumnPlan plan{{}, rules.required};
  std::ranges::copy_if(rules.optional, std::back_inserter(plan.columns), is_present);
  std::vector<std::string_view> known = {"t_s"};
  known.insert(known.end(), plan.columns.begin(), plan.columns.end());

  for (std::size_t i = 0; i < present.size(); ++i) {
    const auto& [name, position] = present[i];
    const auto found = std::ranges::find(known, name);
    if (found == known.end() && !rules.others_allowed) {
      throw InputRefused(file, position, fmt::format("column {} is not known", in_quotes(name)),
                         suggestion(name, known));
    }
    if (found != known.end() && std::ranges::count(present.first(i), name, &ColumnName::name) > 0) {
      throw InputRefused(file, position, fmt::format("column {} is there twice", in_quotes(name)), "keep one of them");
    }
    const auto index = static_cast<int>(found - known.begin());
    plan.target.push_back(found == known.end() ? ColumnPlan::kSkip : index == 0 ? ColumnPlan::kTime : index - 1);
  }
  for (const std::string_view name : known) {
    if (!is_present(std::string(name))) {
      throw InputIncomplete(file, present.empty() ? Position{} : Position{present.front().position.line, 0},
                            fmt::format("lacks column {}", in_quotes(name)),
                            fmt::format("its columns must be {}", fmt::join(known, ",")));
    }
  }
  return plan;
}

}  // namespace trihedron::io
