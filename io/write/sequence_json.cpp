#include "io/write/sequence_json.h"

#include <cmath>
#include <map>
#include <vector>

#include "io/text/job_keys.h"
#include "io/text/json_text.h"

namespace slabwright {

namespace {

constexpr int kQuantity = 6;  // decimals of a step's quantities

/// What every step has.
void begin_step(JsonText& json, const SequenceStep& step) {
    json.key("id").integer(step.id);
    json.key("layer").integer(step.layer);
    json.key("action").string(step.action);
    json.key("needs").begin_array();
    for (const int need : step.needs) json.integer(need);
    json.end();
    json.key("seconds").rounded(step.seconds, 2);
}

}  // namespace

std::string sequence_json(const Plan& plan) {
    using Shape = JsonText::Shape;
    JsonText json;
    json.begin_object();
    json.key("schema").string("slabwright.sequence/1");
    json.key("units").string("mm");
    json.key("frame").string(word_of(kFrameWords, frame_of(plan.job.machine)));
    json.key("pattern").string(plan.input.file);
    json.key("sha256").string(plan.input.sha256);
    // The glue under each layer, then that between the slabs of each; a layer's glue steps go upwards.
    struct Glue {
        int layer = 0;
        const Joint* joint = nullptr;
    };
    std::vector<Glue> glue;
    std::map<int, std::vector<std::size_t>> glue_of;
    const auto add = [&](const Layer& layer, const Joint& joint) {
        glue_of[layer.index].push_back(glue.size());
        glue.push_back({layer.index, &joint});
    };
    for (const Layer& layer : plan.layers)
        if (!layer.joints.empty()) add(layer, layer.joints.front());
    for (const Layer& layer : plan.layers)
        for (std::size_t k = 1; k < layer.joints.size(); ++k) add(layer, layer.joints[k]);
    std::map<int, std::size_t> told;
    json.key("steps").begin_array();
    for (const SequenceStep& step : plan.sequence) {
        json.begin_object(Shape::line);
        begin_step(json, step);
        for (const auto& [key, value] : step.words) json.key(key).string(value);
        if (const auto of = glue_of.find(step.layer); step.action == "glue" && of != glue_of.end())
            if (const std::size_t k = told[step.layer]++; k < of->second.size())
                json.key("polygons").string("#/glue/" + std::to_string(of->second[k]));
        for (const auto& [key, value] : step.numbers) json.key(key).rounded(value, kQuantity);
        json.end();
    }
    json.end();
    json.key("glue").begin_array();
    for (const Glue& g : glue) {
        json.begin_object().key("layer").integer(g.layer);
        json.key("z_mm").rounded(g.joint->z, 6);
        json.key("loops").begin_array();
        for (std::size_t i = 0; i < g.joint->glue.size(); ++i) {
            json.begin_array(Shape::line);
            for (const Point2 p : g.joint->glue.loop(i)) json.begin_array().units(p.x).units(p.y).end();
            json.end();
        }
        json.end();
        if (!g.joint->beads.empty()) {
            json.key("beads").begin_array(Shape::line);
            for (const GlueRun& b : g.joint->beads)
                json.begin_array().units(b.y).units(b.from).units(b.to).end();
            json.end();
        }
        json.end();
    }
    json.end().end();
    return json.take();
}

std::string sequence_json(const BuildSequence& sequence) {
    using Shape = JsonText::Shape;
    JsonText json;
    json.begin_object();
    json.key("schema").string("slabwright.sequence/1");
    json.key("units").string("mm");
    json.key("frame").string(word_of(kFrameWords, sequence.frame));
    json.key("pattern").string(sequence.pattern);
    json.key("sha256").string(sequence.sha256);
    json.key("steps").begin_array();
    for (const SequenceStep& step : sequence.steps) {
        json.begin_object(Shape::line);
        begin_step(json, step);
        for (const auto& [key, value] : step.words) json.key(key).string(value);
        for (const auto& [key, value] : step.numbers) json.key(key).rounded(value, kQuantity);
        json.end();
    }
    json.end();
    json.key("glue").begin_array();
    for (const StatedGlue& g : sequence.glue) {
        json.begin_object().key("layer").integer(g.layer);
        if (!std::isnan(g.z)) json.key("z_mm").rounded(g.z, kQuantity);
        json.key("loops").begin_array();
        for (const auto& loop : g.loops) {
            json.begin_array(Shape::line);
            for (const auto& [x, y] : loop) json.begin_array().rounded(x, 4).rounded(y, 4).end();
            json.end();
        }
        json.end();
        if (!g.beads.empty()) {
            json.key("beads").begin_array(Shape::line);
            for (const auto& [y, a, b] : g.beads)
                json.begin_array().rounded(y, 4).rounded(a, 4).rounded(b, 4).end();
            json.end();
        }
        json.end();
    }
    json.end().end();
    return json.take();
}

}  // namespace slabwright
