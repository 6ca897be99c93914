#pragma once
/// What is kept of each calibration, over the starts of the rotors.

#include <string>

#include "trihedron/records/calibration.hpp"

namespace trihedron {

/// One calibration in a catalogue, and what it belongs to.
struct CatalogueEntry {
  std::string spacecraft;
  std::string pass;      ///< its name; of the last one where the calibration combines several
  std::string start_up;  ///< of the rotors: drift coefficients are those of one start; empty where it has no name
  int passes = 1;        ///< that the calibration combines
  Calibration calibration;
};

}  // namespace trihedron
