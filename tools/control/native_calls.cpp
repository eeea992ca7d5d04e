// SPDX-License-Identifier: Apache-2.0
#include "tools/control/native_calls.hpp"

#include "host/call_client.hpp"
#include "host/interrupt.hpp"
#include "tools/control/daemon_options.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <optional>
#include <utility>

namespace obscura::tools {
namespace {

/// A frame of 16,384 x 16,384 pixels.
constexpr std::uint64_t max_array_bytes = 1ULL << 29;
/// How soon an interrupt ends a wait.
constexpr double poll_interval_s = 0.2;

std::string line_of(std::string_view verb, std::string message) {
    // What the library asks there is of the rendering server.
    message.erase(std::min(message.find(" (is `obscura serve`"), message.size()));
    return fmt::format("obscura {}: {}", verb, message);
}

class NativeCalls final : public host::DaemonCalls {
public:
    NativeCalls(std::string_view verb, const std::string& address, const host::CallClient::Options& options)
        : verb_(verb), client_(address, options) {}

    [[nodiscard]] host::CallAnswer call(std::string_view name, const host::CallJson& fields) override {
        try {
            client_.begin(std::string(name), fields);
            while (true) {
                if (std::optional<host::CallClient::Answer> answer = client_.wait(poll_interval_s))
                    return answer_of(*answer);
                if (host::interrupted()) throw host::Interrupted();
            }
        } catch (const host::CallRefused& refused) {
            if (refused.code == "unknown-call")
                throw host::CallError(
                    refused.code,
                    fmt::format(
                        "obscura {}: the daemon has no call {}: it is of another version than this program",
                        verb_, name));
            throw host::CallError(refused.code, refusal_line(verb_, name, refused.what(), refused.hint));
        } catch (const HardwareError& error) {
            throw HardwareError(line_of(verb_, error.what()));
        }
    }

private:
    static host::CallAnswer answer_of(host::CallClient::Answer& answer) {
        host::CallAnswer out{std::move(answer.head)};
        const auto pixels = answer.numbers("pixels");
        const auto shape = answer.shape("pixels");
        constexpr std::size_t longest = 65536;
        if (shape.size() != 2 || shape[0] > longest || shape[1] > longest) return out;
        out.height = static_cast<std::int32_t>(shape[0]);
        out.width = static_cast<std::int32_t>(shape[1]);
        out.pixels.assign(pixels.begin(), pixels.end());
        return out;
    }

    std::string verb_;
    host::CallClient client_;
};

} // namespace

std::unique_ptr<host::DaemonCalls> connect_natively(std::string_view verb, const std::string& address,
                                                    const NativeOptions& options) {
    const bool is_path = address.find('/') != std::string::npos;
    if (is_path && ::access(address.c_str(), W_OK) != 0 && errno == EACCES)
        throw host::CallError(
            "forbidden",
            fmt::format(
                "obscura {}: {}: only root, the daemon's user and members of its group may (adduser NAME obscura)",
                verb, address));
    try {
        return std::make_unique<NativeCalls>(verb, address,
                                             host::CallClient::Options{.timeout_s = options.timeout_s,
                                                                       .token_file = options.token_file,
                                                                       .max_array_bytes = max_array_bytes});
    } catch (const host::CallRefused& refused) {
        throw host::CallError(refused.code, refusal_line(verb, "hello", refused.what(), refused.hint));
    } catch (const HardwareError& error) {
        throw HardwareError(line_of(verb, error.what()));
    }
}

} // namespace obscura::tools
