#pragma once
/// Several passes of one start of the rotors: the result of one is the prior of the next, and each is tested for
/// whether it agrees with those before.

#include <string>
#include <utility>
#include <vector>

#include "trihedron/ground/judge/agreement.hpp"
#include "trihedron/records/catalogue.hpp"
#include "trihedron/records/progress.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// One pass, and how it agrees with those before; for the first there is nothing to compare.
struct PassAlone {
  std::string name;
  CalibrationRun run;  ///< from its own prior, without the other passes
  Agreement coefficients;
  Agreement alignments;
};

/// By the data of the new pass alone and of the passes before alone: the priors of both are taken out. The likelihood
/// of a calibration with estimate x and covariance P from a prior x0, P0 has the information P⁻¹ − P0⁻¹ and its
/// greatest value at x + (P⁻¹ − P0⁻¹)⁻¹ P0⁻¹ (x − x0). Compared are the directions in which the difference is better
/// known than the prior of the passes before.
class SeveralPasses {
 public:
  explicit SeveralPasses(CalibrationOptions options) : options_(std::move(options)) {}

  /// The next pass. Throws SetupError, also where it begins before the last one ends, or is of another spacecraft,
  /// start-up, or set of gyros and star trackers.
  const PassAlone& add(const std::string& name, const Pass& pass, const Progress& progress = {});

  /// One per pass.
  [[nodiscard]] const std::vector<PassAlone>& passes() const { return passes_; }
  /// The last pass, calibrated from all those before. Known before is what was known before the first.
  [[nodiscard]] const CalibrationRun& combined() const { return combined_; }
  /// That the passes name; empty where none does.
  [[nodiscard]] const std::string& start_up() const { return start_up_; }
  /// For a catalogue: each pass alone, and where there are several the last one from all those before.
  [[nodiscard]] std::vector<CatalogueEntry> catalogue_entries() const;

 private:
  void combine(const Pass& pass, const CalibrationOptions& options, const Progress& progress);

  CalibrationOptions options_;
  std::vector<PassAlone> passes_;
  PassSettings last_;
  CalibrationRun combined_;
  std::string start_up_;
};

}  // namespace trihedron::ground
