#include "kernels/forces/hardest.h"

#include <algorithm>
#include <numeric>
#include <system_error>

#include "kernels/forces/turn.h"
#include "kernels/mesh/raw_array.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

// Of the double model, measured on one thread at 2.6 GHz (bench/RESULTS.md); only the decision whether to
// start a device hangs on them.
constexpr double kSecondsFlat = 8e-6, kSecondsBall = 55e-6;
// Twice what the self-test allows a device, as a share of the cut's own peak resultant.
constexpr double kScreen = 2e-4;

SegmentForces in_double(const CutSegment& cut) {
    return cut.flat() ? closed_form_forces(cut, kForceAccuracy) : reference_forces(cut, kForceAccuracy);
}

constexpr std::array<double SegmentForces::*, 5> kAsked{
    &SegmentForces::peak_resultant_n, &SegmentForces::peak_in_plane_n, &SegmentForces::peak_y_n,
    &SegmentForces::peak_torque_nmm, &SegmentForces::mean_power_w};

// By how much the device may be off in each of these.
std::array<double, kAsked.size()> doubts(const SegmentForces& found, const CutSegment& cut) {
    const double force = kScreen * found.peak_resultant_n, torque = force * cut.radius_mm;
    return {force, force, force, torque, torque * forces::watts_per_nmm(cut.spindle_rpm)};
}

}  // namespace

SolverAhead::SolverAhead(Context& context, double worth_seconds)
    : context_(context), worth_seconds_(worth_seconds) {}

SolverAhead::~SolverAhead() {
    if (opening_.valid()) opening_.wait();
}

void SolverAhead::expect(std::span<const CutSegment> cuts) {
    const auto balls = static_cast<std::uint64_t>(
        std::count_if(cuts.begin(), cuts.end(), [](const CutSegment& cut) { return !cut.flat(); }));
    const std::lock_guard lock(mutex_);
    balls_ += balls;
    flats_ += cuts.size() - balls;
    if (opening_.valid() || solver_ || context_.device() == "reference") return;
    if (static_cast<double>(flats_) * kSecondsFlat + static_cast<double>(balls_) * kSecondsBall <
        worth_seconds_)
        return;
    const auto open = [this] { return std::make_unique<ForceSolver>(context_, context_.device()); };
    try {
        opening_ = std::async(std::launch::async, open);
    } catch (const std::system_error&) {  // there is no thread to be had: it is opened here
        opening_ = std::async(std::launch::deferred, open);
    }
}

ForceSolver* SolverAhead::solver() {
    const std::lock_guard lock(mutex_);
    if (opening_.valid()) solver_ = opening_.get();
    return solver_.get();
}

HardestSearch hardest_cuts(Context& context, std::span<const CutSegment> cuts,
                           std::span<const std::size_t> starts, ForceSolver* solver) {
    HardestSearch search;
    for (std::size_t i = 0; i < cuts.size(); ++i) forces::check_segment(cuts[i], i);
    RawArray<SegmentForces> found(cuts.size());
    // Cuts whose double forces are needed: all, or those that a device could not rule out.
    std::vector<std::uint32_t> doubtful;
    if (solver != nullptr) {
        search.device = solver->device();
        search.note = solver->on_device() ? "" : solver->note();
    }
    if (solver == nullptr || !solver->on_device()) {
        doubtful.resize(cuts.size());
        std::iota(doubtful.begin(), doubtful.end(), 0U);
    } else {
        solver->solve(context, cuts, found.span());
        for (std::size_t g = 0; g + 1 < starts.size(); ++g) {
            std::array<double, kAsked.size()> surely{};
            for (std::size_t i = starts[g]; i < starts[g + 1]; ++i) {
                const auto doubt = doubts(found[i], cuts[i]);
                for (std::size_t q = 0; q < kAsked.size(); ++q)
                    surely[q] = std::max(surely[q], found[i].*kAsked[q] - doubt[q]);
            }
            for (std::size_t i = starts[g]; i < starts[g + 1]; ++i) {
                const auto doubt = doubts(found[i], cuts[i]);
                bool may = false;
                for (std::size_t q = 0; q < kAsked.size(); ++q)
                    may |= found[i].*kAsked[q] + doubt[q] >= surely[q];
                if (may) doubtful.push_back(static_cast<std::uint32_t>(i));
            }
        }
    }
    parallel_for(context, doubtful.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) found[doubtful[k]] = in_double(cuts[doubtful[k]]);
    });
    std::size_t next = 0;
    for (std::size_t g = 0; g + 1 < starts.size(); ++g) {
        std::array<std::size_t, kAsked.size()> best;
        best.fill(kNoCut);
        for (; next < doubtful.size() && doubtful[next] < starts[g + 1]; ++next)
            for (std::size_t q = 0; q < kAsked.size(); ++q)
                if (best[q] == kNoCut || found[doubtful[next]].*kAsked[q] > found[best[q]].*kAsked[q])
                    best[q] = doubtful[next];
        search.groups.push_back({best[0], best[1], best[2], best[3], best[4]});
    }
    return search;
}

}  // namespace slabwright
