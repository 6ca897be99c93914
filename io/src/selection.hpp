#pragma once
/// Leaves out of a pass what is not to be used, before it is screened.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <vector>

#include "input_formats.hpp"
#include "series.hpp"
#include "trihedron/io/pass.hpp"

namespace trihedron::io {

/// Adds a row to the defect: its count, and its place where it is one of the first.
void add_place(Defect& defect, const Series& series, std::size_t row);

/// Leaves out each row that `is_left_out`, and counts them as one defect of this kind.
void leave_out(Series& series, const std::function<bool(std::size_t)>& is_left_out, Defect::Kind kind,
               std::vector<Defect>& defects);

/// Cuts the pass to the range of `raw.selection`, and leaves out what lies in its intervals. Times of places in
/// `defects`, which count from the epoch of the pass, count from that of the part afterwards. Throws InputRefused where
/// less than a minute of the pass lies in that range.
void select(UnscreenedPass& raw, const std::filesystem::path& path, std::vector<Defect>& defects);

}  // namespace trihedron::io
