#include "work.hpp"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <string_view>
#include <thread>

#include "trihedron/records/stop.hpp"

namespace trihedron::python {
namespace nb = nanobind;
namespace {

/// How long Python waits for the next look at signals and progress.
constexpr std::chrono::milliseconds kLook{50};

/// Work in a thread of its own. Must not be made or destroyed while the interpreter's lock is held.
class Worker {
 public:
  explicit Worker(const std::function<void(const Progress&)>& work)
      : thread_([this, &work] {
          const StopScope scope(&stop_);
          try {
            work([this](std::string_view /*doing*/, double fraction) {
              fraction_.store(fraction, std::memory_order_relaxed);
            });
          } catch (...) {
            failure_ = std::current_exception();
          }
          const std::scoped_lock lock(mutex_);
          done_ = true;
          changed_.notify_all();
        }) {}
  ~Worker() {
    stop_.make();
    join();
  }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Whether the work is done; waits for that for a while.
  [[nodiscard]] bool wait() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kLook, [this] { return done_; });
  }
  [[nodiscard]] double fraction() const { return fraction_.load(std::memory_order_relaxed); }
  /// After the work: throws what it threw.
  void finish() {
    join();
    if (failure_) {
      std::rethrow_exception(failure_);
    }
  }

 private:
  void join() {
    if (thread_.joinable()) {
      thread_.join();
    }
  }

  StopRequest stop_;
  std::atomic<double> fraction_{0};
  std::mutex mutex_;
  std::condition_variable changed_;
  bool done_ = false;
  std::exception_ptr failure_;
  std::thread thread_;  // the last member: it uses the others
};

}  // namespace

void interruptible(const nb::object& progress, const std::function<void(const Progress&)>& work) {
  const nb::gil_scoped_release without_lock;
  Worker worker(work);
  double told = -1;
  for (bool done = false; !done;) {
    done = worker.wait();
    const nb::gil_scoped_acquire lock;
    if (PyErr_CheckSignals() != 0) {
      throw nb::python_error();
    }
    const double fraction = done ? 1 : worker.fraction();
    if (!progress.is_none() && fraction > told) {
      progress(fraction);
      told = fraction;
    }
  }
  worker.finish();
}

}  // namespace trihedron::python
