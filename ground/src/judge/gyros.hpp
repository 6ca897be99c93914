#pragma once
/// Findings on the gyros: their readings, and how they are placed.

#include <optional>
#include <vector>

#include "trihedron/records/finding.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// Of a calibration or a navigation with so many gyros. `without_pair`: what the loss of a gyro means where it leaves
/// no pair.
void judge_gyros(const Pass& pass, const std::vector<GyroEvent>& gyro_events, int gyros, const char* without_pair,
                 std::vector<Finding>& findings);
/// Samples that are closer together than is used, or far apart; after judge_noise_by_rate().
void judge_gyro_rate(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings);
/// Readings that were wrong for a moment.
void judge_bursts(const std::optional<Bursts>& bursts, std::vector<Finding>& findings);
void judge_readout_noise(const std::optional<ReadoutNoise>& noise, std::vector<Finding>& findings);
/// Whether the momenta of the pair are far enough from one line.
void judge_pair(const CalibrationRun& run, std::vector<Finding>& findings);

}  // namespace trihedron::ground
