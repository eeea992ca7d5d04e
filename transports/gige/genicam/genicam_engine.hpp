// SPDX-License-Identifier: Apache-2.0
// A GenICam description evaluated by Aravis on memory of our own, by feature name.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace obscura::transports::gige {

/// Reads and writes the features of a description that somebody else wrote. Not thread safe: control thread
/// only. Getters and setters return false when the feature is not there, of another kind, or cannot be
/// evaluated.
class GenicamEngine {
public:
    /// Where registers lie. False: no such address.
    class Memory {
    public:
        virtual ~Memory() = default;
        virtual bool load(std::uint64_t address, std::span<std::uint8_t> out) = 0;
        virtual bool store(std::uint64_t address, std::span<const std::uint8_t> bytes) = 0;
    };
    enum class Kind : std::uint8_t { absent, number, choice, flag, command, text };
    /// What one register node covers.
    struct RegisterRange {
        std::uint64_t begin = 0, end = 0;
        bool writable = false;
        bool indexed = false; ///< lies elsewhere, too, when a selector changes
    };

    /// `memory` must outlive the engine. Throws ConfigError with one line that does not name the file: not a
    /// GenICam description, values that refer to themselves, registers of no sensible length. Features that
    /// take too many steps to evaluate count as absent.
    GenicamEngine(const std::string& xml, Memory& memory);
    ~GenicamEngine();
    GenicamEngine(const GenicamEngine&) = delete;
    GenicamEngine& operator=(const GenicamEngine&) = delete;

    /// While the result lives, what GLib, Aravis and libxml2 have to say about somebody's file is not
    /// printed by anybody in this process. For start-up, on one thread.
    [[nodiscard]] static std::shared_ptr<void> hush();

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
