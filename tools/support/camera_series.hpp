// Series of images from a running GigE Vision camera, as EMVA 1288 wants them: one light, many exposures.
#pragma once

#include "sensors/emva1288.hpp"
#include "tools/support/receiver.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace obscura::tools {

struct CameraSeriesSettings {
    ReceiverSettings receiver;
    std::string pixel_format; ///< empty: as the camera has it
    double least_us = 0;      ///< shortest exposure; 0: the shortest that the camera has
    double most_us = 0;       ///< longest exposure; 0: found by raising it until the image is saturated
    int levels = 24;          ///< exposures, evenly spaced
    int pairs = 4;            ///< of images at each exposure
    int stack = 16;           ///< images for the fixed patterns
    double timeout_s = 10;    ///< for one frame
};

/// One exposure time: what a pair of images tells, averaged over the pairs.
struct CameraLevel {
    double exposure_s = 0;
    sensors::emva1288::PairStatistics pair;
};

struct CameraSeries {
    std::string camera;                            ///< vendor, model, serial number
    int bits = 0;                                  ///< of the pixel format
    std::vector<CameraLevel> levels;               ///< rising exposures
    sensors::emva1288::ImageStack low{0}, half{0}; ///< at the shortest exposure and at half the longest
    double half_exposure_s = 0;
};

/// Takes the series: free run, one acquisition for each exposure, whose first frame is thrown away (it may
/// have been begun under old settings). The camera keeps the last settings. Throws HardwareError.
[[nodiscard]] CameraSeries take_camera_series(const CameraSeriesSettings& settings);

} // namespace obscura::tools
