// SPDX-License-Identifier: Apache-2.0
// GenICam engine: features of a camera description by name, evaluated by Aravis on registers in memory.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace obscura::transports::gige {

/// Reads and writes the features of a description from an untrusted file. Thread-bound: control thread.
/// Getters and setters return false when the feature is absent, of another kind, or cannot be evaluated.
class GenicamEngine {
public:
    /// Address space of the registers. The functions return false when an address does not exist.
    class Memory {
    public:
        virtual ~Memory() = default;
        virtual bool load(std::uint64_t address, std::span<std::uint8_t> out) = 0;
        virtual bool store(std::uint64_t address, std::span<const std::uint8_t> bytes) = 0;
    };
    enum class Kind : std::uint8_t { absent, number, choice, flag, command, text };
    /// Addresses of one register node.
    struct RegisterRange {
        std::uint64_t begin = 0, end = 0;
        bool writable = false;
        bool indexed = false; ///< the addresses depend on a selector
    };

    /// `memory` must outlive the engine. Throws ConfigError with one line that does not name the file: not a
    /// GenICam description, a value that refers to itself, a register of length 0 or above the limit.
    /// Features that take too many steps to evaluate count as absent.
    GenicamEngine(const std::string& xml, Memory& memory);
    ~GenicamEngine();
    GenicamEngine(const GenicamEngine&) = delete;
    GenicamEngine& operator=(const GenicamEngine&) = delete;

    /// Suppresses messages of GLib, Aravis and libxml2 in the whole process while the result lives. For
    /// start-up, on one thread.
    [[nodiscard]] static std::shared_ptr<void> suppress_messages();

    [[nodiscard]] Kind kind(const std::string& feature) const;
    bool get(const std::string& feature, double& number);
    bool get(const std::string& feature, std::string& text);
    bool set(const std::string& feature, double number);
    bool set(const std::string& feature, const std::string& text);
    bool execute(const std::string& command);
    /// Registers of the device (not of chunks), as their selectors are now.
    [[nodiscard]] std::vector<RegisterRange> registers();

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace obscura::transports::gige
