#pragma once
/// A campaign in the processes of a job: rank 0 has the journal and hands out the runs, each rank has processes that
/// perform them (docs/adr/0021-mpi.md).

#include <cstddef>
#include <memory>
#include <string>

#include "transport.hpp"
#include "trihedron/campaign/distribute.hpp"
#include "trihedron/io/campaign.hpp"

namespace trihedron::cli {

/// Performs the runs whose numbers come on standard input, those on a line together, and prints the digest of the
/// campaign and then the record of each as a line, up to the end of the input. Throws UsageError for what is no number
/// of a run.
void serve(const io::CampaignFile& file, const CampaignIdentity& identity, const campaign::SetupOf& setup_of);

/// The job that this process is a rank of. Its end waits for the other ranks, unless this process has been stopped, as
/// they are then, or is another than rank 0 and has failed: mpirun then ends the job. Nor where a rank is lost, for
/// which MPI may wait for ever.
class Job {
 public:
  /// Throws MachineFailed where what carries the messages is not there.
  Job();
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;
  ~Job();

  [[nodiscard]] Transport& transport() const { return transport_; }
  /// To be called when there is nothing more to do. Rank 0 tells it to the others, when it fails as well.
  void end();
  /// Of rank 0: another rank is no more.
  void lose_a_rank() { has_lost_a_rank_ = true; }

 private:
  Transport& transport_;
  bool has_lost_a_rank_ = false;
  bool has_ended_ = false;
};

/// What every rank but 0 does in place of the campaign: has runs performed by `jobs` processes, until rank 0 tells the
/// end. Throws MachineFailed, Stopped, and std::runtime_error where rank 0 is no more.
void serve_rank(Job& job, const std::string& campaign_file, std::size_t jobs);

/// Those of all ranks, `jobs` of each. For rank 0.
[[nodiscard]] std::unique_ptr<campaign::Workers> workers_of_all_ranks(Job& job, const std::string& campaign_file,
                                                                      std::size_t jobs, std::string digest);

}  // namespace trihedron::cli
