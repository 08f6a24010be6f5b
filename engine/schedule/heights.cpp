#include "engine/schedule/heights.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/schedule/fit.h"
#include "engine/schedule/glue_path.h"

namespace slabwright {

namespace {

constexpr double kSlack = 1e-4;  // mm: paths are whole tenths of a micrometre

/// The lowest or the highest place of the spindle, and what brings it there.
struct SpindlePlace {
    double height;  ///< of the holder's nose, machine, mm
    const Layer* layer = nullptr;
    const Operation* operation = nullptr;
};

std::string words_of(const SpindlePlace& place) {
    return fmt::format("{:.1f} mm in layer {} ({}, tool {})", place.height, place.layer->index,
                       place.operation->purpose.empty() ? name(place.operation->kind)
                                                        : std::string_view(place.operation->purpose),
                       place.operation->tool);
}

double stickout_of(const Job& job, int number) {
    for (const Tool& tool : job.tools)
        if (tool.number == number) return tool.stickout;
    return 0;
}

}  // namespace

LayerHeights layer_heights(const Machine& machine, double first_top, double layer_top) {
    const bool counts_from_top = frame_of(machine) == Frame::layer_top;
    const double risen = layer_top - first_top;
    LayerHeights heights;
    heights.origin = zero_height(machine, layer_top);
    // What does not move with the layer must be moved on the control.
    if (machine.table == BuildTable::moving) heights.work_offset = counts_from_top ? 0 : -risen;
    else heights.work_offset = counts_from_top ? risen : 0;
    heights.table = heights.work_offset - heights.origin - machine.base_board_thickness;
    return heights;
}

double table_seconds(const Machine& machine, double from, double to) {
    return machine.table == BuildTable::moving ? std::abs(to - from) / machine.table_speed * 60 : 0;
}

double press_seconds(const Job& job) {
    const Machine& machine = job.machine;
    if (!has_handler(machine)) return job.bonding.press_time_s;
    return job.bonding.press_time_s + machine.grip_s + 2 * table_seconds(machine, 0, machine.press_lift);
}

double slab_mass_kg(const Plan& plan, const Blank& blank, double thickness) {
    return blank.mm2() * thickness * 1e-9 * plan.job.material.density_kg_m3;
}

double board_mass_kg(const Plan& plan) {
    return slab_mass_kg(plan, {plan.stock_min, plan.stock_max}, plan.job.machine.base_board_thickness);
}

std::vector<FeedSlab> feed_slabs(const Plan& plan, std::size_t from_layer) {
    std::vector<FeedSlab> slabs;
    for (std::size_t l = from_layer; l < plan.layers.size(); ++l) {
        const Layer& layer = plan.layers[l];
        const double each = layer.slab_thickness / layer.slabs;
        slabs.insert(slabs.end(), static_cast<std::size_t>(layer.slabs),
                     FeedSlab{each, slab_mass_kg(plan, slab_of(plan, layer), each)});
    }
    return slabs;
}

std::vector<int> feed_loads(const Plan& plan) {
    const Machine& machine = plan.job.machine;
    if (machine.feed_height == 0) return {};
    for (const Layer& layer : plan.layers) {
        const double slab = layer.slab_thickness / layer.slabs,
                     weight = slab_mass_kg(plan, slab_of(plan, layer), slab);
        const std::string place = fmt::format("layer {}", layer.index);
        if (slab > machine.feed_height + kSlack)
            throw refusal("machine.feed_height",
                          fmt::format("the slab of layer {} is {:.1f} mm thick, {:.1f} mm more than the feed "
                                      "chamber's machine.feed_height of {:.1f} mm",
                                      layer.index, slab, slab - machine.feed_height, machine.feed_height),
                          place, "take thinner slabs, or lay them by hand (machine.feed_height = 0)");
        if (weight > machine.feed_mass_kg)
            throw refusal(
                "machine.feed_mass",
                fmt::format("the slab of layer {} weighs {:.1f} kg, {:.1f} kg more than the feed "
                            "table's machine.feed_mass_kg of {:.1f} kg",
                            layer.index, weight, weight - machine.feed_mass_kg, machine.feed_mass_kg),
                place, "take thinner slabs, or lay them by hand (machine.feed_height = 0)");
    }
    return feed_loads(machine, feed_slabs(plan));
}

std::vector<int> feed_loads(const Machine& machine, std::span<const FeedSlab> slabs) {
    std::vector<int> loads;
    if (machine.feed_height == 0) return loads;
    double height = INFINITY, mass = INFINITY;
    for (const auto& [slab, weight] : slabs) {
        if (height + slab > machine.feed_height + kSlack || mass + weight > machine.feed_mass_kg) {
            loads.push_back(0);
            height = mass = 0;
        }
        ++loads.back();
        height += slab;
        mass += weight;
    }
    return loads;
}

void add_heights(SequenceStep& step, std::span<const Operation> operations, double origin) {
    std::int32_t low = std::numeric_limits<std::int32_t>::max(),
                 high = std::numeric_limits<std::int32_t>::min();
    for (const Operation& operation : operations)
        for (const Move& move : operation.moves) {
            low = std::min(low, move.z);
            high = std::max(high, move.z);
        }
    if (low > high) return;
    const std::int32_t zero = to_units(origin);
    step.numbers.emplace_back("z_low_mm", to_mm(std::int64_t{low} - zero));
    step.numbers.emplace_back("z_high_mm", to_mm(std::int64_t{high} - zero));
}

void check_chambers(const Plan& plan) {
    const Machine& machine = plan.job.machine;
    if (machine.table == BuildTable::moving)
        for (const Layer& layer : plan.layers) {
            const double depth = machine.base_board_thickness + layer.z_top;
            if (depth > machine.build_height + kSlack)
                throw refusal(
                    "machine.build_height",
                    fmt::format("layer {}: the table must sink {:.1f} mm below the layer's top, base board "
                                "included, {:.1f} mm more than machine.build_height of {:.1f} mm",
                                layer.index, depth, depth - machine.build_height, machine.build_height),
                    fmt::format("layer {}", layer.index), "split the pattern, or use a thinner base board");
        }
    (void)feed_loads(plan);
    check_handler(plan);
}

void check_spindle(const Plan& plan) {
    const Machine& machine = plan.job.machine;
    if (plan.layers.empty()) return;
    SpindlePlace low{INFINITY}, high{-INFINITY};
    for (const Layer& layer : plan.layers) {
        const LayerHeights at = layer_heights(machine, plan.layers.front().z_top, layer.z_top);
        const double bottom = at.work_offset - at.origin;  // the pattern's, machine
        for (const Operation& operation : layer.operations) {
            if (operation.moves.empty()) continue;
            const auto [least, most] =
                std::minmax_element(operation.moves.begin(), operation.moves.end(),
                                    [](const Move& a, const Move& b) { return a.z < b.z; });
            const double up = bottom + stickout_of(plan.job, operation.tool);
            const SpindlePlace lowest{up + to_mm(least->z), &layer, &operation},
                highest{up + to_mm(most->z), &layer, &operation};
            if (lowest.height < low.height) low = lowest;
            if (highest.height > high.height) high = highest;
        }
    }
    const double needed = high.height - low.height;
    if (!(needed > machine.travel_z + kSlack)) return;
    throw refusal(
        "machine.travel_z",
        fmt::format("the spindle must go from {} to {}, tools' lengths included: {:.1f} mm, {:.1f} mm more "
                    "than machine.travel_z of {:.1f} mm",
                    words_of(low), words_of(high), needed, needed - machine.travel_z, machine.travel_z),
        fmt::format("layer {}", high.layer->index),
        machine.table == BuildTable::moving
            ? "use thinner slabs, tools that stick out alike, or less machine.clearance"
            : "use a machine whose table moves (machine.table), or split the pattern");
}

}  // namespace slabwright
