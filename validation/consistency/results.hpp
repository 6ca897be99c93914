#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "consistency/flight.hpp"

namespace trihedron::consistency {

/// Key of an outcome: flight and estimator.
struct Key {
  std::string cell;
  int run = 0;
  std::string estimator;

  auto operator<=>(const Key&) const = default;
};

/// Columns of the table for one estimator.
struct Column {
  std::string estimator;
  int runs = 0;  ///< flights per cell: 1 … runs
};

/// Outcomes of flights; where a file is given, kept in it as they come, so that a campaign can go on after a break.
class Results {
 public:
  Results() = default;
  /// Reads what the file holds, if there is one. Throws std::runtime_error where it holds something else.
  explicit Results(std::filesystem::path file);

  [[nodiscard]] bool contains(const Key& key) const { return outcomes_.contains(key); }
  /// Throws std::runtime_error where the file cannot be written.
  void add(const Key& key, const Outcome& outcome);

  /// Markdown: a row per cell; per estimator the means of NEES and NIS over its runs, marked where they lie outside
  /// their bands, and the error over its bound. Needs all those runs.
  [[nodiscard]] std::string table(const std::vector<Cell>& cells, const std::vector<Column>& columns) const;
  /// The same of the NEES of what the flights made observable: its mean, that of its degrees of freedom, its band.
  [[nodiscard]] std::string observable_table(const std::vector<Cell>& cells, const std::vector<Column>& columns) const;
  /// How estimators invariant and batch differ over runs 1 … `runs` of each cell.
  [[nodiscard]] std::string agreement_table(const std::vector<Cell>& cells, int runs) const;

 private:
  /// Means over the runs; of the NIS over the fixes.
  [[nodiscard]] Outcome mean_of(const Cell& cell, const Column& column) const;

  std::filesystem::path file_;
  std::map<Key, Outcome> outcomes_;
};

/// Puts `text` between the lines `<!-- place -->` and `<!-- end -->` of the document. Throws std::runtime_error where
/// it has none, or cannot be written.
void write_between_markers(const std::filesystem::path& document, const std::string& place, const std::string& text);

}  // namespace trihedron::consistency
