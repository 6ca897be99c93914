#pragma once
/// One request to stop for everything that a caller has begun: long loops look at it.

#include <atomic>
#include <exception>

namespace trihedron {

/// Thrown where work ends because it was asked to.
class Stopped : public std::exception {
 public:
  [[nodiscard]] const char* what() const noexcept override { return "stopped"; }
};

/// May be made from another thread, and by the handler of a signal.
class StopRequest {
 public:
  StopRequest() = default;
  /// For a part of the work. It counts as made when `also` is, which may be null and must outlive it.
  explicit StopRequest(const StopRequest* also) noexcept : also_(also) {}

  void make() noexcept { made_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool made() const noexcept {
    return made_.load(std::memory_order_relaxed) || (also_ != nullptr && also_->made());
  }

 private:
  static_assert(std::atomic<bool>::is_always_lock_free, "the handler of a signal may not wait for a lock");
  std::atomic<bool> made_ = false;
  const StopRequest* also_ = nullptr;
};

/// While it lives, this request stops what its thread does. Work that ground/tasks gives to other threads has the
/// request of the thread that gave it.
class StopScope {
 public:
  /// Refers to `request`; null: nothing stops it.
  explicit StopScope(const StopRequest* request) noexcept { current_ = request; }
  StopScope(const StopScope&) = delete;
  StopScope& operator=(const StopScope&) = delete;
  ~StopScope() { current_ = before_; }

  [[nodiscard]] static const StopRequest* current() noexcept { return current_; }

 private:
  static inline thread_local const StopRequest* current_ = nullptr;
  const StopRequest* before_ = current_;
};

/// Throws Stopped where the request of this thread has been made. Cheap: each turn of a long loop may call it.
inline void check_stop() {
  const StopRequest* const request = StopScope::current();
  if (request != nullptr && request->made()) {
    throw Stopped();
  }
}

}  // namespace trihedron
