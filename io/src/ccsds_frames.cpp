#include "ccsds_frames.hpp"

#include <algorithm>
#include <array>
#include <cctype>

namespace trihedron::io {

std::string normalised(std::string_view name) {
  std::string result;
  for (const char c : name) {
    const char next = c == ' ' ? '_' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    if (next != '_' || result.empty() || result.back() != '_') {
      result.push_back(next);
    }
  }
  return result;
}

bool is_inertial_frame(std::string_view name) {
  constexpr std::array<std::string_view, 8> kKnown = {"ICRF", "ICRF1",   "ICRF2", "ICRF3",
                                                      "GCRF", "EME2000", "J2000", "EME_2000"};
  return std::ranges::find(kKnown, name) != kKnown.end();
}

bool is_spacecraft_frame(std::string_view name) {
  constexpr std::array<std::string_view, 12> kFrameKinds = {"SC_BODY",    "AST",       "STARTRACKER", "INSTRUMENT",
                                                            "GYRO_FRAME", "IMU_FRAME", "SENSOR",      "ACC",
                                                            "DSS",        "CSS",       "ESA",         "TAM"};
  return std::ranges::any_of(kFrameKinds, [&](std::string_view kind) {
    if (!name.starts_with(kind)) {
      return false;
    }
    std::string_view rest = name.substr(kind.size());
    if (rest.empty()) {
      return true;
    }
    const bool underscore = rest.starts_with('_');
    rest.remove_prefix(underscore ? 1 : 0);
    return underscore && !rest.empty() && rest.size() <= 8 &&
           std::ranges::all_of(rest, [](unsigned char c) { return std::isalnum(c) != 0; });
  });
}

}  // namespace trihedron::io
