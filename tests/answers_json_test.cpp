// What the command answers in JSON, key by key: errors, ways out of an undercut, verdicts.
#include <gtest/gtest.h>

#include <array>
#include <nlohmann/json.hpp>

#include "io/slabwright.h"
#include "io/ways_out.h"
#include "io/write/sheets_json.h"
#include "io/write/verify_json.h"
#include "kernels/errors.h"

namespace slabwright {
namespace {

using nlohmann::json;

TEST(AnswersJson, AnErrorHasItsWordsAndThoseOfTheOthers) {
    const Error open(ErrorKind::input, "stl.open", "is open", "part.stl", "close it");
    const std::array also{
        Error(ErrorKind::no_plan, "left.too_much", "3 mm are left", "L01.ngc:7", "give a tool")};
    EXPECT_EQ(json::parse(error_json(open)), json::parse(R"({"error": {"kind": "input", "exit": 3,
        "code": "stl.open", "message": "is open", "place": "part.stl", "remedy": "close it"}})"));
    EXPECT_EQ(json::parse(error_json(open, also)), json::parse(R"({"error": {"kind": "input", "exit": 3,
        "code": "stl.open", "message": "is open", "place": "part.stl", "remedy": "close it",
        "also": [{"code": "left.too_much", "message": "3 mm are left", "place": "L01.ngc:7",
                  "remedy": "give a tool"}]}})"));
}

TEST(AnswersJson, SheetsTellHowTheirModelWasPrepared) {
    ReadingOptions reading;
    const std::vector<SheetCost> costs;
    const auto prepared = [&] {
        return json::parse(
                   sheets_json(SheetsPlan{}, InputInfo{}, reading, {costs, nullptr, nullptr, {}}))["input"]
            .value("prepared", json());
    };
    EXPECT_EQ(prepared(), json());
    reading.preparation.skin = {.mm = 0.75, .normal = std::array{0.0, 0.0, 1.0}, .angle_deg = 12};
    EXPECT_EQ(prepared(), json::parse(R"({"matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]],
        "skin": {"mm": 0.75, "angle_deg": 12, "normal": [0, 0, 1]}})"));
}

TEST(AnswersJson, WaysOutTellWhatEachLeaves) {
    WaysOut ways;
    ways.looked = true;
    ways.lies = {3, 1234.56, 7.5, true};
    WayOut turned, cut;
    turned.turn = {90, 0, 0};
    turned.outcome = {4, 0.26, 1.5, false};
    cut.plane.emplace();
    cut.outcome = {2, 0, 0, true};
    ways.commands = {{"slabwright plan --turn 90,0,0", turned}, {"slabwright split", cut}};
    MilledWay way;
    way.turn = {0, 90, 0};
    way.size = {100, 70.5, 36};
    way.has_room = false;
    way.above.tops = {18, 36};
    way.above.air.volume_mm3 = 500.04, way.above.air.error_mm3 = 2, way.above.air.height_mm = 6;
    way.above.air.pockets.resize(1);
    way.above.air.pockets[0].layer = 1;
    way.above.air.pockets[0].volume_mm3 = 499, way.above.air.pockets[0].height_mm = 5.5;
    way.above.air.pockets[0].at = {1, 2, 30};
    way.both_sides.tops = {36};
    ways.milled = {way};
    const std::string told = ways_out_json(ways);
    EXPECT_EQ(json::parse(told), json::parse(R"({
        "schema": "slabwright.ways_out/1", "units": "mm", "looked": true,
        "commands": [
          {"command": "slabwright plan --turn 90,0,0", "halves": false,
           "layers": 4, "unmade_mm3": 0.3, "unmade_height": 1.5, "has_room": false},
          {"command": "slabwright split", "halves": true,
           "layers": 2, "unmade_mm3": 0, "unmade_height": 0, "has_room": true}],
        "as_it_lies": {"layers": 3, "unmade_mm3": 1234.6, "unmade_height": 7.5, "has_room": true},
        "ways": [{"turn_deg": [0, 90, 0], "size": [100, 70.5, 36], "has_room": false,
          "milled_from_above": {"layers": 2, "tops": [18, 36], "volume": 500, "volume_error": 2, "height": 6,
             "pockets": 1, "largest": [{"layer": 2, "volume": 499, "height": 5.5, "where": [1, 2, 30]}]},
          "milled_on_both_sides": {"layers": 1, "tops": [36], "volume": 0, "volume_error": 0, "height": 0,
             "pockets": 0, "largest": []}}]})"));
}

TEST(AnswersJson, AVerdictHasEachProgramsFigures) {
    SimulationInput input;
    Program& program = input.programs.emplace_back();
    program.file = "L02_03_rough_T2.ngc";
    program.layer = 1;
    program.kind = OperationKind::rough;
    program.tool = 2;
    SimulationReport report;
    ProgramFindings& found = report.programs.emplace_back();
    found.gouge.cutter.depth = 0.0123456, found.gouge.cutter.line = 77;
    found.gouge.shank.depth = 0.5, found.gouge.holder.depth = 1.25;
    found.rapid.size = 0.00016;
    found.removed_mm3 = 1234.56;
    found.lowest = 17.12346;
    found.cutting_mm = 100.26, found.rapid_mm = 49.94, found.seconds = 90.072;
    const json told = json::parse(verify_json(input, report, {}, "part.stl", true));
    EXPECT_EQ(told.at("programs"),
              json::parse(R"([{"file": "nc/L02_03_rough_T2.ngc", "layer": 2, "kind": "rough",
        "tool": 2, "gouge_mm": 0.01235, "gouge_line": 77, "shank_in_part_mm": 0.5, "holder_in_part_mm": 1.25,
        "rapid_takes_mm": 0.0002, "removed_mm3": 1234.6, "lowest_z": 17.1235, "cutting_mm": 100.3,
        "rapid_mm": 49.9, "minutes": 1.501}])"));
}

}  // namespace
}  // namespace slabwright
