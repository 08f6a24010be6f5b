#include "io/write/sheets_json.h"

#include <fmt/format.h>

#include "io/text/job_keys.h"
#include "io/text/json_text.h"
#include "io/write/plan_json.h"

namespace slabwright {

namespace {

const char* name_of(SheetStrategy strategy) {
    return strategy == SheetStrategy::uniform   ? "uniform"
           : strategy == SheetStrategy::printed ? "printed"
                                                : "optimal";
}
const char* name_of(StairSide side) {
    return side == StairSide::outside ? "outside" : side == StairSide::inside ? "inside" : "middle";
}
const char* name_of(SheetHead head) {
    return head == SheetHead::router ? "router" : head == SheetHead::laser ? "laser" : "jet";
}

/// All that reads the pattern alike again.
void put_preparation(JsonText& json, const Preparation& preparation) {
    json.begin_object().key("matrix").begin_array();
    for (const auto& row : preparation.map.rows) {
        json.begin_array(JsonText::Shape::line);
        for (const double v : row) json.exact(v);
        json.end();
    }
    json.end();
    const auto put = [&](const char* key, const auto& values) {
        json.key(key).begin_array();
        for (const double v : values) json.exact(v);
        json.end();
    };
    if (const Skin& skin = preparation.skin; skin.mm > 0) {
        json.key("skin").begin_object(JsonText::Shape::line).key("mm").exact(skin.mm);
        json.key("angle_deg").exact(skin.angle_deg);
        if (skin.normal) put("normal", *skin.normal);
        if (skin.box) put("box", *skin.box);
        json.end();
    }
    json.end();
}

}  // namespace

std::string sheet_file(std::size_t index) { return fmt::format("sheet_{:02}", index + 1); }

namespace {

const char* name_of(SheetAlignment way) {
    return way == SheetAlignment::none     ? "none"
           : way == SheetAlignment::holes  ? "holes"
           : way == SheetAlignment::dowels ? "dowels"
                                           : "tabs";
}

void put_point(JsonText& json, Point2 p) {
    json.begin_array(JsonText::Shape::line).units(p.x).units(p.y).end();
}

void put_hold(JsonText& json, const SheetPiece& piece) {
    json.key("dowels").begin_array(JsonText::Shape::line);
    for (const Point2 hole : piece.hold.holes) put_point(json, hole);
    json.end().key("tabs").begin_array(JsonText::Shape::line);
    for (std::size_t l = 0; l < piece.hold.added.size(); ++l) {
        json.begin_array(JsonText::Shape::line);
        for (const Point2 p : piece.hold.added.loop(l)) put_point(json, p);
        json.end();
    }
    json.end().key("pins").begin_array(JsonText::Shape::line);
    for (const Point2 pin : piece.pins) put_point(json, pin);
    json.end();
}

void put_engravings(JsonText& json, const SheetPiece& piece) {
    json.key("engraved").begin_array(JsonText::Shape::line);
    for (const Engraving& engraving : piece.engravings) {
        json.begin_object(JsonText::Shape::line).key("text").string(engraving.text);
        json.key("strokes").begin_array(JsonText::Shape::line);
        for (const std::vector<Point2>& stroke : engraving.strokes) {
            json.begin_array(JsonText::Shape::line);
            for (const Point2 p : stroke) put_point(json, p);
            json.end();
        }
        json.end().end();
    }
    json.end();
}

void put_costs(JsonText& json, const std::vector<SheetCost>& costs, bool has_weight) {
    json.key("ways").begin_array();
    for (const SheetCost& cost : costs) {
        json.begin_object(JsonText::Shape::line).key("way").string(cost.way);
        if (!cost.why_not.empty()) {
            json.key("why_not").string(cost.why_not).end();
            continue;
        }
        json.key("sheets").count(cost.sheets).key("stock_sheets").count(cost.stock_sheets);
        json.key("cut_mm").rounded(cost.cut_mm, 1).key("minutes").rounded(cost.minutes, 3);
        json.key("stair_mm3").rounded(cost.stair_mm3, 2).key("deviation").rounded(cost.deviation, 4);
        if (has_weight)
            json.key("part_kg").rounded(cost.part_kg, 4).key("stock_kg").rounded(cost.stock_kg, 4);
        json.key("money").rounded(cost.money, 2).end();
    }
    json.end();
}

/// The joint with the least bonded face, and what it bears.
void put_joint(JsonText& json, const SheetsPlan& plan, const SheetBond* bond) {
    if (bond != nullptr) {
        json.key("bonding").begin_object(JsonText::Shape::line).key("kind").string(bond->name);
        json.key("strength_mpa").rounded(bond->strength_mpa, 2).key("source").string(bond->source).end();
    }
    const SheetPiece* least = nullptr;
    for (std::size_t i = 0; i + 1 < plan.pieces.size(); ++i)
        if (least == nullptr || plan.pieces[i].joint_mm2 < least->joint_mm2) least = &plan.pieces[i];
    if (least == nullptr) return;
    json.key("weakest_joint").begin_object(JsonText::Shape::line).key("below").integer(least->number);
    json.key("above").integer(least->number + 1).key("area_mm2").rounded(least->joint_mm2, 2);
    if (bond != nullptr) json.key("bears_n").rounded(least->joint_mm2 * bond->strength_mpa, 0);
    json.end();
}

}  // namespace

std::string sheets_json(const SheetsPlan& plan, const InputInfo& input, const ReadingOptions& reading,
                        const SheetsTold& told) {
    const SheetJob& job = plan.job;
    JsonText json;
    json.begin_object().key("schema").string("slabwright.sheets/1").key("units").string("mm");
    json.key("input").begin_object();
    json.key("file")
        .string(input.file)
        .key("sha256")
        .string(input.sha256)
        .key("triangles")
        .count(input.triangles);
    json.key("units").string(word_of(kUnitWords, reading.units)).key("weld").exact(reading.weld_mm);
    json.key("repair").string(word_of(kRepairWords, reading.repair));
    if (!reading.preparation.changes_nothing()) {
        json.key("prepared");
        put_preparation(json, reading.preparation);
    }
    json.end();
    json.key("axis").string(std::string(1, job.axis)).key("height").rounded(plan.height, 4);
    json.key("strategy").string(name_of(job.slicing.strategy)).key("side").string(name_of(job.slicing.side));
    json.key("head").string(name_of(job.head)).key("kerf").exact(job.cutting.kerf);
    json.key("most_tilt_deg").exact(job.cutting.most_tilt_deg).key("bond").exact(job.slicing.bond);
    json.key("thicknesses").begin_array(JsonText::Shape::line);
    for (const double t : job.slicing.thicknesses) json.exact(t);
    json.end();
    json.key("alignment").string(name_of(job.alignment.way));
    if (job.alignment.way != SheetAlignment::none) json.key("dowel").exact(job.alignment.dowel);
    if (told.material != nullptr) json.key("material").string(told.material->name);
    put_joint(json, plan, told.bond);
    json.key("pieces").begin_array();
    for (const SheetPiece& piece : plan.pieces) {
        json.begin_object(JsonText::Shape::line).key("number").integer(piece.number);
        json.key("bottom").rounded(piece.span.bottom, 4).key("top").rounded(piece.span.top, 4);
        json.key("program").string("nc/" + sheet_file(static_cast<std::size_t>(piece.program)) + ".ngc");
        json.key("turn").integer(piece.place.turn).key("x").units(piece.place.shift.x);
        json.key("y").units(piece.place.shift.y).key("islands").integer(piece.islands);
        json.key("area_mm2").rounded(piece.area_mm2, 2).key("stair_mm3").rounded(piece.stair_mm3, 2);
        json.key("deviation").rounded(piece.deviation, 4).key("tilt_deg").rounded(piece.tilt_deg, 2);
        json.key("joint_mm2").rounded(piece.joint_mm2, 2);
        put_hold(json, piece);
        put_engravings(json, piece);
        json.end();
    }
    json.end().key("programs").begin_array();
    double cut_mm = 0, minutes = 0;
    for (std::size_t i = 0; i < plan.programs.size(); ++i) {
        const SheetProgram& program = plan.programs[i];
        cut_mm += program.cut_mm, minutes += program.minutes;
        json.begin_object(JsonText::Shape::line).key("file").string("nc/" + sheet_file(i) + ".ngc");
        json.key("dxf")
            .string("dxf/" + sheet_file(i) + ".dxf")
            .key("svg")
            .string("svg/" + sheet_file(i) + ".svg");
        json.key("thickness").exact(program.thickness).key("length").exact(program.stock.length);
        json.key("width").exact(program.stock.width).key("pieces").begin_array(JsonText::Shape::line);
        for (const int number : program.pieces) json.integer(number);
        json.end().key("cut_mm").rounded(program.cut_mm, 1).key("minutes").rounded(program.minutes, 3);
        const StockSheet offcut = offcut_of(plan, i);
        json.key("offcut").begin_array(JsonText::Shape::line);
        if (offcut.length > 0) json.rounded(offcut.length, 1).rounded(offcut.width, 1);
        json.end().end();
    }
    json.end().key("totals").begin_object();
    json.key("sheets").count(plan.pieces.size()).key("uniform_sheets").count(plan.uniform_sheets);
    json.key("stock_sheets").count(plan.programs.size()).key("cut_mm").rounded(cut_mm, 1);
    json.key("minutes").rounded(minutes, 3).key("stair_mm3").rounded(plan.stack.stair_mm3, 2);
    json.key("left_on_top").rounded(plan.stack.left_on_top, 4).end();
    json.key("fixture").begin_array(JsonText::Shape::line);
    for (const std::string& name : told.fixture) json.string(name);
    json.end();
    put_costs(json, told.costs, told.material != nullptr);
    json.key("diagnostics");
    put_diagnostics(json, plan.diagnostics);
    json.end();
    return json.take();
}

std::string sheets_verify_json(const SheetProof& proof, const std::string& pattern) {
    JsonText json;
    json.begin_object().key("schema").string("slabwright.sheets-verify/1");
    json.key("passed").boolean(proof.passed).key("pattern").string(pattern);
    json.key("part_mm3").rounded(proof.part_mm3, 2).key("made_mm3").rounded(proof.made_mm3, 2);
    json.key("gouge_mm").rounded(proof.gouge, 4).key("left_over_mm").rounded(proof.left_over, 4);
    json.key("left_on_top_mm").rounded(proof.left_on_top, 4).key("islands").integer(proof.islands);
    json.key("dowels").integer(proof.dowels).key("engraved").integer(proof.engraved);
    json.key("violations");
    put_diagnostics(json, proof.violations);
    json.end();
    return json.take();
}

}  // namespace slabwright
