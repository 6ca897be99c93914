#include "trihedron/io/named_pass.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "trihedron/io/error.hpp"

namespace trihedron::io {
namespace {

std::string stem_of(const std::filesystem::path& path) {
  const std::filesystem::path whole = path.lexically_normal();
  return (whole.has_filename() ? whole : whole.parent_path()).stem().string();
}

}  // namespace

NamedPass read_named_pass(const std::filesystem::path& path) {
  NamedPass named{path, stem_of(path), read_pass(path), read_truth(path)};
  if (named.truth && named.truth->gyros.size() != static_cast<std::size_t>(named.pass().gyro.gyros)) {
    throw InputRefused(
        path, {},
        fmt::format("the truth has {} gyros, the telemetry {}", named.truth->gyros.size(), named.pass().gyro.gyros),
        "give the truth of this pass, or none");
  }
  return named;
}

std::vector<NamedPass> read_passes(const std::vector<std::string>& paths) {
  std::vector<NamedPass> passes;
  std::map<std::string, int> seen;
  for (const std::string& path : paths) {
    NamedPass& pass = passes.emplace_back(read_named_pass(path));
    if (const int same = ++seen[pass.name]; same > 1) {
      pass.name = fmt::format("{}-{}", pass.name, same);
    }
  }
  std::ranges::stable_sort(passes, {}, [](const NamedPass& pass) { return pass.pass().settings.epoch; });
  return passes;
}

}  // namespace trihedron::io
