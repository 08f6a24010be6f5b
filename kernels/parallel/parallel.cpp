#include "kernels/parallel/parallel.h"

#include <sys/sysinfo.h>

#include <exception>
#include <mutex>
#include <thread>

#include "kernels/errors.h"

#if defined(SLABWRIGHT_STD_THREADS)
// ThreadSanitizer reports false races in Debian's oneTBB, so the tsan preset runs on plain threads.
#else
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>
#endif

namespace slabwright {

namespace {
int machine_threads() { return std::max(1, static_cast<int>(std::thread::hardware_concurrency())); }
}  // namespace

struct Context::Impl {
    explicit Impl(int n)
        : threads(n)
#if !defined(SLABWRIGHT_STD_THREADS)
          ,
          arena(std::min(
              n, machine_threads()))  // oneTBB warns on stderr about more, and would not run them anyway
#endif
    {
    }
    int threads;
    std::string device;
#if !defined(SLABWRIGHT_STD_THREADS)
    tbb::task_arena arena;
#endif
    ProgressSink sink;
    std::mutex mutex;  // guards everything below
    std::string phase;
    double share_from = 0, share_to = 1;  // of the whole, that phases divide
    double from = 0, to = 0, reported = 0;
    std::uint64_t steps = 1;
    std::atomic<std::uint64_t> done{0};
};

Context::Context() : Context(Options{}) {}

Context::Context(Options options)
    : impl_(std::make_unique<Impl>(options.threads > 0 ? options.threads : machine_threads())),
      memory_limit_(options.memory_bytes) {
    impl_->sink = std::move(options.progress);
    impl_->device = std::move(options.device);
    if (memory_limit_ == 0) {
        struct sysinfo info {};
        if (sysinfo(&info) == 0)
            memory_limit_ =
                static_cast<std::uint64_t>(0.6 * static_cast<double>(info.totalram) * info.mem_unit);
        else memory_limit_ = std::uint64_t{4} << 30;
    }
}

Context::~Context() = default;

int Context::threads() const noexcept { return impl_->threads; }
const std::string& Context::device() const noexcept { return impl_->device; }

void Context::throw_if_cancelled() const {
    if (cancelled())
        throw Error(ErrorKind::cancelled, "cancelled", "cancelled on request; nothing was written");
}

void Context::begin_phase(std::string_view name, double from, double to, std::uint64_t steps) {
    throw_if_cancelled();
    const std::lock_guard lock(impl_->mutex);
    impl_->phase = name;
    impl_->from = impl_->share_from + from * (impl_->share_to - impl_->share_from);
    impl_->to = impl_->share_from + to * (impl_->share_to - impl_->share_from);
    impl_->steps = std::max<std::uint64_t>(1, steps);
    impl_->done.store(0, std::memory_order_relaxed);
    impl_->reported = std::max(impl_->reported, impl_->from);
    if (impl_->sink) impl_->sink({impl_->phase, impl_->reported});
}

void Context::share_progress(double from, double to) {
    const std::lock_guard lock(impl_->mutex);
    impl_->share_from = from;
    impl_->share_to = to;
}

void Context::advance(std::uint64_t steps) {
    impl_->done.fetch_add(steps, std::memory_order_relaxed);
    if (!impl_->sink) return;
    const std::lock_guard lock(impl_->mutex);
    const double done =
        static_cast<double>(std::min(impl_->done.load(std::memory_order_relaxed), impl_->steps));
    const double fraction =
        impl_->from + (impl_->to - impl_->from) * done / static_cast<double>(impl_->steps);
    if (fraction <= impl_->reported) return;
    impl_->reported = fraction;
    impl_->sink({impl_->phase, fraction});
}

MemoryCharge::MemoryCharge(Context& context, std::uint64_t bytes, std::string_view what)
    : context_(context), bytes_(bytes) {
    const std::uint64_t before = context_.charged_.fetch_add(bytes);
    if (before + bytes > context_.memory_limit_) {
        context_.charged_.fetch_sub(bytes);
        auto mib = [](std::uint64_t b) { return std::to_string((b + (1u << 20) - 1) >> 20) + " MiB"; };
        throw Error(ErrorKind::no_plan, "memory.limit",
                    "no room for " + std::string(what) + ": " + mib(bytes) + " beside " + mib(before) +
                        " in use, over the limit of " + mib(context_.memory_limit_),
                    {}, "raise --memory or plan with fewer facets");
    }
}

MemoryCharge::~MemoryCharge() { context_.charged_.fetch_sub(bytes_); }

void run_chunks(Context& context, std::size_t chunks, void (*fn)(void*, std::size_t), void* state) {
    context.throw_if_cancelled();
    if (chunks == 0) return;
    if (chunks == 1 || context.threads() == 1) {
        for (std::size_t i = 0; i < chunks; ++i) {
            context.throw_if_cancelled();
            fn(state, i);
        }
        return;
    }
    // Which chunk throws first depends on timing; which of the thrown errors is reported must not, so the
    // lowest wins. Later chunks are skipped once one has thrown, earlier ones still run: the lowest failing
    // chunk always does.
    std::mutex mutex;
    std::exception_ptr error;
    std::atomic<std::size_t> failed{chunks};
    auto body = [&](std::size_t i) {
        if (i > failed.load(std::memory_order_relaxed)) return;
        try {
            context.throw_if_cancelled();
            fn(state, i);
        } catch (...) {
            const std::lock_guard lock(mutex);
            if (i < failed.load(std::memory_order_relaxed)) {
                failed.store(i, std::memory_order_relaxed);
                error = std::current_exception();
            }
        }
    };
#if defined(SLABWRIGHT_STD_THREADS)
    std::atomic<std::size_t> next{0};
    auto worker = [&] {
        for (std::size_t i; (i = next.fetch_add(1)) < chunks;) body(i);
    };
    std::vector<std::thread> threads;
    for (int t = 1; t < context.threads(); ++t) threads.emplace_back(worker);
    worker();
    for (std::thread& thread : threads) thread.join();
#else
    // Isolated: a thread that waits for this loop takes no chunk of an outer one, which would hold two
    // layers' memory at once.
    context.impl_->arena.execute(
        [&] { tbb::this_task_arena::isolate([&] { tbb::parallel_for(std::size_t{0}, chunks, body); }); });
#endif
    if (error) std::rethrow_exception(error);
}

}  // namespace slabwright
