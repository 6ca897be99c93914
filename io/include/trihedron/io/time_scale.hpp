#pragma once
/// Time scales of other software's files. Inside everything is TAI.

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "trihedron/core/time.hpp"

namespace trihedron::io {

/// As files name them: TAI, UTC, GPS, TT, TDB.
enum class TimeScale { kTai, kUtc, kGps, kTt, kTdb };

inline constexpr std::array<std::string_view, 5> kTimeScales = {"TAI", "UTC", "GPS", "TT", "TDB"};

[[nodiscard]] std::string name_of(TimeScale scale);  ///< As in messages and options.
/// Case does not matter.
[[nodiscard]] std::optional<TimeScale> time_scale_named(std::string_view name);

/// `2009-05-20T00:00:00.125` as the clock of one scale shows it. UTC has leap seconds by the table of ERFA (eraDat),
/// with 60 in the seconds; GPS is TAI − 19 s, TT is TAI + 32.184 s; TDB is TT + eraDtdb at the geocentre, interpolated
/// from whole ten minutes on (3e-12 s). Remembers the last ten minutes: not to be used by two threads.
class TimeText {
 public:
  explicit TimeText(TimeScale scale) : scale_(scale) {}

  [[nodiscard]] TimeScale scale() const { return scale_; }
  /// Fraction of nine digits where there is one. Throws UsageError for UTC before 1972 or after the years for which
  /// leap seconds are known.
  [[nodiscard]] std::string format(Time t);

  /// What is wrong with a text, and what helps.
  struct Fault {
    std::string reason;
    std::string cure;
  };
  /// Date by month and day or by day of the year, any number of decimals (rounded to nanoseconds), and Z where the
  /// scale is UTC. `fault` says what is wrong where there is no result.
  [[nodiscard]] std::optional<Time> parse(std::string_view text, Fault& fault);
  /// TAI of what the clock of the scale shows, given as Time counts TAI. A clock of UTC that shows the second after a
  /// leap second is taken to be past it. Nothing for UTC where leap seconds are not known.
  [[nodiscard]] std::optional<Time> tai_of(Time clock);

 private:
  /// TDB − TT at an instant of TT, counted as Time counts TAI.
  [[nodiscard]] Duration tdb_minus_tt(Time tt);

  TimeScale scale_;
  std::int64_t cell_ = -1;  ///< of ten minutes, that `cell_begin_s_` and `cell_end_s_` are for
  double cell_begin_s_ = 0;
  double cell_end_s_ = 0;
};

/// `text` as TimeText of UTC prints it for the clock of the system, to the second.
[[nodiscard]] std::string utc_now();

}  // namespace trihedron::io
