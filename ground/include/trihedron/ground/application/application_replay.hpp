#pragma once
/// The on-board application fed with a pass, event by event, and its snapshots: a replay can be broken off anywhere and
/// carried on.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "trihedron/core/step_report.hpp"
#include "trihedron/core/tables.hpp"
#include "trihedron/records/calibration.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

namespace detail {
class FlownApplication;
}

/// How much of its output the caller has put where it outlives the program; part of a snapshot. Plain data.
struct ConfirmedOutput {
  std::uint64_t bytes = 0;
  std::uint32_t crc = 0;      ///< crc32() of them
  std::uint32_t is_kept = 0;  ///< 1: there is an output
};

/// Inputs that the application was given and has done nothing with.
struct NotTaken {
  std::uint64_t samples = 0;  ///< it had failed
  std::uint64_t fixes = 0;    ///< of a mode that looks at none; lost to a jump of the clock; still waiting for samples
};

/// A PairApplication or TrioApplication, by the number of gyros. What it gives depends on nothing but the pass and the
/// parameters, bit for bit: not on when it was broken off and carried on.
class ApplicationReplay {
 public:
  /// Loads the parameters and starts. Refers to the pass. Throws SetupError.
  ApplicationReplay(const Pass& pass, const Parameters& parameters);
  ApplicationReplay(ApplicationReplay&&) noexcept;
  ApplicationReplay& operator=(ApplicationReplay&&) noexcept;
  ~ApplicationReplay();

  /// Of the next event; nothing after the last one.
  [[nodiscard]] std::optional<Time> next_t() const;

  /// What came of one event.
  struct Step {
    StepReport report;
    /// The attitude delivered at a sample that was used, as of navigate(); nothing where there is none.
    std::optional<AttitudeSolution> attitude;
    double age_s = 0;  ///< of the attitude: since the last astro-correction
  };
  /// Feeds the next event, of which there must be one, and asks for the attitude: what a flight computer does in a
  /// cycle. Valid until the next call.
  const Step& feed();

  [[nodiscard]] Mode mode() const;
  [[nodiscard]] Housekeeping housekeeping() const;
  /// That of the application itself: trustworthy where it has adopted the calibration and has not failed. Where it has
  /// failed, the finding says when and why.
  [[nodiscard]] Verdict verdict() const;
  /// Of the events fed since the beginning of the pass.
  [[nodiscard]] NotTaken not_taken() const;
  /// As of the latest sample: values, covariance, statistics of the fixes, verdict. Nothing before the first fix.
  [[nodiscard]] std::optional<Calibration> calibration() const;
  /// Attitudes delivered since the beginning of the pass.
  [[nodiscard]] std::uint64_t attitudes() const;

  /// Memory that snapshots need: two slots, of which one is whole at any moment.
  [[nodiscard]] std::size_t snapshots_size() const;
  /// A snapshot, and the bytes of the memory that are new: those of one slot.
  struct Saved {
    std::uint64_t sequence = 0;  ///< counted from 1
    std::size_t offset = 0;
    std::size_t size = 0;
  };
  Saved save(std::span<std::byte> memory, const ConfirmedOutput& output);

  /// What became of an attempt to go on.
  struct Resumed {
    std::array<SnapshotAnswer, 2> slots{};  ///< what each held
    std::uint64_t sequence = 0;             ///< 0: neither is whole; nothing is changed
    bool is_of_this_replay = false;         ///< false: of another pass or of other parameters, or of a place that the
                                            ///< pass does not have; nothing is changed
    ConfirmedOutput output;
  };
  /// Goes on from the newest whole snapshot.
  [[nodiscard]] Resumed resume(std::span<const std::byte> memory);

 private:
  std::unique_ptr<detail::FlownApplication> flown_;
};

}  // namespace trihedron::ground
