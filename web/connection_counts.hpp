// SPDX-License-Identifier: Apache-2.0
// Numbers of connections by address and by session.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>

namespace obscura::web {

/// Numbers of connections, each under a name. Thread-bound.
class NamedCounts {
public:
    [[nodiscard]] std::size_t of(std::string_view name) const {
        const auto found = counts_.find(name);
        return found == counts_.end() ? 0 : found->second;
    }
    void add(const std::string& name) { ++counts_[name]; }
    /// After an add() of that name.
    void remove(const std::string& name) {
        if (--counts_[name] == 0) counts_.erase(name);
    }

private:
    std::map<std::string, std::size_t, std::less<>> counts_;
};

/// Connections: those without an admitted request by address, which users behind one proxy share, the others
/// by the session of their holder. Thread-bound.
struct ConnectionCounts {
    std::size_t all = 0;
    NamedCounts strangers{}, of_session{};
};

/// Place of one connection in the counts, which outlive it. Thread-bound.
class CountedConnection {
public:
    CountedConnection(ConnectionCounts& counts, std::string address)
        : counts_(counts), address_(std::move(address)) {
        ++counts_.all;
        counts_.strangers.add(address_);
    }
    ~CountedConnection() {
        leave();
        --counts_.all;
    }
    CountedConnection(const CountedConnection&) = delete;
    CountedConnection& operator=(const CountedConnection&) = delete;

    [[nodiscard]] const std::string& address() const { return address_; }
    /// Counts as one of `session` (not empty) from now on; false if that has `most` of them already.
    bool join(const std::string& session, std::size_t most) {
        if (session_ == session) return true;
        if (counts_.of_session.of(session) >= most) return false;
        leave();
        session_ = session;
        counts_.of_session.add(session);
        return true;
    }

private:
    void leave() {
        if (session_.empty())
            counts_.strangers.remove(address_);
        else
            counts_.of_session.remove(session_);
    }

    ConnectionCounts& counts_;
    const std::string address_;
    std::string session_; ///< empty: a stranger
};

} // namespace obscura::web
