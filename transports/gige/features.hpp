// Where the camera's features lie in the manufacturer's part of the register space; camera.xml says the same.
#pragma once

#include <cstdint>

/// Lengths are in units of 10 ns, frame rates in mHz, gains in mdB (two's complement): 32-bit words hold them
/// all, and camera.xml converts to the units of SFNC.
namespace obscura::transports::gige::feature {

constexpr std::int64_t time_unit_ns = 10;

constexpr std::uint32_t sensor_width = 0xA000;
constexpr std::uint32_t sensor_height = 0xA004;
constexpr std::uint32_t width_min = 0xA008;
constexpr std::uint32_t width_step = 0xA00C;
constexpr std::uint32_t height_min = 0xA010;
constexpr std::uint32_t height_step = 0xA014;
constexpr std::uint32_t adc_bits = 0xA018;
constexpr std::uint32_t width = 0xA020;
constexpr std::uint32_t height = 0xA024;
constexpr std::uint32_t offset_x = 0xA028;
constexpr std::uint32_t offset_y = 0xA02C;
constexpr std::uint32_t pixel_format = 0xA030;
constexpr std::uint32_t payload_size = 0xA034;

constexpr std::uint32_t acquisition_mode = 0xA100;
constexpr std::uint32_t acquisition_start = 0xA104;
constexpr std::uint32_t acquisition_stop = 0xA108;
constexpr std::uint32_t acquisition_abort = 0xA10C;
constexpr std::uint32_t acquisition_frame_count = 0xA110;
constexpr std::uint32_t frame_rate = 0xA114;
constexpr std::uint32_t frame_rate_min = 0xA118;
constexpr std::uint32_t frame_rate_max = 0xA11C;
constexpr std::uint32_t acquiring = 0xA120;
constexpr std::uint32_t trigger_mode = 0xA130;
constexpr std::uint32_t trigger_source = 0xA134;
constexpr std::uint32_t trigger_software = 0xA138;
constexpr std::uint32_t trigger_delay = 0xA13C;
constexpr std::uint32_t exposure_time = 0xA150;
constexpr std::uint32_t exposure_min = 0xA154;
constexpr std::uint32_t exposure_max = 0xA158;
constexpr std::uint32_t gain = 0xA160;
constexpr std::uint32_t gain_min = 0xA164;
constexpr std::uint32_t gain_max = 0xA168;

constexpr std::uint32_t packet_size_max = 0xA200;
constexpr std::uint32_t throughput_limit = 0xA204; // bytes per second
constexpr std::uint32_t throughput_limit_mode = 0xA208;
constexpr std::uint32_t stream_submitted = 0xA210;
constexpr std::uint32_t stream_delivered = 0xA214;
constexpr std::uint32_t stream_dropped = 0xA218;
constexpr std::uint32_t stream_resent = 0xA21C;

constexpr std::uint32_t chunk_mode_active = 0xA300;
constexpr std::uint32_t chunk_enable = 0xA310; // one word per Chunk

constexpr std::uint32_t event_notification = 0xA400; // one word per Event
constexpr std::uint32_t test_event_generate = 0xA440;
constexpr std::uint32_t test_pending_ack = 0xA444; // ms
constexpr std::uint32_t device_reset = 0xA450;
constexpr std::uint32_t user_set_selector = 0xA460;
constexpr std::uint32_t user_set_load = 0xA464;
constexpr std::uint32_t user_set_save = 0xA468;
constexpr std::uint32_t user_set_default = 0xA46C;
constexpr std::uint32_t fault_percent = 0xA500; // one word per Fault, in 1/1000 %
constexpr std::uint32_t fault_amount = 0xA540;  // one word per Fault

/// The zipped camera.xml.
constexpr std::uint32_t xml_file = 0x0010'0000;

} // namespace obscura::transports::gige::feature
