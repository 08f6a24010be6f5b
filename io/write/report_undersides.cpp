#include "io/write/report_undersides.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/undersides/underside_target.h"

namespace slabwright {

namespace {

using Json = nlohmann::json;

constexpr double kHundredths = 100;

Json outlines(const Loops& region) {
    Json list = Json::array();
    for (std::size_t i = 0; i < region.size(); ++i) {
        Json points = Json::array();
        for (const Point2 p : region.loop(i)) {
            points.push_back(std::llround(to_mm(p.x) * kHundredths));
            points.push_back(std::llround(to_mm(p.y) * kHundredths));
        }
        list.push_back(std::move(points));
    }
    return list;
}

}  // namespace

std::vector<bool> milled_below(const PlannedFolder& folder) {
    std::vector<bool> below(folder.simulation.layers.size(), false);
    for (const UndersideToMill& underside : folder.build.undersides)
        below.at(static_cast<std::size_t>(underside.layer - 1)) = true;
    return below;
}

std::string report_undersides(Context& context, const PlannedFolder& folder, MeshView mesh,
                              const FolderRefusal& refusal) {
    Json list = Json::array();
    for (const UndersideToMill& planned : folder.build.undersides) {
        const PlannedFolder under = read_planned_folder(folder.path / planned.folder, refusal);
        if (!under.turned) continue;
        const TurnedSlab& slab = *under.turned;
        Json programs = Json::array(), dowels = Json::array();
        for (const PlannedProgram& p : under.build.programs)
            programs.push_back({{"file", p.file.substr(3)},
                                {"purpose", p.purpose},
                                {"tool", p.tool},
                                {"minutes", p.minutes.value_or(0)}});
        for (const JointDowel& d : under.build.layers.front().dowels)
            dowels.push_back({{"x", d.x}, {"y", d.y}, {"diameter", d.diameter}, {"depth", d.below}});
        list.push_back({{"layer", planned.layer},
                        {"folder", planned.folder},
                        {"minutes", planned.minutes.value_or(0)},
                        {"length", slab.blank.length()},
                        {"width", slab.blank.width()},
                        {"thickness", slab.slab_thickness},
                        {"floor", recess_floor(slab)},
                        {"strips", has_strips(slab)},
                        {"region", outlines(turned_region(underside_region(context, mesh, slab), slab))},
                        {"dowels", std::move(dowels)},
                        {"programs", std::move(programs)}});
    }
    return list.dump();
}

}  // namespace slabwright
