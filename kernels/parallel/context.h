// The Context is the first argument of every kernel: who may use how many threads and how much memory, who
// hears of progress, and whether anybody still wants the result. No globals, so several plans may run at once
// in one process.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "kernels/export.h"

namespace slabwright {

/// A report of progress. `fraction` is of the whole request, in [0, 1], and never falls.
struct Progress {
    std::string_view phase;
    double fraction = 0;
};

/// Called from worker threads, one call at a time. Must not throw.
using ProgressSink = std::function<void(const Progress&)>;

class SLABWRIGHT_API Context {
public:
    struct Options {
        int threads = 0;                 ///< 0: all that the machine offers
        std::uint64_t memory_bytes = 0;  ///< limit for charged memory; 0: 60 % of the machine's
        ProgressSink progress = {};
        std::string device = {};  ///< OpenCL device for what pays there: "" or "auto", "reference" (none), or
                                  ///< part of a device's name
    };

    Context();
    explicit Context(Options options);
    ~Context();
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;

    [[nodiscard]] int threads() const noexcept;
    /// As the options named it; it changes how fast an answer comes, never the answer.
    [[nodiscard]] const std::string& device() const noexcept;

    /// Asks every kernel that runs on this context to stop. May be called from any thread or a signal
    /// handler.
    void cancel() noexcept { cancelled_.store(true, std::memory_order_relaxed); }
    [[nodiscard]] bool cancelled() const noexcept { return cancelled_.load(std::memory_order_relaxed); }
    /// @throws Error(cancelled) after cancel()
    void throw_if_cancelled() const;

    /// Names the running phase and its share [from, to] of the whole; then advance() counts within it.
    void begin_phase(std::string_view name, double from, double to, std::uint64_t steps = 1);
    void advance(std::uint64_t steps = 1);
    /// The phases that follow are shares of [from, to] of the whole, until the next call: one request may
    /// hold several, each of which counts from 0 to 1.
    void share_progress(double from, double to);

    [[nodiscard]] std::uint64_t memory_limit() const noexcept { return memory_limit_; }
    [[nodiscard]] std::uint64_t memory_charged() const noexcept {
        return charged_.load(std::memory_order_relaxed);
    }

private:
    friend class MemoryCharge;
    friend void run_chunks(Context&, std::size_t, void (*)(void*, std::size_t), void*);
    struct Impl;
    std::unique_ptr<Impl> impl_;
    std::atomic<bool> cancelled_{false};
    std::atomic<std::uint64_t> charged_{0};
    std::uint64_t memory_limit_ = 0;
};

/// Books `bytes` on the context's memory account for as long as it lives.
class MemoryCharge {
public:
    /// @throws Error(no_plan, "memory.limit") that names `what` and the need, when the account would pass its
    /// limit
    MemoryCharge(Context& context, std::uint64_t bytes, std::string_view what);
    ~MemoryCharge();
    MemoryCharge(const MemoryCharge&) = delete;
    MemoryCharge& operator=(const MemoryCharge&) = delete;

private:
    Context& context_;
    std::uint64_t bytes_;
};

}  // namespace slabwright
