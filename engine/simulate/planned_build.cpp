#include "engine/simulate/planned_build.h"

#include <algorithm>

namespace slabwright {

namespace {

constexpr std::size_t kStepsEach = 9;     // for each slab, without its programs and their tool changes
constexpr std::size_t kMostRemakes = 20;  // layers made again in one sequence

}  // namespace

PlannedBuild::PlannedBuild(const BuildPlan& plan) : plan_(plan) {
    std::size_t between = plan.layers.size();
    for (std::size_t l = 0; l < plan.layers.size(); ++l) {
        const LayerToBuild& layer = plan.layers[l];
        const double each = layer.slab_thickness / layer.slabs;
        const Blank blank = layer.blank.value_or(Blank{plan.stock_min, plan.stock_max});
        const double kg = blank.mm2() * each * 1e-9 * plan.job.material.density_kg_m3;
        for (int k = 0; k < layer.slabs; ++k)
            slabs_.push_back({.layer = l,
                              .number = k,
                              .thickness = each,
                              .z_bottom = layer.z_bottom + k * each,
                              .blank = blank,
                              .kg = kg,
                              .glue = k == 0 ? l : between++});
    }
}

std::size_t PlannedBuild::most_steps() const {
    const std::size_t programs = plan_.programs.size() + plan_.face_offs.size();
    const std::size_t builds = 1 + std::min(plan_.face_offs.size(), kMostRemakes);
    // A program may have a change of tool and a load of the magazine before it; its places are filled too.
    const auto places = static_cast<std::size_t>(plan_.job_stated ? plan_.job.machine.magazine : 0);
    return builds * (kStepsEach * (slabs_.size() + 2) + 3 * programs + places) +
           3 * builds * plan_.probes.size() + 2 * plan_.undersides.size();
}

double PlannedBuild::board_mass(double thickness) const {
    return (plan_.stock_max[0] - plan_.stock_min[0]) * (plan_.stock_max[1] - plan_.stock_min[1]) * thickness *
           1e-9 * plan_.job.material.density_kg_m3;
}

PlannedJoint PlannedBuild::joint_of(const DueSlab& slab) const {
    const std::vector<PlannedJoint>& joints = plan_.layers[slab.layer].joints;
    const auto k = static_cast<std::size_t>(slab.number);
    return k < joints.size() ? joints[k] : PlannedJoint{};
}

double PlannedBuild::origin_of(std::size_t layer) const {
    if (plan_.frame == Frame::table_top) return -plan_.job.machine.base_board_thickness;
    return plan_.frame == Frame::layer_top ? plan_.layers[layer].z_top : 0;
}

double PlannedBuild::bottom_at(std::size_t layer) const {
    const double risen = plan_.layers[layer].z_top - plan_.layers.front().z_top;
    return -origin_of(0) - (plan_.job.machine.table == BuildTable::moving ? risen : 0);
}

std::array<std::pair<const char*, double>, 2> PlannedBuild::edges_of(const DueSlab& slab) const {
    return {{{"slab_left_mm", slab.blank.min[0] - plan_.zero[0]},
             {"slab_front_mm", slab.blank.min[1] - plan_.zero[1]}}};
}

std::array<double, 3> PlannedBuild::probed_at(const DueSlab& slab) const {
    const Probing& probing = plan_.job.probing;
    if (probing.reference.size() != 3) return {kUnbounded, kUnbounded, kUnbounded};  // nowhere
    return {plan_.stock_min[0] + probing.reference[0] - plan_.zero[0],
            plan_.stock_min[1] + probing.reference[1] - plan_.zero[1],
            probing.reference[2] - plan_.job.machine.base_board_thickness + probing.plate -
                origin_of(slab.layer)};
}

const Tool* PlannedBuild::tool_of(int number) const {
    for (const Tool& tool : plan_.tools)
        if (tool.number == number) return &tool;
    return nullptr;
}

std::optional<std::size_t> PlannedBuild::whole_layer(const BuildState& state) const {
    if (state.placed == 0 || !state.pressed) return std::nullopt;
    const DueSlab& last = slabs_[state.placed - 1];
    if (last.number + 1 != plan_.layers[last.layer].slabs) return std::nullopt;
    return last.layer;
}

double PlannedBuild::stack_top(const BuildState& state) const {
    if (state.placed == 0) return 0;
    const DueSlab& last = slabs_[state.placed - 1];
    for (std::size_t p = 0; p < state.ran_in.size(); ++p)
        if (plan_.programs[p].layer == last.layer && plan_.programs[p].kind == OperationKind::face &&
            state.ran_in[p])
            return plan_.layers[last.layer].z_top;
    return last.z_bottom + last.thickness;
}

}  // namespace slabwright
