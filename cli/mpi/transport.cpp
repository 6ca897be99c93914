// Transport by MPI, in a library of its own: cli/src/transport.cpp loads it.

#define OMPI_SKIP_MPICXX 1
#include "transport.hpp"

#include <mpi.h>

#include <string>

namespace trihedron::cli {
namespace {

constexpr int kTag = 0;

class MpiTransport : public Transport {
 public:
  MpiTransport() {
    MPI_Init(nullptr, nullptr);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &size_);
    // A rank that is no more ends nobody else: campaign_workers.cpp notices that it says nothing.
    MPI_Comm_set_errhandler(MPI_COMM_WORLD, MPI_ERRORS_RETURN);
  }

  [[nodiscard]] int rank() const override { return rank_; }
  [[nodiscard]] int size() const override { return size_; }

  void send(int to, std::string_view text) override {
    MPI_Send(text.data(), static_cast<int>(text.size()), MPI_CHAR, to, kTag, MPI_COMM_WORLD);
  }

  std::optional<Message> receive() override {
    int has_come = 0;
    MPI_Status status;
    MPI_Iprobe(MPI_ANY_SOURCE, kTag, MPI_COMM_WORLD, &has_come, &status);
    if (has_come == 0) {
      return std::nullopt;
    }
    int size = 0;
    MPI_Get_count(&status, MPI_CHAR, &size);
    Message message{status.MPI_SOURCE, std::string(static_cast<std::size_t>(size), '\0')};
    MPI_Recv(message.text.data(), size, MPI_CHAR, message.from, kTag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    return message;
  }

  void finish() override { MPI_Finalize(); }

 private:
  int rank_ = 0;
  int size_ = 1;
};

}  // namespace
}  // namespace trihedron::cli

extern "C" __attribute__((visibility("default"))) trihedron::cli::Transport* trihedron_transport(const char* version) {
  if (std::string_view(version) != TRIHEDRON_VERSION) {
    return nullptr;
  }
  static trihedron::cli::MpiTransport transport;
  return &transport;
}
