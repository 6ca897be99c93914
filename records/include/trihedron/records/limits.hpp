#pragma once
/// What each number that comes from outside may be: by settings, calibrations, scenarios and options of the command
/// line. The bounds are wide, but within them everything that is computed stays finite; beyond them a number has
/// another unit than its name says, or is no measurement.

#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>

namespace trihedron {

/// The values that one kind of number may have, both ends included, in the unit that its names end with.
struct Range {
  double least = -std::numeric_limits<double>::max();
  double most = std::numeric_limits<double>::max();
  std::string_view unit;      ///< empty for a pure number
  std::string_view why;       ///< for people: a whole sentence without its full stop
  bool zero_allowed = false;  ///< although it is below `least`: there is none of it

  /// False for what is not finite.
  [[nodiscard]] constexpr bool holds(double value) const {
    return (value >= least && value <= most) || (zero_allowed && value == 0);
  }
};

/// All ranges. Where not told otherwise a noise is a 1-sigma.
namespace limits {

inline constexpr double kFullTurn_rad = 6.2832;
inline constexpr double kYear_s = 3.2e7;

// ---- Settings of a pass

inline constexpr Range kPassDuration_s{60, kYear_s, "s",
                                       "in a pass shorter than a minute nothing can be calibrated, and none is longer "
                                       "than a year"};
inline constexpr Range kGyroPeriod_s{1e-5, 60, "s", "it is the time between samples: 0.125 s for 8 Hz"};
inline constexpr Range kStarTrackerPeriod_s{1e-3, 86400, "s",
                                            "it is the time between fixes, a fraction of a second to some seconds"};
inline constexpr Range kClockOffset_s{-1e3, 1e3, "s", "it is the time from a stamp to what it stands for"};
inline constexpr Range kClockRate_s_s{-1e-2, 1e-2, "s/s", "1e-6 s/s is a clock that gains a microsecond each second"};
inline constexpr Range kLatency_s{-10, 10, "s", "it is the time from a reading to its stamp"};
inline constexpr Range kReadoutNoise_rad{1e-9, 0.1, "rad",
                                         "it is the 1-sigma of a direction cosine, which is at most 1; an arcsecond is "
                                         "4.8e-6 rad"};
inline constexpr Range kStarTrackerNoise_rad{1e-9, 0.1, "rad",
                                             "it is the 1-sigma of an attitude; an arcsecond is 4.8e-6 rad"};
inline constexpr Range kDrift_rad_s{-0.1, 0.1, "rad/s", "no gyro drifts by degrees a second; 1 deg/h is 4.8e-6 rad/s"};
inline constexpr Range kDriftSigma_rad_s{1e-15, 1e-2, "rad/s",
                                         "no gyro drifts by half a degree a second; 1 deg/h is 4.8e-6 rad/s"};
inline constexpr Range kDriftField_rad_s{0, 0.1, "rad/s",
                                         "no gyro drifts by degrees a second; 1 deg/h is 4.8e-6 rad/s"};
inline constexpr Range kSigmaFactor{1, 1e9, "", "a level is known to a factor of 1 or more"};
inline constexpr Range kRotation_rad{-kFullTurn_rad, kFullTurn_rad, "rad",
                                     "it is one component of a rotation vector; a degree is 0.0175 rad"};
inline constexpr Range kAlignmentSigma_rad{1e-9, 3.15, "rad",
                                           "a half turn is all there is; an arcminute is 2.9e-4 rad"};

// ---- Telemetry of others

inline constexpr Range kHeaderLine{0, 1000, "", "it is the number of a line at the top of the file; 0 is none"};
inline constexpr Range kCountsPerUnit{1e-9, 1e18, "", "it is the count that stands for 1, or for one unit of an angle"};

inline constexpr Range kApid{0, 2046, "", "it is the number of an application process; 2047 is for idle packets"};
inline constexpr Range kGyrosOfPackets{2, 4, "", "attitude needs two gyros, and at most four are handled"};

// ---- Settings of the estimators

inline constexpr Range kRandomWalk_rad_sqrt_s{1e-15, 0.1, "rad/s^0.5", "give 0 where there is none", true};
inline constexpr Range kGateNis{0.1, 1e12, "", "30 passes good fixes; a large number lets all pass"};
inline constexpr Range kStudentTFreedom{1, 1e6, "", "give 5 to 20, or 0 for the gate alone", true};
inline constexpr Range kRejections{1, 1e6, "", "it is a number of fixes"};
inline constexpr Range kAnglesAfter_s{1e-3, kYear_s, "s", "give some seconds or minutes, or never"};
inline constexpr Range kCorrectionInterval_s{1e-3, kYear_s, "s", "it is the time between two corrections"};
inline constexpr Range kNeededError_rad{1e-9, 3.15, "rad",
                                        "an arcminute is 2.9e-4 rad, and a half turn is all there is"};
inline constexpr Range kNeededInterval_s{1, 3.2e6, "s",
                                         "it is the time between two astro-corrections, a month at most"};
inline constexpr Range kWanderingDrift_rad_s{1e-15, 1e-2, "rad/s", "give auto, off, or a 1-sigma like 0.01deg/h"};
inline constexpr Range kWanderingTime_s{1, kYear_s, "s", "an hour is usual"};
inline constexpr Range kChangeTime_s{1, kYear_s, "s", "rotors warm up in an hour or two"};
inline constexpr Range kPolhodePeriod_s{60, kYear_s, "s", "a polhode takes minutes to days"};
inline constexpr Range kPolhodePeriodRate{-0.5, 0.5, "", "it is the change of the period in seconds per second"};

// ---- Calibrations

inline constexpr Range kOrbitalRate_rad_s{-0.01, 0.01, "rad/s", "a low orbit has 1.1e-3 rad/s"};
inline constexpr Range kReadoutBias{-0.1, 0.1, "", "it is the error of a direction cosine, which is at most 1"};
/// Clock offset in seconds, errors of a star tracker in rad, drift in rad/s.
inline constexpr Range kFurtherState{-1e3, 1e3, "", "no error of a star tracker or gyro is so large"};
inline constexpr Range kFurtherStateSigma{0, 1e3, "", "no error of a star tracker or gyro is so large"};
inline constexpr Range kForecastTime_s{0, 3.2e6, "s", "a forecast is for a month at most"};
inline constexpr Range kForecastError_rad{0, 1e9, "rad", "it is an angle"};
inline constexpr Range kShare{0, 1e9, "", "it is a share"};
inline constexpr Range kTimeOfCalibration_s{-1e9, 1e9, "s", "it is the time since the epoch"};

// ---- Scenarios; what several keys say together is judged by the simulation

inline constexpr Range kLength_m{0, 1e9, "m", "the Moon is 3.8e8 m away"};
inline constexpr Range kAltitude_m{1, 1e9, "m", "an orbit is above the Earth, and the Moon is 3.8e8 m away"};
inline constexpr Range kFrequency_hz{0, 1e4, "Hz", "a spacecraft does not shake faster"};
inline constexpr Range kAcceleration_rad_s2{1e-9, 10, "rad/s^2", "a spacecraft turns by hundredths of a degree/s^2"};
inline constexpr Range kRate_rad_s{-10, 10, "rad/s", "no spacecraft turns faster"};
inline constexpr Range kRateWalk_rad_s_sqrt_s{0, 1e-2, "rad/s/s^0.5", "no gyro drifts so fast"};
inline constexpr Range kScenarioRandomWalk_rad_sqrt_s{0, 1e-2, "rad/s^0.5", "no gyro drifts so fast"};
inline constexpr Range kAngle_rad{-kFullTurn_rad, kFullTurn_rad, "rad", "it is at most a full turn"};
inline constexpr Range kSizeOfAngle_rad{0, kFullTurn_rad, "rad", "it is a size, which is not negative"};
inline constexpr Range kHalfTurn_rad{0, std::numbers::pi, "rad", "it is an angle between two directions"};
inline constexpr Range kHysteresisWidth_rad{1e-6, std::numbers::pi / 2, "rad",
                                            "it is the angle over which the drift changes sides"};
inline constexpr Range kRadius_rad{1e-6, std::numbers::pi / 2, "rad", "it is a radius of some degrees"};
inline constexpr Range kCorrelation_rad{1e-6, kFullTurn_rad, "rad", "it is the angle after which an error is another"};
inline constexpr Range kSizeOfRate_rad_s{0, 10, "rad/s", "it is a size, which is not negative"};
inline constexpr Range kBodyRate_rad_s{1e-6, 10, "rad/s", "a spacecraft turns by some tenths of a degree a second"};
inline constexpr Range kInterval_s{-kYear_s, kYear_s, "s", "it is at most a year"};
inline constexpr Range kStretch_s{0, kYear_s, "s", "it is a length of time, which is not negative"};
inline constexpr Range kTimeConstant_s{1e-3, kYear_s, "s", "it is the time in which something decays or changes"};
inline constexpr Range kMeanRest_s{1e-3, kYear_s, "s",
                                   "it is the mean of times that are drawn, which cannot all be zero"};
inline constexpr Range kProbability{0, 1, "", "it is a probability"};
inline constexpr Range kHarmonicDegree{1, 20, "", "it is the degree of a spherical harmonic"};
inline constexpr Range kHarmonicOrder{-20, 20, "", "it is the order of a spherical harmonic"};
inline constexpr Range kPureNumber{-1e3, 1e3, "", "no fraction or component is so large"};

inline constexpr Range kOrbitRadius_m{6.3e6, 2e9, "m", "an orbit goes round the Earth, whose radius is 6378 km"};
inline constexpr Range kOrbitSpeed_m_s{1, 2e4, "m/s", "what is faster than 11 km/s leaves the Earth"};
inline constexpr Range kInterpolationDegree{1, 25, "", "polynomials of higher degree swing between the states"};

// ---- Options

inline constexpr Range kAttitudeLimit_rad{1e-9, 3.15, "rad", "an error has no sign, and is at most a half turn"};
inline constexpr Range kGap_s{1e-6, kYear_s, "s", "it is a time between epochs beyond which a new segment begins"};
inline constexpr Range kSlewRate_rad_s{1e-6, 1, "rad/s", "a spacecraft turns by some tenths of a degree a second"};
inline constexpr Range kSlewAngle_rad{1e-4, 3.15, "rad", "a slew has some degrees, and at most a half turn"};
inline constexpr Range kSlews{1, 100, "", "it is a number of slews"};
inline constexpr Range kManoeuvreTime_s{1, kYear_s, "s", "it is the time of all slews together"};
inline constexpr Range kSpeed{1e-3, 1e9, "",
                              "it is how many times faster than the telemetry was taken; max is as fast as can be"};
inline constexpr Range kRequiredInterval_s{1, 3.1e7, "s",
                                           "it is the time for which an attitude is to hold, at most a year"};
inline constexpr Range kPredictionWindow_s{1, 3.1e7, "s",
                                           "it is the stretch of the pass from which errors are predicted, an orbit or "
                                           "more"};
inline constexpr Range kFlights{1, 1e6, "", "it is a number of flights"};
/// A row of a campaign takes a kilobyte of memory when its table is written.
inline constexpr Range kCampaignRuns{1, 1e6, "",
                                     "a campaign has one run at least; divide one of more than a million into several "
                                     "with seeds of their own"};
inline constexpr Range kSpreadOver{0, 20, "", "it is a number of samples; on board no more are taken"};
inline constexpr Range kJobs{1, 1024, "", "it is a number of threads"};

}  // namespace limits
}  // namespace trihedron
