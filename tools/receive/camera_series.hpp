// SPDX-License-Identifier: Apache-2.0
// EMVA 1288 image series taken from a GigE Vision camera: constant light, varying exposure time.
#pragma once

#include "sensors/emva1288.hpp"
#include "tools/receive/receiver.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace obscura::tools {

struct CameraSeriesSettings {
    ReceiverSettings receiver;
    std::string pixel_format; ///< PixelFormat; empty: the camera's setting
    double min_us = 0;        ///< shortest exposure time; 0: the camera's minimum
    double max_us = 0;        ///< longest exposure time; 0: raised until the image saturates
    int levels = 24;          ///< number of exposure times, evenly spaced
    int pairs = 4;            ///< pairs of images at each exposure time
    int stack = 16;           ///< images of each stack for the fixed patterns
    double timeout_s = 10;    ///< longest wait for one frame
};

/// One exposure time: statistics of a pair of images, averaged over the pairs.
struct CameraLevel {
    double exposure_s = 0;
    sensors::emva1288::PairStatistics pair;
};

struct CameraSeries {
    std::string camera;                            ///< vendor, model, serial number
    int bits = 0;                                  ///< bit depth of the pixel format
    std::size_t width = 0;                         ///< columns of the images
    std::vector<CameraLevel> levels;               ///< in order of rising exposure time
    sensors::emva1288::ImageStack low{0}, half{0}; ///< at the shortest exposure and at half the longest
    double half_exposure_s = 0;
};

/// Takes the series in free run, with one acquisition per exposure time. The first frame of an acquisition is
/// discarded, because its exposure may have begun under old settings. The camera keeps the last settings.
/// Throws HardwareError.
[[nodiscard]] CameraSeries take_camera_series(const CameraSeriesSettings& settings);

} // namespace obscura::tools
