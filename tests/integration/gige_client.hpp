// SPDX-License-Identifier: Apache-2.0
// Small helpers around libaravis, the independent GigE Vision client of the tests.
#pragma once

#include <arv.h>
#include <unistd.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace obscura::test {

/// A loopback address that no other test process uses now: GVCP knows one port only.
inline std::string own_loopback_address() {
    const int pid = getpid();
    return "127." + std::to_string(64 + (pid >> 14 & 63)) + "." + std::to_string(pid >> 6 & 255) + "." +
           std::to_string((pid & 63) * 4 + 1);
}

struct ObjectDeleter {
    void operator()(void* object) const { g_object_unref(object); }
};
template<typename T>
using Object = std::unique_ptr<T, ObjectDeleter>;

/// Throws std::runtime_error with the text of `error`, if set.
inline void check(GError*& error, const char* what) {
    if (error == nullptr) return;
    const std::string text = std::string(what) + ": " + error->message;
    g_clear_error(&error);
    throw std::runtime_error(text);
}

/// A connection to a camera by address, and its stream.
class GigeClient {
public:
    explicit GigeClient(const std::string& address) {
        GError* error = nullptr;
        camera_.reset(arv_camera_new(address.c_str(), &error));
        check(error, "connect");
        // The packet socket hands packets over in blocks of 5 ms and needs privileges that not every user
        // has.
        arv_camera_gv_set_stream_options(camera_.get(), ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
    }

    [[nodiscard]] ArvCamera* camera() const { return camera_.get(); }
    [[nodiscard]] ArvDevice* device() const { return arv_camera_get_device(camera_.get()); }

    void set(const char* feature, const char* value) {
        GError* error = nullptr;
        arv_camera_set_string(camera_.get(), feature, value, &error);
        check(error, feature);
    }
    void set(const char* feature, std::int64_t value) {
        GError* error = nullptr;
        arv_camera_set_integer(camera_.get(), feature, value, &error);
        check(error, feature);
    }
    void set(const char* feature, double value) {
        GError* error = nullptr;
        arv_camera_set_float(camera_.get(), feature, value, &error);
        check(error, feature);
    }
    void set_flag(const char* feature, bool value) {
        GError* error = nullptr;
        arv_camera_set_boolean(camera_.get(), feature, value ? TRUE : FALSE, &error);
        check(error, feature);
    }
    [[nodiscard]] std::int64_t integer(const char* feature) {
        GError* error = nullptr;
        const std::int64_t value = arv_camera_get_integer(camera_.get(), feature, &error);
        check(error, feature);
        return value;
    }
    [[nodiscard]] bool flag(const char* feature) {
        GError* error = nullptr;
        const bool value = arv_camera_get_boolean(camera_.get(), feature, &error) != FALSE;
        check(error, feature);
        return value;
    }
    [[nodiscard]] double real(const char* feature) {
        GError* error = nullptr;
        const double value = arv_camera_get_float(camera_.get(), feature, &error);
        check(error, feature);
        return value;
    }
    [[nodiscard]] std::string text(const char* feature) {
        GError* error = nullptr;
        const char* value = arv_camera_get_string(camera_.get(), feature, &error);
        const std::string copy = value != nullptr ? value : "";
        check(error, feature);
        return copy;
    }
    void execute(const char* command) {
        GError* error = nullptr;
        arv_camera_execute_command(camera_.get(), command, &error);
        check(error, command);
    }

    void open_stream(int buffers) {
        GError* error = nullptr;
        const auto payload = static_cast<std::size_t>(integer("PayloadSize"));
        stream_.reset(arv_camera_create_stream(camera_.get(), nullptr, nullptr, &error));
        check(error, "stream");
        // A test machine may be busy with anything: wait long for what is missing, and have room for what
        // comes.
        g_object_set(stream_.get(), "frame-retention", 3'000'000U, "packet-timeout", 20'000U,
                     "packet-request-ratio", 1.0, "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED,
                     "socket-buffer-size", 4 << 20, nullptr);
        for (int i = 0; i < buffers; ++i)
            arv_stream_push_buffer(stream_.get(), arv_buffer_new_allocate(payload));
    }
    void close_stream() { stream_.reset(); }
    [[nodiscard]] ArvStream* stream() const { return stream_.get(); }
    /// The next buffer, complete or not; nothing after `timeout_ms`.
    Object<ArvBuffer> next(int timeout_ms = 120'000) {
        return Object<ArvBuffer>(
            arv_stream_timeout_pop_buffer(stream_.get(), static_cast<guint64>(timeout_ms) * 1000));
    }
    void give_back(Object<ArvBuffer> buffer) { arv_stream_push_buffer(stream_.get(), buffer.release()); }

private:
    Object<ArvCamera> camera_;
    Object<ArvStream> stream_;
};

} // namespace obscura::test
