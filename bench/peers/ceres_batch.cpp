// The batch with Ceres: ceres_batch PASS. Without process noise one arc of all the pass and 24 unknowns; with a random
// walk of the momenta an arc a minute, the momenta at the begin of each, and the walk between them. Each with
// derivatives by hand and with Ceres' own.

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>

#include <array>
#include <chrono>
#include <limits>
#include <string>

#include "batch_model.hpp"

namespace {

using namespace peers;

/// An arc, and the 1-sigma of the walk from its end to the next; the last has none.
struct ArcOfPass {
  const Course* course;
  const Arc* arc;
  double walk_rad;

  [[nodiscard]] bool has_next() const { return walk_rad > 0; }
  [[nodiscard]] int residuals() const { return 4 * arc->fixes + (has_next() ? 4 : 0); }
};

/// Parameter blocks of an arc: both momenta at its begin, coefficients and alignment of each gyro, and where it has a
/// next one, the momenta at the begin of that.
constexpr int kMomentum[] = {0, 1};
constexpr int kDrift[] = {2, 4};
constexpr int kAlignment[] = {3, 5};
constexpr int kNext[] = {6, 7};
constexpr std::array<int, 8> kSizes{3, 3, 7, 3, 7, 3, 3, 3};

template <class T>
Estimates<T> estimates_of(const T* const* parameters) {
  Estimates<T> now;
  for (int k = 0; k < 2; ++k) {
    now.h_in[k] = Eigen::Map<const Vec3<T>>(parameters[kMomentum[k]]);
    now.kappa[k] = Eigen::Map<const Eigen::Matrix<T, 7, 1>>(parameters[kDrift[k]]);
    now.C_c_b[k] = rotation(parameters[kAlignment[k]]);
  }
  return now;
}

/// Carries the momenta to the end of the arc; calls at_fix(node, whitening) and after(step, what it turned).
template <class T, class AtFix, class After>
void go_along(const ArcOfPass& its, Estimates<T>& now, const AtFix& at_fix, const After& after) {
  const auto compare = [&](const Node& node) {
    if (node.fix != nullptr) {
      at_fix(node, whitening(node, now));
    }
  };
  for (std::size_t i = its.arc->begin; i < its.arc->end; ++i) {
    compare(its.course->nodes[i]);
    const Step& step = its.course->steps[i];
    after(step, carry(step, now));
  }
  if (!its.has_next()) {
    compare(its.course->nodes[its.arc->end]);
  }
}

/// The residuals of an arc. `next`: both momenta, where it has a next one.
template <class T>
void residuals_of(const ArcOfPass& its, const T* const* parameters, const T* const* next, T* residuals) {
  Estimates<T> now = estimates_of(parameters);
  const auto compare = [&](const Node& node, const Whitening& white) {
    Eigen::Map<Eigen::Matrix<T, 4, 1>> four(residuals);
    four = white.rows * misfit(node, now);
    residuals += 4;
  };
  go_along(its, now, compare, [](const Step&, const Turned<T>&) {});
  for (int k = 0; k < 2 && its.has_next(); ++k) {
    const Vec3<T> h_next = Eigen::Map<const Vec3<T>>(next[k]);
    const Eigen::Matrix<double, 2, 3> rows = across(values_of(h_next)) / its.walk_rad;
    Eigen::Map<Eigen::Matrix<T, 2, 1>> two(residuals + 2 * k);
    two = rows * h_next.cross(now.h_in[k]);
  }
}

struct ArcByJets {
  ArcOfPass its;

  template <class T>
  bool operator()(const T* h1, const T* h2, const T* kappa1, const T* alignment1, const T* kappa2, const T* alignment2,
                  const T* next1, const T* next2, T* residuals) const {
    const T* const parameters[] = {h1, h2, kappa1, alignment1, kappa2, alignment2};
    const T* const next[] = {next1, next2};
    residuals_of(its, parameters, next, residuals);
    return true;
  }
  template <class T>
  bool operator()(const T* h1, const T* h2, const T* kappa1, const T* alignment1, const T* kappa2, const T* alignment2,
                  T* residuals) const {
    const T* const parameters[] = {h1, h2, kappa1, alignment1, kappa2, alignment2};
    residuals_of<T>(its, parameters, nullptr, residuals);
    return true;
  }
};

ceres::CostFunction* arc_by_jets(const ArcOfPass& its) {
  auto* residuals = new ArcByJets{its};
  if (its.has_next()) {
    return new ceres::AutoDiffCostFunction<ArcByJets, ceres::DYNAMIC, 3, 3, 7, 3, 7, 3, 3, 3>(residuals,
                                                                                              its.residuals());
  }
  return new ceres::AutoDiffCostFunction<ArcByJets, ceres::DYNAMIC, 3, 3, 7, 3, 7, 3>(residuals, its.residuals());
}

/// How the small rotation of each momentum depends on the momentum at the begin, the coefficients and the alignment is
/// carried along with it. The attitude that turns the drift into `in` counts as known.
class ArcByHand : public ceres::CostFunction {
 public:
  explicit ArcByHand(const ArcOfPass& its) : its_(its) {
    set_num_residuals(its.residuals());
    mutable_parameter_block_sizes()->assign(kSizes.begin(), kSizes.begin() + (its.has_next() ? 8 : 6));
  }

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    if (jacobians == nullptr) {
      residuals_of(its_, parameters, parameters + kNext[0], residuals);
      return true;
    }
    for (std::size_t block = 0; block < parameter_block_sizes().size(); ++block) {
      if (jacobians[block] != nullptr) {
        std::fill_n(jacobians[block], num_residuals() * kSizes[block], 0.0);
      }
    }
    Estimates<double> now = estimates_of(parameters);
    By by[2];
    Matrix3d by_alignment[2];  // rotation in c by the rotation vector
    for (int k = 0; k < 2; ++k) {
      by[k] << cross(now.h_in[k]), Eigen::Matrix<double, 3, 10>::Zero();
      by_alignment[k] = left_jacobian(Eigen::Map<const Vector3d>(parameters[kAlignment[k]]));
    }
    int row = 0;
    const auto put = [&](int k, const auto& rows) {
      put_block(jacobians, kMomentum[k], row, rows.template leftCols<3>());
      put_block(jacobians, kDrift[k], row, rows.template middleCols<7>(3));
      put_block(jacobians, kAlignment[k], row, rows.template rightCols<3>() * by_alignment[k]);
    };
    const auto compare = [&](const Node& node, const Whitening& white) {
      Eigen::Map<Eigen::Vector4d>(residuals + row) = white.rows * misfit(node, now);
      for (int k = 0; k < 2; ++k) {
        By apart = by[k];
        apart.rightCols<3>() -= white.C_in_c;
        put(k, Eigen::Matrix<double, 4, 13>(-white.rows.middleCols<3>(3L * k) * apart));
      }
      row += 4;
    };
    const auto carry_along = [&](const Step& step, const Turned<double>& turned) {
      for (int k = 0; k < 2; ++k) {
        By apart = by[k];
        apart.rightCols<3>() -= turned.C_in_c;
        by[k] += cross(turned.by_rad[k]).lazyProduct(apart);
        by[k].middleCols<7>(3) += (turned.C_in_c * now.C_c_b[k]).lazyProduct(step.dt_basis_b[k]);
      }
    };
    go_along(its_, now, compare, carry_along);
    for (int k = 0; k < 2 && its_.has_next(); ++k, row += 2) {
      const Vector3d next = Eigen::Map<const Vector3d>(parameters[kNext[k]]);
      const Eigen::Matrix<double, 2, 3> rows = across(next) / its_.walk_rad;
      Eigen::Map<Eigen::Vector2d>(residuals + row) = rows * next.cross(now.h_in[k]);
      put(k, Eigen::Matrix<double, 2, 13>(rows * by[k]));
      put_block(jacobians, kNext[k], row, Eigen::Matrix<double, 2, 3>(-rows * cross(next)));
    }
    return true;
  }

 private:
  using By = Eigen::Matrix<double, 3, 13>;
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  template <class Rows>
  void put_block(double** jacobians, int block, int row, const Rows& rows) const {
    if (jacobians[block] != nullptr) {
      const int columns = kSizes[static_cast<std::size_t>(block)];
      Eigen::Map<RowMajor>(jacobians[block], num_residuals(), columns).middleRows(row, rows.rows()) = rows;
    }
  }

  ArcOfPass its_;
};

class Batch {
 public:
  /// Begins with the means of the prior, zero, and with the momenta that the first fix of each arc shows.
  Batch(const Course& course, double walk_rad_sqrt_s, bool by_hand) : momenta_(course.arcs.size()) {
    for (int k = 0; k < 2; ++k) {
      add_prior(kappa_[k], kCoefficient_rad_s);
      add_prior(alignment_[k], kAlignment_rad);
    }
    for (std::size_t i = 0; i < momenta_.size(); ++i) {
      const Arc& arc = course.arcs[i];
      const Node& first = course.nodes[arc.begin];
      const double duration_s = course.nodes[arc.end].t_s - first.t_s;
      const bool last = i + 1 == momenta_.size();
      const ArcOfPass its{&course, &arc, last ? 0 : walk_rad_sqrt_s * std::sqrt(duration_s)};
      std::vector<double*> blocks{momenta_[i][0].data(), momenta_[i][1].data(), kappa_[0].data(),
                                  alignment_[0].data(),  kappa_[1].data(),      alignment_[1].data()};
      if (its.has_next()) {
        blocks.insert(blocks.end(), {momenta_[i + 1][0].data(), momenta_[i + 1][1].data()});
      }
      problem_.AddResidualBlock(by_hand ? new ArcByHand(its) : arc_by_jets(its), nullptr, blocks);
      for (int k = 0; k < 2; ++k) {
        momenta_[i][k] = first.fix->q_in_c * first.h_b[k];
        problem_.SetManifold(momenta_[i][k].data(), new ceres::SphereManifold<3>());
      }
    }
  }

  /// Gauss–Newton, as long as it goes downhill: with Ceres' own first radius it takes up to five times as many steps.
  void solve(int threads) {
    ceres::Solver::Options options;
    options.linear_solver_type = momenta_.size() > 1 ? ceres::SPARSE_NORMAL_CHOLESKY : ceres::DENSE_NORMAL_CHOLESKY;
    options.initial_trust_region_radius = options.max_trust_region_radius;
    options.num_threads = threads;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    if (summary.termination_type != ceres::CONVERGENCE) {
      std::fprintf(stderr, "ceres_batch: %s\n", summary.message.c_str());
      std::exit(1);
    }
  }

  /// Of coefficients and alignments, gyro by gyro.
  std::vector<double> sigmas(int threads) {
    std::vector<const double*> blocks;
    for (int k = 0; k < 2; ++k) {
      blocks.insert(blocks.end(), {kappa_[k].data(), alignment_[k].data()});
    }
    ceres::Covariance::Options options;
    options.num_threads = threads;
    ceres::Covariance covariance(options);
    Eigen::Matrix<double, 20, 20, Eigen::RowMajor> P;
    if (!covariance.Compute(blocks, &problem_) || !covariance.GetCovarianceMatrix(blocks, P.data())) {
      std::fputs("ceres_batch: no covariance\n", stderr);
      std::exit(1);
    }
    std::vector<double> sigmas;
    for (int k = 0; k < 2; ++k) {
      // Of rotations in c, as the others, not of the rotation vector.
      const Matrix3d J = left_jacobian(alignment_[k]);
      const Matrix3d rotation = J * P.block<3, 3>(10 * k + 7, 10 * k + 7) * J.transpose();
      for (int i = 0; i < 10; ++i) {
        sigmas.push_back(std::sqrt(i < 7 ? P(10 * k + i, 10 * k + i) : rotation(i - 7, i - 7)));
      }
    }
    return sigmas;
  }

  [[nodiscard]] std::vector<double> parameters() const {
    std::vector<double> values;
    for (int k = 0; k < 2; ++k) {
      values.insert(values.end(), kappa_[k].begin(), kappa_[k].end());
      values.insert(values.end(), alignment_[k].begin(), alignment_[k].end());
    }
    return values;
  }

 private:
  template <class Block>
  void add_prior(Block& block, double sigma) {
    block.setZero();
    const Eigen::MatrixXd root = Eigen::MatrixXd::Identity(block.size(), block.size()) / sigma;
    problem_.AddResidualBlock(new ceres::NormalPrior(root, Eigen::VectorXd::Zero(block.size())), nullptr, block.data());
  }

  std::vector<std::array<Vector3d, 2>> momenta_;  ///< at the begin of each arc
  Eigen::Matrix<double, 7, 1> kappa_[2];
  Vector3d alignment_[2];
  ceres::Problem problem_;
};

double elapsed_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string list_of(const std::vector<double>& values) {
  std::string list;
  for (const double value : values) {
    char text[32];
    std::snprintf(text, sizeof text, "%s%.17g", list.empty() ? "" : ", ", value);
    list += text;
  }
  return list;
}

/// The best of three.
void measure_and_print(const Pass& pass, double walk_rad_sqrt_s, bool by_hand, int threads) {
  const double arc_s = walk_rad_sqrt_s > 0 ? 60 : std::numeric_limits<double>::max();
  double best_s = std::numeric_limits<double>::max();
  double best_elapsed_s = best_s;
  double best_sigmas_s = best_s;
  std::string found;
  for (int i = 0; i < 3; ++i) {
    const double begin_elapsed_s = elapsed_s();
    const double begin_s = processor_s();
    const Course course = course_of(pass, arc_s);
    Batch batch(course, walk_rad_sqrt_s, by_hand);
    batch.solve(threads);
    const double solved_s = processor_s();
    best_s = std::min(best_s, solved_s - begin_s);
    best_elapsed_s = std::min(best_elapsed_s, elapsed_s() - begin_elapsed_s);
    const std::vector<double> sigmas = batch.sigmas(threads);
    best_sigmas_s = std::min(best_sigmas_s, processor_s() - solved_s);
    found = "\"parameters\": [" + list_of(batch.parameters()) + "], \"sigmas\": [" + list_of(sigmas) + "]";
  }
  std::printf(
      "{\"peer\": \"Ceres, derivatives %s%s\", \"walk_rad_sqrt_s\": %g, \"seconds\": %.6f, \"elapsed_seconds\": %.6f, "
      "\"sigmas_seconds\": %.6f, %s}\n",
      by_hand ? "by hand" : "by Jets", threads > 1 ? ", two threads" : "", walk_rad_sqrt_s, best_s, best_elapsed_s,
      best_sigmas_s, found.c_str());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: ceres_batch PASS\n", stderr);
    return 2;
  }
  const Pass pass = read_pass(argv[1]);
  for (const bool by_hand : {true, false}) {
    measure_and_print(pass, 0, by_hand, 1);
    measure_and_print(pass, 3e-9, by_hand, 1);
    measure_and_print(pass, 3e-9, by_hand, 2);
  }
}
