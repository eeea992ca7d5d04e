// SPDX-License-Identifier: Apache-2.0
// GigE Vision client on libaravis; the only translation unit that includes its client API.
#include "tools/receive/receiver.hpp"

#include "core/camera/frame.hpp"
#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"
#include "core/time.hpp"

#include <arv.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

namespace obscura::tools {
namespace {

std::int64_t realtime_ns() {
    timespec now{};
    clock_gettime(CLOCK_REALTIME, &now);
    return static_cast<std::int64_t>(now.tv_sec) * ns_per_s + now.tv_nsec;
}

struct Unref {
    void operator()(gpointer object) const { g_object_unref(object); }
};
template<typename T>
using Object = std::unique_ptr<T, Unref>;

/// Owner of a GError, checked explicitly after each call.
class ErrorSlot {
public:
    ~ErrorSlot() { g_clear_error(&error_); }
    GError** operator&() { return &error_; }
    explicit operator bool() const { return error_ != nullptr; }
    [[nodiscard]] std::string text() const {
        std::string out = error_ != nullptr ? error_->message : "no answer";
        for (char& c : out)
            if (c == '\n') c = ' ';
        return out;
    }

private:
    GError* error_ = nullptr;
};

/// IPv4 address of `host` (`remote`), and of the local interface that routes to it (`local`).
void resolve(const std::string& host, in_addr& remote, in_addr& local) {
    addrinfo hints{};
    hints.ai_family = AF_INET;
    hints.ai_socktype = SOCK_DGRAM;
    addrinfo* found = nullptr;
    if (const int rc = getaddrinfo(host.c_str(), "3956", &hints, &found); rc != 0)
        throw HardwareError(fmt::format("{}: {}", host.substr(0, 200), gai_strerror(rc)));
    const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owner(found, freeaddrinfo);
    remote = reinterpret_cast<const sockaddr_in*>(found->ai_addr)->sin_addr;
    const int probe = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in own{};
    socklen_t size = sizeof own;
    const bool routed = probe >= 0 && connect(probe, found->ai_addr, found->ai_addrlen) == 0 &&
                        getsockname(probe, reinterpret_cast<sockaddr*>(&own), &size) == 0;
    const int why = errno;
    if (probe >= 0) close(probe);
    if (!routed) throw HardwareError(fmt::format("{}: no route to the camera: {}", host, std::strerror(why)));
    local = own.sin_addr;
}

Object<GInetAddress> inet_address(const in_addr& address) {
    return Object<GInetAddress>(
        g_inet_address_new_from_bytes(reinterpret_cast<const guint8*>(&address), G_SOCKET_FAMILY_IPV4));
}

// GigE Vision bootstrap registers: time stamp tick frequency, control (latch) and value.
constexpr guint64 reg_tick_high = 0x093c, reg_tick_low = 0x0940, reg_control = 0x0944, reg_time_high = 0x0948,
                  reg_time_low = 0x094c;
constexpr guint32 latch = 2;

} // namespace

struct Receiver::Impl {
    ReceiverSettings settings;
    Object<ArvDevice> device;
    Object<ArvCamera> camera;
    Object<ArvStream> stream;
    ArvBuffer* held = nullptr; ///< buffer of the frame that receive() returned last
    bool acquiring = false;
    bool receiving = false;                 ///< libaravis's stream thread runs
    std::optional<CameraStatistics> before; ///< the camera's counters at the start

    /// Runs on libaravis's stream thread.
    static void on_stream(void*, ArvStreamCallbackType type, ArvBuffer* buffer) {
        if (type != ARV_STREAM_CALLBACK_TYPE_BUFFER_DONE || buffer == nullptr) return;
        stamp_of(buffer).store(realtime_ns(), std::memory_order_release);
    }
    void give_back() {
        if (held == nullptr) return;
        stamp_of(held).store(0, std::memory_order_release);
        arv_stream_push_buffer(stream.get(), std::exchange(held, nullptr));
    }
    /// Time at which the stream thread completed the buffer, CLOCK_REALTIME; 0: not yet known.
    static std::atomic<std::int64_t>& stamp_of(ArvBuffer* buffer) {
        return *static_cast<std::atomic<std::int64_t>*>(const_cast<void*>(arv_buffer_get_user_data(buffer)));
    }
    /// Waits for the completion time of a received buffer: libaravis queues a buffer before its callback
    /// stamps it, microseconds later. Without the wait the stamp could be written after the buffer is queued
    /// again.
    static std::int64_t completion_of(ArvBuffer* buffer) {
        const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(1);
        std::int64_t stamp = 0;
        while ((stamp = stamp_of(buffer).load(std::memory_order_acquire)) == 0 &&
               std::chrono::steady_clock::now() < give_up)
            std::this_thread::yield();
        return stamp != 0 ? stamp : realtime_ns();
    }
    /// The camera's counters; nullopt if it has none, or does not answer.
    [[nodiscard]] std::optional<CameraStatistics> camera_counters() const {
        CameraStatistics out;
        const std::pair<const char*, std::uint64_t*> counters[] = {
            {"StreamAskedPacketCount", &out.asked_packets},
            {"StreamResentPacketCount", &out.resent_packets},
            {"StreamAskedBeforeSentPacketCount", &out.asked_before_sent},
            {"StreamRefusedPacketCount", &out.refused_packets},
        };
        for (const auto& [feature, value] : counters) {
            ErrorSlot error;
            if (!arv_camera_is_feature_available(camera.get(), feature, &error) || error) return std::nullopt;
            *value = static_cast<std::uint64_t>(arv_camera_get_integer(camera.get(), feature, &error));
            if (error) return std::nullopt;
        }
        return out;
    }
    void check(const ErrorSlot& error, std::string_view what) const {
        if (error) throw HardwareError(fmt::format("{}: {}: {}", settings.address, what, error.text()));
    }
    /// As check(), of a number that was to be set: with what is allowed.
    void check_number(const ErrorSlot& error, const char* feature, double value) const {
        if (!error) return;
        ErrorSlot unknown;
        double low = 0, high = 0;
        ArvGcNode* const node = arv_device_get_feature(device.get(), feature);
        const char* unit = "";
        if (node != nullptr && ARV_IS_GC_FLOAT(node)) {
            arv_camera_get_float_bounds(camera.get(), feature, &low, &high, &unknown);
            const char* const stated = arv_gc_float_get_unit(ARV_GC_FLOAT(node));
            if (stated != nullptr) unit = stated;
        } else {
            gint64 least = 0, largest = 0;
            arv_camera_get_integer_bounds(camera.get(), feature, &least, &largest, &unknown);
            low = static_cast<double>(least), high = static_cast<double>(largest);
        }
        if (unknown || (value >= low && value <= high)) check(error, feature);
        throw HardwareError(fmt::format("{}: {}: {:.12g} is refused, allowed {:.12g} to {:.12g}{}{} ({})",
                                        settings.address, feature, value, low, high, *unit != 0 ? " " : "",
                                        unit, error.text()));
    }
    /// As check(), of an entry of an enumeration.
    void check_entry(const ErrorSlot& error, const char* feature, std::string_view value) const {
        if (!error) return;
        ErrorSlot unknown;
        guint count = 0;
        const std::unique_ptr<const char*, decltype(&g_free)> entries(
            arv_camera_dup_available_enumerations_as_strings(camera.get(), feature, &count, &unknown),
            g_free);
        if (unknown || !entries) check(error, feature);
        const std::vector<std::string_view> known(entries.get(), entries.get() + count);
        if (std::find(known.begin(), known.end(), value) != known.end()) check(error, feature);
        throw HardwareError(fmt::format("{}: {}: unknown entry \"{}\", {}", settings.address, feature,
                                        printable(value, 60), suggestion(value, known)));
    }
};

Receiver::Receiver(const ReceiverSettings& settings) : impl_(std::make_unique<Impl>()) {
    impl_->settings = settings;
    in_addr remote{}, local{};
    resolve(settings.address, remote, local);
    ErrorSlot error;
    impl_->device.reset(arv_gv_device_new(inet_address(local).get(), inet_address(remote).get(), &error));
    if (error || !impl_->device)
        throw HardwareError(fmt::format("{}: no GigE Vision camera answers on UDP port 3956: {}",
                                        settings.address, error.text()));
    if (!arv_gv_device_is_controller(ARV_GV_DEVICE(impl_->device.get())))
        throw HardwareError(fmt::format("{}: another client controls the camera", settings.address));
    impl_->camera.reset(arv_camera_new_with_device(impl_->device.get(), &error));
    impl_->check(error, "not usable as a camera");
}

Receiver::~Receiver() {
    try {
        stop();
    } catch (const Error&) {
        // Ignore a failing stop: the camera may have disappeared.
    }
}

void Receiver::set(const char* feature, std::string_view value) {
    ErrorSlot error;
    arv_camera_set_string(impl_->camera.get(), feature, std::string(value).c_str(), &error);
    impl_->check_entry(error, feature, value);
}

void Receiver::set(const char* feature, double value) {
    ErrorSlot error;
    arv_camera_set_float(impl_->camera.get(), feature, value, &error);
    impl_->check_number(error, feature, value);
}

void Receiver::set(const char* feature, std::int64_t value) {
    ErrorSlot error;
    arv_camera_set_integer(impl_->camera.get(), feature, value, &error);
    impl_->check_number(error, feature, static_cast<double>(value));
}

std::string Receiver::get_text(const char* feature) const {
    ErrorSlot error;
    const char* text = arv_camera_get_string(impl_->camera.get(), feature, &error);
    return error || text == nullptr ? std::string() : std::string(text);
}

std::optional<std::int64_t> Receiver::find_integer(const char* feature) const {
    ErrorSlot error;
    if (!arv_device_is_feature_available(impl_->device.get(), feature, &error) || error) return std::nullopt;
    const gint64 value = arv_camera_get_integer(impl_->camera.get(), feature, &error);
    return error ? std::nullopt : std::optional<std::int64_t>(value);
}

std::optional<double> Receiver::find_real(const char* feature) const {
    ErrorSlot error;
    if (!arv_device_is_feature_available(impl_->device.get(), feature, &error) || error) return std::nullopt;
    const double value = arv_camera_get_float(impl_->camera.get(), feature, &error);
    return error ? std::nullopt : std::optional<double>(value);
}

void Receiver::set_flag(const char* feature, bool value) {
    ErrorSlot error;
    arv_camera_set_boolean(impl_->camera.get(), feature, value, &error);
    impl_->check(error, feature);
}

double Receiver::least(const char* feature) const {
    ErrorSlot error;
    double low = 0, high = 0;
    arv_camera_get_float_bounds(impl_->camera.get(), feature, &low, &high, &error);
    impl_->check(error, feature);
    return low;
}

void Receiver::execute(const char* feature) {
    ErrorSlot error;
    arv_camera_execute_command(impl_->camera.get(), feature, &error);
    impl_->check(error, feature);
}

void Receiver::start() {
    Impl& d = *impl_;
    auto* gv = ARV_GV_DEVICE(d.device.get());
    ErrorSlot error;
    arv_gv_device_set_stream_options(gv, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
    if (d.settings.packet_size > 0) {
        arv_gv_device_set_packet_size_adjustment(gv, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
        arv_gv_device_set_packet_size(gv, d.settings.packet_size, &error);
        d.check(error, "packet size");
    } else {
        arv_gv_device_auto_packet_size(gv, &error);
        d.check(error, "packet size");
    }
    if (d.settings.packet_delay_ns >= 0) {
        arv_camera_gv_set_packet_delay(d.camera.get(), d.settings.packet_delay_ns, &error);
        d.check(error, "packet delay");
    }
    set("AcquisitionMode", "Continuous");
    const guint payload = arv_camera_get_payload(d.camera.get(), &error);
    d.check(error, "payload size");
    d.stream.reset(arv_camera_create_stream(d.camera.get(), &Impl::on_stream, nullptr, &error));
    d.check(error, "stream");
    if (!d.stream) throw HardwareError(fmt::format("{}: the stream cannot be opened", d.settings.address));
    d.receiving = true;
    // Request a receive buffer of several frames, as the default is smaller than one; the kernel caps it.
    g_object_set(d.stream.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size",
                 static_cast<gint>(std::min<std::uint64_t>(4ull * payload + (1u << 20), 256u << 20)),
                 // A camera that sends rows as it reads them pauses within a frame, as long as an exposure or
                 // as a busy host takes; only a longer silence means that the remaining packets are lost.
                 "frame-retention", guint{2'000'000}, "packet-timeout", guint{40'000},
                 // Permit resend requests for all packets, because the receive buffer may be far smaller than
                 // a frame.
                 "packet-request-ratio", 1.0, nullptr);
    for (std::size_t i = 0; i < d.settings.buffers; ++i) {
        auto* done = new std::atomic<std::int64_t>(0);
        const auto free_stamp = [](void* stamp) { delete static_cast<std::atomic<std::int64_t>*>(stamp); };
        arv_stream_push_buffer(d.stream.get(), arv_buffer_new_full(payload, nullptr, done, free_stamp));
    }
    d.before = d.camera_counters();
    arv_camera_start_acquisition(d.camera.get(), &error);
    d.check(error, "AcquisitionStart");
    d.acquiring = true;
}

void Receiver::end_stream() {
    Impl& d = *impl_;
    if (d.stream) d.give_back();
    ErrorSlot error;
    if (std::exchange(d.acquiring, false)) arv_camera_stop_acquisition(d.camera.get(), &error);
    if (d.stream && std::exchange(d.receiving, false)) arv_stream_stop_thread(d.stream.get(), FALSE);
    d.check(error, "AcquisitionStop");
}

void Receiver::stop() {
    // libaravis takes a stream whose thread is stopped already for a mistake when it is freed.
    const auto free_stream = [](Impl& d) {
        if (d.stream && !d.receiving) arv_stream_start_thread(d.stream.get());
        d.stream.reset();
    };
    try {
        end_stream();
    } catch (const HardwareError&) {
        free_stream(*impl_);
        throw;
    }
    free_stream(*impl_);
}

std::optional<ReceivedFrame> Receiver::receive(double timeout_s) {
    Impl& d = *impl_;
    d.give_back();
    ArvBuffer* buffer = arv_stream_timeout_pop_buffer(d.stream.get(), static_cast<guint64>(timeout_s * 1e6));
    if (buffer == nullptr) return std::nullopt;
    d.held = buffer;
    ReceivedFrame frame;
    frame.block_id = arv_buffer_get_frame_id(buffer);
    frame.complete = arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS;
    frame.device_ns = arv_buffer_get_timestamp(buffer);
    frame.first_packet_ns = static_cast<std::int64_t>(arv_buffer_get_system_timestamp(buffer));
    frame.complete_ns = Impl::completion_of(buffer);
    if (frame.complete) {
        frame.width = arv_buffer_get_image_width(buffer);
        frame.height = arv_buffer_get_image_height(buffer);
        frame.pixel_format = arv_buffer_get_image_pixel_format(buffer);
        std::size_t size = 0;
        const void* data = arv_buffer_get_data(buffer, &size);
        frame.data = {static_cast<const std::uint8_t*>(data), size};
    }
    return frame;
}

std::span<const std::uint8_t> Receiver::chunk(std::uint32_t id) const {
    ArvBuffer* const buffer = impl_->held;
    if (buffer == nullptr || !arv_buffer_has_chunks(buffer)) return {};
    std::size_t size = 0;
    const void* const data = arv_buffer_get_chunk_data(buffer, id, &size);
    return {static_cast<const std::uint8_t*>(data), data == nullptr ? 0 : size};
}

StreamStatistics Receiver::statistics() const {
    StreamStatistics out;
    if (!impl_->stream) return out;
    guint64 completed = 0, failures = 0, underruns = 0;
    arv_stream_get_statistics(impl_->stream.get(), &completed, &failures, &underruns);
    const auto count = [this](const char* name) {
        return arv_stream_get_info_uint64_by_name(impl_->stream.get(), name);
    };
    // libaravis calls "resent" what came after it had been asked for, although most of that is only late.
    return {.missing_packets = count("n_missing_packets"),
            .asked_packets = count("n_resend_requests"),
            .late_packets = count("n_resent_packets"),
            .duplicate_packets = count("n_duplicated_packets"),
            .refusals = count("n_error_packets"),
            .underruns = underruns};
}

std::optional<CameraStatistics> Receiver::camera_statistics(std::uint64_t asked) const {
    const std::optional<CameraStatistics>& before = impl_->before;
    if (!before) return std::nullopt;
    std::optional<CameraStatistics> now;
    for (int attempt = 0; attempt < 20; ++attempt) {
        if (attempt > 0) std::this_thread::sleep_for(std::chrono::milliseconds(10));
        now = impl_->camera_counters();
        if (!now) return std::nullopt;
        // Registers have 32 bits and wrap.
        const auto since = [](std::uint64_t then, std::uint64_t value) {
            return std::uint64_t{static_cast<std::uint32_t>(value - then)};
        };
        now = {since(before->asked_packets, now->asked_packets),
               since(before->resent_packets, now->resent_packets),
               since(before->asked_before_sent, now->asked_before_sent),
               since(before->refused_packets, now->refused_packets)};
        if (now->asked_packets >= asked &&
            now->resent_packets + now->asked_before_sent + now->refused_packets >= asked)
            break;
    }
    return now;
}

std::optional<ClockReading> Receiver::read_clock(int attempts) const {
    ArvDevice* device = impl_->device.get();
    const auto read = [device](guint64 address) -> std::optional<std::uint64_t> {
        ErrorSlot error;
        guint32 value = 0;
        if (!arv_device_read_register(device, address, &value, &error)) return std::nullopt;
        return value;
    };
    const auto high = read(reg_tick_high), low = read(reg_tick_low);
    if (!high || !low) return std::nullopt;
    const std::uint64_t ticks_per_s = *high << 32 | *low;
    if (ticks_per_s == 0) return std::nullopt;
    std::optional<ClockReading> best;
    std::int64_t earlier_ns = -1;
    for (int i = 0; i < attempts; ++i) {
        ErrorSlot error;
        const std::int64_t before = realtime_ns();
        if (!arv_device_write_register(device, reg_control, latch, &error)) return std::nullopt;
        const std::int64_t after = realtime_ns();
        const auto time_high = read(reg_time_high), time_low = read(reg_time_low);
        if (!time_high || !time_low) return std::nullopt;
        const std::uint64_t ticks = *time_high << 32 | *time_low;
        const auto camera_ns = static_cast<std::int64_t>(ticks / ticks_per_s * 1'000'000'000u +
                                                         ticks % ticks_per_s * 1'000'000'000u / ticks_per_s);
        // Some cameras acknowledge the latch command and do nothing: a constant value means no latch.
        if (camera_ns <= earlier_ns) return std::nullopt;
        earlier_ns = camera_ns;
        if (!best || after - before < best->round_trip_ns)
            best = {before + (after - before) / 2, before + (after - before) / 2 - camera_ns, after - before};
    }
    return best;
}

std::vector<std::uint16_t> unpack_pixels(std::uint32_t pixel_format, std::size_t pixels,
                                         std::span<const std::uint8_t> data, int& bits) {
    const auto format = static_cast<PixelFormat>(pixel_format);
    int packed_bits = 0;
    switch (format) {
    case PixelFormat::mono8:
        bits = 8, packed_bits = 8;
        break;
    case PixelFormat::mono10:
        bits = 10, packed_bits = 16;
        break;
    case PixelFormat::mono12:
        bits = 12, packed_bits = 16;
        break;
    case PixelFormat::mono14:
        bits = 14, packed_bits = 16;
        break;
    case PixelFormat::mono16:
        bits = 16, packed_bits = 16;
        break;
    case PixelFormat::mono10p:
        bits = 10, packed_bits = 10;
        break;
    case PixelFormat::mono12p:
        bits = 12, packed_bits = 12;
        break;
    default:
        return {};
    }
    if (data.size() * 8 < pixels * static_cast<std::size_t>(packed_bits)) return {};
    std::vector<std::uint16_t> out(pixels);
    // PFNC "p" formats are a little-endian bit stream.
    std::uint32_t reservoir = 0;
    int held = 0;
    std::size_t at = 0;
    const std::uint32_t mask = (1u << packed_bits) - 1;
    for (std::uint16_t& pixel : out) {
        while (held < packed_bits) {
            reservoir |= static_cast<std::uint32_t>(data[at++]) << held;
            held += 8;
        }
        pixel = static_cast<std::uint16_t>(reservoir & mask);
        reservoir >>= packed_bits;
        held -= packed_bits;
    }
    return out;
}

} // namespace obscura::tools
