// The paper's filter with a full covariance in Eigen, propagated at each gyro sample: dense PASS.

#include "paper_model.hpp"

namespace {

class Dense {
 public:
  void start(const peers::Square& P) { P_ = P; }
  void predict(const peers::Square& F) {
    const peers::Square FP = F * P_;
    P_.noalias() = FP * F.transpose();
  }
  peers::State update(const peers::Innovation& y, const peers::Observation& H, const peers::Noise& R) {
    const Eigen::Matrix<double, peers::kStates, peers::kMeasured> PHt = P_ * H.transpose();
    const Eigen::LLT<peers::Noise> S(peers::Noise(H * PHt + R));
    const Eigen::Matrix<double, peers::kStates, peers::kMeasured> K = S.solve(PHt.transpose()).transpose();
    P_.noalias() -= K * PHt.transpose();
    P_ = (0.5 * (P_ + P_.transpose())).eval();
    return K * y;
  }
  const peers::Square& covariance() const { return P_; }

 private:
  peers::Square P_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: dense PASS\n", stderr);
    return 2;
  }
  peers::measure_and_print<Dense>("dense covariance in Eigen", peers::read_pass(argv[1]), 3);
}
