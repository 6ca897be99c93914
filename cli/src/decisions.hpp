#pragma once
/// What goes into the log: what was read, decided and found, and why.

#include <string>

#include "output.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::cli {

void log_pass(const Log& log, const std::string& path, const io::LoadedPass& loaded);
void log_settings(const Log& log, const CalibrationOptions& options);
void log_verdict(const Log& log, const Verdict& verdict);
/// What the pass gave evidence of, drift model, noise, what was rejected, verdict.
void log_run(const Log& log, const CalibrationRun& run);

}  // namespace trihedron::cli
