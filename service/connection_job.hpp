// SPDX-License-Identifier: Apache-2.0
// Request of a connection, from its arrival to its answer.
#pragma once

#include "service/connection.hpp"
#include "service/failure.hpp"

#include <nlohmann/json.hpp>

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

namespace obscura::service {

[[nodiscard]] Outgoing error_message(std::uint32_t id, const Failure& failure);
/// Throws Failure (forbidden).
void check_permission(const Call& call, Permission permission);
/// The name of the call that a request wants. Throws Failure (bad_message).
[[nodiscard]] const std::string& name_of_call(const nlohmann::json& request);

/// Made by the server's thread; then of the thread that runs it, but for what is atomic, and `credits`.
class Connection::Job final : public Work {
public:
    /// Request of a client with that permission. `the_text`: the head, unless it has been read already.
    Job(Connection& connection, std::uint32_t the_id, std::string the_text, nlohmann::json the_request)
        : id(the_id),
          granted(connection.access_.permission.value_or(Permission::view)),
          text(std::move(the_text)),
          request(std::move(the_request)),
          lane(&connection),
          connection_(connection) {}

    const std::uint32_t id;
    const Permission granted;
    std::string text;
    nlohmann::json request;
    const void* lane;                       ///< of its messages: the connection, but of streams the job
    std::atomic<const Call*> call{nullptr}; ///< null: not yet known
    std::atomic<bool> stop{false};
    std::atomic<std::uint64_t> done{0}, total{0};
    std::uint32_t credits = 0; ///< with the connection's mutex
    MemoryAccount::Share share;

    [[nodiscard]] const std::atomic<bool>& cancelled() const noexcept override { return stop; }
    [[nodiscard]] Permission permission() const noexcept override { return granted; }
    void reserve(std::uint64_t bytes) override {
        share = {};
        share = connection_.context_.memory.take(bytes);
    }
    void progress(std::uint64_t now_done, std::uint64_t now_total) override {
        if (now_done == 0) begun_ = Clock::now().time_since_epoch();
        done = now_done, total = now_total;
    }
    void grant(std::uint32_t more) override { (void)connection_.grant(id, more); }
    void await_credit() override { connection_.await_credit(*this); }
    void push(Answer frame) override { connection_.push(*this, std::move(frame)); }

    /// How far the call is; none: it has not said.
    [[nodiscard]] std::optional<nlohmann::json> news(Clock::time_point now) const {
        const std::uint64_t now_done = done, now_total = total;
        if (now_total == 0) return {};
        nlohmann::json head{{"event", "progress"}, {"done", now_done}, {"total", now_total}};
        const double spent_s = std::chrono::duration<double>(now.time_since_epoch() - begun_.load()).count();
        if (now_done > 0)
            head["left_s"] =
                spent_s * static_cast<double>(now_total - now_done) / static_cast<double>(now_done);
        return head;
    }

private:
    Connection& connection_;
    std::atomic<Clock::duration> begun_{Clock::now().time_since_epoch()};
};

} // namespace obscura::service
