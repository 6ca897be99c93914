// The simulator against passes in files: its own, and where it is at hand that of an independent generator.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "sample_passes.hpp"
#include "statistics.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::sim {
namespace {

using Eigen::Vector3d;
using Row = std::vector<double>;

std::vector<Row> read_csv(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::vector<Row> rows;
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    Row row;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) {
      row.push_back(std::stod(cell));
    }
    rows.push_back(row);
  }
  return rows;
}

/// All arrays of numbers called `key`, in order.
std::vector<Row> json_arrays(const std::filesystem::path& file, const std::string& key) {
  std::stringstream content;
  content << std::ifstream(file).rdbuf();
  const std::string text = content.str();
  std::vector<Row> arrays;
  for (std::size_t at = text.find('"' + key + '"'); at != std::string::npos; at = text.find('"' + key + '"', at + 1)) {
    const std::size_t open = text.find('[', at);
    std::istringstream cells(text.substr(open + 1, text.find(']', open) - open - 1));
    Row row;
    for (std::string cell; std::getline(cells, cell, ',');) {
      row.push_back(std::stod(cell));
    }
    arrays.push_back(row);
  }
  return arrays;
}

class SamplePass : public testing::TestWithParam<PassOfKind> {};

INSTANTIATE_TEST_SUITE_P(WithAllDriftInEq1, SamplePass, testing::ValuesIn(sample_passes({PassKind::kNominal})),
                         [](const auto& pass) { return pass.param.identifier(); });

TEST_P(SamplePass, GyrosOnItsAttitudeRepeatItsMomentaAndReadings) {
  const std::filesystem::path& pass = GetParam().path;
  const std::vector<Row> truth = read_csv(pass / "truth.csv");
  const std::vector<Row> telemetry = read_csv(pass / "gyro.csv");
  const std::vector<Row> kappa = json_arrays(pass / "truth.json", "drift_rad_s");
  const std::vector<Row> lambda = json_arrays(pass / "truth.json", "lambda_rad");
  ASSERT_EQ(truth.size(), 10'801U);
  ASSERT_EQ(kappa.size(), 2U);

  Scenario scenario;
  scenario.attitude.reference = AttitudeScenario::Reference::kRecorded;
  scenario.attitude.slews = std::vector<Slew>{};
  scenario.attitude.jitter_rad = 0;
  for (const Row& row : truth) {
    scenario.attitude.recorded.push_back({row[0], Eigen::Quaterniond(row[4], row[1], row[2], row[3])});
  }
  const Eigen::Quaterniond q_in_c = scenario.attitude.recorded.front().q_in_c.normalized();
  for (std::size_t gyro = 0; gyro < 2; ++gyro) {
    GyroScenario& ours = scenario.gyros[gyro];
    ours.drift.outside_sigma_rad_s = 0;
    ours.start_direction_c = q_in_c.conjugate() * Vector3d(&truth.front()[5 + 3 * gyro]);
    ours.misalignment_rad = Vector3d(lambda[gyro].data());
    std::copy(kappa[gyro].begin(), kappa[gyro].end(), ours.drift.kappa_rad_s.emplace().begin());
    ours.readout.noise_rad = 0;
  }
  const SimulatedPass result = simulate(scenario);

  test::Sequence noise;
  for (std::size_t fix = 0; fix < truth.size(); ++fix) {
    for (std::size_t gyro = 0; gyro < 2; ++gyro) {
      const Vector3d ours(&result.truth.h_in[(fix * 2 + gyro) * 3]);
      const Vector3d theirs(&truth[fix][5 + 3 * gyro]);
      // The truth has 12 digits; 0.002″ of the hundreds of arc minutes travelled is left to another integration and to
      // the spline through 3 s in slews.
      ASSERT_LT((ours - theirs).norm(), 1e-8) << truth[fix][0] << " s, gyro " << gyro;

      const Vector3d h = result.pass.gyro.direction(fix * 24, static_cast<int>(gyro));
      const Vector3d error = Vector3d(&telemetry[fix * 24][1 + 3 * gyro]) - h;
      const Vector3d u = h.unitOrthogonal();
      noise.push_back(u.dot(error));
      noise.push_back(h.cross(u).dot(error));
    }
  }
  EXPECT_NEAR(test::mean_square(noise) / std::pow(2 * kArcsecond, 2), 1,
              test::kBand * test::mean_square_sigma(noise.size()));
}

}  // namespace
}  // namespace trihedron::sim
