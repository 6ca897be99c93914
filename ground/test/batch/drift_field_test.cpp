#include "batch/drift_field.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <chrono>
#include <cmath>
#include <random>

#include "batch/batch.hpp"
#include "batch/pass_setup.hpp"
#include "passes.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"
#include "trihedron/records/drift_models.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

const Layout kSmall{.drift_model = vsh(3)};
constexpr double kSigmaOfMember = 0.8;  // ln, as the prior has it

MatrixXd normal_matrix(Index rows, Index columns, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
}

/// Every amplitude seen with this sigma, mixed so that no member stands alone.
FieldInformation seen_with(double sigma_rad_s, const VectorXd& amplitudes, std::mt19937_64& random) {
  const Index size = amplitudes.size();
  const Eigen::HouseholderQR<MatrixXd> mixed(normal_matrix(size, size, random));
  FieldInformation information;
  information.R = MatrixXd(mixed.householderQ()) / sigma_rad_s;
  information.y = information.R * amplitudes + normal_matrix(size, 1, random);
  return information;
}

/// ln of the normal density of y when the amplitudes have these sigmas.
double log_density(const FieldInformation& information, const VectorXd& sigma) {
  const MatrixXd spread = information.R * sigma.asDiagonal();
  MatrixXd covariance = spread * spread.transpose();
  covariance.diagonal().array() += 1;
  const Eigen::LLT<MatrixXd> root(covariance);
  return -root.matrixLLT().diagonal().array().log().sum() -
         VectorXd(root.matrixL().solve(information.y)).squaredNorm() / 2;
}

/// Whether half a turn about any axis of the case leaves the drift of a member as it is.
bool is_left_by_half_turns(const DriftModel& model, Index member) {
  const Eigen::Vector3d h = Eigen::Vector3d(0.3, -0.5, 0.7).normalized();
  const auto across_h = [&](const Eigen::Vector3d& direction) {
    Columns<kMaxDriftColumns> columns;
    model.basis(direction, {}, columns.view(model.columns()));
    const Eigen::Vector3d drift = columns.first(model.size()).col(member);
    return Eigen::Vector3d(drift - direction * direction.dot(drift));
  };
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Vector3d turn = Eigen::Vector3d::Constant(-1);
    turn(axis) = 1;
    if ((across_h(turn.cwiseProduct(h)) - turn.cwiseProduct(across_h(h))).norm() > 1e-12) {
      return false;
    }
  }
  return true;
}

TEST(DriftField, SymmetricGroupsAreWhatHalfTurnsLeaveAsItIs) {
  const Layout layout{.drift_model = vsh(8)};
  const FieldMembers members(layout);
  EXPECT_EQ(members.groups().size(), 2U * 2 * (8 + 5));  // of degrees 1 to 8, and from 4 on both kinds
  const DriftModel model(layout.drift_model, {});
  for (Index i = 0; i < Layout::kEq1; ++i) {
    EXPECT_TRUE(is_left_by_half_turns(model, i));
  }
  for (Index i = 0; i < members.of_one_gyro(); ++i) {
    const Index group = members.group_of()[static_cast<std::size_t>(i)];
    EXPECT_EQ(members.groups()[static_cast<std::size_t>(group)].symmetric,
              is_left_by_half_turns(model, Layout::kEq1 + i))
        << i;
  }
}

TEST(DriftField, GroupsTheMembersOutsideEq1ByGyroPotentialAndDegree) {
  const FieldMembers members(kSmall);
  EXPECT_EQ(members.size(), 2 * (vsh(3).size() - Layout::kEq1));
  ASSERT_EQ(members.groups().size(), 12U);
  EXPECT_EQ(members.groups()[0].degree, 1);
  EXPECT_EQ(members.groups()[11].gyro, 1);
  EXPECT_EQ(members.groups()[11].potential, DriftCoefficient::Member::kD);
  EXPECT_EQ(members.groups()[11].degree, 3);
  EXPECT_EQ(members.states().front(), kSmall.drift(0) + Layout::kEq1);
  EXPECT_EQ(members.states().back(), kSmall.alignment(1) - 1);
}

/// Members of degree 1 are complete: with random amplitudes of the sigmas, the mean square of their drift over the
/// sphere is that asked for.
TEST(DriftField, SigmasMakeDriftOfTheRootMeanSquare) {
  const Layout layout{.drift_model = vsh(1)};
  const FieldMembers members(layout);
  VectorXd log_rms = VectorXd::Constant(4, -100.0);
  log_rms(0) = std::log(2e-8);
  const VectorXd sigma = members.sigma(log_rms);
  const DriftModel model(layout.drift_model, {});
  std::mt19937_64 random(3);
  double square = 0;
  constexpr int kDirections = 4000;
  for (int i = 0; i < kDirections; ++i) {
    const Eigen::Vector3d h = normal_matrix(3, 1, random).col(0).head<3>().normalized();
    Columns<kMaxDriftColumns> columns;
    model.basis(h, {}, columns.view(model.columns()));
    const MatrixXd basis = columns.first(model.size());
    for (Index j = 0; j < members.size() / 2; ++j) {
      const Eigen::Vector3d column = basis.col(Layout::kEq1 + j);
      square += (column - h * h.dot(column)).squaredNorm() * sigma(j) * sigma(j) / kDirections;
    }
  }
  EXPECT_NEAR(std::sqrt(square), 2e-8, 0.02 * 2e-8);
}

TEST(DriftField, FindsTheSpectrumOfAmplitudesThatAreSeenWell) {
  std::mt19937_64 random(5);
  const FieldMembers members(kSmall);
  const VectorXd truth = VectorXd::Constant(static_cast<Index>(members.groups().size()), std::log(3e-8));
  const VectorXd amplitudes = members.sigma(truth).cwiseProduct(normal_matrix(members.size(), 1, random).col(0));
  const FieldInformation information = seen_with(1e-10, amplitudes, random);
  const FieldSpectrum found = most_likely_spectrum(members, information);
  // What these amplitudes show themselves, drawn towards the level of the other groups: three members of degree 1 show
  // it to 0.4, and W and D of a degree are alike to 0.7, so that a quarter of their difference is taken back.
  VectorXd square = VectorXd::Zero(truth.size());
  VectorXd count = VectorXd::Zero(truth.size());
  const VectorXd in_sigmas = amplitudes.cwiseQuotient(members.sigma(truth));
  for (Index i = 0; i < members.size(); ++i) {
    const Index group = members.group_of()[static_cast<std::size_t>(i)];
    square(group) += in_sigmas(i) * in_sigmas(i);
    count(group) += 1;
  }
  const VectorXd shown = truth.array() + square.cwiseQuotient(count).array().log() / 2;
  EXPECT_LT((found.log_rms - shown).cwiseAbs().maxCoeff(), 0.35);
}

/// ln of the prior density of a spectrum of two gyros, up to a constant: docs/adr/0017-drift-field.md.
double log_prior(const FieldMembers& members, const VectorXd& log_rms) {
  const Index size = log_rms.size();
  MatrixXd covariance(size, size);
  for (Index i = 0; i < size; ++i) {
    for (Index j = 0; j < size; ++j) {
      const FieldMembers::Group& a = members.groups()[static_cast<std::size_t>(i)];
      const FieldMembers::Group& b = members.groups()[static_cast<std::size_t>(j)];
      const bool of_one_gyro = a.gyro == b.gyro;
      const double alike = std::exp(-std::abs(a.degree - b.degree) / 3.0);
      covariance(i, j) =
          4 + (of_one_gyro ? 1 + (a.symmetric == b.symmetric ? 4 + 1 : 4) * alike : 0) + (i == j ? 0.25 : 0);
    }
  }
  VectorXd apart = log_rms;
  for (Index g = 0; g < size; ++g) {
    const FieldMembers::Group& group = members.groups()[static_cast<std::size_t>(g)];
    apart(g) -= std::log(std::max(5e-9 * std::exp(-0.7 * (group.degree - 1)), 1e-10)) + (group.symmetric ? 1 : 0);
  }
  return -apart.dot(covariance.inverse() * apart) / 2;
}

TEST(DriftField, TheSpectrumIsTheMostLikelyOne) {
  std::mt19937_64 random(7);
  const FieldMembers members(Layout{.drift_model = vsh(4)});
  const FieldInformation information = seen_with(1e-9, normal_matrix(members.size(), 1, random).col(0) * 1e-8, random);
  const FieldSpectrum found = most_likely_spectrum(members, information);
  const auto log_posterior = [&](const VectorXd& log_rms) {
    return log_density(information, members.sigma(log_rms)) + log_prior(members, log_rms);
  };
  const double highest = log_posterior(found.log_rms);
  EXPECT_NEAR(found.log_likelihood, highest, 1e-6);
  for (Index g = 0; g < found.log_rms.size(); ++g) {
    for (const double step : {-0.3, 0.3}) {
      VectorXd away = found.log_rms;
      away(g) += step;
      EXPECT_LT(log_posterior(away), highest) << g;
    }
  }
}

TEST(DriftField, TheSpectrumIsTheSameFromWhereverItsSearchBegins) {
  std::mt19937_64 random(15);
  const FieldMembers members(Layout{.drift_model = vsh(4)});
  const FieldInformation information = seen_with(1e-9, normal_matrix(members.size(), 1, random).col(0) * 3e-9, random);
  const FieldSpectrum found = most_likely_spectrum(members, information);
  for (const double rms_rad_s : {1e-12, 1e-8, 1e-6}) {
    const VectorXd first = VectorXd::Constant(found.log_rms.size(), std::log(rms_rad_s));
    const FieldSpectrum other = most_likely_spectrum(members, information, first);
    EXPECT_NEAR(other.log_likelihood, found.log_likelihood, 0.002) << rms_rad_s;
    EXPECT_LT((other.log_rms - found.log_rms).cwiseAbs().maxCoeff(), 0.1) << rms_rad_s;
  }
}

TEST(DriftField, OfDriftBeyondMeasureEachGroupIsAsLargeAsItMayBe) {
  std::mt19937_64 random(17);
  const FieldMembers members(kSmall);
  const FieldInformation information = seen_with(1e-9, normal_matrix(members.size(), 1, random).col(0) * 1e-3, random);
  const FieldSpectrum found = most_likely_spectrum(members, information);
  EXPECT_LT((found.log_rms.array() - std::log(1e-5)).abs().maxCoeff(), 1e-9);
  EXPECT_LT(found.log_likelihood, information.log_likelihood);
}

TEST(DriftField, WithoutEvidenceItIsSmallAndNotNothing) {
  std::mt19937_64 random(9);
  const FieldMembers members(kSmall);
  const FieldInformation information = seen_with(1e-9, VectorXd::Zero(members.size()), random);
  const FieldSpectrum found = most_likely_spectrum(members, information);
  // What the noise alone would make of degree 3: 1e-9 √(7 · 12/4π).
  EXPECT_LT(found.log_rms.maxCoeff(), std::log(2.6e-9));
  EXPECT_GT(found.log_rms.minCoeff(), std::log(1e-13));
}

/// One degree is seen to be large: what cannot be seen of the other degrees is taken to be larger than without that.
TEST(DriftField, ARotorThatHasMuchOfOneDegreeMayHaveMuchOfTheNext) {
  std::mt19937_64 random(11);
  const FieldMembers members(kSmall);
  FieldInformation information = seen_with(1e-9, VectorXd::Zero(members.size()), random);
  const auto blind_but_for_degree_1 = [&](double amplitude) {
    information.R.setZero();
    information.y.setZero();
    for (Index i = 0; i < members.size(); ++i) {
      if (members.groups()[static_cast<std::size_t>(members.group_of()[static_cast<std::size_t>(i)])].degree == 1) {
        information.R(i, i) = 1e10;
        information.y(i) = 1e10 * amplitude;
      }
    }
    return most_likely_spectrum(members, information).log_rms(11);
  };
  EXPECT_GT(blind_but_for_degree_1(1e-7), blind_but_for_degree_1(0) + 2);
}

/// Against the mixture of posteriors by spectra drawn from what the pass leaves open, each with its weight.
TEST(DriftField, TheUncertaintyOfTheSpectrumIsThatOfAllSpectraThatThePassAllows) {
  std::mt19937_64 random(13);
  const Layout layout{.drift_model = vsh(1)};
  const FieldMembers members(layout);
  const FieldInformation information = seen_with(2e-9, normal_matrix(members.size(), 1, random).col(0) * 4e-9, random);
  const FieldSpectrum found = most_likely_spectrum(members, information);
  const MatrixXd added = covariance_of_spectrum(members, information, found);

  const auto posterior = [&](const VectorXd& sigma, VectorXd& mean) {
    const VectorXd weight = sigma.cwiseAbs2().cwiseInverse();
    MatrixXd square = information.R.transpose() * information.R;
    square.diagonal() += weight;
    const Eigen::LLT<MatrixXd> root(square);
    mean = root.solve(information.R.transpose() * information.y);
    return MatrixXd(root.solve(MatrixXd::Identity(members.size(), members.size())));
  };
  VectorXd centre;
  const MatrixXd covariance = posterior(members.sigma(found.log_rms), centre);
  const Eigen::LLT<MatrixXd> information_root(found.information);
  const MatrixXd to_log = information_root.matrixU().solve(MatrixXd::Identity(4, 4));
  const double highest = log_density(information, members.sigma(found.log_rms)) + log_prior(members, found.log_rms);
  MatrixXd sum = MatrixXd::Zero(members.size(), members.size());
  double weights = 0;
  constexpr int kDraws = 20000;
  for (int i = 0; i < kDraws; ++i) {
    // From the normal approximation, and what each member differs by from its prior, weighted by how likely they are.
    const VectorXd drawn = normal_matrix(4, 1, random).col(0);
    const VectorXd log_rms = found.log_rms + to_log * drawn;
    const VectorXd own_factor = (kSigmaOfMember * normal_matrix(members.size(), 1, random).col(0)).array().exp();
    const VectorXd sigma = members.sigma(log_rms).cwiseProduct(own_factor);
    const double weight =
        std::exp(log_density(information, sigma) + log_prior(members, log_rms) - highest + drawn.squaredNorm() / 2);
    VectorXd mean;
    const MatrixXd own = posterior(sigma, mean);
    sum += weight * (own + (mean - centre) * (mean - centre).transpose() - covariance);
    weights += weight;
  }
  sum /= weights;
  EXPECT_NEAR((added.trace() + covariance.trace()) / (sum.trace() + covariance.trace()), 1, 0.25);
  EXPECT_GT(added.trace(), 0);
}

/// All but the last member seen, and small.
TEST(DriftField, AMemberThatIsNotSeenMayBeLargerThanThoseOfItsGroup) {
  std::mt19937_64 random(29);
  const FieldMembers members(kSmall);
  const Index size = members.size();
  const double seen_rad_s = 1e-11;
  FieldInformation information = seen_with(seen_rad_s, normal_matrix(size, 1, random).col(0) * 1e-9, random);
  information.R = MatrixXd::Identity(size - 1, size) / seen_rad_s;
  information.y = normal_matrix(size - 1, 1, random).col(0) * 1e-9 / seen_rad_s;
  const FieldSpectrum found = most_likely_spectrum(members, information);
  const MatrixXd added = covariance_of_spectrum(members, information, found);
  const VectorXd by_group = members.sigma(found.log_rms);
  const double factor = std::exp(2 * kSigmaOfMember * kSigmaOfMember);
  const double of_unseen = 1 + added(size - 1, size - 1) / std::pow(by_group(size - 1), 2);
  EXPECT_GT(of_unseen, 0.95 * factor);
  EXPECT_LT(of_unseen, 3 * factor);  // with what the uncertainty of the level adds
  EXPECT_LT(added.diagonal().head(size - 1).maxCoeff(), 0.01 * seen_rad_s * seen_rad_s);
}

TEST(DriftField, PutsItsVariancesIntoThePrior) {
  const FieldMembers members(kSmall);
  Prior prior;
  prior.covariance = MatrixXd::Identity(kSmall.parameters(), kSmall.parameters());
  const VectorXd sigma = VectorXd::LinSpaced(members.size(), 1e-9, 2e-9);
  put_sigma(kSmall, members, sigma, prior);
  EXPECT_EQ(prior.covariance(6, 6), 1);
  EXPECT_EQ(prior.covariance(7, 7), sigma(0) * sigma(0));
  EXPECT_EQ(prior.covariance(kSmall.drift_size(), kSmall.drift_size()), 1);
}

CalibrationOptions told_batch(const DriftModelId& model) {
  CalibrationOptions options = told();
  options.estimator = Estimator::kBatch;
  options.drift_model = model;
  return options;
}

/// What modes leave out cannot be seen: eq. (1), alignment and their sigmas are those of all members. At the level of
/// this prior each mode that is left out moves all fixes together by less than a tenth of their noise, which is worth a
/// hundredth of a sigma, of some modes next to the limit.
TEST(DriftField, ItsModesTellWhatAllMembersTell) {
  const CalibrationOptions options = told_batch(vsh(6));
  const Screened screened = screen(two_hours().pass, options);
  PassSetup setup = pass_setup(two_hours().pass.settings, options);
  const FieldMembers members(setup.layout());
  const VectorXd level = VectorXd::Constant(static_cast<Index>(members.groups().size()), std::log(2e-8));
  put_sigma(setup.layout(), members, members.sigma(level), setup.prior);
  const PassProblem all(screened.pass, setup);
  PassProblem few(screened.pass, setup);
  const PassSolution first = first_solution(all, screened);
  const MovedByModes by_coefficients = few.moved_by_coefficients(first);
  few.use(modes_of(few, by_coefficients, members, level.array() + std::log(3.0)), by_coefficients);
  EXPECT_LT(few.layout().drift_modes, members.of_one_gyro());
  const BatchResult by_all = most_likely(all, first);
  const BatchResult by_few = most_likely(few, first);
  for (int k = 0; k < 2; ++k) {
    for (int i = 0; i < Layout::kEq1; ++i) {
      const double sigma = by_all.errors.last_root.row(all.layout().drift(k) + i).norm();
      EXPECT_NEAR(by_few.solution.gyros[k].drift_rad_s(i), by_all.solution.gyros[k].drift_rad_s(i), 0.03 * sigma);
      EXPECT_NEAR(by_few.errors.last_root.row(few.layout().drift(k) + i).norm() / sigma, 1, 0.01);
    }
    const Eigen::Matrix3d& C_c_b = by_all.solution.gyros[k].C_c_b;
    const auto sigma = by_all.errors.last_root.middleRows<3>(all.layout().alignment(k)).rowwise().norm().eval();
    const Eigen::Vector3d apart =
        Rot<C, C>::assume(Eigen::Matrix3d(by_few.solution.gyros[k].C_c_b * C_c_b.transpose())).log().raw();
    EXPECT_LT(apart.cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 0.03);
  }
}

/// With modes; all that works on the parts of a pass beside each other.
PassProblem::Linear linearised(const Screened& screened, const PassSetup& setup, bool by_parts) {
  PassProblem problem(screened.pass, setup);
  const PassSolution first = first_solution(problem, screened);
  const MovedByModes by_coefficients = problem.moved_by_coefficients(first);
  problem.use(modes_of(problem, by_coefficients), by_coefficients);
  return by_parts ? problem.linearise_by_parts(first) : problem.linearise(first);
}

/// Also where there are fewer arcs than parts.
TEST(PassProblem, IsLinearisedTheSameOnAnyNumberOfCores) {
  const CalibrationOptions options = told_batch(vsh(2));
  const Screened screened = screen(two_hours().pass, options);
  PassSetup setup = pass_setup(two_hours().pass.settings, options);
  for (const Duration arc : {setup.arc, Duration(std::chrono::minutes(50)), Duration(std::chrono::hours(3))}) {
    setup.arc = arc;
    for (const bool by_parts : {false, true}) {
      const PassProblem::Linear on_all = linearised(screened, setup, by_parts);
      PassProblem::Linear on_one;
      with_cores(1, [&] { on_one = linearised(screened, setup, by_parts); });
      ASSERT_EQ(on_all.stages.size(), on_one.stages.size());
      EXPECT_EQ(on_all.cost_outside_rows, on_one.cost_outside_rows);
      for (std::size_t i = 0; i < on_all.stages.size(); ++i) {
        ASSERT_EQ(on_all.stages[i].H, on_one.stages[i].H) << i;
        ASSERT_EQ(on_all.stages[i].y, on_one.stages[i].y) << i;
      }
      for (std::size_t i = 0; i < on_all.ends.size(); ++i) {
        ASSERT_EQ(on_all.ends[i].A, on_one.ends[i].A) << i;
        ASSERT_EQ(on_all.stages[i].B, on_one.stages[i].B) << i;
      }
    }
  }
}

}  // namespace
}  // namespace trihedron::ground
