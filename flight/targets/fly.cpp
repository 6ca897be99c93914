// fly RECORDS RESULT: flies the on-board application of trihedron.h through records, as `trihedron replay PASS
// --records RECORDS` writes them, on any target, and writes what came out. The desktop compares the results of targets;
// see fly.py, which also names the columns of a result and gives each target its byte order.

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>

#include "probe.hpp"
#include "trihedron.h"

namespace {

using trihedron::targets::instructions;
using trihedron::targets::instructions_between;

enum ExitStatus { kFlown = 0, kWrongUsage = 2, kNoRecords = 3, kNoResult = 4 };
enum RecordKind : std::uint64_t { kParameters = 0, kSample = 1, kFix = 2 };

constexpr std::size_t kBufferSize = 32768;

/// A file with a buffer that is not of the heap. NOLINTBEGIN(cppcoreguidelines-owning-memory)
class File {
 public:
  File(const char* path, const char* mode) : file_(std::fopen(path, mode)) {
    if (file_ != nullptr && std::setvbuf(file_, buffer_.data(), _IOFBF, buffer_.size()) != 0) {
      static_cast<void>(close());
    }
  }
  ~File() { static_cast<void>(close()); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  template <class Record>
  [[nodiscard]] bool take(Record& record) {
    return file_ != nullptr && std::fread(&record, sizeof record, 1, file_) == 1;
  }
  template <class Record>
  void put(const Record& record) {
    ok_ = ok_ && file_ != nullptr && std::fwrite(&record, sizeof record, 1, file_) == 1;
  }
  /// Whether all that was there has been read.
  [[nodiscard]] bool at_end() const { return file_ != nullptr && std::feof(file_) != 0; }
  /// Whether everything has been written.
  [[nodiscard]] bool close() {
    if (file_ != nullptr) {
      ok_ = std::fclose(file_) == 0 && ok_;
      file_ = nullptr;
      return ok_;
    }
    return false;
  }

 private:
  std::FILE* file_;
  bool ok_ = true;
  std::array<char, kBufferSize> buffer_{};
};
// NOLINTEND(cppcoreguidelines-owning-memory)

/// What one event came to; the attitude is zero where there is none.
struct Outcome {
  std::uint64_t kind = 0;
  std::uint64_t status = 0;         ///< of `trihedron_sample` or `trihedron_fix`
  std::uint64_t call_cost = 0;      ///< instructions
  std::uint64_t attitude_cost = 0;  ///< instructions; of a sample alone
  trihedron_attitude attitude{};
};

/// What follows the last of them.
struct End {
  trihedron_housekeeping housekeeping{};
  trihedron_housekeeping restored{};  ///< after a reset and a snapshot
  std::uint64_t measured = 0;         ///< whether costs and stack are
  std::uint64_t stack_bytes = 0;
  std::uint64_t state_bytes = 0;
  /// Instructions of the calls that are not part of a slot.
  std::uint64_t housekeeping_cost = 0;
  std::uint64_t save_cost = 0;
  std::uint64_t restore_cost = 0;
  std::uint64_t correct_now_cost = 0;
  std::uint64_t adopt_cost = 0;
  std::uint64_t hold_cost = 0;
  std::uint64_t select_cost = 0;
  std::uint64_t reset_cost = 0;
  std::uint64_t load_cost = 0;
  std::uint64_t start_cost = 0;
};

template <class Call>
std::uint64_t cost_of(Call&& call) {
  const std::uint32_t before = instructions();
  call();
  return instructions_between(before, instructions());
}

alignas(TRIHEDRON_ALIGNMENT) std::array<std::byte, TRIHEDRON_SIZE_OF_2_GYROS> memory;
std::array<std::byte, TRIHEDRON_SNAPSHOTS_SIZE_OF_2_GYROS> snapshots;
trihedron_parameters parameters;

trihedron_application* started(File& records) {
  std::uint64_t kind = 0;
  if (!records.take(kind) || kind != kParameters || !records.take(parameters)) {
    return nullptr;
  }
  trihedron_application* application = trihedron_create(memory.data(), memory.size(), parameters.gyros);
  const bool is_started = application != nullptr &&
                          trihedron_load_parameters(application, &parameters) == TRIHEDRON_ANSWER_ACCEPTED &&
                          trihedron_command(application, TRIHEDRON_COMMAND_START, 0) == TRIHEDRON_ANSWER_ACCEPTED;
  return is_started ? application : nullptr;
}

[[nodiscard]] bool fly_sample(File& records, trihedron_application* application, Outcome& outcome) {
  trihedron_gyro_sample sample;
  if (!records.take(sample)) {
    return false;
  }
  outcome.call_cost = cost_of([&] { outcome.status = trihedron_on_gyro(application, &sample); });
  outcome.attitude_cost = cost_of([&] { static_cast<void>(trihedron_get_attitude(application, &outcome.attitude)); });
  return true;
}

[[nodiscard]] bool fly_fix(File& records, trihedron_application* application, Outcome& outcome) {
  trihedron_star_fix fix;
  if (!records.take(fix)) {
    return false;
  }
  outcome.call_cost = cost_of([&] { outcome.status = trihedron_on_fix(application, &fix); });
  return true;
}

/// A snapshot, restored, and each command; after the flight.
void try_others(trihedron_application* application, End& end) {
  end.housekeeping_cost = cost_of([&] { trihedron_get_housekeeping(application, &end.housekeeping); });
  end.save_cost = cost_of([&] { static_cast<void>(trihedron_save(application, snapshots.data(), snapshots.size())); });
  const auto cost_of_command = [&](std::uint32_t command, std::uint32_t argument) {
    return cost_of([&] { static_cast<void>(trihedron_command(application, command, argument)); });
  };
  end.correct_now_cost = cost_of_command(TRIHEDRON_COMMAND_CORRECT_NOW, 0);
  end.hold_cost = cost_of_command(TRIHEDRON_COMMAND_HOLD_CALIBRATION, 0);
  end.adopt_cost = cost_of_command(TRIHEDRON_COMMAND_ADOPT_CALIBRATION, 0);
  end.select_cost = cost_of_command(TRIHEDRON_COMMAND_SELECT_GYROS, 3);
  end.reset_cost = cost_of_command(TRIHEDRON_COMMAND_RESET, 0);
  end.load_cost = cost_of([&] { static_cast<void>(trihedron_load_parameters(application, &parameters)); });
  end.start_cost = cost_of_command(TRIHEDRON_COMMAND_START, 0);
  end.restore_cost =
      cost_of([&] { static_cast<void>(trihedron_restore(application, snapshots.data(), snapshots.size(), nullptr)); });
  trihedron_get_housekeeping(application, &end.restored);
}

/// Feeds the events; false where the records break off. The stack is counted from here.
bool fly(File& records, trihedron_application* application, File& result, End& end) {
  trihedron::targets::paint_stack();
  std::uint64_t kind = 0;
  while (records.take(kind)) {
    Outcome outcome{.kind = kind};
    if (kind != kSample && kind != kFix) {
      return false;
    }
    if (!(kind == kSample ? fly_sample(records, application, outcome) : fly_fix(records, application, outcome))) {
      return false;
    }
    result.put(outcome);
  }
  try_others(application, end);
  end.stack_bytes = trihedron::targets::stack_used();
  return records.at_end();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    return kWrongUsage;
  }
  static File records(argv[1], "rb");
  static File result(argv[2], "wb");
  trihedron_application* application = started(records);
  if (application == nullptr) {
    return kNoRecords;
  }
  trihedron::targets::start_counting();
  End end;
  const bool whole = fly(records, application, result, end);
  end.measured = trihedron::targets::measures() ? 1 : 0;
  end.state_bytes = trihedron_size(parameters.gyros);
  result.put(end);
  if (!whole) {
    return kNoRecords;
  }
  return result.close() ? kFlown : kNoResult;
}
