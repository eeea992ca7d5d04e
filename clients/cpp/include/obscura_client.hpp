// SPDX-License-Identifier: Apache-2.0
// C++17 client of the Obscura rendering server: owners, exceptions and std:: types over libobscura-client.
/**
 * @file
 * C++17 client of the Obscura rendering server (`obscura serve`), header-only over libobscura-client.
 *
 *     auto camera = obscura::client::start("demo");
 *     auto picture = camera.render();
 *     std::cout << picture["irradiance"].at(0, 128, 128) << " W/m2\n";
 *
 * Failures throw RequestError, Cancelled, ConnectionLost or BadUse, all of them Error. A client is for one
 * thread at a time, cancel() for any. Names of keys, calls and fields: docs/reference/scene.md and
 * docs/reference/calls.md.
 */
#pragma once

#include "obscura_client.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace obscura::client {

/// What went wrong: what() is one line for people, with the server's hint.
class Error : public std::runtime_error {
public:
    explicit Error(const obscura_error& error)
        : std::runtime_error(error.hint[0] == 0 ? std::string(error.message)
                                                : std::string(error.message) + " (" + error.hint + ")"),
          code(error.code),
          field(error.field),
          allowed(error.allowed),
          hint(error.hint) {}

    std::string code;    ///< word such as "bad-argument", "bad-scene", "connection-lost"
    std::string field;   ///< what of the request or scene is wrong; empty: not known
    std::string allowed; ///< values that it may have; empty: not known
    std::string hint;    ///< what to try; empty: nothing
};
/// The server refused a request; the connection lives on and the scene is as it was.
class RequestError : public Error {
    using Error::Error;
};
/// The request was cancelled; the connection lives on.
class Cancelled : public Error {
    using Error::Error;
};
/// The server is gone, cannot be reached, does not answer in time or does not speak the protocol.
class ConnectionLost : public Error {
    using Error::Error;
};
/// Nothing was sent: an argument is wrong, or memory is short.
class BadUse : public Error {
    using Error::Error;
};

/// Throws the exception for a status other than OBSCURA_OK and OBSCURA_PENDING.
inline void check(obscura_status status, const obscura_error& error) {
    switch (status) {
    case OBSCURA_OK:
    case OBSCURA_PENDING:
        return;
    case OBSCURA_REFUSED:
        throw RequestError(error);
    case OBSCURA_CANCELLED:
        throw Cancelled(error);
    case OBSCURA_LOST:
        throw ConnectionLost(error);
    case OBSCURA_BAD_USE:
        break;
    }
    throw BadUse(error);
}

/// View of a value in an answer; valid while the answer, or the Value, lives. What is not there is nil.
class ValueView {
public:
    ValueView(const obscura_value* value = nullptr) noexcept : value_(value) {}

    [[nodiscard]] obscura_type type() const noexcept { return obscura_type_of(value_); }
    [[nodiscard]] bool is_nil() const noexcept { return type() == OBSCURA_NIL; }
    [[nodiscard]] std::size_t size() const noexcept { return obscura_count(value_); }
    [[nodiscard]] ValueView operator[](const char* name) const noexcept {
        return {obscura_find(value_, name)};
    }
    [[nodiscard]] ValueView operator[](std::size_t number) const noexcept {
        return {obscura_at(value_, number)};
    }
    /// Name of a member by number; empty: there is none.
    [[nodiscard]] std::string_view name(std::size_t number) const noexcept {
        const char* const name = obscura_name_at(value_, number);
        return name == nullptr ? std::string_view() : name;
    }
    /// The value as `otherwise` is: number, integer, true or false; `otherwise` if it is none.
    template<typename T>
    [[nodiscard]] T as(T otherwise) const noexcept {
        static_assert(std::is_arithmetic_v<T>);
        if constexpr (std::is_same_v<T, bool>)
            return type() == OBSCURA_BOOL ? obscura_as_bool(value_) != 0 : otherwise;
        else if constexpr (std::is_floating_point_v<T>)
            return static_cast<T>(obscura_as_number(value_, static_cast<double>(otherwise)));
        else
            return static_cast<T>(obscura_as_int(value_, static_cast<std::int64_t>(otherwise)));
    }
    /// The string; empty if it is none.
    [[nodiscard]] std::string string() const {
        return type() == OBSCURA_STRING ? std::string(obscura_as_string(value_), size()) : std::string();
    }
    /// The elements of an array that are numbers.
    [[nodiscard]] std::vector<double> numbers() const {
        std::vector<double> all;
        for (std::size_t i = 0; i < size(); ++i)
            if (const ValueView each = (*this)[i];
                each.type() == OBSCURA_NUMBER || each.type() == OBSCURA_INT)
                all.push_back(each.as(0.0));
        return all;
    }
    [[nodiscard]] const obscura_value* get() const noexcept { return value_; }

private:
    const obscura_value* value_;
};

class Map;

/// A value that is sent: nil, true or false, a number, a string, an array ({1, 2, 3}, vectors), a Map.
class Value {
public:
    Value(std::nullptr_t = nullptr) : value_(obscura_nil()) {}
    Value(const char* text) : value_(obscura_string(text)) {}
    Value(std::string_view text) : value_(obscura_text(text.data(), text.size())) {}
    Value(const std::string& text) : Value(std::string_view(text)) {}
    template<typename T, std::enable_if_t<std::is_arithmetic_v<T>, int> = 0>
    Value(T number) : value_(make(number)) {}
    Value(std::initializer_list<Value> elements) : value_(obscura_array_new()) {
        for (const Value& each : elements)
            obscura_append(value_.get(), Value(each).release());
    }
    template<typename T>
    Value(const std::vector<T>& elements) : value_(obscura_array_new()) {
        for (const auto& each : elements)
            obscura_append(value_.get(), Value(each).release());
    }
    inline Value(Map map);
    explicit Value(ValueView value) : value_(obscura_value_copy(value.get())) {}
    Value(const Value& other) : value_(obscura_value_copy(other.value_.get())) {}
    Value(Value&& other) noexcept = default;
    Value& operator=(const Value& other) { return *this = Value(other); }
    Value& operator=(Value&& other) noexcept = default;
    ~Value() = default;

    [[nodiscard]] ValueView view() const noexcept { return {value_.get()}; }
    /// Hands the value to a function of the C interface.
    [[nodiscard]] obscura_value* release() noexcept { return value_.release(); }

private:
    friend class Map;
    struct Free {
        void operator()(obscura_value* value) const noexcept { obscura_value_free(value); }
    };
    template<typename T>
    static obscura_value* make(T number) {
        if constexpr (std::is_same_v<T, bool>)
            return obscura_bool(number ? 1 : 0);
        else if constexpr (std::is_floating_point_v<T>)
            return obscura_number(static_cast<double>(number));
        else
            return obscura_int(static_cast<std::int64_t>(number));
    }
    std::unique_ptr<obscura_value, Free> value_;
};

/// Map of names and values: Map{{"width", 640}, {"boresight", {0, 0, 1}}}.
class Map {
public:
    Map() : value_(empty()) {}
    Map(std::initializer_list<std::pair<const char*, Value>> members) : Map() {
        for (const auto& [name, value] : members)
            put(name, value);
    }
    /// Puts a member in, instead of one of that name.
    Map& put(const char* name, Value value) {
        obscura_put(value_.value_.get(), name, value.release());
        return *this;
    }
    [[nodiscard]] obscura_value* release() noexcept { return value_.release(); }

private:
    friend class Value;
    static Value empty() {
        Value value;
        value.value_.reset(obscura_map_new());
        return value;
    }
    Value value_;
};

inline Value::Value(Map map) : value_(map.release()) {}

/// View of an array of float32, or of another type, in an answer; valid while the answer lives.
class Array {
public:
    explicit Array(const obscura_array& array) noexcept : array_(&array) {}

    [[nodiscard]] std::string_view name() const noexcept { return array_->name; }
    [[nodiscard]] std::string_view dtype() const noexcept { return array_->dtype; }
    [[nodiscard]] std::vector<std::size_t> shape() const {
        return {array_->shape, array_->shape + array_->dimensions};
    }
    [[nodiscard]] const void* data() const noexcept { return array_->data; }
    [[nodiscard]] std::size_t bytes() const noexcept { return array_->bytes; }
    [[nodiscard]] std::size_t size() const noexcept { return array_->count; }
    /// The elements, if they are float32; else both null.
    [[nodiscard]] const float* begin() const noexcept { return array_->floats; }
    [[nodiscard]] const float* end() const noexcept {
        return array_->floats == nullptr ? nullptr : array_->floats + array_->count;
    }
    /// Element at [row, column] of a layer or [band, row, column] of a picture. Throws std::out_of_range.
    template<typename... Index>
    [[nodiscard]] float at(Index... index) const {
        const std::size_t place[] = {static_cast<std::size_t>(index)...};
        std::size_t offset = 0;
        bool inside = array_->floats != nullptr && sizeof...(index) == array_->dimensions;
        for (std::size_t i = 0; inside && i < sizeof...(index); ++i) {
            inside = place[i] < array_->shape[i];
            offset = offset * array_->shape[i] + place[i];
        }
        if (!inside) throw std::out_of_range("no such element of the float32 array " + std::string(name()));
        return array_->floats[offset];
    }

private:
    const obscura_array* array_;
};

/// Answer of a call: a map and arrays. A picture is the answer of render().
class Answer {
public:
    explicit Answer(obscura_answer* answer) noexcept : answer_(answer) {}

    [[nodiscard]] ValueView map() const noexcept { return {obscura_answer_map(answer_.get())}; }
    /// All arrays; the first of a picture is "irradiance" or "radiance".
    [[nodiscard]] std::vector<Array> arrays() const {
        std::vector<Array> all;
        for (std::size_t i = 0; i < obscura_array_count(answer_.get()); ++i)
            all.emplace_back(*obscura_array_at(answer_.get(), i));
        return all;
    }
    /// The array of that name. Throws std::out_of_range.
    [[nodiscard]] Array operator[](const char* name) const {
        const obscura_array* const found = obscura_array_find(answer_.get(), name);
        if (found == nullptr) throw std::out_of_range(std::string("the answer has no array ") + name);
        return Array(*found);
    }

private:
    struct Free {
        void operator()(obscura_answer* answer) const noexcept { obscura_answer_free(answer); }
    };
    std::unique_ptr<obscura_answer, Free> answer_;
};
using Picture = Answer;

/// Fields of `render`; what is not given has the server's default.
struct RenderOptions {
    double time_s = 0;
    std::optional<double> exposure_s, error;
    std::optional<int> width, height, samples, max_samples, bounces;
    std::optional<std::int64_t> seed, frame;
    std::vector<int> window; ///< column, row, width, height; empty: all
    std::vector<std::string> layers;
    bool truth = false;
    std::string
        sensor; ///< that exposes the picture: shipped, or a file below the server's folder; empty: none
    std::optional<double> gain_db; ///< of a sensor

    [[nodiscard]] Map fields() const {
        Map map{{"time_s", time_s}, {"truth", truth}};
        const auto put = [&map](const char* name, const auto& value) {
            if (value) map.put(name, *value);
        };
        put("exposure_s", exposure_s);
        put("error", error);
        put("width", width);
        put("height", height);
        put("samples", samples);
        put("max_samples", max_samples);
        put("bounces", bounces);
        put("seed", seed);
        put("frame", frame);
        if (!window.empty()) map.put("window", window);
        put("gain_db", gain_db);
        if (!sensor.empty()) map.put("sensor", sensor);
        if (!layers.empty()) map.put("layers", layers);
        return map;
    }
};

/// Frames of a stream in a range-based for loop, which may be left at any time. Keeps no other than the one
/// at hand.
class Frames {
public:
    explicit Frames(obscura_client* client) : client_(client) {}

    /// Behind the last frame.
    struct End {};
    /// Input iterator, which waits for the next frame.
    class Iterator {
    public:
        explicit Iterator(obscura_client* client) : client_(client) { ++*this; }
        [[nodiscard]] const Answer& operator*() const noexcept { return *frame_; }
        [[nodiscard]] const Answer* operator->() const noexcept { return &*frame_; }
        Iterator& operator++() {
            frame_.reset();
            obscura_answer* frame = nullptr;
            check(obscura_next(client_, -1, &frame), *obscura_last_error(client_));
            if (frame != nullptr) frame_.emplace(frame);
            return *this;
        }
        [[nodiscard]] bool operator!=(End /*end*/) const noexcept { return frame_.has_value(); }

    private:
        obscura_client* client_;
        std::optional<Answer> frame_;
    };
    [[nodiscard]] Iterator begin() const { return Iterator(client_); }
    [[nodiscard]] End end() const noexcept { return {}; }

private:
    obscura_client* client_;
};

/// Hears of a call that takes long: done, total, seconds left (NaN: not known). Returning false cancels the
/// call.
using Progress = std::function<bool(std::int64_t, std::int64_t, double)>;

/// A connection and its scene, which ends with it.
class Client {
public:
    /// Takes over a client of the C interface.
    explicit Client(obscura_client* client) : client_(client), progress_(std::make_unique<Told>()) {}

    /// What the server said of itself: version, permission, limits.
    [[nodiscard]] ValueView server() const noexcept { return {obscura_server(client_.get())}; }
    [[nodiscard]] obscura_client* get() const noexcept { return client_.get(); }

    /// Any call of the server.
    Answer call(const char* name, Map fields = {}) {
        obscura_answer* answer = nullptr;
        finish(obscura_call(get(), name, fields.release(), &answer));
        return Answer(answer);
    }
    /// Sends a request without waiting; one in progress is cancelled and forgotten.
    void begin(const char* name, Map fields = {}) { finish(obscura_begin(get(), name, fields.release())); }
    /// The answer of the request in progress, waiting at most so long (below 0: the client's timeout); none
    /// yet: nullopt.
    std::optional<Answer> wait(double wait_s = -1) {
        obscura_answer* answer = nullptr;
        const obscura_status status = obscura_wait(get(), wait_s, &answer);
        finish(status);
        return status == OBSCURA_PENDING ? std::nullopt : std::optional<Answer>(std::in_place, answer);
    }
    /// Opens a stream of a camera's daemon: `for (const Answer& frame : client.frames({{"every", 10}}))`. The
    /// next request ends it.
    Frames frames(Map fields = {}) {
        begin("stream", std::move(fields));
        return Frames(get());
    }
    /// Cancels the request in progress; for any thread.
    void cancel() noexcept { obscura_cancel(get()); }
    /// Function that hears of the progress of further calls; an exception of it cancels the call and comes
    /// out of it.
    void on_progress(Progress progress) {
        progress_->function = std::move(progress);
        obscura_set_progress(get(), progress_->function ? tell : nullptr, progress_.get());
    }

    /// Replaces the scene: a shipped one ("demo"), or a file below the server's folder.
    void load(const std::string& file) { finish(obscura_load(get(), file.c_str())); }
    /// Replaces the scene by the text of a scene file.
    void load_toml(const std::string& toml) { finish(obscura_load_toml(get(), toml.c_str())); }
    /// Replaces the scene by tables.
    void load_scene(Map scene) { finish(obscura_load_scene(get(), scene.release())); }
    /// Changes keys of a table: set("camera", {{"width", 640}}).
    void set(const std::string& section, Map keys) {
        finish(obscura_set(get(), section.c_str(), nullptr, keys.release()));
    }
    /// Changes keys of an element: set("body", "ball", {{"albedo", 0.3}}).
    void set(const std::string& section, const std::string& item, Map keys) {
        finish(obscura_set(get(), section.c_str(), item.c_str(), keys.release()));
    }
    /// Adds an element of "body", "lamp", ...
    void add(const std::string& section, Map keys) {
        finish(obscura_add(get(), section.c_str(), keys.release()));
    }
    /// Removes a table.
    void remove(const std::string& section) { finish(obscura_remove(get(), section.c_str(), nullptr)); }
    /// Removes an element.
    void remove(const std::string& section, const std::string& item) {
        finish(obscura_remove(get(), section.c_str(), item.c_str()));
    }
    /// The keys that a table, or an element, gives.
    [[nodiscard]] Value get(const std::string& section, const std::optional<std::string>& item = {}) {
        Map fields{{"section", section}};
        if (item) fields.put("item", *item);
        return Value(call("scene.get", std::move(fields)).map()["keys"]);
    }
    /// The scene as a scene file.
    [[nodiscard]] std::string export_toml() { return call("scene.export").map()["toml"].string(); }
    /// Renders the scene.
    Picture render(const RenderOptions& options = {}) { return call("render", options.fields()); }

private:
    struct Close {
        void operator()(obscura_client* client) const noexcept { obscura_close(client); }
    };
    struct Told {
        Progress function;
        std::exception_ptr thrown;
    };
    static int tell(void* context, std::int64_t done, std::int64_t total, double left_s) noexcept {
        auto& told = *static_cast<Told*>(context);
        try {
            return told.function(done, total, left_s) ? 0 : 1;
        } catch (...) {
            if (!told.thrown) told.thrown = std::current_exception();
            return 1;
        }
    }
    void finish(obscura_status status) {
        if (status != OBSCURA_PENDING)
            if (const std::exception_ptr thrown = std::exchange(progress_->thrown, nullptr))
                std::rethrow_exception(thrown);
        check(status, *obscura_last_error(get()));
    }

    std::unique_ptr<obscura_client, Close> client_;
    std::unique_ptr<Told> progress_; ///< stays where it is when the client moves
};

/// Client of a server that runs: "HOST:PORT", or the path of its Unix socket. `token_file`: file of the token
/// that the server wants; empty: none.
inline Client connect(const std::string& address = "127.0.0.1:5152", double timeout_s = 600,
                      const std::string& token_file = {}) {
    obscura_error error;
    obscura_connect_options options{};
    options.timeout_s = timeout_s;
    options.token_file = token_file.empty() ? nullptr : token_file.c_str();
    obscura_client* const client = obscura_connect(address.c_str(), &options, &error);
    if (client == nullptr) check(error.status, error);
    return Client(client);
}

/// How start() starts a server.
struct StartOptions {
    std::string root;    ///< folder below which scenes may name files; empty: the working directory
    std::string program; ///< program `obscura`; empty: that of the environment variable OBSCURA, else of PATH
    int threads = 0;     ///< render threads; 0: one per core
    double timeout_s = 600;
};
/// Client of a server of this program's own, which ends with it. `scene`: what to begin with; empty: nothing.
inline Client start(const std::string& scene = {}, const StartOptions& options = {}) {
    const auto given = [](const std::string& text) { return text.empty() ? nullptr : text.c_str(); };
    obscura_error error;
    obscura_start_options how{};
    how.scene = given(scene);
    how.root = given(options.root);
    how.program = given(options.program);
    how.threads = options.threads;
    how.timeout_s = options.timeout_s;
    obscura_client* const client = obscura_start(&how, &error);
    if (client == nullptr) check(error.status, error);
    return Client(client);
}

} // namespace obscura::client
