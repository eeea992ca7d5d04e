// Where the camera's features lie in the manufacturer's part of the register space; camera.xml says the same.
#pragma once

#include <cstdint>

namespace obscura::transports::gige {

/// LineSource of the output line.
enum class LineSource : std::uint32_t {
    off,
    exposure_active,
    frame_active,
    frame_trigger_wait,
    acquisition_active,
    timer0_active,
    timer1_active,
    counter0_active,
    counter1_active,
    user_output0,
};
constexpr std::uint32_t line_source_count = 10;

} // namespace obscura::transports::gige

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
constexpr std::uint32_t pixel_format = 0xA030;
constexpr std::uint32_t payload_size = 0xA034;
constexpr std::uint32_t test_pattern = 0xA038; // ImagePattern
constexpr std::uint32_t binning_horizontal = 0xA03C;
constexpr std::uint32_t binning_vertical = 0xA040;
constexpr std::uint32_t shutter_mode = 0xA044;
constexpr std::uint32_t regions_max = 0xA048;
constexpr std::uint32_t binning_horizontal_mode = 0xA04C; // BinningMode
constexpr std::uint32_t binning_vertical_mode = 0xA050;
constexpr std::uint32_t width_max = 0xA054; // in binned pixels, as width_min and width_step
constexpr std::uint32_t height_max = 0xA058;
constexpr std::uint32_t sensor_name = 0xA060; // 32 bytes

constexpr std::uint32_t acquisition_mode = 0xA100;
constexpr std::uint32_t acquisition_start = 0xA104;
constexpr std::uint32_t acquisition_stop = 0xA108;
constexpr std::uint32_t acquisition_abort = 0xA10C;
constexpr std::uint32_t acquisition_frame_count = 0xA110;
constexpr std::uint32_t frame_rate = 0xA114;
constexpr std::uint32_t frame_rate_min = 0xA118;
constexpr std::uint32_t frame_rate_max = 0xA11C;
constexpr std::uint32_t acquiring = 0xA120; // bits of AcquisitionStatusSelector
constexpr std::uint32_t frame_rate_enable = 0xA124;
constexpr std::uint32_t resulting_frame_rate = 0xA128; // mHz
constexpr std::uint32_t readout_time = 0xA12C;
constexpr std::uint32_t burst_frame_count = 0xA130;
constexpr std::uint32_t line_edges = 0xA14C; // two bits per input: rising edges are told of, falling ones
constexpr std::uint32_t exposure_time = 0xA150;
constexpr std::uint32_t exposure_min = 0xA154;
constexpr std::uint32_t exposure_max = 0xA158;
constexpr std::uint32_t exposure_auto = 0xA15C;
constexpr std::uint32_t gain = 0xA160;
constexpr std::uint32_t gain_min = 0xA164;
constexpr std::uint32_t gain_max = 0xA168;
constexpr std::uint32_t black_level = 0xA170; // in 1/1000 DN
constexpr std::uint32_t black_level_min = 0xA174;
constexpr std::uint32_t black_level_max = 0xA178;
constexpr std::uint32_t temperature = 0xA180; // in 1/1000 degrees Celsius, two's complement

constexpr std::uint32_t exposure_auto_target = 0xA184;     // in 1/1000 %
constexpr std::uint32_t exposure_auto_percentile = 0xA188; // in 1/1000 %
constexpr std::uint32_t exposure_mode = 0xA18C;            // 1: Timed, 2: TriggerWidth

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

constexpr std::uint32_t line_source = 0xA608; // of the output, LineSource
constexpr std::uint32_t line_status_all = 0xA60C;
constexpr std::uint32_t user_output_value = 0xA610; // one bit per output
constexpr std::uint32_t line_inverter = 0xA620;     // one word per line, the output last

constexpr std::uint32_t counters = 0xA700; // counter_count times counter_stride bytes
constexpr std::uint32_t counter_stride = 0x20;
namespace counter {
constexpr std::uint32_t event_source = 0x00; // IoEvent
constexpr std::uint32_t reset_source = 0x04; // CounterReset
constexpr std::uint32_t reset = 0x08;
constexpr std::uint32_t value = 0x0C;
constexpr std::uint32_t value_at_reset = 0x10;
constexpr std::uint32_t duration = 0x14;
constexpr std::uint32_t status = 0x18;
} // namespace counter
constexpr std::uint32_t timers = 0xA780; // timer_count times timer_stride bytes
constexpr std::uint32_t timer_stride = 0x20;
namespace timer {
constexpr std::uint32_t trigger_source = 0x00; // IoEvent
constexpr std::uint32_t delay = 0x04;
constexpr std::uint32_t duration = 0x08;
constexpr std::uint32_t reset = 0x0C;
constexpr std::uint32_t value = 0x10;
constexpr std::uint32_t status = 0x14;
} // namespace timer

constexpr std::uint32_t sequencer_mode = 0xA800;
constexpr std::uint32_t sequencer_configuration = 0xA804;
constexpr std::uint32_t sequencer_set_start = 0xA808;
constexpr std::uint32_t sequencer_set_active = 0xA80C;
constexpr std::uint32_t sequencer_set_selector = 0xA810;
constexpr std::uint32_t sequencer_set_save = 0xA814;
constexpr std::uint32_t sequencer_set_load = 0xA818;
constexpr std::uint32_t sequencer_feature_enable = 0xA820; // one word per SequencedFeature
constexpr std::uint32_t sequencer_set_next = 0xA840;       // one word per set
constexpr std::uint32_t sequencer_end = 0xA860;

constexpr std::uint32_t ptp_enable = 0xA900;
constexpr std::uint32_t ptp_state = 0xA904;
constexpr std::uint32_t ptp_servo = 0xA908;
constexpr std::uint32_t ptp_data_set_latch = 0xA90C;
constexpr std::uint32_t ptp_accuracy = 0xA910; // latched, as what follows
constexpr std::uint32_t ptp_utc_offset = 0xA914;
constexpr std::uint32_t ptp_offset = 0xA918; // two words, as what follows
constexpr std::uint32_t ptp_path_delay = 0xA920;
constexpr std::uint32_t ptp_clock_id = 0xA928;
constexpr std::uint32_t ptp_parent_id = 0xA930;
constexpr std::uint32_t ptp_grandmaster_id = 0xA938;

// Of the trigger for FrameStart; those for AcquisitionStart, FrameBurstStart and ExposureStart follow.
constexpr std::uint32_t trigger_mode = 0xAA00;
constexpr std::uint32_t trigger_source = 0xAA04;
constexpr std::uint32_t trigger_software = 0xAA08;
constexpr std::uint32_t trigger_delay = 0xAA0C; // the first has it alone, as the two after it
constexpr std::uint32_t trigger_divider = 0xAA10;
constexpr std::uint32_t trigger_overlap = 0xAA14;
constexpr std::uint32_t trigger_activation = 0xAA18;
constexpr std::uint32_t trigger_stride = 0x40;

constexpr std::uint32_t regions = 0xB000; // windows_max times region_stride bytes
constexpr std::uint32_t region_stride = 0x40;
namespace region {
constexpr std::uint32_t width = 0x00;
constexpr std::uint32_t height = 0x04;
constexpr std::uint32_t offset_x = 0x08;
constexpr std::uint32_t offset_y = 0x0C;
constexpr std::uint32_t mode = 0x10;
constexpr std::uint32_t exposure = 0x14;
constexpr std::uint32_t sampling = 0x18; // Sampling
constexpr std::uint32_t reads = 0x1C;
constexpr std::uint32_t exposure_min = 0x20; // from here on what the chip makes of it
constexpr std::uint32_t exposure_max = 0x24;
constexpr std::uint32_t flags = 0x28;
constexpr std::uint32_t obtained_x = 0x2C;
constexpr std::uint32_t obtained_y = 0x30;
constexpr std::uint32_t obtained_width = 0x34;
constexpr std::uint32_t obtained_height = 0x38;
constexpr std::uint32_t image_y = 0x3C;
} // namespace region
// Of Region0, which is always on.
constexpr std::uint32_t width = regions + region::width;
constexpr std::uint32_t height = regions + region::height;
constexpr std::uint32_t offset_x = regions + region::offset_x;
constexpr std::uint32_t offset_y = regions + region::offset_y;

/// The zipped camera.xml.
constexpr std::uint32_t xml_file = 0x0010'0000;

} // namespace obscura::transports::gige::feature
