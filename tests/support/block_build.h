// A plan of a block, scheduled, and what plan.json and its programs would say of it: for tests of sequences.
#pragma once

#include <random>
#include <string>

#include "engine/schedule/schedule.h"
#include "engine/simulate/build_replay.h"

namespace slabwright::support {

inline Operation operation(OperationKind kind, int tool, double low, double high, double minutes) {
    Operation op;
    op.kind = kind;
    op.purpose = std::string("to ") + std::string(name(kind));
    op.tool = tool;
    op.minutes = minutes;
    op.moves = {{0, 0, to_units(high), 0}, {0, 0, to_units(low), 1000}, {0, 0, to_units(high), 0}};
    return op;
}

/// Another area and force at every joint.
inline void set_glue(Layer& layer, std::int32_t width, std::int32_t depth) {
    for (int k = 0; k < layer.slabs; ++k, width += 20'000) {
        Joint& joint = layer.joints.emplace_back();
        joint.z = layer.z_bottom + k * layer.slab_thickness / layer.slabs;
        joint.glue.points = {{0, 0}, {width, 0}, {width, depth}, {0, depth}};
        joint.glue.close_loop();
        joint.area_mm2 = to_mm(width) * to_mm(depth);
        joint.force_n = joint.area_mm2 / 4;
    }
}

struct Shape {
    int layers = 3, slabs = 1;
    bool flask = false;
};

/// A plan of a block in the stock of 200 × 100 mm, scheduled.
inline Plan block(const Job& job, const Shape& shape) {
    Plan plan;
    plan.job = job;
    plan.input.file = "block.stl";
    plan.input.sha256 = std::string(64, 'b');
    plan.stock_min = {-20, -10};
    plan.stock_max = {180, 90};
    for (int i = 0; i < shape.layers; ++i) {
        Layer layer;
        layer.index = i + 1;
        layer.slabs = i == 1 ? shape.slabs : 1;
        layer.slab_thickness = (i % 2 == 0 ? 19.0 : 12.0) * layer.slabs;
        layer.z_bottom = i == 0 ? 0 : plan.layers.back().z_top;
        layer.z_top = layer.z_bottom + layer.slab_thickness - 0.5 - i;
        set_glue(layer, 1'000'000 + 10'000 * i, 600'000);
        const double clear = layer.z_bottom + layer.slab_thickness + 10;
        layer.operations = {operation(OperationKind::face, 1, layer.z_top, clear, 1.5 + i),
                            operation(OperationKind::rough, 2, layer.z_bottom, clear, 4 + i),
                            operation(OperationKind::finish, 3, layer.z_bottom - 3, clear, 6 + i),
                            operation(OperationKind::finish, 3, layer.z_bottom - 2, clear, 2 + i)};
        plan.layers.push_back(layer);
    }
    if (shape.flask) {
        plan.flask.emplace();
        plan.flask->volume_mm3 = 2e6;
        plan.flask->opening_mm3 = 1e6;
    }
    schedule(plan);
    return plan;
}

/// What plan.json and the programs would say of it.
inline BuildPlan stated(const Plan& plan) {
    BuildPlan build;
    build.job = plan.job;
    build.job_stated = true;
    build.frame = frame_of(plan.job.machine);
    build.pattern = plan.input.file;
    build.sha256 = plan.input.sha256;
    build.stock_min = plan.stock_min, build.stock_max = plan.stock_max;
    build.tools = plan.job.tools;
    build.flask = plan.flask.has_value();
    if (plan.flask) {
        build.flask_mass_kg = plan.flask->volume_mm3 * 1e-9 * plan.job.material.density_kg_m3;
        build.sand_litres = (plan.flask->opening_mm3 - plan.totals.part_volume_mm3) * 1e-6;
    }
    for (std::size_t l = 0; l < plan.layers.size(); ++l) {
        const Layer& layer = plan.layers[l];
        LayerToBuild& to = build.layers.emplace_back();
        to.index = layer.index;
        to.z_bottom = layer.z_bottom, to.z_top = layer.z_top;
        to.slab_thickness = layer.slab_thickness, to.slabs = layer.slabs;
        for (const Joint& joint : layer.joints) to.joints.push_back({joint.area_mm2, joint.force_n});
        for (const Operation& op : layer.operations) {
            PlannedProgram& program = build.programs.emplace_back();
            program.file = "nc/" + op.file;
            program.layer = l;
            program.kind = op.kind;
            program.tool = op.tool;
            program.purpose = op.purpose;
            program.minutes = op.minutes;
            program.low = to_mm(op.moves[1].z), program.high = to_mm(op.moves[0].z);
        }
    }
    return build;
}

inline Job random_job(std::mt19937& random) {
    Job job;
    job.machine.table = random() % 3 ? BuildTable::moving : BuildTable::fixed;
    job.machine.frame = static_cast<Frame>(random() % 3);
    job.machine.travel_z = 400;
    job.machine.feed_height = random() % 3 == 0 ? 0 : random() % 2 ? 1200 : 40;
    if (random() % 5 == 0) job.machine.handler_speed = 0;
    job.machine.glue_pitch = 1 + static_cast<double>(random() % 20);
    job.machine.pump_g_min = random() % 2 ? 0 : 30;
    if (random() % 3 == 0) job.machine.glue_head = random() % 2 ? GlueHead::stack : GlueHead::none;
    if (random() % 4 == 0) job.bonding.glue_g_per_m2 = 0;
    if (random() % 2) job.machine.magazine = 1 + static_cast<int>(random() % 4);
    return job;
}

inline Shape random_shape(std::mt19937& random) {
    return {1 + static_cast<int>(random() % 6), 1 + static_cast<int>(random() % 3), random() % 2 == 0};
}

}  // namespace slabwright::support
