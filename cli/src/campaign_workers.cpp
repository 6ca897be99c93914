#include "campaign_workers.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <map>
#include <optional>
#include <span>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "output.hpp"
#include "standard_streams.hpp"
#include "trihedron/campaign/perform.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/records/stop.hpp"
#include "worker_processes.hpp"

namespace trihedron::cli {
namespace {

/// Between two looks at the messages: less than a hundredth of the shortest run of nine hours, and a hundredth of a
/// processor for those who look.
constexpr std::chrono::milliseconds kPatience(2);

// Rank 0 says kSayBegin, then "WORKER RUN …", at last kSayEnd, or kSayLeave where a rank is lost; the others "WORKER
// said LINE" and "WORKER ended HOW"; all kSayAlive.
constexpr std::string_view kSayBegin = "begin";
constexpr std::string_view kSayEnd = "end";
constexpr std::string_view kSayLeave = "leave";
constexpr std::string_view kSayAlive = "alive";
constexpr std::string_view kSayLine = "said";
constexpr std::string_view kSayEnded = "ended";

std::optional<std::uint64_t> number(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  return fault == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

/// Up to the next blank, which is taken off `text` with it.
std::string_view word_of(std::string_view& text) {
  const std::size_t end = text.find(' ');
  const std::string_view word = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  return word;
}

/// Those of a text that has nothing else; none where it has.
std::vector<std::uint64_t> numbers(std::string_view text) {
  std::vector<std::uint64_t> values;
  while (!text.empty()) {
    const std::optional<std::uint64_t> value = number(word_of(text));
    if (!value) {
      return {};
    }
    values.push_back(*value);
  }
  return values;
}

std::string text_of(const WorkerNews& news) {
  return fmt::format("{} {} {}", news.worker, news.ended ? kSayEnded : kSayLine, news.text);
}

WorkerNews news_of(std::string_view text) {
  const std::optional<std::uint64_t> worker = number(word_of(text));
  const std::string_view kind = word_of(text);
  if (!worker || (kind != kSayLine && kind != kSayEnded)) {
    throw std::logic_error("a rank says what no rank says");
  }
  return {*worker, kind == kSayEnded, std::string(text)};
}

using Clock = std::chrono::steady_clock;

/// MPI does not tell that a rank is no more: each says so often that it is there.
constexpr Clock::duration kSaysSo = std::chrono::seconds(2);
/// A rank that says nothing for so long is no more.
constexpr Clock::duration kSilence = std::chrono::seconds(15);
/// Other ranks wait longer for rank 0: it may write to a disk that is slow.
constexpr Clock::duration kSilenceOfRank0 = std::chrono::minutes(2);

/// When other ranks have been heard, and this one has said that it is there.
class Silence {
 public:
  explicit Silence(int ranks) : heard_(static_cast<std::size_t>(ranks), Clock::now()) {}

  void hear(int rank) { heard_[static_cast<std::size_t>(rank)] = now_; }
  [[nodiscard]] bool is_too_long(int rank, Clock::duration longest) const {
    return now_ - heard_[static_cast<std::size_t>(rank)] > longest;
  }
  /// To be called in each turn of a loop, before what has come is heard. Whether to say now that this rank is there.
  bool turn() {
    const Clock::time_point now = Clock::now();
    if (now - now_ > kSaysSo) {
      // This process was stopped for a while, and perhaps the whole job with it.
      std::ranges::fill(heard_, now);
    }
    now_ = now;
    if (now - said_ < kSaysSo) {
      return false;
    }
    said_ = now;
    return true;
  }

 private:
  std::vector<Clock::time_point> heard_;
  Clock::time_point now_ = Clock::now();
  Clock::time_point said_ = now_;
};

/// Of rank 0 and of the others alike.
class RankedWorkers : public campaign::Workers {
 public:
  RankedWorkers(Job& job, const std::string& campaign_file, std::size_t jobs, std::string digest)
      : job_(job),
        transport_(job.transport()),
        digest_(std::move(digest)),
        own_(campaign_file, jobs),
        silence_(transport_.size()),
        is_lost_(static_cast<std::size_t>(transport_.size())) {
    send_to_all(kSayBegin);
  }

  void give(std::uint64_t worker, std::span<const std::uint64_t> runs) override {
    const auto [rank, number] = workers_.at(worker);
    if (rank == 0) {
      own_.give(number, runs);
    } else {
      transport_.send(rank, fmt::format("{} {}", number, fmt::join(runs, " ")));
    }
  }

  std::vector<campaign::WorkerEvent> wait() override {
    std::vector<campaign::WorkerEvent> events;
    while (events.empty()) {
      check_stop();
      for (const WorkerNews& news : own_.wait(kPatience)) {
        events.push_back(event_of(0, news));
      }
      if (silence_.turn()) {
        send_to_all(kSayAlive);
      }
      while (const std::optional<Message> message = transport_.receive()) {
        silence_.hear(message->from);
        // What a rank says that was given up comes too late: others have its runs.
        if (message->text != kSayAlive && !is_lost_[static_cast<std::size_t>(message->from)]) {
          events.push_back(event_of(message->from, news_of(message->text)));
        }
      }
      for (int rank = 1; rank < transport_.size(); ++rank) {
        if (silence_.is_too_long(rank, kSilence) && !is_lost_[static_cast<std::size_t>(rank)]) {
          lose(rank, events);
        }
      }
    }
    return events;
  }

 private:
  using Place = std::pair<int, std::uint64_t>;  ///< rank, and number of the process there

  void send_to_all(std::string_view text) {
    for (int rank = 1; rank < transport_.size(); ++rank) {
      if (!is_lost_[static_cast<std::size_t>(rank)]) {
        transport_.send(rank, text);
      }
    }
  }

  void lose(int rank, std::vector<campaign::WorkerEvent>& events) {
    is_lost_[static_cast<std::size_t>(rank)] = true;
    job_.lose_a_rank();
    say(fmt::format("trihedron: rank {} says nothing any more; others get its runs\n", rank));
    for (auto its = numbers_.lower_bound({rank, 0}); its != numbers_.end() && its->first.first == rank;) {
      events.push_back({its->second, campaign::WorkerEvent::Kind::kEnded, {}, "the end of its rank"});
      its = numbers_.erase(its);
    }
  }

  campaign::WorkerEvent event_of(int rank, const WorkerNews& news) {
    using Kind = campaign::WorkerEvent::Kind;
    const auto [its, is_new] = numbers_.try_emplace({rank, news.worker}, workers_.size());
    if (is_new) {
      workers_.emplace_back(rank, news.worker);
    }
    if (news.ended) {
      const std::uint64_t ended = its->second;
      numbers_.erase(its);
      return {ended, Kind::kEnded, {}, news.text};
    }
    if (is_new) {
      expect_same_campaign(rank, news.text);
      return {its->second, Kind::kReady, {}, {}};
    }
    std::optional<RunRecord> record = io::parse_record(news.text);
    if (!record) {
      throw std::logic_error(fmt::format("a worker of rank {} gives a record that is none", rank));
    }
    return {its->second, Kind::kPerformed, std::move(*record), {}};
  }

  void expect_same_campaign(int rank, const std::string& digest) const {
    if (digest != digest_) {
      throw std::runtime_error(
          fmt::format("rank {} reads another campaign than rank 0, or has another version of this program: give all "
                      "machines the same files",
                      rank));
    }
  }

  Job& job_;
  Transport& transport_;
  std::string digest_;
  WorkerProcesses own_;
  Silence silence_;
  std::vector<bool> is_lost_;  ///< by ranks
  std::map<Place, std::uint64_t> numbers_;
  std::vector<Place> workers_;
};

}  // namespace

void serve(const io::CampaignFile& file, const CampaignIdentity& identity, const campaign::SetupOf& setup_of) {
  const auto say_line = [](const std::string& line) {
    print_data(stdout, line + "\n");
    std::fflush(stdout);
    check_stop();  // nobody listens any more
  };
  say_line(io::digest_of(identity));
  for (std::string line; std::getline(std::cin, line);) {
    const std::vector<std::uint64_t> runs = numbers(line);
    if (runs.empty() || std::ranges::any_of(runs, [&](std::uint64_t run) { return run >= file.plan().runs; })) {
      throw io::UsageError(fmt::format("--serve: \"{}\" are no numbers of runs, 0 to {}", line, file.plan().runs - 1));
    }
    std::vector<RunRecord> records;
    ground::with_cores(1, [&] { records = campaign::perform_together(file.plan(), runs, setup_of); });
    for (const RunRecord& record : records) {
      say_line(io::format_record(record));
    }
  }
  check_stop();
}

void serve_rank(Job& job, const std::string& campaign_file, std::size_t jobs) {
  Transport& transport = job.transport();
  while (true) {
    check_stop();
    if (const std::optional<Message> message = transport.receive()) {
      if (message->text == kSayEnd) {
        job.end();
        return;
      }
      break;  // kSayBegin
    }
    std::this_thread::sleep_for(kPatience);
  }
  WorkerProcesses processes(campaign_file, jobs);
  Silence silence(1);
  while (!silence.is_too_long(0, kSilenceOfRank0)) {
    check_stop();
    for (const WorkerNews& news : processes.wait(kPatience)) {
      transport.send(0, text_of(news));
    }
    if (silence.turn()) {
      transport.send(0, kSayAlive);
    }
    while (const std::optional<Message> message = transport.receive()) {
      silence.hear(0);
      if (message->text == kSayEnd) {
        job.end();
        return;
      }
      if (message->text == kSayLeave) {
        return;
      }
      if (message->text != kSayAlive) {
        std::string_view text = message->text;
        const std::optional<std::uint64_t> worker = number(word_of(text));
        processes.give(worker.value(), numbers(text));
      }
    }
  }
  throw std::runtime_error("rank 0 says nothing any more; go on with --resume");
}

Job::Job() : transport_(transport_of_the_job()) {}

Job::~Job() {
  const StopRequest* const request = StopScope::current();
  const bool is_stopped = request != nullptr && request->made();
  if (transport_.rank() == 0 && !is_stopped) {
    end();
  }
  if (has_ended_ && !has_lost_a_rank_) {
    transport_.finish();
  }
}

void Job::end() {
  for (int rank = 1; rank < transport_.size() && transport_.rank() == 0 && !has_ended_; ++rank) {
    transport_.send(rank, has_lost_a_rank_ ? kSayLeave : kSayEnd);
  }
  has_ended_ = true;
}

std::unique_ptr<campaign::Workers> workers_of_all_ranks(Job& job, const std::string& campaign_file, std::size_t jobs,
                                                        std::string digest) {
  return std::make_unique<RankedWorkers>(job, campaign_file, jobs, std::move(digest));
}

}  // namespace trihedron::cli
