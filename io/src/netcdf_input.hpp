#pragma once
/// A NetCDF-4 file to read. The libraries for it crash on files that are damaged or made to harm, so each question is
/// answered by a process of its own.

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "series.hpp"
#include "trihedron/core/time.hpp"

namespace trihedron::io {

/// As NetcdfReader, which see; throws as in_own_process() as well.
class NetcdfInput {
 public:
  explicit NetcdfInput(std::filesystem::path file) : file_(std::move(file)) {}

  [[nodiscard]] bool has_group(const std::string& group) const;
  /// Of each name; nullopt where there is none.
  [[nodiscard]] std::vector<std::optional<std::string>> text_attributes(const std::string& group,
                                                                        const std::vector<std::string>& names) const;
  [[nodiscard]] std::vector<std::vector<double>> read_variables(const std::vector<std::string>& paths) const;
  [[nodiscard]] Series read_group(const std::string& group, Time epoch, ChooseRules choose) const;

 private:
  std::filesystem::path file_;
};

}  // namespace trihedron::io
