#pragma once
/// What inspect says of periods, and of mistakes in how the telemetry is read.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "trihedron/core/time.hpp"
#include "trihedron/ground/inspect/mistakes.hpp"
#include "trihedron/io/pass.hpp"

namespace trihedron::cli {

/// As the settings tell them, and the median of the steps from row to row.
struct Periods {
  Duration gyro_told{};
  Duration gyro{};
  Duration star_tracker_told{};
  Duration star_tracker{};  ///< zero where there is one fix only
};

[[nodiscard]] Periods periods_of(const Pass& pass);
[[nodiscard]] std::string periods_text(const Periods& periods);
[[nodiscard]] nlohmann::ordered_json periods_json(const Periods& periods);

/// Whether momenta stand still in inertial axes; where they do not, the mistakes that explain it, and the lines of
/// telemetry.toml or pass.toml that mend it where there is one mistake only that does.
[[nodiscard]] std::string consistency_text(const std::optional<ground::Consistency>& consistency,
                                           const io::LoadedPass& loaded);
/// null where the pass has too little telemetry for it.
[[nodiscard]] nlohmann::ordered_json consistency_json(const std::optional<ground::Consistency>& consistency,
                                                      const io::LoadedPass& loaded);

}  // namespace trihedron::cli
