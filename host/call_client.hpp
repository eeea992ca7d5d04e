// SPDX-License-Identifier: Apache-2.0
// Client of a daemon's calls: fields and answers as JSON, over the C client of the native protocol.
#pragma once

#include "core/io/file_descriptor.hpp"

#include <nlohmann/json.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

struct obscura_answer;
struct obscura_client;

namespace obscura::host {

/// A request that was refused, or cancelled; the connection lives on. what() is the server's line.
class CallRefused : public std::runtime_error {
public:
    CallRefused(std::string the_code, const std::string& message)
        : std::runtime_error(message), code(std::move(the_code)) {}

    std::string code;      ///< word of service/failure.hpp, such as "bad-argument", "controlled", "not-now"
    std::string field{};   ///< of the request; empty: not known
    std::string allowed{}; ///< values that it may have; empty: not known
    std::string hint{};    ///< what to try; empty: nothing
};

/// A connection to the calls of a daemon. Thread-bound.
class CallClient {
public:
    /// Answer of a call.
    class Answer {
    public:
        explicit Answer(obscura_answer* answer);

        nlohmann::ordered_json head; ///< without the rows of the arrays
        /// Elements of an array of type uint16 that lives as long as this, or a copy of this; empty: the
        /// answer has none of that name and type.
        [[nodiscard]] std::span<const std::uint16_t> numbers(std::string_view name) const;
        /// The same of an array of type float32.
        [[nodiscard]] std::span<const float> floats(std::string_view name) const;
        /// Length of each dimension of an array, slowest first; empty: the answer has none of that name.
        [[nodiscard]] std::span<const std::size_t> shape(std::string_view name) const;

        /// Takes a file that came with it, over a Unix socket; empty: there is none of that number.
        [[nodiscard]] FileDescriptor take_file(std::size_t number);

    private:
        std::shared_ptr<obscura_answer> answer_;
    };
    struct Options {
        double timeout_s = 600;                     ///< longest silence of the daemon
        double connect_timeout_s = 10;              ///< longest wait for the connection
        std::string token_file{};                   ///< that the daemon wants; empty: none
        std::uint64_t max_array_bytes = 1ULL << 30; ///< of one answer
    };
    /// `address`: as of [control], "HOST:PORT" or the path of a Unix socket. Throws HardwareError if nothing
    /// answers there, CallRefused if it wants another token.
    CallClient(const std::string& address, const Options& options);

    /// Makes a call; `fields` is an object, or null for none. Throws CallRefused, or HardwareError once the
    /// connection is lost.
    Answer call(const std::string& name, const nlohmann::ordered_json& fields = nullptr);
    /// Sends a request, whose answer wait() gets.
    void begin(const std::string& name, const nlohmann::ordered_json& fields = nullptr);
    /// The answer of the request in progress, waiting at most so long; none: not there yet. Throws as call().
    [[nodiscard]] std::optional<Answer> wait(double wait_s);

private:
    std::shared_ptr<obscura_client> client_;
};

} // namespace obscura::host
