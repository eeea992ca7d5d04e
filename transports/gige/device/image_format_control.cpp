// SPDX-License-Identifier: Apache-2.0
// ImageFormatControl: sensor, regions, pixel format, binning.
#include "core/setting_ranges.hpp"
#include "transports/gige/device/accessors.hpp"
#include "transports/gige/device/region_binning.hpp"
#include "transports/gige/device/region_entries.hpp"
#include "transports/gige/device/regions.hpp"

#include <algorithm>
#include <array>

namespace obscura::transports::gige {
namespace {

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

std::uint64_t get_height_max(const Feature&, DeviceContext& d, std::uint32_t) {
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
std::uint64_t get_composed(const Feature&, DeviceContext& d, std::uint32_t i) {
    return is_composed(d, i) ? 1 : 0;
}

std::uint64_t get_region_mode(const Feature&, DeviceContext& d, std::uint32_t i) {
    return i == 0 || d.regions[i].enabled ? 1 : 0;
}
Status set_region_mode(const Feature&, DeviceContext& d, std::uint32_t i, std::uint32_t word) {
    if (i == 0 && word == 0) return Status::invalid_parameter; // Region0 is always enabled
    return write_region(d, i, region_window(d, i), i > 0 && word == 1);
}

std::uint64_t get_region_exposure(const Feature& f, DeviceContext& d, std::uint32_t i) {
    return encode(f, region_window(d, i).exposure_ns);
}
Status set_region_exposure(const Feature& f, DeviceContext& d, std::uint32_t i, std::uint32_t word) {
    if (word > INT32_MAX || (i == 0 && d.control.settings().exposure_auto != ExposureAuto::off))
        return Status::invalid_parameter;
    CameraWindow w = region_window(d, i);
    decode(f, word, w.exposure_ns);
    return write_region(d, i, w, d.regions[i].enabled);
}

std::uint64_t get_region_sampling(const Feature&, DeviceContext& d, std::uint32_t i) {
    return value(region_window(d, i).sampling);
}
Status set_region_sampling(const Feature& f, DeviceContext& d, std::uint32_t i, std::uint32_t word) {
    CameraWindow w = region_window(d, i);
    decode(f, word, w.sampling);
    // Set a number of reads that the sampling allows, as the client cannot write both at once.
    const SettingRange range = reads_range(w.sampling);
    w.reads = std::clamp(w.reads, range.minimum, range.maximum);
    return write_region(d, i, w, d.regions[i].enabled);
}

std::uint64_t get_region_reads(const Feature&, DeviceContext& d, std::uint32_t i) {
    return value(region_window(d, i).reads);
}
Status set_region_reads(const Feature& f, DeviceContext& d, std::uint32_t i, std::uint32_t word) {
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

constexpr std::array region_destination_entries{
    entry("Stream0", 0),
};

constexpr std::array region_sampling_entries{
    FeatureEntry{.name = "Destructive", .value = value(Sampling::destructive), .custom = true},
    FeatureEntry{.name = "NonDestructive", .value = value(Sampling::non_destructive), .custom = true},
    FeatureEntry{.name = "CorrelatedDouble", .value = value(Sampling::cds), .custom = true},
    FeatureEntry{.name = "Ramp", .value = value(Sampling::ramp), .custom = true},
};

constexpr std::array component_selector_entries{
    entry("Intensity", 1),
};

constexpr std::array pixel_format_entries{
    entry("Mono8", PixelFormat::mono8),     entry("Mono10", PixelFormat::mono10),
    entry("Mono12", PixelFormat::mono12),   entry("Mono14", PixelFormat::mono14),
    entry("Mono16", PixelFormat::mono16),   entry("Mono10p", PixelFormat::mono10p),
    entry("Mono12p", PixelFormat::mono12p),
};

constexpr std::array pixel_size_entries{
    entry("Bpp8", 8),
    entry("Bpp10", 10),
    entry("Bpp12", 12),
    entry("Bpp16", 16),
};

constexpr std::array test_pattern_entries{
    entry("Off", ImagePattern::off),
    entry("Black", ImagePattern::black),
    entry("White", ImagePattern::white),
    entry("GreyHorizontalRamp", ImagePattern::horizontal_ramp),
    entry("GreyVerticalRamp", ImagePattern::vertical_ramp),
    entry("GreyHorizontalRampMoving", ImagePattern::horizontal_ramp_moving),
    entry("GreyVerticalRampMoving", ImagePattern::vertical_ramp_moving),
    entry("FrameCounter", ImagePattern::frame_counter),
};

constexpr std::array binning_modes{
    entry("Sum", BinningMode::sum),
    entry("Average", BinningMode::average),
};

constexpr std::array sensor_shutter_mode_entries{
    entry("Global", 0),
    entry("Rolling", 1),
};

/// A pitch in the feature's unit, um.
template<auto member>
std::uint64_t get_pitch(const Feature& f, DeviceContext& d, std::uint32_t /*index*/) {
    return encode(f, 1e6 * (d.limits.*member));
}

constexpr std::array features{
    Feature{.name = "SensorWidth",
            .access = Access::read_only,
            .address = 0xA000,
            .cached = true,
            .get = get_limit<&CameraLimits::sensor_width>,
            .foreign = {.bound = true}},
    Feature{.name = "SensorHeight",
            .access = Access::read_only,
            .address = 0xA004,
            .cached = true,
            .get = get_limit<&CameraLimits::sensor_height>,
            .foreign = {.bound = true}},
    Feature{.name = "SensorPixelWidth",
            .type = FeatureType::floating,
            .visibility = Visibility::expert,
            .tooltip = "Pitch of the columns of the sensor, before binning",
            .access = Access::read_only,
            .address = 0xA024,
            .cached = true,
            .unit = "um",
            .scale = 1000,
            .get = get_pitch<&CameraLimits::pixel_width_m>,
            .foreign = {.bound = true}},
    Feature{.name = "SensorPixelHeight",
            .type = FeatureType::floating,
            .visibility = Visibility::expert,
            .tooltip = "Pitch of the rows of the sensor, before binning",
            .access = Access::read_only,
            .address = 0xA028,
            .cached = true,
            .unit = "um",
            .scale = 1000,
            .get = get_pitch<&CameraLimits::pixel_height_m>,
            .foreign = {.bound = true}},
    Feature{.name = "WidthMax",
            .access = Access::read_only,
            .address = 0xA054,
            .get = get_columns<&BinnedExtent::maximum>,
            .foreign = {.bound = true, .rank = -2}},
    Feature{.name = "HeightMax",
            .access = Access::read_only,
            .address = 0xA058,
            .get = get_height_max,
            .foreign = {.bound = true, .rank = -2}},
    Feature{.name = "RegionSelector",
            .type = FeatureType::enumeration,
            .entries = region_entries,
            .entries_below = "RegionsMax"},
    Feature{.name = "RegionMode",
            .type = FeatureType::enumeration,
            .address = 0xB010,
            .selectors = {"RegionSelector"},
            .stride = 64,
            .entries = off_on,
            .lock = FeatureLock::streaming,
            .locked_by = "LockedOrBinned",
            .get = get_region_mode,
            .set = set_region_mode},
    Feature{.name = "RegionIDValue",
            .access = Access::read_only,
            .value_of = "RegionSelector",
            .selectors = {"RegionSelector"}},
    Feature{.name = "RegionDestination",
            .type = FeatureType::enumeration,
            .access = Access::read_only,
            .selectors = {"RegionSelector"},
            .entries = region_destination_entries},
    Feature{.name = "Width",
            .tooltip =
                "Of the image that is sent; read-only while several windows or reads make up one image",
            .address = 0xB000,
            .selectors = {"RegionSelector"},
            .stride = 64,
            .minimum = in_changing_register(0xA008, get_columns<&BinnedExtent::minimum>),
            .maximum = held_by("WidthRoom"),
            .increment = in_changing_register(0xA00C, get_columns<&BinnedExtent::step>),
            .lock = FeatureLock::streaming,
            .locked_by = "LockedOrComposed",
            .get = get_size<&Region::width, &Binning::horizontal, &ImageSize::width>,
            .set = set_size<&Region::width, &Binning::horizontal, &ImageSize::width>,
            .kept = get_own_extent<&Region::width, &Binning::horizontal>,
            .foreign = {.bound = true}},
    Feature{.name = "Height",
            .tooltip =
                "Of the image that is sent; read-only while several windows or reads make up one image",
            .address = 0xB004,
            .selectors = {"RegionSelector"},
            .stride = 64,
            .minimum = in_changing_register(0xA010, get_rows<&BinnedExtent::minimum>),
            .maximum = held_by("HeightRoom"),
            .increment = in_changing_register(0xA014, get_rows<&BinnedExtent::step>),
            .lock = FeatureLock::streaming,
            .locked_by = "LockedOrComposed",
            .get = get_size<&Region::height, &Binning::vertical, &ImageSize::height>,
            .set = set_size<&Region::height, &Binning::vertical, &ImageSize::height>,
            .kept = get_own_extent<&Region::height, &Binning::vertical>,
            .foreign = {.bound = true}},
    Feature{.name = "OffsetX",
            .address = 0xB008,
            .selectors = {"RegionSelector"},
            .stride = 64,
            .minimum = fixed(0),
            .maximum = held_by("OffsetXRoom"),
            .increment = held_by("WidthStep"),
            .get = get_extent<&Region::x, &Binning::horizontal>,
            .set = set_extent<&Region::x, &Binning::horizontal>,
            .kept = get_own_extent<&Region::x, &Binning::horizontal>,
            .foreign = {.bound = true, .rank = -1}},
    Feature{.name = "OffsetY",
            .address = 0xB00C,
            .selectors = {"RegionSelector"},
            .stride = 64,
            .minimum = fixed(0),
            .maximum = held_by("OffsetYRoom"),
            .increment = held_by("HeightStep"),
            .get = get_extent<&Region::y, &Binning::vertical>,
            .set = set_extent<&Region::y, &Binning::vertical>,
            .kept = get_own_extent<&Region::y, &Binning::vertical>,
            .foreign = {.bound = true, .rank = -1}},
    Feature{.name = "RegionExposureTime",
            .type = FeatureType::floating,
            .custom = true,
            .tooltip = "Integration time of the window; that of Region0 is ExposureTime",
            .address = 0xB014,
            .selectors = {"RegionSelector"},
            .stride = 64,
            .unit = "us",
            .scale = 100,
            .minimum = held_by("ExposureTimeMin"),
            .maximum = held_by("ExposureTimeMax"),
            .get = get_region_exposure,
            .set = set_region_exposure},
    Feature{.name = "RegionSampling",
            .type = FeatureType::enumeration,
            .custom = true,
            .tooltip = "How the charge is read; NonDestructive delivers every read",
            .address = 0xB018,
            .selectors = {"RegionSelector"},
            .stride = 64,
            .entries = region_sampling_entries,
            .lock = FeatureLock::streaming,
            .get = get_region_sampling,
            .set = set_region_sampling},
    Feature{.name = "RegionReads",
            .custom = true,
            .address = 0xB01C,
            .selectors = {"RegionSelector"},
            .stride = 64,
            .minimum = fixed(any_reads_range.minimum),
            .maximum = fixed(any_reads_range.maximum),
            .lock = FeatureLock::streaming,
            .get = get_region_reads,
            .set = set_region_reads},
    Feature{.name = "RegionExposureTimeMin",
            .type = FeatureType::floating,
            .custom = true,
            .tooltip = "Shortest exposure obtained over the rows; 0 when the region is off",
            .access = Access::read_only,
            .address = 0xB020,
            .selectors = {"RegionSelector"},
            .stride = 64,
            .unit = "us",
            .scale = 100,
            .get = get_obtained<&FrameWindow::exposure_min_ns>},
    Feature{.name = "RegionExposureTimeMax",
            .type = FeatureType::floating,
            .custom = true,
            .tooltip = "Longest exposure obtained over the rows; 0 when the region is off",
            .access = Access::read_only,
            .address = 0xB024,
            .selectors = {"RegionSelector"},
            .stride = 64,
            .unit = "us",
            .scale = 100,
            .get = get_obtained<&FrameWindow::exposure_max_ns>},
    Feature{.name = "RegionFlags",
            .custom = true,
            .tooltip = "1, 2 exposure clamped, 4 rows shared, 8 quantised, 16 cropped, 32 trigger deferred, "
                       "64 settings changed",
            .access = Access::read_only,
            .address = 0xB028,
            .selectors = {"RegionSelector"},
            .stride = 64,
            .get = get_obtained<&FrameWindow::flags>},
    Feature{.name = "RegionObtainedX",
            .custom = true,
            .access = Access::read_only,
            .address = 0xB02C,
            .selectors = {"RegionSelector"},
            .stride = 64,
            .get = get_obtained_extent<&Region::x>},
    Feature{.name = "RegionObtainedY",
            .custom = true,
            .access = Access::read_only,
            .address = 0xB030,
            .selectors = {"RegionSelector"},
            .stride = 64,
            .get = get_obtained_extent<&Region::y>},
    Feature{.name = "RegionObtainedWidth",
            .custom = true,
            .access = Access::read_only,
            .address = 0xB034,
            .selectors = {"RegionSelector"},
            .stride = 64,
            .get = get_obtained_extent<&Region::width>},
    Feature{.name = "RegionObtainedHeight",
            .custom = true,
            .access = Access::read_only,
            .address = 0xB038,
            .selectors = {"RegionSelector"},
            .stride = 64,
            .get = get_obtained_extent<&Region::height>},
    Feature{.name = "RegionImageY",
            .custom = true,
            .access = Access::read_only,
            .address = 0xB03C,
            .selectors = {"RegionSelector"},
            .stride = 64,
            .get = get_obtained<&FrameWindow::image_y>},
    Feature{.name = "RegionsMax",
            .custom = true,
            .tooltip = "Windows that the sensor reads at once",
            .access = Access::read_only,
            .address = 0xA048,
            .cached = true,
            .get = [](const Feature&, DeviceContext& d, std::uint32_t) -> std::uint64_t {
                return region_count(d);
            }},
    Feature{
        .name = "ComponentSelector", .type = FeatureType::enumeration, .entries = component_selector_entries},
    Feature{.name = "ComponentEnable",
            .type = FeatureType::boolean,
            .access = Access::read_only,
            .value_of = "One",
            .selectors = {"ComponentSelector"}},
    Feature{.name = "ComponentIDValue",
            .access = Access::read_only,
            .value_of = "One",
            .selectors = {"ComponentSelector"}},
    Feature{.name = "PixelFormat",
            .type = FeatureType::enumeration,
            .address = 0xA030,
            .entries = pixel_format_entries,
            .lock = FeatureLock::streaming,
            .get = get_setting<&CameraSettings::pixel_format>,
            .set = set_setting<&CameraSettings::pixel_format>,
            .foreign = {.bound = true}},
    Feature{.name = "PixelSize",
            .type = FeatureType::enumeration,
            .visibility = Visibility::expert,
            .access = Access::read_only,
            .value_of = "PixelSizeValue",
            .entries = pixel_size_entries},
    Feature{.name = "PixelDynamicRangeMax",
            .type = FeatureType::formula,
            .visibility = Visibility::expert,
            .tooltip =
                "Largest digital number the converter makes; formats with fewer bits drop the low ones",
            .formula = "(1<<BITS)-1",
            .variables = {{{"BITS", "AdcBitsReg"}}}},
    Feature{.name = "TestPattern",
            .type = FeatureType::enumeration,
            .address = 0xA038,
            .entries = test_pattern_entries,
            .get = get_setting<&CameraSettings::test_pattern>,
            .set = set_setting<&CameraSettings::test_pattern>,
            .foreign = {.bound = true, .other_names = {"TestImageSelector"}}},
    Feature{.name = "BinningHorizontal",
            .visibility = Visibility::expert,
            .tooltip = "1, 2 or 4, of one region; not in multi-part payload",
            .address = 0xA03C,
            .minimum = fixed(1),
            .maximum = fixed(4),
            .lock = FeatureLock::streaming,
            .locked_by = "LockedOrMultiPart",
            .get = get_binning<&Binning::horizontal>,
            .set = set_binning<&Binning::horizontal>,
            .foreign = {.bound = true, .rank = -3}},
    Feature{.name = "BinningHorizontalMode",
            .type = FeatureType::enumeration,
            .visibility = Visibility::expert,
            .tooltip = "Sum stops at the largest number of the pixel format, Average rounds half up",
            .address = 0xA04C,
            .entries = binning_modes,
            .lock = FeatureLock::streaming,
            .get = get_binning<&Binning::horizontal_mode>,
            .set = set_binning<&Binning::horizontal_mode>,
            .foreign = {.bound = true, .rank = -3}},
    Feature{.name = "BinningVertical",
            .visibility = Visibility::expert,
            .tooltip = "1, 2 or 4, of one region; not in multi-part payload",
            .address = 0xA040,
            .minimum = fixed(1),
            .maximum = fixed(4),
            .lock = FeatureLock::streaming,
            .locked_by = "LockedOrMultiPart",
            .get = get_binning<&Binning::vertical>,
            .set = set_binning<&Binning::vertical>,
            .foreign = {.bound = true, .rank = -3}},
    Feature{.name = "BinningVerticalMode",
            .type = FeatureType::enumeration,
            .visibility = Visibility::expert,
            .tooltip = "Sum stops at the largest number of the pixel format, Average rounds half up",
            .address = 0xA050,
            .entries = binning_modes,
            .lock = FeatureLock::streaming,
            .get = get_binning<&Binning::vertical_mode>,
            .set = set_binning<&Binning::vertical_mode>,
            .foreign = {.bound = true, .rank = -3}},
    Feature{.name = "SensorShutterMode",
            .type = FeatureType::enumeration,
            .access = Access::read_only,
            .address = 0xA044,
            .cached = true,
            .entries = sensor_shutter_mode_entries,
            .get = [](const Feature&, DeviceContext& d, std::uint32_t) -> std::uint64_t {
                return d.limits.global_shutter ? 0 : 1;
            }},
    Feature{.name = "SensorType",
            .type = FeatureType::string,
            .custom = true,
            .tooltip = "The sensor description in use",
            .access = Access::read_only,
            .address = 0xA060,
            .bytes = 32,
            .text = [](const DeviceContext& d) { return d.limits.sensor_name; }},
    Feature{.name = "AdcBitsReg",
            .listed = false,
            .access = Access::read_only,
            .address = 0xA018,
            .cached = true,
            .get = get_limit<&CameraLimits::adc_bits>},
    Feature{.name = "LockedOrBinned",
            .type = FeatureType::formula,
            .listed = false,
            .formula = "(LOCKED>0)||(X>1)||(Y>1)",
            .variables = {{{"LOCKED", "TLParamsLocked"},
                           {"X", "BinningHorizontal"},
                           {"Y", "BinningVertical"}}}},
    Feature{.name = "LockedOrMultiPart",
            .type = FeatureType::formula,
            .listed = false,
            .formula = "(LOCKED>0)||(PARTS>0)",
            .variables = {{{"LOCKED", "TLParamsLocked"}, {"PARTS", "GevSCCFGMultiPart"}}}},
    Feature{.name = "LockedOrComposed",
            .type = FeatureType::formula,
            .listed = false,
            .formula = "(LOCKED>0)||(COMPOSED>0)",
            .variables = {{{"LOCKED", "TLParamsLocked"}, {"COMPOSED", "RegionComposed"}}}},
    Feature{.name = "RegionComposed",
            .listed = false,
            .access = Access::read_only,
            .address = 0xB800,
            .selectors = {"RegionSelector"},
            .stride = 32,
            .get = get_composed},
    Feature{.name = "WidthRoom",
            .listed = false,
            .access = Access::read_only,
            .address = 0xB804,
            .selectors = {"RegionSelector"},
            .stride = 32,
            .get = get_size_room<binned_columns, &Region::x, &Binning::horizontal, &ImageSize::width>},
    Feature{.name = "HeightRoom",
            .listed = false,
            .access = Access::read_only,
            .address = 0xB808,
            .selectors = {"RegionSelector"},
            .stride = 32,
            .get = get_size_room<binned_rows, &Region::y, &Binning::vertical, &ImageSize::height>},
    Feature{.name = "OffsetXRoom",
            .listed = false,
            .access = Access::read_only,
            .address = 0xB80C,
            .selectors = {"RegionSelector"},
            .stride = 32,
            .get = get_offset_room<binned_columns, &Region::width, &Binning::horizontal>},
    Feature{.name = "OffsetYRoom",
            .listed = false,
            .access = Access::read_only,
            .address = 0xB810,
            .selectors = {"RegionSelector"},
            .stride = 32,
            .get = get_offset_room<binned_rows, &Region::height, &Binning::vertical>},
    Feature{.name = "One", .listed = false, .constant = 1},
    Feature{.name = "PixelSizeValue",
            .type = FeatureType::formula,
            .listed = false,
            .formula = "(PFNC>>16)&255",
            .variables = {{{"PFNC", "PixelFormat"}}}},
};

} // namespace

FeatureCategory image_format_control() {
    return {.name = "ImageFormatControl", .features = features};
}

} // namespace obscura::transports::gige
