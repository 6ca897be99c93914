#include "batch/drift_field.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "batch/information_smoother.hpp"
#include "linear/gram.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"
#include "trihedron/records/drift_models.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Prior of the spectrum: ln of the root mean square of a group is normal. What is expected falls from degree to
/// degree, from some thousandths of eq. (1) to what no pass can show; of symmetric members, as the three pairs of
/// electrodes make them, e times as much is expected. Of all gyros together it is uncertain by a factor of e², gyros
/// among each other by a factor of e, degrees of one gyro by e² of which neighbours have most in common, symmetric
/// members and others by e in the same way, W and D of one degree by half a logarithm. A rotor that has much of one
/// degree is likely to have some of the next, and near a great circle W and D of a degree look alike; but of low
/// degrees, which act much as eq. (1) does, a pass without slews shows little, and that it shows nothing of high ones
/// says little of them. Symmetric members look more like eq. (1) than others, so that a pass shows less of them than of
/// these: they may be there alone, and where the others are, they are as well. A rotor may also have a single member
/// that is larger than the others of its group: each is uncertain by e^0.8 beside the level of its group.
constexpr double kRmsOfDegree1_rad_s = 5e-9;
constexpr double kFallPerDegree = 0.7;
constexpr double kLeastRms_rad_s = 1e-10;
constexpr double kLogOfSymmetric = 1;
constexpr double kSigmaOfAll = 2;
constexpr double kSigmaOfGyro = 1;
constexpr double kSigmaOfDegree = 2;
constexpr double kDegreesAlike = 3;
constexpr double kSigmaOfSymmetry = 1;
constexpr double kSigmaOfGroup = 0.5;
constexpr double kSigmaOfMember = 0.8;
/// Larger than all of eq. (1): a rotor that drifts so is not one that it describes.
constexpr double kMostRms_rad_s = 1e-5;

VectorXd prior_mean(const std::vector<FieldMembers::Group>& groups) {
  VectorXd mean(static_cast<Index>(groups.size()));
  std::ranges::transform(groups, mean.begin(), [](const FieldMembers::Group& group) {
    return std::log(std::max(kRmsOfDegree1_rad_s * std::exp(-kFallPerDegree * (group.degree - 1)), kLeastRms_rad_s)) +
           (group.symmetric ? kLogOfSymmetric : 0);
  });
  return mean;
}

MatrixXd prior_information(const std::vector<FieldMembers::Group>& groups) {
  const auto size = static_cast<Index>(groups.size());
  MatrixXd covariance = MatrixXd::Constant(size, size, kSigmaOfAll * kSigmaOfAll);
  for (Index i = 0; i < size; ++i) {
    for (Index j = 0; j < size; ++j) {
      const FieldMembers::Group& a = groups[static_cast<std::size_t>(i)];
      const FieldMembers::Group& b = groups[static_cast<std::size_t>(j)];
      if (a.gyro == b.gyro) {
        const double alike = std::exp(-std::abs(a.degree - b.degree) / kDegreesAlike);
        covariance(i, j) += kSigmaOfGyro * kSigmaOfGyro + kSigmaOfDegree * kSigmaOfDegree * alike;
        covariance(i, j) += a.symmetric == b.symmetric ? kSigmaOfSymmetry * kSigmaOfSymmetry * alike : 0;
      }
    }
    covariance(i, i) += kSigmaOfGroup * kSigmaOfGroup;
  }
  return covariance.llt().solve(MatrixXd::Identity(size, size));
}

/// W(2, 0), W(2, 2) and so on, even in each component of h, and those that are h1 h2 h3 times such.
bool is_symmetric(const DriftCoefficient& member) {
  const bool even_degree = member.degree % 2 == 0;
  return member.order % 2 == 0 && (even_degree ? member.order >= 0 : member.order < 0);
}

/// The pass by one spectrum.
struct FieldLikelihood {
  VectorXd sigma;  ///< of the members, rad/s
  MatrixXd L;      ///< root of the covariance of y
  VectorXd y;      ///< white
  double log_likelihood = 0;
};

/// The posterior of the amplitudes by one spectrum.
struct Posterior {
  VectorXd sigma;  ///< before, rad/s
  MatrixXd white;  ///< their covariance before, which is 1 in these, less that after is whiteᵀ white
  VectorXd mean;   ///< in these

  [[nodiscard]] VectorXd amplitudes() const { return sigma.cwiseProduct(mean); }
  /// The lower triangle of the covariance after is added to that of `sum`.
  void add_covariance(double weight, MatrixXd& sum) const {
    sum.diagonal() += weight * sigma.cwiseAbs2();
    add_gram(sigma.asDiagonal() * white.transpose(), -weight, sum);
  }
};

/// Posteriors by different spectra of one pass.
class Posteriors {
 public:
  Posteriors(const FieldMembers& members, const FieldInformation& information)
      : members_(members),
        information_(information),
        prior_mean_(prior_mean(members.groups())),
        prior_(prior_information(members.groups())) {}

  [[nodiscard]] FieldLikelihood at(const VectorXd& log_rms) const {
    FieldLikelihood found = with(members_.sigma(log_rms));
    const VectorXd apart_from_prior = log_rms - prior_mean_;
    found.log_likelihood -= apart_from_prior.dot(prior_ * apart_from_prior) / 2;
    return found;
  }

  /// With these sigmas of the members; the likelihood is that of the pass alone.
  [[nodiscard]] FieldLikelihood with(const VectorXd& sigma) const {
    check_stop();
    FieldLikelihood found;
    found.sigma = sigma;
    // y by its own covariance: there are fewer of it than of the members.
    MatrixXd covariance = MatrixXd::Identity(information_.R.rows(), information_.R.rows());
    add_gram(information_.R * found.sigma.asDiagonal(), 1, covariance);
    if (!to_root(covariance)) {  // of numbers that are none
      covariance.setConstant(std::nan(""));
    }
    found.L = std::move(covariance);
    found.y = found.L.triangularView<Eigen::Lower>().solve(information_.y);
    found.log_likelihood =
        information_.log_likelihood - found.L.diagonal().array().log().sum() - found.y.squaredNorm() / 2;
    return found;
  }

  [[nodiscard]] Posterior posterior(const FieldLikelihood& by) const {
    Posterior found;
    found.sigma = by.sigma;
    found.white = information_.R * by.sigma.asDiagonal();
    solve_lower(by.L, found.white);
    found.mean = found.white.transpose() * by.y;
    return found;
  }

  /// Derivatives of the log likelihood by ln of the root mean squares.
  struct Slope {
    VectorXd first;
    MatrixXd expected;  ///< information on them: of the negative second derivative what is expected,
    MatrixXd observed;  ///< what it is,
    MatrixXd mean;      ///< and a mean of both that is always positive definite
  };
  [[nodiscard]] Slope slope(const VectorXd& log_rms, const FieldLikelihood& by) const {
    const Posterior at = posterior(by);
    MatrixXd learnt = MatrixXd::Zero(members_.size(), members_.size());
    add_gram(at.white.transpose(), 1, learnt);
    const std::vector<Index>& group = members_.group_of();
    VectorXd first = VectorXd::Zero(prior_.rows());
    MatrixXd squares = MatrixXd::Zero(prior_.rows(), prior_.cols());
    MatrixXd products = squares;
    for (Index j = 0; j < members_.size(); ++j) {
      const Index g = group[static_cast<std::size_t>(j)];
      first(g) += at.mean(j) * at.mean(j) - learnt(j, j);
      for (Index i = j; i < members_.size(); ++i) {
        const Index h = group[static_cast<std::size_t>(i)];
        const double both = i == j ? 1 : 2;
        squares(h, g) += both * learnt(i, j) * learnt(i, j);
        products(h, g) += both * at.mean(i) * learnt(i, j) * at.mean(j);
      }
    }
    squares = MatrixXd(squares + squares.transpose());
    products = MatrixXd(products + products.transpose());
    Slope slope{first - prior_ * (log_rms - prior_mean_), squares + prior_, 2 * products - squares + prior_,
                products + prior_};
    slope.observed.diagonal() -= 2 * first;
    return slope;
  }

 private:
  const FieldMembers& members_;
  const FieldInformation& information_;
  VectorXd prior_mean_;
  MatrixXd prior_;
};

}  // namespace

FieldMembers::FieldMembers(const Layout& layout) {
  const std::vector<DriftCoefficient> coefficients = coefficients_of(layout.drift_model);
  VectorXd sizes;  // of the groups
  for (int k = 0; k < layout.gyros; ++k) {
    for (std::size_t i = 0; i < coefficients.size(); ++i) {
      const DriftCoefficient& its = coefficients[i];
      if (its.is_in_eq1()) {
        continue;
      }
      const Group group{k, its.member, its.degree, is_symmetric(its)};
      const auto found = std::ranges::find(groups_, group) - groups_.begin();
      if (found == std::ssize(groups_)) {
        groups_.push_back(group);
        sizes.conservativeResizeLike(VectorXd::Zero(found + 1));
      }
      sizes(found) += 1;
      group_of_.push_back(found);
      states_.push_back(layout.drift(k) + static_cast<Index>(i));
    }
  }
  of_rms_.resize(size());
  for (Index i = 0; i < size(); ++i) {
    const Index g = group_of_[static_cast<std::size_t>(i)];
    // The mean square of |∇Y| over the sphere is l (l + 1)/4π.
    const double l = groups_[static_cast<std::size_t>(g)].degree;
    of_rms_(i) = std::sqrt(4 * std::numbers::pi / (sizes(g) * l * (l + 1)));
  }
}

VectorXd FieldMembers::expected() const { return prior_mean(groups_); }

VectorXd FieldMembers::sigma(const VectorXd& log_rms) const {
  return of_rms_.cwiseProduct(VectorXd(log_rms.array().exp())(group_of_));
}

namespace {

/// `units`: a lower triangle for each gyro, by which its members are made of ones that are independent and of size 1.
DriftModes modes_of(const PassProblem& problem, const MovedByModes& by_coefficients, const PerGyro<MatrixXd>& units) {
  // What moves all fixes together by less than this part of their noise cannot be seen and does not matter.
  constexpr double kLeastEffect = 0.3;
  const PassSetup& setup = problem.setup();
  const Index size = units[0].rows();
  const auto arcs = static_cast<Index>(problem.arcs());
  const double noise_rad = setup.on_board.star_trackers[0].noise_rad.minCoeff() /
                           std::sqrt(static_cast<double>(problem.fixes()) / static_cast<double>(arcs));
  // How far each member has turned the momenta until the end of each arc, in units of the noise of the fixes of one.
  PerGyro<MatrixXd> turned;
  for (int k = 0; k < setup.on_board.layout.gyros; ++k) {
    turned[k].setZero(3 * arcs, size);
    for (Index arc = 0; arc + 1 < arcs; ++arc) {
      const auto of_arc = static_cast<std::size_t>(arc);
      turned[k].middleRows<3>(3 * arc + 3) =
          turned[k].middleRows<3>(3 * arc) +
          by_coefficients.added(of_arc, by_coefficients.size(of_arc) - 1, k).cast<double>() / noise_rad;
    }
  }
  // The squares of the singular values span ten powers of ten at most, so that those that count are exact enough.
  struct Axes {
    VectorXd squares;
    MatrixXd directions;
  };
  const std::vector<Axes> found =
      on_all_cores(static_cast<std::size_t>(setup.on_board.layout.gyros), [&](std::size_t k) {
        const auto gyro = static_cast<int>(k);
        const MatrixXd effects = square(turned[gyro].transpose());
        Axes axes{{}, multiply(multiply(units[gyro].transpose(), effects), units[gyro])};
        axes.squares = to_axes(axes.directions);
        return axes;
      });
  Index count = 1;
  for (const Axes& its : found) {
    count = std::max<Index>(count, (its.squares.array() > kLeastEffect * kLeastEffect).count());
  }
  DriftModes modes;
  for (int k = 0; k < setup.on_board.layout.gyros; ++k) {
    const MatrixXd directions = found[static_cast<std::size_t>(k)].directions.rightCols(count);
    const auto unit = units[k].triangularView<Eigen::Lower>();
    modes.gyros[k].coefficients = unit * directions;
    modes.gyros[k].amplitudes = unit.transpose().solve(directions).transpose();
  }
  return modes;
}

}  // namespace

DriftModes modes_of(const PassProblem& problem, const MovedByModes& by_coefficients, const FieldMembers& members,
                    const VectorXd& log_rms) {
  PerGyro<MatrixXd> units;
  const Index size = members.of_one_gyro();
  for (int k = 0; k < problem.setup().on_board.layout.gyros; ++k) {
    units[k] = members.sigma(log_rms).segment(k * size, size).asDiagonal();
  }
  return modes_of(problem, by_coefficients, units);
}

DriftModes modes_of(const PassProblem& problem, const MovedByModes& by_coefficients) {
  constexpr double kSigmas = 3;
  const Layout layout = problem.setup().layout();
  const Index size = layout.drift_size() - Layout::kEq1;
  PerGyro<MatrixXd> units;
  for (int k = 0; k < layout.gyros; ++k) {
    const int row = layout.drift(k) - layout.drift(0) + Layout::kEq1;
    const MatrixXd covariance = problem.setup().prior.covariance.block(row, row, size, size);
    units[k] = kSigmas * MatrixXd(covariance.llt().matrixL());
  }
  return modes_of(problem, by_coefficients, units);
}

FieldInformation information_on_field(const PassProblem& problem, const PassSolution& solution,
                                      const PassProblem::Linear& linear, const ProcessNoise& noise,
                                      const FieldMembers& members) {
  const Layout& layout = problem.layout();
  MatrixXd prior = linear.prior;
  VectorXd prior_y = linear.prior_y;
  const DriftModes& modes = *problem.modes();
  problem.put_noise(solution, noise, prior, prior_y);
  std::vector<bool> is_mode(static_cast<std::size_t>(layout.size()), false);
  for (int k = 0; k < layout.gyros; ++k) {
    for (Index state = layout.drift(k) + Layout::kEq1; state < layout.alignment(k); ++state) {
      prior.row(state).setZero();
      prior_y(state) = 0;
      is_mode[static_cast<std::size_t>(state)] = true;
    }
  }
  const ConstantsInformation found = eliminate_moving(prior, prior_y, linear.stages.size(), [&](std::size_t arc) {
    return problem.stage(solution, linear, arc, noise);
  });

  // The modes after all others, then the right side, with the error of the solution made the amplitude itself.
  const Index size = Index{layout.gyros} * layout.drift_modes;
  const Index others = layout.constants() - size;
  const Index last = others + size;
  std::vector<Index> order;
  for (const bool modes_now : {false, true}) {
    for (Index state = layout.dynamic(); state < layout.size(); ++state) {
      if (is_mode[static_cast<std::size_t>(state)] == modes_now) {
        order.push_back(state - layout.dynamic());
      }
    }
  }
  order.push_back(layout.constants());
  VectorXd amplitudes = VectorXd::Zero(size);
  for (int k = 0; k < layout.gyros; ++k) {
    const MatrixXd& its = modes.gyros[k].amplitudes;
    amplitudes.segment(Index{k} * layout.drift_modes, layout.drift_modes) =
        its * solution.gyros[k].drift_rad_s.segment(Layout::kEq1, its.cols());
  }
  MatrixXd squares = MatrixXd(found.squares.selfadjointView<Eigen::Lower>())(order, order);
  squares.col(last) += squares.middleCols(others, size) * amplitudes;
  squares.row(last) += amplitudes.transpose() * squares.middleRows(others, size);
  const MatrixXd triangle = lower_root(squares).transpose();
  const auto by_members = [&](const MatrixXd& by_modes) {
    MatrixXd by(by_modes.rows(), members.size());
    for (int k = 0; k < layout.gyros; ++k) {
      const MatrixXd& its = modes.gyros[k].amplitudes;
      by.middleCols(Index{k} * its.cols(), its.cols()) =
          multiply(by_modes.middleCols(Index{k} * layout.drift_modes, layout.drift_modes), its);
    }
    return by;
  };
  FieldInformation information;
  information.R = by_members(triangle.block(others, others, size, size));
  information.y = triangle.block(others, last, size, 1);
  const auto own = triangle.topLeftCorner(others, others);
  information.others_by_members = by_members(
      MatrixXd(-own.triangularView<Eigen::Upper>().solve(MatrixXd(triangle.block(0, others, others, size)))));
  // Of the directions at the start nothing is known before; the rest of the prior is triangular.
  double log_prior_root = 0;
  for (Index state = 2L * layout.gyros; state < layout.size(); ++state) {
    log_prior_root += is_mode[static_cast<std::size_t>(state)] ? 0 : std::log(std::abs(prior(state, state)));
  }
  const double residual = triangle(last, last);
  information.log_likelihood = log_prior_root - found.log_root_determinant - own.diagonal().array().abs().log().sum() -
                               (residual * residual + linear.cost_outside_rows) / 2;
  return information;
}

namespace {

/// Newton's step uphill; of groups that are as large as they may be, and would be larger, none.
VectorXd step_from(const VectorXd& log_rms, const Posteriors::Slope& slope) {
  const auto held = (log_rms.array() >= std::log(kMostRms_rad_s) && slope.first.array() > 0).eval();
  const VectorXd first = held.select(0, slope.first);
  for (const MatrixXd* second : {&slope.observed, &slope.mean}) {
    MatrixXd curvature = *second;
    for (Index g = 0; g < held.size(); ++g) {
      if (held(g)) {
        curvature.row(g).setZero();
        curvature.col(g).setZero();
        curvature(g, g) = 1;
      }
    }
    const Eigen::LLT<MatrixXd> root(curvature);
    if (root.info() == Eigen::Success) {
      return root.solve(first);
    }
  }
  return VectorXd::Zero(first.size());  // of numbers that are none
}

}  // namespace

FieldSpectrum most_likely_spectrum(const FieldMembers& members, const FieldInformation& information,
                                   const VectorXd& first) {
  constexpr int kMostSteps = 60;
  constexpr double kLongestStep = 2;     // of any logarithm: a factor of seven
  constexpr double kNearEnough = 0.001;  // in the log likelihood
  constexpr int kMostHalvings = 10;
  const Posteriors posteriors(members, information);
  FieldSpectrum spectrum;
  spectrum.log_rms = first.size() > 0 ? first : members.expected();
  FieldLikelihood here = posteriors.at(spectrum.log_rms);
  for (int i = 0; i < kMostSteps; ++i) {
    const Posteriors::Slope slope = posteriors.slope(spectrum.log_rms, here);
    spectrum.information = slope.expected;
    VectorXd step = step_from(spectrum.log_rms, slope);
    if (step.dot(slope.first) < kNearEnough) {
      break;
    }
    step *= std::min(1.0, kLongestStep / step.cwiseAbs().maxCoeff());
    step = (spectrum.log_rms + step).cwiseMin(std::log(kMostRms_rad_s)) - spectrum.log_rms;
    FieldLikelihood next = posteriors.at(spectrum.log_rms + step);
    for (int halving = 0; halving < kMostHalvings && !(next.log_likelihood > here.log_likelihood); ++halving) {
      step /= 2;
      next = posteriors.at(spectrum.log_rms + step);
    }
    if (!(next.log_likelihood > here.log_likelihood)) {
      break;
    }
    spectrum.log_rms += step;
    here = std::move(next);
  }
  spectrum.log_likelihood = here.log_likelihood;
  return spectrum;
}

namespace {

/// ln of the root mean square of each group, of which the square is the mean over the spectra that the pass allows; not
/// below the most likely one. Other groups follow as far as they have their level in common.
VectorXd log_of_mean_squares(const Posteriors& posteriors, const FieldSpectrum& spectrum, double log_likelihood) {
  // In sigmas of the logarithm. The mean of a square is far above its most likely value, and of large values the pass
  // says itself that they are not.
  constexpr std::array<double, 7> kAway = {-2.5, -1.25, 1.25, 2.5, 3.75, 5, 6.25};
  const Index size = spectrum.log_rms.size();
  const MatrixXd covariance = spectrum.information.llt().solve(MatrixXd::Identity(size, size));
  const std::vector<double> found = on_all_cores(static_cast<std::size_t>(size), [&](std::size_t group) {
    const auto g = static_cast<Index>(group);
    const VectorXd sigma = covariance.col(g) / std::sqrt(covariance(g, g));
    double weights = 1;
    double squares = 1;
    for (const double away : kAway) {
      const VectorXd other = (spectrum.log_rms + away * sigma).cwiseMin(std::log(kMostRms_rad_s));
      const double there = posteriors.at(other).log_likelihood;
      const double weight = std::exp(std::min(there - log_likelihood, 0.0));
      weights += weight;
      squares += weight * std::exp(2 * (other(g) - spectrum.log_rms(g)));
    }
    return std::log(std::max(squares / weights, 1.0)) / 2;
  });
  return spectrum.log_rms + VectorXd::Map(found.data(), size);
}

/// By how much the variance of each member is larger than that of its group, in the mean over what the pass allows; not
/// below 1. `by_group`: with the variances of the groups. The covariance of the spectrum alone would have it that of a
/// group of which a pass shows some members, and small ones, those that it does not show are as small.
VectorXd own_variances(const Posterior& by_group) {
  constexpr int kPerSigma = 4;  // values of the normal variable at which the integral is taken
  constexpr int kMost = 4;      // sigmas, on both sides
  VectorXd found(by_group.mean.size());
  for (Index i = 0; i < found.size(); ++i) {
    // Of the amplitude in sigmas z the pass says exp(h z - L z^2 / 2), all others integrated over.
    const double left = std::max(1 - by_group.white.col(i).squaredNorm(), 1e-12);
    const double L = 1 / left - 1;
    const double h = by_group.mean(i) / left;
    double weights = 0;
    double variances = 0;
    const auto exponent = [&](double variance) { return h * h * variance / (1 + variance * L) / 2; };
    const double most = exponent(std::exp(2 * kSigmaOfMember * kMost));
    for (int step = -kMost * kPerSigma; step <= kMost * kPerSigma; ++step) {
      const double x = static_cast<double>(step) / kPerSigma;
      const double variance = std::exp(2 * kSigmaOfMember * x);
      const double weight = std::exp(exponent(variance) - most - x * x / 2) / std::sqrt(1 + variance * L);
      weights += weight;
      variances += weight * variance;
    }
    found(i) = std::max(variances / weights, 1.0);
  }
  return found;
}

}  // namespace

MatrixXd covariance_of_spectrum(const FieldMembers& members, const FieldInformation& information,
                                const FieldSpectrum& spectrum) {
  const Posteriors posteriors(members, information);
  const FieldLikelihood likelihood = posteriors.at(spectrum.log_rms);
  const Posterior most_likely = posteriors.posterior(likelihood);
  const FieldLikelihood by_group = posteriors.at(log_of_mean_squares(posteriors, spectrum, likelihood.log_likelihood));
  const VectorXd own = own_variances(posteriors.posterior(by_group));
  const Posterior mean = posteriors.posterior(posteriors.with(by_group.sigma.cwiseProduct(own.cwiseSqrt())));
  MatrixXd added = MatrixXd::Zero(members.size(), members.size());
  mean.add_covariance(1, added);
  most_likely.add_covariance(-1, added);
  add_gram(mean.amplitudes() - most_likely.amplitudes(), 1, added);
  return added.selfadjointView<Eigen::Lower>();
}

namespace {

/// `added`: to the variances of the amplitudes, by the uncertainty of the spectrum.
MeanSquares posterior_mean_squares(const Layout& layout, const FieldMembers& members,
                                   const FieldInformation& information, const FieldSpectrum& spectrum,
                                   const VectorXd& added) {
  const Posteriors posteriors(members, information);
  const Posterior found = posteriors.posterior(posteriors.at(spectrum.log_rms));
  const VectorXd learnt = found.white.colwise().squaredNorm();
  const VectorXd squares =
      found.amplitudes().cwiseAbs2() + VectorXd(found.sigma.cwiseAbs2().array() * (1 - learnt.array())) + added;
  const auto groups = static_cast<Index>(members.groups().size());
  const VectorXd of_rms = members.sigma(VectorXd::Zero(groups)).cwiseAbs2();
  VectorXd mean = VectorXd::Zero(groups);
  VectorXd count = VectorXd::Zero(groups);
  for (Index i = 0; i < members.size(); ++i) {
    const Index g = members.group_of()[static_cast<std::size_t>(i)];
    mean(g) += std::max(squares(i), 0.0) / of_rms(i);
    count(g) += 1;
  }
  mean = mean.cwiseQuotient(count);
  const std::vector<DriftCoefficient> coefficients = coefficients_of(layout.drift_model);
  MeanSquares found_of(static_cast<std::size_t>(layout.gyros));
  for (Index i = 0; i < members.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Index g = members.group_of()[at];
    const int gyro = members.groups()[static_cast<std::size_t>(g)].gyro;
    const auto column = static_cast<std::size_t>(members.states()[at] - layout.drift(gyro));
    found_of[static_cast<std::size_t>(gyro)][coefficients[column]] = of_rms(i) * mean(g);
  }
  return found_of;
}

/// The spectrum by potential and degree. `covariance`: of the ln of the root mean squares of the groups.
std::vector<DriftFieldLevel> levels_of(const FieldMembers& members, const VectorXd& log_rms,
                                       const MatrixXd& covariance) {
  const std::vector<FieldMembers::Group>& groups = members.groups();
  std::vector<DriftFieldLevel> levels;
  for (const FieldMembers::Group& first : groups) {
    if (std::ranges::any_of(levels, [&](const DriftFieldLevel& level) {
          return level.gyro == first.gyro && level.potential == first.potential && level.degree == first.degree;
        })) {
      continue;
    }
    VectorXd squares(log_rms.size());
    std::ranges::transform(groups, log_rms, squares.begin(), [&](const FieldMembers::Group& group, double log) {
      const bool its = group.gyro == first.gyro && group.potential == first.potential && group.degree == first.degree;
      return its ? std::exp(2 * log) : 0;
    });
    const VectorXd parts = squares / squares.sum();
    levels.push_back({first.gyro, first.potential, first.degree, std::sqrt(squares.sum()),
                      std::exp(std::sqrt(parts.dot(covariance * parts)))});
  }
  return levels;
}

}  // namespace

FieldPrior field_prior(const PassProblem& problem, const FieldMembers& members, const FieldInformation& information,
                       const FieldSpectrum& spectrum) {
  const Layout layout = problem.setup().layout();
  FieldPrior prior;
  prior.modes = *problem.modes();
  prior.sigma_rad_s = members.sigma(spectrum.log_rms);
  const MatrixXd added = covariance_of_spectrum(members, information, spectrum);
  prior.log_evidence = spectrum.log_likelihood - (information.log_likelihood - information.y.squaredNorm() / 2);
  prior.members = posterior_mean_squares(layout, members, information, spectrum, added.diagonal());
  MatrixXd by_members = MatrixXd::Zero(layout.parameters(), members.size());
  std::vector<bool> is_member(static_cast<std::size_t>(layout.parameters()), false);
  for (Index i = 0; i < members.size(); ++i) {
    const Index row = members.states()[static_cast<std::size_t>(i)] - layout.drift(0);
    is_member[static_cast<std::size_t>(row)] = true;
    by_members(row, i) = 1;
  }
  Index other = 0;
  for (Index row = 0; row < layout.parameters(); ++row) {
    if (!is_member[static_cast<std::size_t>(row)]) {
      by_members.row(row) = information.others_by_members.row(other++);
    }
  }
  const MatrixXd more = multiply(multiply(by_members, added), by_members.transpose());
  prior.more_covariance = (more + more.transpose()) / 2;
  const MatrixXd covariance =
      spectrum.information.llt().solve(MatrixXd::Identity(spectrum.information.rows(), spectrum.information.cols()));
  prior.levels = levels_of(members, spectrum.log_rms, covariance);
  return prior;
}

void put_sigma(const Layout& layout, const FieldMembers& members, const VectorXd& sigma_rad_s, Prior& prior) {
  for (Index i = 0; i < members.size(); ++i) {
    const Index row = members.states()[static_cast<std::size_t>(i)] - layout.drift(0);
    prior.covariance.row(row).setZero();
    prior.covariance.col(row).setZero();
    prior.covariance(row, row) = sigma_rad_s(i) * sigma_rad_s(i);
  }
}

}  // namespace trihedron::ground
