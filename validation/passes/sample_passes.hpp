#pragma once
/// The passes that tests fly: of each kind our own, simulated, and that of an independent generator where it is at
/// hand. What is not there gives no test.

#include <algorithm>
#include <array>
#include <filesystem>
#include <initializer_list>
#include <ostream>
#include <string>
#include <vector>

namespace trihedron {

/// What is special about a pass. All have nine hours of two gyros and one star tracker.
enum class PassKind {
  kNominal,            ///< slews, all drift in eq. (1)
  kSteadyFlight,       ///< no slew: the alignment about the orbit normal cannot be observed
  kDirty,              ///< outliers, a gap, clock offset of 10 ms, error at orbital period, drift outside eq. (1)
  kYawManoeuvre,       ///< steady flight of a large spacecraft, turned round once
  kDriftOfHighDegree,  ///< drift of degrees up to 6 outside eq. (1)
};

struct PassOfKind {
  PassKind kind{};
  std::string name;
  std::filesystem::path path;  ///< a directory; our own are beside it as NetCDF as well
  bool own = true;

  /// The name as Google Test allows it.
  [[nodiscard]] std::string identifier() const {
    std::string text = name;
    std::ranges::replace(text, '-', '_');
    return text;
  }
  friend std::ostream& operator<<(std::ostream& out, const PassOfKind& pass) { return out << pass.name; }
};

[[nodiscard]] inline std::vector<PassOfKind> sample_passes(std::initializer_list<PassKind> kinds) {
  constexpr std::array kOwn{"nominal", "steady-flight", "dirty", "yaw-manoeuvre", "drift-of-high-degree"};
  constexpr std::array kIndependent{"pass-a", "pass-b", "pass-c", "pass-d", "pass-e"};
  std::vector<PassOfKind> passes;
  for (const PassKind kind : kinds) {
    const auto i = static_cast<std::size_t>(kind);
    passes.push_back({kind, kOwn.at(i), std::filesystem::path(TRIHEDRON_OWN_PASSES) / kOwn.at(i), true});
    const std::filesystem::path independent = std::filesystem::path(TRIHEDRON_INDEPENDENT_PASSES) / kIndependent.at(i);
    if (std::filesystem::exists(independent)) {
      passes.push_back({kind, kIndependent.at(i), independent, false});
    }
  }
  return passes;
}

[[nodiscard]] inline std::vector<PassOfKind> all_sample_passes() {
  using enum PassKind;
  return sample_passes({kNominal, kSteadyFlight, kDirty, kYawManoeuvre, kDriftOfHighDegree});
}

[[nodiscard]] inline std::vector<PassOfKind> own_sample_passes() {
  std::vector<PassOfKind> passes = all_sample_passes();
  std::erase_if(passes, [](const PassOfKind& pass) { return !pass.own; });
  return passes;
}

}  // namespace trihedron
