#include "trihedron/io/campaign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "campaign_view.hpp"
#include "campaign_workers.hpp"
#include "commands.hpp"
#include "progress.hpp"
#include "standard_streams.hpp"
#include "steps.hpp"
#include "terminal.hpp"
#include "transport.hpp"
#include "trihedron/campaign/distribute.hpp"
#include "trihedron/campaign/perform.hpp"
#include "trihedron/campaign/sampling.hpp"
#include "trihedron/campaign/summary.hpp"
#include "trihedron/io/apart.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/records/stop.hpp"
#include "trihedron/records/text.hpp"
#include "trihedron/report/campaign.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kJournalFile = "runs.journal";
constexpr std::string_view kTableFile = "runs.nc";
constexpr std::string_view kTimesFile = "times.csv";
constexpr std::string_view kCampaignReport = "report.html";
// Of a run that is replayed.
constexpr std::string_view kScenarioFile = "scenario.toml";
constexpr std::string_view kRunFile = "run.json";
constexpr std::string_view kPassFile = "pass.nc";

struct CampaignArguments {
  std::string file;
  std::string out;
  bool resume = false;
  std::optional<std::int64_t> only;  ///< as given; a number below zero is refused with those of the runs
  bool serve = false;
  unsigned jobs = 0;  ///< 0: one per core, in a job of mpirun one per rank
};

/// A number that is kept as it is given: CLI11 takes one that is too large for the largest.
CLI::Validator run_number() {
  return {[](const std::string& text) {
            std::int64_t value = 0;
            const char* const end = text.data() + text.size();
            const auto [next, fault] = std::from_chars(text.data(), end, value);
            return fault == std::errc() && next == end ? std::string()
                                                       : fmt::format("{} is not the number of a run", text);
          },
          ""};
}

campaign::SetupOf setups_of(const io::CampaignFile& file) {
  return [&file](std::uint64_t seed, std::span<const double> draws) {
    try {
      return campaign::RunSetup{file.scenario(seed, draws), file.options(draws)};
    } catch (const io::InputRefused& refused) {
      throw std::invalid_argument(refused.reason());
    }
  };
}

/// Without --only and the number.
std::string command_of(const CampaignArguments& arguments) {
  return fmt::format("trihedron campaign {} -o {}", shell_word(arguments.file),
                     arguments.out.empty() ? "OUT" : shell_word(arguments.out));
}

bool is_there(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

/// The runs that OUT has of this campaign; nothing where there is no journal. Refuses that of another campaign.
std::optional<io::Journal> journal_in(const fs::path& out, const CampaignIdentity& identity) {
  const fs::path file = out / kJournalFile;
  if (!is_there(file) || io::is_barely_begun(file, identity)) {
    return std::nullopt;
  }
  io::Journal journal = io::read_journal(file);
  const std::string difference = io::difference_between(journal.identity, identity);
  if (!difference.empty()) {
    throw io::InputRefused(file, {}, fmt::format("belongs to another campaign: {}", difference),
                           "give another directory, or the campaign as it was");
  }
  return journal;
}

std::size_t jobs_of_a_rank(const CampaignArguments& arguments) { return std::max(arguments.jobs, 1U); }

/// Carries a campaign on to its end, whatever of it is there.
class Campaign {
 public:
  /// job: null for one that no mpirun has started.
  Campaign(const io::CampaignFile& file, const CampaignArguments& arguments, const Common& common, Job* job)
      : file_(file),
        arguments_(arguments),
        common_(common),
        job_(job),
        identity_(file.identity(TRIHEDRON_VERSION)),
        staged_(arguments.out) {
    staged_.expect_places(std::array<fs::path, 3>{kTableFile, kTimesFile, kCampaignReport});
    const fs::path journal_file = fs::path(arguments.out) / kJournalFile;
    if (std::optional<io::Journal> journal = journal_in(arguments.out, identity_)) {
      if (!arguments.resume) {
        throw io::InputRefused(
            journal_file, {}, fmt::format("holds {} of {} runs of this campaign", journal->records.size(), plan().runs),
            "add --resume to go on with it, or give another directory");
      }
      if (journal->damaged > 0 && journal->records.size() < plan().runs) {
        say(fmt::format("trihedron: {}: {} damaged, performed again\n", printable(journal_file.string()),
                        journal->damaged == 1 ? "1 run is" : fmt::format("{} runs are", journal->damaged)));
      }
      // Only where it cannot take the others with it.
      const std::size_t lost = job_ != nullptr ? std::erase_if(journal->records, campaign::was_lost) : 0;
      if (lost > 0) {
        say(fmt::format("trihedron: {}: {} with {} process, performed again\n", printable(journal_file.string()),
                        lost == 1 ? "1 run was lost" : fmt::format("{} runs were lost", lost),
                        lost == 1 ? "its" : "their"));
      }
      writer_.emplace(journal_file, *journal);
      records_ = std::move(journal->records);
    } else {
      writer_.emplace(journal_file, identity_);
    }
  }

  ExitStatus carry_out() {
    perform();
    const fs::path& path = staged_.path();
    io::write_run_table(path / kTableFile, plan(), io::digest_of(identity_), records_);
    io::write_run_times(path / kTimesFile, records_);
    const campaign::CampaignSummary summary = campaign::summarise(plan(), records_);
    const std::string command = command_of(arguments_);
    io::write_file(path / kCampaignReport, report::render_campaign({plan(), records_, summary, command}));
    staged_.commit();
    common_.log.say(fmt::format("written {}", arguments_.out));
    show(
        common_, [&] { return campaign_json(plan(), summary, command); },
        [&] {
          return campaign_text(plan(), summary, command) + fmt::format("Written     {}: {} {} {} {}\n",
                                                                       printable(arguments_.out), kTableFile,
                                                                       kCampaignReport, kTimesFile, kJournalFile);
        });
    return summary.trustworthy_campaign() ? kTrustworthy : kDoNotUse;
  }

 private:
  [[nodiscard]] const CampaignPlan& plan() const { return file_.plan(); }

  void perform() {
    std::vector<std::uint64_t> missing;
    auto there = records_.begin();
    for (std::uint64_t run = 0; run < plan().runs; ++run) {
      if (there != records_.end() && there->run == run) {
        ++there;
      } else {
        missing.push_back(run);
      }
    }
    common_.log.say(
        fmt::format("campaign {}: {} of {} runs are to be performed", plan().name, missing.size(), plan().runs));
    RunCounter counter("campaign", records_.size(), plan().runs, common_.quiet);
    const auto collect = [&](std::vector<RunRecord>&& records) {
      writer_->add(records);
      for (RunRecord& record : records) {
        common_.log.say(fmt::format("run {}: {}{}{}", record.run, name_of(record.outcome),
                                    record.reason.empty() ? "" : ": ", record.reason));
        records_.push_back(std::move(record));
        counter.add();
      }
    };
    try {
      if (job_ != nullptr) {
        const auto workers =
            workers_of_all_ranks(*job_, arguments_.file, jobs_of_a_rank(arguments_), io::digest_of(identity_));
        campaign::distribute(plan(), missing, *workers, collect);
        job_->end();
      } else {
        const unsigned jobs = arguments_.jobs > 0 ? arguments_.jobs : std::max(std::thread::hardware_concurrency(), 1U);
        campaign::perform_all(plan(), missing, setups_of(file_), jobs, collect);
      }
    } catch (const Stopped&) {
      say(fmt::format("{}trihedron: stopped; {} of {} runs are kept: go on with {} --resume\n",
                      is_screen(stderr) ? "\r\033[K" : "", records_.size(), plan().runs,
                      printable(command_of(arguments_))));
      throw;
    }
    std::ranges::sort(records_, {}, &RunRecord::run);
  }

  const io::CampaignFile& file_;
  const CampaignArguments& arguments_;
  const Common& common_;
  Job* job_;
  CampaignIdentity identity_;
  io::StagedDirectory staged_;
  std::optional<io::JournalWriter> writer_;
  std::vector<RunRecord> records_;
};

/// The times apart, which no two runs share.
bool is_same(RunRecord a, const RunRecord& b) {
  a.cpu_s = b.cpu_s;
  a.elapsed_s = b.elapsed_s;
  return io::format_record(a) == io::format_record(b);
}

void stage_flight(io::StagedDirectory& staged, const io::CampaignFile& file, const RunRecord& record,
                  campaign::Flight&& flight) {
  const Scenario scenario = file.scenario(record.seed, record.draws);
  io::write_pass(staged.path() / kPassFile, flight.simulated.pass, &flight.simulated.truth, io::format_for(scenario));
  io::NamedPass pass{staged.path() / kPassFile, fmt::format("run-{}", record.run), {}, {}};
  pass.loaded.pass = std::move(flight.simulated.pass);
  pass.truth = std::move(flight.simulated.truth);
  stage_calibration(staged, pass, flight.run, std::move(flight.evaluation), file.options(record.draws));
}

ExitStatus replay_run(const io::CampaignFile& file, const CampaignArguments& arguments, const Common& common) {
  const CampaignPlan& plan = file.plan();
  const std::int64_t asked = *arguments.only;
  if (asked < 0 || static_cast<std::uint64_t>(asked) >= plan.runs) {
    throw io::UsageError(fmt::format("--only {}: the campaign has runs 0 to {}", asked, plan.runs - 1));
  }
  const auto run = static_cast<std::uint64_t>(asked);
  std::optional<io::Journal> journal;
  std::optional<io::StagedDirectory> staged;
  const fs::path directory = fs::path(arguments.out) / fmt::format("run-{}", run);
  if (!arguments.out.empty()) {
    std::vector<fs::path> outputs = {directory / kScenarioFile, directory / kRunFile, directory / kPassFile};
    for (const std::string_view name : outcome_files()) {
      outputs.push_back(directory / name);
    }
    io::expect_apart(file.inputs(), outputs);
    journal = journal_in(arguments.out, file.identity(TRIHEDRON_VERSION));
    staged.emplace(directory);
  }
  std::optional<campaign::Flight> flight;
  const RunRecord record = campaign::perform(plan, run, setups_of(file),
                                             [&](campaign::Flight&& flown) { flight.emplace(std::move(flown)); });
  std::string comparison;
  if (journal) {
    const auto row = std::ranges::find(journal->records, run, &RunRecord::run);
    if (row != journal->records.end()) {
      if (row->outcome == RunOutcome::kFailed && record.outcome != RunOutcome::kFailed) {
        comparison = fmt::format("Campaign    failed there: {}\n", printable(row->reason));
      } else if (!is_same(record, *row)) {
        throw io::MachineFailed(fs::path(arguments.out) / kJournalFile,
                                fmt::format("run {} has another result there than now", run),
                                "compare program and machine with those of the campaign; memory may be faulty");
      } else {
        comparison = "Campaign    the same result, bit for bit\n";
      }
    }
  }
  if (staged) {
    io::write_file(staged->path() / kScenarioFile, file.scenario_text(record.seed, record.draws));
    io::write_file(staged->path() / kRunFile, json_text(run_json(plan, record)) + "\n");
    if (flight) {
      stage_flight(*staged, file, record, std::move(*flight));
    }
    staged->commit();
  }
  show(
      common, [&] { return run_json(plan, record); },
      [&] {
        return run_text(plan, record) + comparison +
               (staged ? fmt::format("Written     {}: scenario.toml run.json{}\n", printable(directory.string()),
                                     flight ? " pass.nc calibration.json attitude.csv residuals.nc report.html "
                                              "effective-config.toml"
                                            : "")
                       : "");
      });
  return record.outcome == RunOutcome::kTrustworthy ? kTrustworthy : kDoNotUse;
}

/// job: null for one that no mpirun has started.
ExitStatus carry_out(const CampaignArguments& arguments, const Common& common, Job* job) {
  const io::CampaignFile file(arguments.file, sim::expect_possible);
  const fs::path out = arguments.out;
  if (!out.empty()) {
    std::vector<fs::path> outputs = {out};
    for (const std::string_view name : {kJournalFile, kTableFile, kTimesFile, kCampaignReport}) {
      outputs.push_back(out / name);
    }
    io::expect_apart(file.inputs(), outputs);
  }
  if (arguments.only) {
    return replay_run(file, arguments, common);
  }
  return Campaign(file, arguments, common, job).carry_out();
}

ExitStatus run_campaign(const CampaignArguments& arguments, const Common& common) {
  if (arguments.serve) {
    const io::CampaignFile file(arguments.file, sim::expect_possible);
    serve(file, file.identity(TRIHEDRON_VERSION), setups_of(file));
    return kTrustworthy;
  }
  if (!is_in_a_job()) {
    return carry_out(arguments, common, nullptr);
  }
  if (arguments.only) {
    throw io::UsageError("--only performs one run: start it without mpirun");
  }
  Job job;
  if (job.transport().rank() > 0) {
    serve_rank(job, arguments.file, jobs_of_a_rank(arguments));
    return kTrustworthy;
  }
  return carry_out(arguments, common, &job);
}

}  // namespace

void add_campaign(CLI::App& program, const Common& common, int& exit_status) {
  auto arguments = std::make_shared<CampaignArguments>();
  CLI::App* command = program.add_subcommand(
      "campaign", "Simulate, calibrate and measure many flights with values drawn from distributions");
  command->add_option("CAMPAIGN.toml", arguments->file, "What varies, and how often; trihedron schema campaign")
      ->required();
  CLI::Option* out =
      command->add_option("-o,--output", arguments->out, "Directory to write into")->type_name("DIRECTORY");
  CLI::Option* resume =
      command->add_flag("--resume", arguments->resume, "Go on where the campaign in that directory ended")->needs(out);
  CLI::Option* only = command
                          ->add_option("--only", arguments->only,
                                       "Perform this run alone, from 0; with -o into a directory run-N there, with its "
                                       "scenario, pass, calibration and report")
                          ->check(run_number())
                          ->type_name("NUMBER")
                          ->excludes(resume);
  CLI::Option* jobs =
      command
          ->add_option("--jobs", arguments->jobs,
                       "Runs at the same time, under mpirun of each rank; without it one per core, under mpirun one")
          ->check(whole(trihedron::limits::kJobs))
          ->type_name("NUMBER");
  CLI::Option* serve =
      command
          ->add_flag("--serve", arguments->serve,
                     "Perform the runs whose numbers come on standard input, those on a line together, and print "
                     "the digest of the campaign and the record of each run, as the journal has it")
          ->excludes(out)
          ->excludes(resume)
          ->excludes(only)
          ->excludes(jobs);
  command->footer(
      "trihedron campaign examples/campaign.toml -o out\n"
      "# After a break, whatever it was\n"
      "trihedron campaign examples/campaign.toml -o out --resume\n"
      "# On several machines\n"
      "mpirun -n 64 trihedron campaign examples/campaign.toml -o out\n"
      "# A run to be looked at\n"
      "trihedron campaign examples/campaign.toml -o out --only 17\n"
      "python3 -c 'import xarray; print(xarray.open_dataset(\"out/runs.nc\"))'");
  command->callback([&common, &exit_status, arguments, out, only, serve] {
    if (out->count() == 0 && only->count() == 0 && serve->count() == 0) {
      throw io::UsageError("-o is required: a campaign writes its runs into a directory; --only N can do without");
    }
    exit_status = run_campaign(*arguments, common);
  });
}

}  // namespace trihedron::cli
