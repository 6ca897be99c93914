#pragma once

#include <exception>
#include <new>
#include <optional>
#include <string>

#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::ground {

/// Does `work`: why it failed, with the cure where one is told, or nothing where it did not. Throws what says nothing
/// of the work itself: Stopped and std::bad_alloc.
template <class Work>
[[nodiscard]] std::optional<std::string> reason_of_failure(const Work& work) {
  try {
    work();
    return std::nullopt;
  } catch (const Stopped&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const SetupError& error) {
    return std::string(error.what()) + "; " + error.cure();
  } catch (const std::exception& error) {
    return error.what();
  }
}

}  // namespace trihedron::ground
