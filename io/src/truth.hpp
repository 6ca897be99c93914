#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "series.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::io {

/// The text of truth.json: drift, alignment and what lies outside the drift model, per gyro.
[[nodiscard]] std::string format_truth_parameters(const Truth& truth);

/// Truth from its parameters (the text of truth.json) and its table (q, h1, h2 …). Throws InputRefused for any flaw.
[[nodiscard]] Truth make_truth(std::string_view json, const std::filesystem::path& json_file, const Series& series,
                               Time epoch);

}  // namespace trihedron::io
