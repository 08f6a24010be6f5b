// The batch solver. Segments are packed into single precision on the context's threads (their pieces in
// double, so that which teeth cut is decided once and well), streamed through two pairs of buffers, and one
// is packed while the device works on the other. The driver keeps the compiled program; PoCL does so in
// POCL_CACHE_DIR or under HOME.
#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "kernels/errors.h"
#include "kernels/forces/turn.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr const char* kSource =
#include "kernels/forces/forces.cl"
    ;

constexpr std::size_t kBatch = 1 << 15;  ///< segments on the way at once, in each of two slots
constexpr std::size_t kGroup = 64;       ///< work items of a group
constexpr std::size_t kOut = 8;          ///< floats per segment that come back

/// As the kernel's Segment.
struct Packed {
    float radius, lag, entry, exit, low, high, pitch, ball;
    float tc, rc, ac, te, re, ae;
    std::int32_t pieces, padding;
    float piece[4][4];
};
static_assert(sizeof(Packed) == 128);

struct Release {
    void operator()(cl_context x) const { clReleaseContext(x); }
    void operator()(cl_command_queue x) const { clReleaseCommandQueue(x); }
    void operator()(cl_program x) const { clReleaseProgram(x); }
    void operator()(cl_kernel x) const { clReleaseKernel(x); }
    void operator()(cl_mem x) const { clReleaseMemObject(x); }
    void operator()(cl_event x) const { clReleaseEvent(x); }
    void operator()(cl_device_id x) const { clReleaseDevice(x); }
};
template <class T>
using Owned = std::unique_ptr<std::remove_pointer_t<T>, Release>;

Error device_error(const std::string& what, cl_int code, const std::string& device) {
    return Error(ErrorKind::usage, "forces.device", what + " (OpenCL error " + std::to_string(code) + ")",
                 device, "choose another device, or \"reference\"");
}

std::string text_of(cl_device_id device, cl_device_info what) {
    std::size_t size = 0;
    if (clGetDeviceInfo(device, what, 0, nullptr, &size) != CL_SUCCESS || size == 0) return {};
    std::string text(size, '\0');
    clGetDeviceInfo(device, what, size, text.data(), nullptr);
    text.resize(std::strlen(text.c_str()));
    while (!text.empty() && text.back() == ' ') text.pop_back();
    return text;
}

std::vector<cl_device_id> all_devices() {
    std::vector<cl_device_id> devices;
    cl_uint platforms = 0;
    if (clGetPlatformIDs(0, nullptr, &platforms) != CL_SUCCESS) return devices;
    std::vector<cl_platform_id> ids(platforms);
    if (platforms == 0 || clGetPlatformIDs(platforms, ids.data(), nullptr) != CL_SUCCESS) return devices;
    for (cl_platform_id platform : ids) {
        cl_uint n = 0;
        if (clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, 0, nullptr, &n) != CL_SUCCESS || n == 0) continue;
        const std::size_t at = devices.size();
        devices.resize(at + n);
        if (clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, n, devices.data() + at, nullptr) != CL_SUCCESS)
            devices.resize(at);
    }
    return devices;
}

SegmentForces double_forces(const CutSegment& s, double accuracy) {
    return s.flat() ? closed_form_forces(s, accuracy) : reference_forces(s, accuracy);
}

/// A segment as the device takes it; the means, which need no device, go to `means`, so that the turn is cut
/// into pieces once.
void pack(const CutSegment& s, std::size_t index, double angle, Packed& out, SegmentForces& means) {
    forces::check_segment(s, index);
    const forces::Turn t = forces::make_turn(s);
    means = {};
    if (t.count > 0) forces::set_means(s, t, means);
    auto f = [](double x) { return static_cast<float>(x); };
    const double c = s.chip_load_mm;
    const ForceCoefficients& k = s.coefficients;
    out.radius = f(s.radius_mm);
    out.lag = f(t.lag_per_mm);
    out.entry = f(t.entry);
    out.exit = f(t.exit);
    out.low = f(t.low);
    out.high = f(t.high);
    out.pitch = f(t.pitch);
    out.ball = s.ball() ? 1.0f : 0.0f;
    out.tc = f(k.ktc * c);
    out.rc = f(k.krc * c);
    out.ac = f(k.kac * c);
    out.te = f(k.kte);
    out.re = f(k.kre);
    out.ae = f(k.kae);
    out.pieces = s.flat() || s.ball() ? t.count : 0;  // the device knows flats and balls
    out.padding = 0;
    for (int p = 0; p < out.pieces; ++p) {
        const forces::Turn::Piece& piece = t.pieces[static_cast<std::size_t>(p)];
        const forces::Teeth teeth = forces::teeth_in(t, piece);
        float* to = out.piece[p];
        to[0] = f(piece.begin + teeth.first * t.pitch);
        to[1] = f(piece.length);
        to[2] = static_cast<float>(std::max(0, teeth.last - teeth.first + 1));
        to[3] = static_cast<float>(forces::samples_of(piece, angle));
    }
}

void set_peaks(const float* o, const CutSegment& s, SegmentForces& f) {
    f.peak_x_n = o[0];
    f.peak_y_n = o[1];
    f.peak_z_n = o[2];
    f.peak_in_plane_n = o[3];
    f.peak_resultant_n = o[4];
    f.peak_torque_nmm = o[5];
    f.mean_in_plane_n = o[6];
    f.peak_power_w = f.peak_torque_nmm * forces::watts_per_nmm(s.spindle_rpm);
}

/// Cuts of every sort the kernel tells apart, for the self-test.
std::vector<CutSegment> test_cuts(std::size_t n) {
    std::vector<CutSegment> cuts(n);
    std::uint32_t state = 1;
    auto random = [&](double low, double high) {
        state = state * 1664525u + 1013904223u;
        return low + (high - low) * (state >> 8) / 16777216.0;
    };
    for (std::size_t i = 0; i < n; ++i) {
        CutSegment& s = cuts[i];
        s.flutes = static_cast<int>(1 + i / 2 % 4);
        s.radius_mm = random(1.5, 12.7);
        s.corner_mm = i % 2 ? s.radius_mm : 0;
        s.helix_rad = i % 8 < 2 ? 0 : random(0, 0.8);
        s.high_mm = random(0.05, 2) * s.radius_mm;
        s.arc = engagement_arc(s.radius_mm, random(0.05, 2.2) * s.radius_mm,
                               i % 3 ? MillingSense::up : MillingSense::down);
        s.chip_load_mm = random(0, 0.7);
        s.coefficients = {8, 0.6, 4, 1, 2.5, 0.6};
    }
    return cuts;
}

double worst_difference(const SegmentForces& a, const SegmentForces& b) {
    double worst = 0;
    for (const auto member :
         {&SegmentForces::peak_x_n, &SegmentForces::peak_y_n, &SegmentForces::peak_z_n,
          &SegmentForces::peak_in_plane_n, &SegmentForces::peak_resultant_n, &SegmentForces::mean_x_n,
          &SegmentForces::mean_y_n, &SegmentForces::mean_z_n, &SegmentForces::mean_in_plane_n}) {
        const double d = std::abs(a.*member - b.*member);
        if (!(d <= worst)) worst = d;  // keeps NaN
    }
    return worst;
}

/// One device with its program and buffers.
class DeviceRunner {
public:
    DeviceRunner(Context& context, cl_device_id device)
        : name_(text_of(device, CL_DEVICE_NAME)), device_(device) {
        // A CPU device ignores the context's arena; a part of it of as many units as the context has threads
        // does not.
        cl_device_type type = 0;
        cl_uint units = 0;
        clGetDeviceInfo(device, CL_DEVICE_TYPE, sizeof type, &type, nullptr);
        clGetDeviceInfo(device, CL_DEVICE_MAX_COMPUTE_UNITS, sizeof units, &units, nullptr);
        if (type & CL_DEVICE_TYPE_CPU && static_cast<cl_uint>(context.threads()) < units) {
            const cl_device_partition_property by[] = {CL_DEVICE_PARTITION_BY_COUNTS, context.threads(),
                                                       CL_DEVICE_PARTITION_BY_COUNTS_LIST_END, 0};
            cl_device_id part = nullptr;
            if (clCreateSubDevices(device, by, 1, &part, nullptr) == CL_SUCCESS)
                part_.reset(part), device_ = part;
        }
        cl_int rc = CL_SUCCESS;
        context_.reset(clCreateContext(nullptr, 1, &device_, nullptr, nullptr, &rc));
        if (rc != CL_SUCCESS) throw device_error("no context", rc, name_);
        queue_.reset(clCreateCommandQueue(context_.get(), device_, 0, &rc));
        if (rc != CL_SUCCESS) throw device_error("no queue", rc, name_);
        const char* source = kSource;
        program_.reset(clCreateProgramWithSource(context_.get(), 1, &source, nullptr, &rc));
        if (rc != CL_SUCCESS) throw device_error("no program", rc, name_);
        rc = clBuildProgram(program_.get(), 1, &device_, "", nullptr, nullptr);
        if (rc != CL_SUCCESS)
            throw device_error("the force kernel does not build: " + build_log(), rc, name_);
        kernel_.reset(clCreateKernel(program_.get(), "forces", &rc));
        if (rc != CL_SUCCESS) throw device_error("no kernel", rc, name_);
        for (Slot& slot : slots_) {
            slot.in.reset(
                clCreateBuffer(context_.get(), CL_MEM_READ_ONLY, kBatch * sizeof(Packed), nullptr, &rc));
            if (rc != CL_SUCCESS) throw device_error("no memory for segments", rc, name_);
            slot.out.reset(clCreateBuffer(context_.get(), CL_MEM_WRITE_ONLY, kBatch * kOut * sizeof(float),
                                          nullptr, &rc));
            if (rc != CL_SUCCESS) throw device_error("no memory for forces", rc, name_);
        }
    }
    DeviceRunner(const DeviceRunner&) = delete;
    DeviceRunner& operator=(const DeviceRunner&) = delete;

    [[nodiscard]] const std::string& name() const { return name_; }

    void solve(Context& context, std::span<const CutSegment> segments, std::span<SegmentForces> out,
               double accuracy) {
        const MemoryCharge charge(
            context, 2 * 2 * std::min(kBatch, segments.size()) * (sizeof(Packed) + kOut * sizeof(float)),
            "cutting forces");
        const double angle = forces::sample_angle(accuracy);
        struct Drain {  // the device reads and writes the slots until it has finished, also when something
                        // throws
            cl_command_queue queue;
            std::array<Slot, 2>& slots;
            ~Drain() {
                clFinish(queue);
                for (Slot& slot : slots) slot.done.reset();
            }
        } drain{queue_.get(), slots_};
        std::size_t turn = 0;
        for (std::size_t at = 0; at < segments.size(); at += kBatch, ++turn) {
            context.throw_if_cancelled();
            Slot& slot = slots_[turn % 2];
            collect(context, slot, segments, out);
            slot.at = at;
            slot.count = std::min(kBatch, segments.size() - at);
            slot.packed.resize(slot.count);
            slot.results.resize(slot.count * kOut);
            parallel_for(context, slot.count, 1024, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i)
                    pack(segments[at + i], at + i, angle, slot.packed[i], out[at + i]);
            });
            enqueue(slot);
        }
        for (std::size_t k = 0; k < 2; ++k) collect(context, slots_[(turn + k) % 2], segments, out);
    }

private:
    struct Slot {
        Owned<cl_mem> in, out;
        std::vector<Packed> packed;
        std::vector<float> results;
        std::size_t at = 0, count = 0;
        Owned<cl_event> done;
    };

    void enqueue(Slot& slot) {
        const cl_uint count = static_cast<cl_uint>(slot.count);
        const std::size_t items = (slot.count + kGroup - 1) / kGroup * kGroup;
        const cl_mem in = slot.in.get(), out = slot.out.get();
        cl_int rc = clEnqueueWriteBuffer(queue_.get(), in, CL_FALSE, 0, slot.count * sizeof(Packed),
                                         slot.packed.data(), 0, nullptr, nullptr);
        if (rc == CL_SUCCESS) rc = clSetKernelArg(kernel_.get(), 0, sizeof in, &in);
        if (rc == CL_SUCCESS) rc = clSetKernelArg(kernel_.get(), 1, sizeof out, &out);
        if (rc == CL_SUCCESS) rc = clSetKernelArg(kernel_.get(), 2, sizeof count, &count);
        if (rc == CL_SUCCESS)
            rc = clEnqueueNDRangeKernel(queue_.get(), kernel_.get(), 1, nullptr, &items, &kGroup, 0, nullptr,
                                        nullptr);
        cl_event event = nullptr;
        if (rc == CL_SUCCESS)
            rc = clEnqueueReadBuffer(queue_.get(), out, CL_FALSE, 0, slot.results.size() * sizeof(float),
                                     slot.results.data(), 0, nullptr, &event);
        if (rc != CL_SUCCESS) throw device_error("the force kernel does not start", rc, name_);
        slot.done.reset(event);
        clFlush(queue_.get());
    }

    void collect(Context& context, Slot& slot, std::span<const CutSegment> segments,
                 std::span<SegmentForces> out) {
        if (!slot.done) return;
        const cl_event event = slot.done.get();
        const cl_int rc = clWaitForEvents(1, &event);
        slot.done.reset();
        if (rc != CL_SUCCESS) throw device_error("the force kernel fails", rc, name_);
        parallel_for(context, slot.count, 4096, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                set_peaks(slot.results.data() + i * kOut, segments[slot.at + i], out[slot.at + i]);
        });
    }

    std::string build_log() const {
        std::size_t size = 0;
        clGetProgramBuildInfo(program_.get(), device_, CL_PROGRAM_BUILD_LOG, 0, nullptr, &size);
        std::string log(size, '\0');
        clGetProgramBuildInfo(program_.get(), device_, CL_PROGRAM_BUILD_LOG, size, log.data(), nullptr);
        log.resize(std::min<std::size_t>(std::strlen(log.c_str()), 400));
        for (char& c : log)
            if (c == '\n') c = ' ';
        return log;
    }

    std::string name_;
    cl_device_id device_;
    Owned<cl_device_id> part_;
    Owned<cl_context> context_;
    Owned<cl_command_queue> queue_;
    Owned<cl_program> program_;
    Owned<cl_kernel> kernel_;
    std::array<Slot, 2> slots_;
};

/// Seconds for the test's cuts. @throws Error when the device's forces are not those of the reference
double self_test(Context& context, DeviceRunner& runner) {
    const std::vector<CutSegment> cuts = test_cuts(256);
    std::vector<SegmentForces> found(cuts.size());
    runner.solve(context, cuts, found, kForceAccuracy);
    for (std::size_t i = 0; i < cuts.size(); ++i) {
        const SegmentForces expected = double_forces(cuts[i], kForceAccuracy);
        const double worst = worst_difference(found[i], expected);
        if (!(worst <= 1e-4 * expected.peak_resultant_n))
            throw Error(ErrorKind::usage, "forces.device",
                        "the force kernel fails its self-test on cut " + std::to_string(i), runner.name(),
                        "choose another device, or \"reference\"");
    }
    std::vector<CutSegment> many;
    for (int k = 0; k < 16; ++k) many.insert(many.end(), cuts.begin(), cuts.end());
    found.resize(many.size());
    const auto start = std::chrono::steady_clock::now();
    runner.solve(context, many, found, kForceAccuracy);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

struct ForceSolver::Impl {
    std::unique_ptr<DeviceRunner> runner;
    std::string device = "reference", note;
};

ForceSolver::ForceSolver(Context& context, const std::string& wanted) : impl_(std::make_unique<Impl>()) {
    if (wanted == "reference") {
        impl_->note = "the double-precision reference was asked for";
        return;
    }
    const bool any = wanted.empty() || wanted == "auto";
    double fastest = 0;
    std::string refused;
    for (cl_device_id id : all_devices()) {
        if (!any && text_of(id, CL_DEVICE_NAME).find(wanted) == std::string::npos) continue;
        try {
            auto runner = std::make_unique<DeviceRunner>(context, id);
            const double seconds = self_test(context, *runner);
            if (!impl_->runner || seconds < fastest) impl_->runner = std::move(runner), fastest = seconds;
        } catch (const Error& e) {
            if (e.kind() == ErrorKind::cancelled || e.code() != "forces.device" || !any) throw;
            refused += (refused.empty() ? "" : "; ") + std::string(e.what());
        }
        if (!any) break;
    }
    if (impl_->runner) {
        impl_->device = impl_->runner->name();
        impl_->note = std::move(refused);
        return;
    }
    if (!any)
        throw Error(ErrorKind::usage, "forces.device", "no OpenCL device has \"" + wanted + "\" in its name",
                    {}, "use \"auto\" or \"reference\"");
    impl_->note = refused.empty() ? "no OpenCL device (PoCL shows one only if HOME is writable or "
                                    "POCL_CACHE_DIR names a folder); forces by reference"
                                  : "no OpenCL device can be used, forces by reference: " + refused;
}

ForceSolver::~ForceSolver() = default;

bool ForceSolver::on_device() const noexcept { return impl_->runner != nullptr; }
const std::string& ForceSolver::device() const noexcept { return impl_->device; }
const std::string& ForceSolver::note() const noexcept { return impl_->note; }

void ForceSolver::solve(Context& context, std::span<const CutSegment> segments, std::span<SegmentForces> out,
                        double accuracy) {
    if (out.size() != segments.size())
        throw Error(ErrorKind::usage, "forces.segment", "there must be as many forces as segments",
                    std::to_string(out.size()));
    const bool on_device = impl_->runner != nullptr;
    if (on_device) impl_->runner->solve(context, segments, out, accuracy);
    parallel_for(context, segments.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            // The device knows flats and balls.
            if (on_device && (segments[i].flat() || segments[i].ball())) continue;
            forces::check_segment(segments[i], i);
            out[i] = double_forces(segments[i], accuracy);
        }
    });
}

}  // namespace slabwright
