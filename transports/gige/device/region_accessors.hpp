// SPDX-License-Identifier: Apache-2.0
// Getters and setters for rows of the feature table that show a region, the image it is part of, or binning.
#pragma once

#include "transports/gige/device/accessors.hpp"
#include "transports/gige/device/region_binning.hpp"
#include "transports/gige/device/regions.hpp"

#include <algorithm>
#include <cstdint>

namespace obscura::transports::gige {

template<std::int32_t BinnedExtent::*member>
std::uint64_t get_columns(const Feature&, DeviceContext& d, std::uint32_t) {
    return value(binned_columns(d, d.binning).*member);
}
template<std::int32_t BinnedExtent::*member>
std::uint64_t get_rows(const Feature&, DeviceContext& d, std::uint32_t) {
    return value(binned_rows(d, d.binning).*member);
}

template<auto member>
std::uint64_t get_binning(const Feature&, DeviceContext& d, std::uint32_t) {
    return value(d.binning.*member);
}
template<auto member>
Status set_binning(const Feature& f, DeviceContext& d, std::uint32_t, std::uint32_t word) {
    Binning wanted = d.binning;
    decode(f, word, wanted.*member);
    return write_binning(d, wanted);
}

inline std::uint64_t get_height_max(const Feature&, DeviceContext& d, std::uint32_t) {
    if (!is_composed(d, 0)) return value(binned_rows(d, d.binning).maximum);
    return value(d.limits.rows_max > 0 ? d.limits.rows_max : d.limits.sensor_height);
}

/// Width, Height and offsets in binned pixels.
template<std::int32_t Region::*member, std::int32_t Binning::*binning>
std::uint64_t get_extent(const Feature&, DeviceContext& d, std::uint32_t i) {
    return value(region_read(d, i).*member / region_binning(d, i).*binning);
}
/// The extent as it is set, whatever image it is a part of and whatever the sensor makes of it.
template<std::int32_t Region::*member, std::int32_t Binning::*binning>
std::uint64_t get_own_extent(const Feature&, DeviceContext& d, std::uint32_t i) {
    return value(region_window(d, i).region.*member / region_binning(d, i).*binning);
}
template<std::int32_t Region::*member, std::int32_t Binning::*binning>
Status set_extent(const Feature&, DeviceContext& d, std::uint32_t i, std::uint32_t word) {
    CameraWindow w = region_window(d, i);
    const std::int64_t pixels = std::int64_t{word} * (region_binning(d, i).*binning);
    if (pixels > INT32_MAX) return Status::invalid_parameter;
    w.region.*member = static_cast<std::int32_t>(pixels);
    return write_region(d, i, w, d.regions[i].enabled);
}

/// Width and Height of the image, of which the region may be a part.
template<std::int32_t Region::*member, std::int32_t Binning::*binning, std::int32_t ImageSize::*of_image>
std::uint64_t get_size(const Feature& f, DeviceContext& d, std::uint32_t i) {
    return is_composed(d, i) ? value(image_size(d).*of_image) : get_extent<member, binning>(f, d, i);
}
template<std::int32_t Region::*member, std::int32_t Binning::*binning, std::int32_t ImageSize::*of_image>
Status set_size(const Feature& f, DeviceContext& d, std::uint32_t i, std::uint32_t word) {
    if (!is_composed(d, i)) return set_extent<member, binning>(f, d, i, word);
    // Clients write back what they have read.
    return word == value(image_size(d).*of_image) ? Status::success : Status::write_protect;
}

/// Largest Width or Height: that of a composed image, or what is left of the sensor from the offset on.
template<auto extent_of, std::int32_t Region::*offset, std::int32_t Binning::*binning,
         std::int32_t ImageSize::*of_image>
std::uint64_t get_size_room(const Feature&, DeviceContext& d, std::uint32_t i) {
    if (is_composed(d, i)) return value(image_size(d).*of_image);
    return value(extent_of(d, region_binning(d, i)).maximum -
                 region_read(d, i).*offset / region_binning(d, i).*binning);
}
/// Largest offset of the region itself.
template<auto extent_of, std::int32_t Region::*size, std::int32_t Binning::*binning>
std::uint64_t get_offset_room(const Feature&, DeviceContext& d, std::uint32_t i) {
    return value(extent_of(d, region_binning(d, i)).maximum -
                 region_read(d, i).*size / region_binning(d, i).*binning);
}
inline std::uint64_t get_composed(const Feature&, DeviceContext& d, std::uint32_t i) {
    return is_composed(d, i) ? 1 : 0;
}

inline std::uint64_t get_region_mode(const Feature&, DeviceContext& d, std::uint32_t i) {
    return i == 0 || d.regions[i].enabled ? 1 : 0;
}
inline Status set_region_mode(const Feature&, DeviceContext& d, std::uint32_t i, std::uint32_t word) {
    if (i == 0 && word == 0) return Status::invalid_parameter; // Region0 is always enabled
    return write_region(d, i, region_window(d, i), i > 0 && word == 1);
}

inline std::uint64_t get_region_exposure(const Feature& f, DeviceContext& d, std::uint32_t i) {
    return encode(f, region_window(d, i).exposure_ns);
}
inline Status set_region_exposure(const Feature& f, DeviceContext& d, std::uint32_t i, std::uint32_t word) {
    if (i == 0 && d.control.settings().exposure_auto != ExposureAuto::off) return Status::invalid_parameter;
    CameraWindow w = region_window(d, i);
    decode(f, word, w.exposure_ns);
    return write_region(d, i, w, d.regions[i].enabled);
}

inline std::uint64_t get_region_sampling(const Feature&, DeviceContext& d, std::uint32_t i) {
    return value(region_window(d, i).sampling);
}
inline Status set_region_sampling(const Feature& f, DeviceContext& d, std::uint32_t i, std::uint32_t word) {
    CameraWindow w = region_window(d, i);
    decode(f, word, w.sampling);
    // Set a number of reads that the sampling allows, as the client cannot write both at once.
    const SettingRange range = reads_range(w.sampling);
    w.reads = std::clamp(w.reads, static_cast<std::int32_t>(range.minimum),
                         static_cast<std::int32_t>(range.maximum));
    return write_region(d, i, w, d.regions[i].enabled);
}

inline std::uint64_t get_region_reads(const Feature&, DeviceContext& d, std::uint32_t i) {
    return value(region_window(d, i).reads);
}
inline Status set_region_reads(const Feature& f, DeviceContext& d, std::uint32_t i, std::uint32_t word) {
    CameraWindow w = region_window(d, i);
    decode(f, word, w.reads);
    return write_region(d, i, w, d.regions[i].enabled);
}

/// Value that the sensor obtains for a region.
template<auto member>
std::uint64_t get_obtained(const Feature& f, DeviceContext& d, std::uint32_t i) {
    return encode(f, region_obtained(d, i).*member);
}
template<std::int32_t Region::*member>
std::uint64_t get_obtained_extent(const Feature&, DeviceContext& d, std::uint32_t i) {
    return value(region_obtained(d, i).sensor.*member);
}

} // namespace obscura::transports::gige
