// SPDX-License-Identifier: Apache-2.0
// HTTP server of the LXI identification document: one answer a connection, and nothing else.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "instrument/link/admission.hpp"
#include "service/acceptor.hpp"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace obscura::instrument {

/// Thread-bound.
class LxiServer {
public:
    static constexpr std::size_t max_clients = 16;
    static constexpr std::size_t max_head_bytes = 4096;
    static constexpr std::chrono::seconds timeout{2}; ///< for the head of a request

    /// `scpi_port`: that the document names; 0: none. `admission` outlives this.
    LxiServer(service::Listener listener, std::string version, std::uint16_t scpi_port,
              const Admission& admission);

    /// Serves until `stopped` returns true, which is asked five times a second.
    void run(const std::function<bool()>& stopped);

private:
    struct Client {
        FileDescriptor socket;
        std::string head;
        std::chrono::steady_clock::time_point until;
    };
    /// Reads what has come. False: the client has been answered, or given up.
    [[nodiscard]] bool serve(Client& client) const;

    service::Acceptor acceptor_;
    const std::string version_;
    const std::uint16_t scpi_port_;
    std::vector<Client> clients_;
};

} // namespace obscura::instrument
