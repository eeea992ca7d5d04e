#include "transports/gige/device/device.hpp"

#include "transports/gige/device/device_words.hpp"
#include "transports/gige/genicam/camera_xml.hpp"
#include "transports/gige/registers/features.hpp"
#include "transports/gige/wire/bytes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace obscura::transports::gige {
namespace {

// GevSCPSPacketSize: the smallest IP datagram every host must take, and the largest we offer.
constexpr std::uint32_t packet_size_min = 576;
constexpr std::uint32_t packet_size_limit = 16'384;
constexpr std::uint32_t action_group_count = 1;
constexpr std::int64_t stop_patience_ns = 2 * ns_per_s;

constexpr std::array pixel_formats{PixelFormat::mono8,  PixelFormat::mono10, PixelFormat::mono12,
                                   PixelFormat::mono14, PixelFormat::mono16, PixelFormat::mono10p,
                                   PixelFormat::mono12p};

/// DeviceVersion.
constexpr const char* device_version = "0.1.0";

constexpr bool is_multicast(std::uint32_t ip) {
    return ip >> 28 == 0xE;
}

} // namespace

Device::Device(const GigeSettings& settings, const NetworkInterface& network, CameraControl& control,
               StreamPort& stream, MessageChannel& messages, const Clock& clock, std::uint64_t seed)
    : settings_(settings),
      seed_(seed),
      network_(network),
      control_(control),
      stream_(stream),
      messages_(messages),
      clock_(clock),
      limits_(control.limits()),
      packet_size_max_(std::max(packet_size_min, std::min(network.mtu, packet_size_limit) / 4 * 4)) {
    bank_.set_lock([this] { return control_.acquiring(); });
    add_identity();
    add_network();
    add_capabilities();
    add_timestamps();
    add_stream();
    add_actions();
    add_image_format();
    add_image_extras();
    add_binning();
    add_regions();
    add_acquisition();
    add_digital_io();
    add_counters();
    add_timers();
    add_sequencer();
    add_statistics();
    add_chunks();
    add_messages();
    add_faults();
    add_user_sets();
    add_ptp();
    add_xml();
    default_set_ = saved_features();
    read_state_file();
    publish_faults();
}

void Device::constant(std::string_view name, std::uint32_t address, std::uint32_t value) {
    bank_.add({.name = name, .address = address, .reset = value});
}

void Device::setting(std::string_view name, std::uint32_t address, bool locked,
                     std::function<std::uint32_t(const CameraSettings&)> get,
                     std::function<bool(CameraSettings&, std::uint32_t)> set) {
    bank_.add({.name = name,
               .address = address,
               .access = Access::read_write,
               .locked_while_streaming = locked,
               .read = [this, get = std::move(get)] { return get(control_.settings()); },
               .write =
                   [this, set = std::move(set)](std::uint32_t value) {
                       CameraSettings wanted = control_.settings();
                       if (!set(wanted, value) || !control_.explain(wanted).empty())
                           return Status::invalid_parameter;
                       return control_.apply(wanted) ? Status::success : Status::invalid_parameter;
                   }});
}

void Device::word(std::string_view name, std::uint32_t address, std::uint32_t maximum,
                  std::function<std::uint32_t()> get, std::function<void(std::uint32_t)> set) {
    Register r{.name = name, .address = address, .maximum = maximum, .read = std::move(get)};
    if (set) {
        r.access = Access::read_write;
        r.write = [set = std::move(set)](std::uint32_t value) {
            set(value);
            return Status::success;
        };
    }
    bank_.add(std::move(r));
}

void Device::command(std::string_view name, std::uint32_t address, std::function<Status()> run) {
    bank_.add({.name = name,
               .address = address,
               .access = Access::write_only,
               .write = [run = std::move(run)](std::uint32_t value) {
                   return value == 1 ? run() : Status::invalid_parameter;
               }});
}

void Device::add_identity() {
    constant("Version", reg::version, 0x00020000);
    constant("DeviceMode", reg::device_mode, device_mode::big_endian | device_mode::utf_8);
    bank_.add_string("DeviceVendorName", reg::manufacturer, 32, Access::read_only, settings_.vendor);
    bank_.add_string("DeviceModelName", reg::model, 32, Access::read_only, settings_.model);
    bank_.add_string("DeviceVersion", reg::device_version, 32, Access::read_only, device_version);
    bank_.add_string("DeviceManufacturerInfo", reg::manufacturer_info, 48, Access::read_only,
                     "Camera emulator");
    bank_.add_string("DeviceSerialNumber", reg::serial, 16, Access::read_only, settings_.serial);
    bank_.add_string("DeviceUserID", reg::user_name, 16, Access::read_write, settings_.user_name).written =
        [this] { write_state_file(); };
}

void Device::add_network() {
    constant("MACHigh", reg::mac_high, static_cast<std::uint32_t>(network_.mac >> 32));
    constant("MACLow", reg::mac_low, static_cast<std::uint32_t>(network_.mac));
    // The host's own configuration decides; to GVCP that looks like a persistent address.
    constexpr std::uint32_t host_decides = ip_configuration::link_local | ip_configuration::persistent;
    constant("IPOptions", reg::ip_options, host_decides);
    constant("IPCurrent", reg::ip_current, host_decides);
    const auto words = [this](std::uint32_t from, std::uint32_t to) {
        for (std::uint32_t a = from; a < to; a += 4)
            constant("Reserved", a, 0);
    };
    words(0x18, reg::current_ip);
    constant("CurrentIPAddress", reg::current_ip, network_.address);
    words(0x28, reg::current_mask);
    constant("CurrentSubnetMask", reg::current_mask, network_.mask);
    words(0x38, reg::current_gateway);
    constant("CurrentDefaultGateway", reg::current_gateway, 0);
    constant("InterfaceCount", reg::interface_count, 1);
    words(0x640, reg::persistent_ip);
    constant("PersistentIPAddress", reg::persistent_ip, network_.address);
    words(0x650, reg::persistent_mask);
    constant("PersistentSubnetMask", reg::persistent_mask, network_.mask);
    words(0x660, reg::persistent_gateway);
    constant("PersistentDefaultGateway", reg::persistent_gateway, 0);
    constant("LinkSpeed", reg::link_speed, network_.speed_mbit_s);
}

void Device::add_capabilities() {
    constant("MessageChannelCount", reg::message_channels, 1);
    constant("StreamChannelCount", reg::stream_channels, 1);
    constant("ActionSignalCount", reg::action_signals, action_group_count);
    constant("ActiveLinkCount", reg::active_links, 1);
    constant("StreamCapability", reg::gvsp_capability,
             gvsp_capability::source_port | gvsp_capability::short_block_ids);
    constant("MessageCapability", reg::message_capability, message_capability::source_port);
    bank_.add({.name = "GVCPCapability", .address = reg::gvcp_capability, .read = [this] {
                   using namespace gvcp_capability;
                   constexpr std::uint32_t always = user_name | serial_number | link_speed |
                                                    primary_application | status_codes_1_1 | switchover |
                                                    unconditional_action | status_codes_2_0 |
                                                    scheduled_action | gvcp_capability::action | pending_ack |
                                                    event | packet_resend | write_memory | concatenation;
                   return always | (ptp_ ? ieee1588 | ieee1588_extended : 0U);
               }});
    bank_.add({.name = "GevTimestampTickFrequencyHigh", .address = reg::tick_frequency_high});
    constant("GevTimestampTickFrequency", reg::tick_frequency_low, 1'000'000'000);
    constant("DiscoveryAckDelay", reg::discovery_ack_delay, 0);
    bank_.add({.name = "GVCPConfiguration",
               .address = reg::gvcp_configuration,
               .access = Access::read_write,
               .reset = gvcp_configuration::pending_ack | gvcp_configuration::status_codes_1_1 |
                        gvcp_configuration::status_codes_2_0,
               .read =
                   [this] {
                       return bank_.peek(reg::gvcp_configuration) |
                              (ptp_ ? gvcp_configuration::ieee1588 : 0U);
                   },
               .write =
                   [this](std::uint32_t value) {
                       using namespace gvcp_configuration;
                       constexpr std::uint32_t choices =
                           pending_ack | status_codes_1_1 | unconditional_action | status_codes_2_0;
                       // The clock is steered from outside: PTP is on or off as the configuration says.
                       const std::uint32_t ptp = ptp_ ? ieee1588 : 0U;
                       if ((value & ~choices) != ptp) return Status::invalid_parameter;
                       bank_.poke(reg::gvcp_configuration, value);
                       return Status::success;
                   }});
    constant("PhysicalLinkCapability", reg::link_capability, link_capability::single_link);
    constant("PhysicalLinkConfiguration", reg::link_configuration, 0); // single link

    constant("ScheduledActionQueueSize", reg::action_queue_size, action_queue_size);
    constant("PendingTimeout", reg::pending_timeout, 1000);
    bank_.add({.name = "GevGVSPExtendedIDMode",
               .address = reg::gvsp_configuration,
               .access = Access::read_write,
               .locked_while_streaming = true,
               .write = [this](std::uint32_t value) {
                   if ((value & ~gvsp_configuration::extended_ids) != 0) return Status::invalid_parameter;
                   bank_.poke(reg::gvsp_configuration, value);
                   return Status::success;
               }});
    constant("ManifestTable", reg::manifest, 0);
}

void Device::add_timestamps() {
    bank_.add({.name = "GevTimestampControl",
               .address = reg::timestamp_control,
               .access = Access::write_only,
               .write = [this](std::uint32_t value) {
                   using namespace timestamp_control;
                   if (value == 0 || (value & ~(reset | latch)) != 0) return Status::invalid_parameter;
                   if ((value & reset) != 0 && control_.acquiring()) return Status::write_protect;
                   const Time now = clock_.now();
                   if ((value & latch) != 0) timestamp_latched_ = device_time(now);
                   if ((value & reset) != 0) timestamp_origin_ns_ = now.ns + clock_.tai_offset_ns();
                   return Status::success;
               }});
    bank_.add({.name = "GevTimestampValueHigh", .address = reg::timestamp_high, .read = [this] {
                   return static_cast<std::uint32_t>(timestamp_latched_ >> 32);
               }});
    bank_.add({.name = "GevTimestampValueLow", .address = reg::timestamp_low, .read = [this] {
                   return static_cast<std::uint32_t>(timestamp_latched_);
               }});
}

void Device::add_stream() {
    bank_.add({.name = "GevSCPHostPort",
               .address = reg::stream_port,
               .access = Access::read_write,
               .write = [this](std::uint32_t value) { return write_stream_port(value); }});
    const auto initial =
        std::clamp(static_cast<std::uint32_t>(settings_.packet_size), packet_size_min, packet_size_max_);
    bank_.add({.name = "GevSCPSPacketSize",
               .address = reg::stream_packet_size,
               .access = Access::read_write,
               .reset = scps::do_not_fragment | initial / 4 * 4,
               .write = [this](std::uint32_t value) { return write_packet_size(value); }});
    // 1 s per packet is the longest gap with any sense in it.
    bank_.add({.name = "GevSCPD",
               .address = reg::stream_packet_delay,
               .access = Access::read_write,
               .locked_while_streaming = true,
               .maximum = static_cast<std::uint32_t>(ns_per_s)});
    for (std::uint32_t a = 0xD0C; a < reg::stream_destination; a += 4)
        constant("Reserved", a, 0);
    bank_.add({.name = "GevSCDA",
               .address = reg::stream_destination,
               .access = Access::read_write,
               .locked_while_streaming = true,
               .write = [this](std::uint32_t ip) {
                   if (check_destination(ip) != Status::success) return Status::invalid_parameter;
                   bank_.poke(reg::stream_destination, ip);
                   return Status::success;
               }});
    bank_.add({.name = "GevSCSP", .address = reg::stream_source_port, .read = [this] {
                   return std::uint32_t{stream_.source_port()};
               }});
    constant("GevSCC", reg::stream_capability, sccfg::multipart | sccfg::chunk_in_image);
    bank_.add({.name = "GevSCCFG",
               .address = reg::stream_configuration,
               .access = Access::read_write,
               .locked_while_streaming = true,
               .reset = sccfg::chunk_in_image,
               .write = [this](std::uint32_t value) {
                   if ((value & ~(sccfg::multipart | sccfg::chunk_in_image)) != 0)
                       return Status::invalid_parameter;
                   if ((value & sccfg::multipart) != 0 && binning_.active()) return Status::write_protect;
                   bank_.poke(reg::stream_configuration, value);
                   return Status::success;
               }});
    const double limit = settings_.throughput_limit_mbit_s * 1e6 / 8;
    bank_.add({.name = "DeviceLinkThroughputLimit",
               .address = feature::throughput_limit,
               .access = Access::read_write,
               .locked_while_streaming = true,
               .reset = static_cast<std::uint32_t>(std::clamp(limit > 0 ? limit : 125e6, 1e6, 4e9)),
               .minimum = 1'000'000,
               .maximum = 4'000'000'000});
    bank_.add({.name = "DeviceLinkThroughputLimitMode",
               .address = feature::throughput_limit_mode,
               .access = Access::read_write,
               .locked_while_streaming = true,
               .reset = limit > 0,
               .maximum = 1});
    constant("PacketSizeMax", feature::packet_size_max, packet_size_max_);
}

void Device::add_actions() {
    bank_.add({.name = "ActionDeviceKey", .address = reg::action_device_key, .access = Access::read_write});
    for (std::uint32_t i = 0; i < action_group_count; ++i) {
        const std::uint32_t base = reg::action_groups + 16 * i;
        bank_.add({.name = "ActionGroupKey", .address = base, .access = Access::read_write});
        bank_.add({.name = "ActionGroupMask", .address = base + 4, .access = Access::read_write});
    }
}

void Device::add_image_format() {
    constant("SensorWidth", feature::sensor_width, static_cast<std::uint32_t>(limits_.sensor_width));
    constant("SensorHeight", feature::sensor_height, static_cast<std::uint32_t>(limits_.sensor_height));
    constant("AdcBits", feature::adc_bits, static_cast<std::uint32_t>(limits_.adc_bits));

    setting(
        "PixelFormat", feature::pixel_format, true,
        [](const CameraSettings& s) { return static_cast<std::uint32_t>(s.pixel_format); },
        [](CameraSettings& s, std::uint32_t value) {
            s.pixel_format = static_cast<PixelFormat>(value);
            return std::find(pixel_formats.begin(), pixel_formats.end(), s.pixel_format) !=
                   pixel_formats.end();
        });
    bank_.add({.name = "PayloadSize", .address = feature::payload_size, .read = [this] {
                   const CameraSettings s = control_.settings();
                   const ImageSize whole = composed_size(s);
                   const Region size = binning_.of({0, 0, whole.width, whole.height});
                   const bool multipart = (bank_.peek(reg::stream_configuration) & sccfg::multipart) != 0;
                   return static_cast<std::uint32_t>(
                       payload_size(s.pixel_format, size.area(), size.height, multipart, chunk_selection()));
               }});
}

void Device::add_image_extras() {
    setting(
        "TestPattern", feature::test_pattern, false,
        [](const CameraSettings& s) { return static_cast<std::uint32_t>(s.test_pattern); },
        [](CameraSettings& s, std::uint32_t value) {
            s.test_pattern = static_cast<ImagePattern>(value);
            return value < image_pattern_count;
        });
    constant("SensorShutterMode", feature::shutter_mode, limits_.global_shutter ? 0 : 1);
    bank_.add_string("SensorType", feature::sensor_name, 32, Access::read_only, limits_.sensor_name);
}

const ReadoutAnswer& Device::readout_answer() {
    const CameraSettings s = control_.settings();
    if (!answered_ || s != answered_settings_) {
        answer_ = control_.readout(s);
        answered_settings_ = s;
        answered_ = true;
    }
    return answer_;
}

void Device::add_acquisition() {
    setting(
        "AcquisitionMode", feature::acquisition_mode, true,
        [](const CameraSettings& s) { return static_cast<std::uint32_t>(s.acquisition_mode); },
        [](CameraSettings& s, std::uint32_t value) {
            s.acquisition_mode = static_cast<AcquisitionMode>(value);
            return value <= static_cast<std::uint32_t>(AcquisitionMode::multi_frame);
        });
    command("AcquisitionStart", feature::acquisition_start, [this] { return acquisition_start(); });
    command("AcquisitionStop", feature::acquisition_stop, [this] { return acquisition_stop(); });
    command("DeviceReset", feature::device_reset, [this] {
        acquisition_stop();
        return load_features(default_set_);
    });
    command("AcquisitionAbort", feature::acquisition_abort, [this] { return acquisition_stop(); });
    setting(
        "AcquisitionFrameCount", feature::acquisition_frame_count, true,
        [](const CameraSettings& s) { return s.acquisition_frame_count; },
        [](CameraSettings& s, std::uint32_t value) {
            s.acquisition_frame_count = value;
            return true;
        });
    setting(
        "AcquisitionFrameRate", feature::frame_rate, false,
        [](const CameraSettings& s) { return milli(s.frame_rate_hz); },
        [](CameraSettings& s, std::uint32_t value) {
            s.frame_rate_hz = from_milli(value);
            return true;
        });
    setting(
        "AcquisitionFrameRateEnable", feature::frame_rate_enable, false,
        [](const CameraSettings& s) { return std::uint32_t{s.frame_rate_enabled}; },
        [](CameraSettings& s, std::uint32_t value) {
            s.frame_rate_enabled = value == 1;
            return value <= 1;
        });
    word("ResultingFrameRate", feature::resulting_frame_rate, 0, [this] {
        const std::int64_t period_ns = readout_answer().frame_period_ns;
        return period_ns > 0 ? milli(std::min(1e9 / static_cast<double>(period_ns), 2e6)) : 0U;
    });
    word("SensorReadoutTime", feature::readout_time, 0,
         [this] { return time_units(readout_answer().readout_ns); });
    constant("AcquisitionFrameRateMin", feature::frame_rate_min, milli(limits_.frame_rate_min_hz));
    constant("AcquisitionFrameRateMax", feature::frame_rate_max, milli(limits_.frame_rate_max_hz));
    bank_.add({.name = "Acquiring", .address = feature::acquiring, .read = [this] {
                   // One bit for each AcquisitionStatusSelector.
                   const CameraActivity a = control_.activity();
                   const bool acquiring = control_.acquiring();
                   return (acquiring ? 1U : 0U) | (acquiring && a.start_awaited ? 2U : 0U) |
                          (acquiring && a.trigger_ready ? 4U : 0U);
               }});
    setting(
        "TriggerDelay", feature::trigger_delay, false,
        [](const CameraSettings& s) { return time_units(s.trigger_delay_ns); },
        [](CameraSettings& s, std::uint32_t value) {
            s.trigger_delay_ns = std::int64_t{value} * feature::time_unit_ns;
            return true;
        });
    setting(
        "TriggerDivider", feature::trigger_divider, false,
        [](const CameraSettings& s) { return s.trigger_divider; },
        [](CameraSettings& s, std::uint32_t value) {
            s.trigger_divider = value;
            return value <= 1'000'000;
        });
    std::uint32_t line_edges = 0;
    for (std::size_t i = 0; i < line_count; ++i)
        line_edges |= ((limits_.lines[i].rising ? 1U : 0U) | (limits_.lines[i].falling ? 2U : 0U)) << (2 * i);
    constant("LineEdges", feature::line_edges, line_edges);
    add_triggers();
    setting(
        "TriggerOverlap", feature::trigger_overlap, false,
        [](const CameraSettings& s) { return static_cast<std::uint32_t>(s.trigger_overlap); },
        [](CameraSettings& s, std::uint32_t value) {
            s.trigger_overlap = static_cast<TriggerOverlap>(value);
            return value <= static_cast<std::uint32_t>(TriggerOverlap::previous_frame);
        });
    bank_.add({.name = "ExposureTime",
               .address = feature::exposure_time,
               .access = Access::read_write,
               .read = [this] { return time_units(control_.settings().exposure_ns); },
               .write =
                   [this](std::uint32_t value) {
                       CameraSettings wanted = control_.settings();
                       if (wanted.exposure_auto != ExposureAuto::off) return Status::write_protect;
                       wanted.exposure_ns = std::int64_t{value} * feature::time_unit_ns;
                       return control_.apply(wanted) ? Status::success : Status::invalid_parameter;
                   }});
    setting(
        "ExposureMode", feature::exposure_mode, false,
        [](const CameraSettings& s) { return static_cast<std::uint32_t>(s.exposure_mode) + 1; },
        [](CameraSettings& s, std::uint32_t value) {
            s.exposure_mode = static_cast<ExposureMode>(value - 1);
            return value >= 1 && value <= 2;
        });
    setting(
        "ExposureAuto", feature::exposure_auto, false,
        [](const CameraSettings& s) { return static_cast<std::uint32_t>(s.exposure_auto); },
        [](CameraSettings& s, std::uint32_t value) {
            s.exposure_auto = static_cast<ExposureAuto>(value);
            return value <= static_cast<std::uint32_t>(ExposureAuto::continuous);
        });
    setting(
        "ExposureAutoTarget", feature::exposure_auto_target, false,
        [](const CameraSettings& s) { return milli(s.auto_target_percent); },
        [](CameraSettings& s, std::uint32_t value) {
            s.auto_target_percent = from_milli(value);
            return true;
        });
    setting(
        "ExposureAutoPercentile", feature::exposure_auto_percentile, false,
        [](const CameraSettings& s) { return milli(s.auto_percentile); },
        [](CameraSettings& s, std::uint32_t value) {
            s.auto_percentile = from_milli(value);
            return true;
        });
    constant("ExposureTimeMin", feature::exposure_min,
             time_units(limits_.exposure_min_ns + feature::time_unit_ns - 1));
    constant("ExposureTimeMax", feature::exposure_max, time_units(limits_.exposure_max_ns));
    setting(
        "Gain", feature::gain, false, [](const CameraSettings& s) { return milli(s.gain_db); },
        [](CameraSettings& s, std::uint32_t value) {
            s.gain_db = from_milli(value);
            return true;
        });
    constant("GainMin", feature::gain_min, milli(limits_.gain_min_db));
    constant("GainMax", feature::gain_max, milli(limits_.gain_max_db));
    setting(
        "BlackLevel", feature::black_level, false,
        [](const CameraSettings& s) { return milli(s.black_level_dn); },
        [](CameraSettings& s, std::uint32_t value) {
            s.black_level_dn = from_milli(value);
            return true;
        });
    constant("BlackLevelMin", feature::black_level_min, milli(limits_.black_level_min_dn));
    constant("BlackLevelMax", feature::black_level_max, milli(limits_.black_level_max_dn));
    constant("DeviceTemperature", feature::temperature, milli(limits_.temperature_c));
}

void Device::add_triggers() {
    using Choice = TriggerChoice;
    struct Trigger {
        Choice CameraSettings::*choice;
        bool (CameraControl::*software)(Time);
    };
    // In the order of TriggerSelector.
    static constexpr std::array all{
        Trigger{&CameraSettings::frame_trigger, &CameraControl::software_trigger},
        Trigger{&CameraSettings::start_trigger, &CameraControl::software_start_trigger},
        Trigger{&CameraSettings::burst_trigger, &CameraControl::software_burst_trigger},
        Trigger{&CameraSettings::exposure_trigger, &CameraControl::software_exposure_trigger},
    };
    for (std::uint32_t i = 0; i < all.size(); ++i) {
        const Trigger& trigger = all[i];
        const std::uint32_t offset = i * feature::trigger_stride;
        const bool locked_while_streaming = i > 0;
        const auto part = [&](std::string_view name, std::uint32_t address, std::uint32_t maximum,
                              std::uint32_t (*get)(const Choice&), void (*set)(Choice&, std::uint32_t)) {
            setting(
                name, address + offset, locked_while_streaming,
                [&trigger, get](const CameraSettings& s) { return get(s.*trigger.choice); },
                [&trigger, set, maximum](CameraSettings& s, std::uint32_t value) {
                    set(s.*trigger.choice, value);
                    return value <= maximum;
                });
        };
        part(
            "TriggerMode", feature::trigger_mode, 1, [](const Choice& c) { return std::uint32_t{c.enabled}; },
            [](Choice& c, std::uint32_t value) { c.enabled = value == 1; });
        part(
            "TriggerSource", feature::trigger_source, trigger_source_count - 1,
            [](const Choice& c) { return static_cast<std::uint32_t>(c.source); },
            [](Choice& c, std::uint32_t value) { c.source = static_cast<TriggerSource>(value); });
        part(
            "TriggerActivation", feature::trigger_activation, trigger_activation_count - 1,
            [](const Choice& c) { return static_cast<std::uint32_t>(c.activation); },
            [](Choice& c, std::uint32_t value) { c.activation = static_cast<TriggerActivation>(value); });
        command("TriggerSoftware", feature::trigger_software + offset, [this, &trigger] {
            // One that comes too early or when none is awaited is the camera's to count, not an error of the
            // command.
            (control_.*trigger.software)(clock_.now());
            return Status::success;
        });
    }
    setting(
        "AcquisitionBurstFrameCount", feature::burst_frame_count, true,
        [](const CameraSettings& s) { return s.burst_frame_count; },
        [](CameraSettings& s, std::uint32_t value) {
            s.burst_frame_count = value;
            return true;
        });
}

void Device::add_statistics() {
    const auto counter = [this](std::string_view name, std::uint32_t address,
                                std::uint32_t StreamStatistics::*member) {
        bank_.add({.name = name, .address = address, .read = [this, member] {
                       return statistics_ ? statistics_().*member : 0U;
                   }});
    };
    counter("StreamSubmittedFrameCount", feature::stream_submitted, &StreamStatistics::submitted);
    counter("StreamDeliveredFrameCount", feature::stream_delivered, &StreamStatistics::delivered);
    counter("StreamLostFrameCount", feature::stream_dropped, &StreamStatistics::dropped);
    counter("StreamResentPacketCount", feature::stream_resent, &StreamStatistics::resent);
}

void Device::add_chunks() {
    bank_.add({.name = "ChunkModeActive",
               .address = feature::chunk_mode_active,
               .access = Access::read_write,
               .locked_while_streaming = true,
               .maximum = 1});
    for (std::uint32_t i = 0; i < chunk_count; ++i)
        bank_.add({.name = "ChunkEnable",
                   .address = feature::chunk_enable + 4 * i,
                   .access = Access::read_write,
                   .locked_while_streaming = true,
                   .maximum = 1});
}

void Device::configure_messages() {
    MessageConfig c;
    c.destination_port = static_cast<std::uint16_t>(bank_.peek(reg::message_port));
    c.destination_ip = bank_.peek(reg::message_destination);
    if (c.destination_ip == 0) c.destination_ip = controller_ip_;
    c.timeout_ms = bank_.peek(reg::message_timeout);
    c.retries = bank_.peek(reg::message_retries);
    messages_.configure(c);
}

void Device::add_messages() {
    const auto channel = [this](std::string_view name, std::uint32_t address, std::uint32_t reset,
                                std::uint32_t maximum) {
        bank_.add({.name = name,
                   .address = address,
                   .access = Access::read_write,
                   .reset = reset,
                   .maximum = maximum,
                   .written = [this] { configure_messages(); }});
    };
    channel("GevMCPHostPort", reg::message_port, 0, 0xFFFF);
    for (std::uint32_t a = reg::message_port + 4; a < reg::message_destination; a += 4)
        constant("Reserved", a, 0);
    bank_.add({.name = "GevMCDA",
               .address = reg::message_destination,
               .access = Access::read_write,
               .write =
                   [this](std::uint32_t ip) {
                       if (check_destination(ip) != Status::success || is_multicast(ip))
                           return Status::invalid_parameter;
                       bank_.poke(reg::message_destination, ip);
                       return Status::success;
                   },
               .written = [this] { configure_messages(); }});
    channel("GevMCTT", reg::message_timeout, 300, 10'000);
    channel("GevMCRC", reg::message_retries, 3, 10);
    bank_.add({.name = "GevMCSP", .address = reg::message_source_port, .read = [this] {
                   return std::uint32_t{messages_.source_port()};
               }});
    for (std::uint32_t i = 0; i < event_count; ++i)
        bank_.add({.name = "EventNotification",
                   .address = feature::event_notification + 4 * i,
                   .access = Access::read_write,
                   .maximum = 1,
                   .written = [this, i] {
                       messages_.enable(static_cast<Event>(i),
                                        bank_.peek(feature::event_notification + 4 * i) != 0);
                   }});
    command("TestEventGenerate", feature::test_event_generate, [this] {
        post(Event::test, clock_.now());
        return Status::success;
    });
    bank_.add({.name = "TestPendingAck",
               .address = feature::test_pending_ack,
               .access = Access::read_write,
               .maximum = 5000,
               .written = [this] { pending_ack_ms_ = bank_.peek(feature::test_pending_ack); }});
}

void Device::add_faults() {
    for (std::uint32_t i = 0; i < fault_count; ++i) {
        const std::uint32_t percent = feature::fault_percent + 4 * i, amount = feature::fault_amount + 4 * i;
        bank_.add({.name = "FaultPercent",
                   .address = percent,
                   .access = Access::read_write,
                   .maximum = 100'000,
                   .written = [this] { publish_faults(); }});
        bank_.add({.name = "FaultAmount",
                   .address = amount,
                   .access = Access::read_write,
                   .reset = 1,
                   .maximum = 1'000'000,
                   .written = [this] { publish_faults(); }});
    }
}

void Device::publish_faults() {
    std::vector<FaultRule> rules = settings_.faults;
    for (FaultRule& rule : rules)
        if (rule.seed == 0) rule.seed = seed_;
    if (settings_.drop_percent > 0) {
        FaultRule lose;
        lose.percent = settings_.drop_percent;
        lose.seed = seed_;
        rules.push_back(lose);
    }
    for (std::uint32_t i = 0; i < fault_count; ++i) {
        const std::uint32_t percent = bank_.peek(feature::fault_percent + 4 * i);
        if (percent == 0) continue;
        FaultRule live;
        live.fault = static_cast<Fault>(i);
        live.percent = percent / 1000.0;
        live.amount = bank_.peek(feature::fault_amount + 4 * i);
        live.seed = seed_;
        rules.push_back(live);
    }
    faults_.set_rules(std::move(rules));
}

std::uint32_t Device::chunk_selection() const {
    std::uint32_t selection = 0;
    if (bank_.peek(feature::chunk_mode_active) != 0)
        for (std::uint32_t i = 0; i < chunk_count; ++i)
            selection |= bank_.peek(feature::chunk_enable + 4 * i) << i;
    return selection;
}

void Device::add_xml() {
    const std::span<const std::uint8_t> zip = zipped_camera_xml();
    std::string url = fmt::format("Local:obscura_camera.zip;{:X};{:X}", feature::xml_file, zip.size());
    if (!settings_.xml.empty()) {
        user_xml_ = std::make_unique<UserXml>(settings_.xml, read_xml_file(settings_.xml),
                                              settings_.xml_values, bank_);
        url = user_xml_->url();
    }
    bank_.add_string("XMLFirstURL", reg::xml_url_first, 512, Access::read_only, url);
    bank_.add_string("XMLSecondURL", reg::xml_url_second, 512, Access::read_only, "");
    if (!user_xml_) bank_.add_block("XMLFile", feature::xml_file, zip);
}

Status Device::read(std::uint32_t address, std::span<std::uint8_t> out) {
    return user_xml_ ? user_xml_->read(address, out) : bank_.read(address, out);
}

Status Device::write(std::uint32_t address, std::span<const std::uint8_t> bytes, std::size_t& done) {
    return user_xml_ ? user_xml_->write(address, bytes, done) : bank_.write(address, bytes, done);
}

Status Device::read_word(std::uint32_t address, std::uint32_t& value) {
    std::uint8_t bytes[4] = {};
    const Status status = read(address, bytes);
    value = load_be32(bytes);
    return status;
}

Status Device::write_word(std::uint32_t address, std::uint32_t value) {
    std::uint8_t bytes[4];
    store_be32(bytes, value);
    std::size_t done = 0;
    return write(address, bytes, done);
}

std::string Device::xml_report() const {
    return user_xml_ ? user_xml_->report() : std::string();
}

bool Device::announces_slow_commands() const {
    return (bank_.peek(reg::gvcp_configuration) & gvcp_configuration::pending_ack) != 0;
}

std::uint64_t Device::device_time(Time t) const noexcept {
    return static_cast<std::uint64_t>(t.ns + clock_.tai_offset_ns() - timestamp_origin_ns_);
}

StatusCodes Device::status_codes() const {
    const std::uint32_t wanted = bank_.peek(reg::gvcp_configuration);
    return {(wanted & gvcp_configuration::status_codes_1_1) != 0,
            (wanted & gvcp_configuration::status_codes_2_0) != 0};
}

StreamConfig Device::stream_config() const {
    StreamConfig c;
    c.status_codes = status_codes();
    c.destination_ip = bank_.peek(reg::stream_destination);
    if (c.destination_ip == 0) c.destination_ip = controller_ip_;
    c.destination_port = static_cast<std::uint16_t>(bank_.peek(reg::stream_port));
    const std::uint32_t packet_size = bank_.peek(reg::stream_packet_size);
    c.packet_size = packet_size & 0xFFFF;
    c.do_not_fragment = (packet_size & scps::do_not_fragment) != 0;
    const std::uint32_t configuration = bank_.peek(reg::stream_configuration);
    c.payload.multipart = (configuration & sccfg::multipart) != 0;
    c.chunk_in_image = (configuration & sccfg::chunk_in_image) != 0;
    // The standard headers have no room for the number of parts.
    c.extended_ids =
        c.payload.multipart || (bank_.peek(reg::gvsp_configuration) & gvsp_configuration::extended_ids) != 0;
    c.packet_delay_ns = bank_.peek(reg::stream_packet_delay);
    if (bank_.peek(feature::throughput_limit_mode) != 0)
        c.throughput_limit = bank_.peek(feature::throughput_limit);
    c.payload.timestamp_origin_ns = timestamp_origin_ns_;
    c.payload.chunks = chunk_selection();
    c.payload.binning = binning_;
    for (std::uint32_t i = 0, request = 0; i < region_count(); ++i)
        if (i == 0 || regions_[i].enabled) c.payload.regions[request++] = static_cast<std::uint8_t>(i);
    c.faults = faults_;
    const PixelFormat format = control_.settings().pixel_format;
    // Frames hold 16-bit words; these formats want them as they are, unless the ADC is deeper.
    const int format_bits = format == PixelFormat::mono10   ? 10
                            : format == PixelFormat::mono12 ? 12
                            : format == PixelFormat::mono14 ? 14
                            : format == PixelFormat::mono16 ? 16
                                                            : 0;
    c.payload.packs_pixels = limits_.adc_bits > format_bits;
    c.payload.max_width = limits_.sensor_width;
    c.payload.max_height = limits_.rows_max > 0 ? limits_.rows_max : limits_.sensor_height;
    c.payload.max_image_bytes = std::size_t{2} * static_cast<std::size_t>(c.payload.max_width) *
                                static_cast<std::size_t>(c.payload.max_height);
    return c;
}

Status Device::acquisition_start() {
    if (control_.acquiring()) return Status::success; // SFNC: starting twice changes nothing
    // Receivers take a block id lower than the last for a late packet, so ids go on for as long as the
    // channel stays open.
    StreamConfig config = stream_config();
    config.continue_blocks = !channel_fresh_;
    if (!stream_.begin(config)) return Status::busy;
    channel_fresh_ = false;
    if (control_.acquisition_start()) return Status::success;
    stream_.abort();
    return Status::busy;
}

Status Device::acquisition_stop() {
    // The block in work has to be off the wire before the answer: what is left of it would reach the port of
    // the next stream and make its receiver take every new block for a late one.
    stream_.abort();
    control_.acquisition_stop(true);
    return stream_.wait_idle(stop_patience_ns) ? Status::success : Status::busy;
}

void Device::control_lost() {
    acquisition_stop();
    bank_.poke(reg::stream_port, 0);
    bank_.poke(reg::message_port, 0);
    configure_messages();
    actions_ = {};
    channel_fresh_ = true;
    controller_ip_ = 0;
    // A client that made the camera deaf cannot take that back.
    for (const Fault deafness : {Fault::mute_control, Fault::heartbeat_loss})
        bank_.poke(feature::fault_percent + 4 * static_cast<std::uint32_t>(deafness), 0);
    publish_faults();
}

bool Device::action(const ActionRequest& request, Time now, Status& status) {
    status = Status::success;
    if (request.device_key != bank_.peek(reg::action_device_key)) return false;
    if (controller_ip_ == 0 &&
        (bank_.peek(reg::gvcp_configuration) & gvcp_configuration::unconditional_action) == 0)
        return false;
    if (request.group_key != bank_.peek(reg::action_groups) ||
        (request.group_mask & bank_.peek(reg::action_groups + 4)) == 0)
        return false;
    if (!request.scheduled) {
        control_.action_trigger(now);
        return true;
    }
    // From device time back to the scheduling clock.
    const auto instant = static_cast<std::int64_t>(request.instant_ns & 0x7FFFFFFFFFFFFFFF);
    const Time due{instant + timestamp_origin_ns_ - clock_.tai_offset_ns()};
    if (due <= now) {
        status = Status::action_late;
        post(Event::action_late, now);
        return true;
    }
    const auto free = std::find(actions_.begin(), actions_.end(), Time{});
    if (free == actions_.end()) {
        status = Status::overflow;
    } else {
        *free = due;
    }
    return true;
}

Time Device::next_action() const noexcept {
    Time next{INT64_MAX};
    for (const Time t : actions_)
        if (t != Time{}) next = std::min(next, t);
    return next;
}

void Device::run_actions(Time now) {
    for (Time next = next_action(); next <= now; next = next_action()) {
        // The edge is the instant that was asked for: every camera on the link gets the same one.
        control_.action_trigger(next);
        *std::find(actions_.begin(), actions_.end(), next) = {};
    }
}

Status Device::check_destination(std::uint32_t ip) const {
    // Without this, whoever takes control can aim a gigabit at any address in the world.
    const bool good = ip == 0 || ip == controller_ip_ || network_.on_link(ip) || is_multicast(ip);
    return good ? Status::success : Status::invalid_parameter;
}

bool Device::may_ask_resend(std::uint32_t ip) const noexcept {
    const std::uint32_t destination = bank_.peek(reg::stream_destination);
    return ip != 0 &&
           (ip == controller_ip_ || ip == destination || (is_multicast(destination) && network_.on_link(ip)));
}

Status Device::write_stream_port(std::uint32_t value) {
    // Bits 16-19 number the network interface; there is one.
    if (value > 0xFFFF) return Status::invalid_parameter;
    if (value == bank_.peek(reg::stream_port)) return Status::success;
    const bool acquiring = control_.acquiring();
    if (acquiring) {
        stream_.abort();
        if (value == 0) {
            control_.acquisition_stop(true);
            stream_.wait_idle(stop_patience_ns);
        }
    }
    bank_.poke(reg::stream_port, value);
    channel_fresh_ = true;
    if (acquiring && value != 0 && !stream_.begin(stream_config())) return Status::busy;
    return Status::success;
}

Status Device::write_packet_size(std::uint32_t value) {
    const std::uint32_t size = value & 0xFFFF;
    const std::uint32_t flags = value & ~0xFFFFU;
    const std::uint32_t kept = bank_.peek(reg::stream_packet_size);
    if ((flags & ~(scps::fire_test_packet | scps::do_not_fragment)) != 0) return Status::invalid_parameter;
    if (size < packet_size_min || size > packet_size_max_ || size % 4 != 0) return Status::invalid_parameter;
    if (control_.acquiring() && (value & ~scps::fire_test_packet) != kept) return Status::write_protect;
    bank_.poke(reg::stream_packet_size, value & ~scps::fire_test_packet);
    if ((flags & scps::fire_test_packet) != 0) {
        const StreamConfig config = stream_config();
        if (config.destination_port != 0 && config.destination_ip != 0) stream_.send_test_packet(config);
    }
    return Status::success;
}

} // namespace obscura::transports::gige
