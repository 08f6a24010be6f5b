#include "io/sequence_json.h"

#include <map>

#include "io/job_keys.h"
#include "io/json_text.h"

namespace slabwright {

std::string sequence_json(const Plan& plan) {
    using Shape = JsonText::Shape;
    JsonText json;
    json.begin_object();
    json.key("schema").string("slabwright.sequence/1");
    json.key("units").string("mm");
    json.key("frame").string(word_of(kFrameWords, frame_of(plan.job.machine)));
    json.key("pattern").string(plan.input.file);
    json.key("sha256").string(plan.input.sha256);
    std::map<int, std::size_t> glue_of;
    for (std::size_t i = 0; i < plan.layers.size(); ++i) glue_of.emplace(plan.layers[i].index, i);
    json.key("steps").begin_array();
    for (const SequenceStep& step : plan.sequence) {
        json.begin_object(Shape::line);
        json.key("id").integer(step.id);
        json.key("layer").integer(step.layer);
        json.key("action").string(step.action);
        json.key("needs").begin_array();
        for (const int need : step.needs) json.integer(need);
        json.end();
        json.key("seconds").rounded(step.seconds, 2);
        for (const auto& [key, value] : step.words) json.key(key).string(value);
        if (const auto glue = glue_of.find(step.layer); step.action == "glue" && glue != glue_of.end())
            json.key("polygons").string("#/glue/" + std::to_string(glue->second));
        for (const auto& [key, value] : step.numbers) json.key(key).rounded(value, 6);
        json.end();
    }
    json.end();
    json.key("glue").begin_array();
    for (const Layer& layer : plan.layers) {
        json.begin_object().key("layer").integer(layer.index).key("loops").begin_array();
        for (std::size_t i = 0; i < layer.glue.size(); ++i) {
            json.begin_array(Shape::line);
            for (const Point2 p : layer.glue.loop(i)) json.begin_array().units(p.x).units(p.y).end();
            json.end();
        }
        json.end().end();
    }
    json.end().end();
    return json.take();
}

}  // namespace slabwright
