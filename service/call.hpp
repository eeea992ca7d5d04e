// SPDX-License-Identifier: Apache-2.0
// One call of the service: name, fields, result, permission and what it does. Read this header first.
//
// Dispatch, checks, `describe`, the reference page and the clients' stubs are made from these rows. Fields
// are keys of the key engine (config/keys.hpp), so that a field and a key of a file are read, checked and
// explained alike.
#pragma once

#include "config/keys.hpp"
#include "service/failure.hpp"
#include "service/message.hpp"
#include "service/permission.hpp"

#include <nlohmann/json.hpp>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::config {
struct Section;
}

namespace obscura::service {

struct Answer;

/// A call in progress: asked to end, and told how far it is. Used by the thread that runs the call.
class Work {
public:
    virtual ~Work() = default;
    /// Becomes true when the client cancels the call or is gone. The call then throws cancelled().
    [[nodiscard]] virtual const std::atomic<bool>& cancelled() const noexcept = 0;
    /// Tells the client that `done` of `total` is done, at most five times a second.
    virtual void progress(std::uint64_t done, std::uint64_t total) = 0;
    /// What the client may do.
    [[nodiscard]] virtual Permission permission() const noexcept { return Permission::view; }
    /// Counts the bytes of the answer, which are about to be allocated, as memory of the server's clients
    /// until it has been sent. Throws Failure (too_large) if there are too many.
    virtual void reserve(std::uint64_t /*bytes*/) {}

    // For calls that send frames of a stream, each for a credit of the client.

    /// The client's first credits.
    virtual void grant(std::uint32_t /*credits*/) {}
    /// Waits until the client has a credit left and the frame before has been sent. Throws cancelled().
    virtual void await_credit() {}
    /// Sends a frame as an event of the request, after await_credit(). Throws cancelled().
    virtual void push(Answer frame);
};

/// What a cancelled call throws.
[[nodiscard]] inline Failure cancelled() {
    return {FailureCode::cancelled, "cancelled"};
}

/// Answer of a call. `keep` lives until the answer has been sent.
struct Answer {
    nlohmann::json head = nlohmann::json::object();
    std::vector<Array> arrays{};
    std::shared_ptr<void> keep{};
    /// Files that the client gets, over a Unix socket only: max_descriptors at most. `keep` keeps them open.
    std::vector<int> descriptors{};
};

inline void Work::push(Answer /*frame*/) {}

/// A field whose value the call reads by itself, such as the keys of a section.
struct FreeField {
    std::string_view name, type, help;
    nlohmann::json* target = nullptr; ///< null if the request does not have the field
    bool required = false;
};

/// Fields of a call, bound to the struct of its arguments, whose values are the defaults.
struct Fields {
    config::Keys keys;
    std::vector<FreeField> free{};
};

/// A field of the answer.
struct Result {
    std::string_view name, type, unit, help;
};

/// A call with the arguments of one request.
struct BoundCall {
    Fields fields;
    std::function<Answer(Work&)> run;
};

/// One row of the table.
struct Call {
    std::string_view name;
    std::string_view help; ///< one or two sentences for the reference
    Permission permission = Permission::view;
    std::vector<Result> results{};
    /// With the defaults of its arguments.
    std::function<BoundCall()> bind{};
    /// Runs at once, also while other requests of the connection wait; must be quick and must not throw
    /// anything but Failure.
    bool overtakes = false;
    /// Further fields of a request are ignored: those of later versions of the protocol.
    bool lenient = false;
    /// Runs beside the other requests of the connection once those before it are done, on a thread of its
    /// own.
    bool beside = false;
    /// Fields of the events "frame" that a stream sends before its answer; empty: it is none.
    std::vector<Result> frames{};
};
using Calls = std::vector<Call>;

/// A row for a struct of arguments with a member `Fields fields()`; `run` is called with it and the work.
template<typename Arguments, typename Run>
[[nodiscard]] Call call(std::string_view name, Permission permission, std::string_view help, Run run) {
    Call made{name, help, permission};
    made.bind = [run] {
        const auto arguments = std::make_shared<Arguments>();
        return BoundCall{arguments->fields(), [run, arguments](Work& work) { return run(*arguments, work); }};
    };
    return made;
}
/// Arguments of a call without fields.
struct NoArguments {
    [[nodiscard]] static Fields fields() { return {}; }
};

/// The row called `name`. Throws Failure (unknown_call) with the names that there are.
[[nodiscard]] const Call& find_call(const Calls& calls, std::string_view name);

/// The call with the fields of `request`, the head of a message. Throws Failure (bad_argument) at the first
/// mistake.
[[nodiscard]] BoundCall bind(const Call& call, const nlohmann::json& request);

/// Reads `values`, a map, into the targets of `keys`; those that it does not name stay. Throws Failure
/// (bad_argument) at the first mistake, with the name of the key as its field.
void read_values(std::string_view call, const nlohmann::json& values, const config::Keys& keys);

/// Reads `values`, a map that is the field `field` of a request, into `section` as a table of a file is read.
/// Throws Failure (bad_argument) at the first mistake, with the dotted path of the key as its field.
void read_section(std::string_view call, const std::string& field, const nlohmann::json& values,
                  const config::Section& section);

/// Rows as `describe` gives them.
[[nodiscard]] nlohmann::json describe(const Calls& calls);

/// Rows of keys as `describe` gives them: name, type, unit, allowed, default, help, required.
[[nodiscard]] nlohmann::json describe(const config::Keys& keys);

/// Rows of members of an answer: name, type, unit, help.
[[nodiscard]] nlohmann::json describe(const std::vector<Result>& results);

/// The value of a head as that of a file. Throws Failure (bad_argument) with `field` for nil.
[[nodiscard]] config::Value value_of(const nlohmann::json& json, const std::string& field);
/// The other way round.
[[nodiscard]] nlohmann::json json_of(const config::Value& value);

} // namespace obscura::service
