#pragma once
/// The two syntaxes of an AEM.

#include <cstddef>
#include <filesystem>
#include <string_view>

#include "aem_builder.hpp"
#include "trihedron/io/attitude_message.hpp"

namespace trihedron::io {

/// Of a data line, the epoch included.
[[nodiscard]] std::size_t columns_of(AemBuilder::Kind kind);

[[nodiscard]] AttitudeMessage parse_aem_kvn(std::string_view text, const std::filesystem::path& file);
[[nodiscard]] AttitudeMessage parse_aem_xml(std::string_view text, const std::filesystem::path& file);

}  // namespace trihedron::io
