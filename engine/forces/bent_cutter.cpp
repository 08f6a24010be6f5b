#include "engine/forces/bent_cutter.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>

#include "engine/forces/cuts.h"
#include "kernels/forces/deflection.h"

namespace slabwright {

namespace {

constexpr double kAccuracy = 0.01;  // of coarse classes' peaks, as a share: far finer than the classes are

SegmentForces forces_of(const CutSegment& cut, double accuracy) {
    return cut.flat() ? closed_form_forces(cut, accuracy) : reference_forces(cut, accuracy);
}

}  // namespace

SegmentForces stated_forces(const CutSegment& cut) { return forces_of(cut, kStatedAccuracy); }

Bent bent_by(const SegmentForces& f, double across_n, const Tool& tool) {
    return {tip_bent_by(tool, across_n),
            cutter_stress(f.peak_in_plane_n, tool.stickout, strength_diameter(tool)),
            f.peak_x_n,
            f.peak_y_n,
            f.peak_z_n,
            f.peak_in_plane_n,
            f.peak_torque_nmm,
            f.mean_power_w};
}

double share_of_limits(const Bent& bent, double limit, const Tool& tool, const Job& job) {
    const auto share = [](double is, double most) { return most > 0 ? is / most : 0; };
    return std::max({bent.wall_mm / limit, share(bent.stress_mpa, tool.strength_mpa),
                     share(bent.torque_nmm, 1000 * job.machine.spindle_torque_nm),
                     share(bent.power_w, job.machine.spindle_power_w)});
}

std::optional<Bent> SharedBents::find(const Of& of, const ClassAndFeed& key) {
    const std::shared_lock lock(mutex_);
    const auto cuts = known_.find(of);
    if (cuts == known_.end()) return std::nullopt;
    const auto cut = cuts->second.find(key);
    return cut == cuts->second.end() ? std::nullopt : std::optional(cut->second);
}

void SharedBents::add(const Of& of, const ClassAndFeed& key, const Bent& bent) {
    const std::lock_guard lock(mutex_);
    known_[of].try_emplace(key, bent);
}

BentCutter::BentCutter(const Job& job, const Operation& operation, const Tool& tool, SharedBents* shared)
    : job_(job), tool_(tool), shared_(shared), idle_(idle_cut(job, tool)) {
    idle_.spindle_rpm = operation.spindle_rpm;
}

double BentCutter::needed_wood(const Bent& b, double height, double overhang) const {
    return least_overhang_thickness(
               {b.x_n, b.y_n, b.z_n, overhang, height, tool_.diameter / 2, job_.material.strength_mpa})
        .least_mm;
}

double BentCutter::thickest_chip(const CutClass& c) const {
    const EngagementArc arc = segment_of(c, idle_, tool_, 1, kCoarse).arc;
    const double middle = std::clamp(std::numbers::pi / 2, arc.entry_rad, arc.exit_rad);
    return std::max(1e-3, std::sin(middle));
}

const Bent& BentCutter::find(Known& known, const CutClass& c, double feed, bool fine) {
    const ClassAndFeed key{c, feed};
    const auto [it, fresh] = known.try_emplace(key);
    if (!fresh) return it->second;
    // What others tell is what would be found here.
    const SharedBents::Of of{tool_.number, idle_.spindle_rpm, fine};
    if (shared_ != nullptr)
        if (const std::optional<Bent> told = shared_->find(of, key)) return it->second = *told;
    const SegmentForces f = forces_of(segment_of(c, idle_, tool_, feed, fine ? kFine : kCoarse),
                                      fine ? kStatedAccuracy : kAccuracy);
    it->second = bent_by(f, f.peak_y_n, tool_);
    if (shared_ != nullptr) shared_->add(of, key, it->second);
    return it->second;
}

}  // namespace slabwright
