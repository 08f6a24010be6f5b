// Tapered balls, cones, drills of any point and holders in profile, from the job to the proof.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <string>

#include "engine/simulate/gouge.h"
#include "engine/tools/libraries.h"
#include "engine/tools/tools.h"
#include "io/posts/tool_table.h"
#include "io/read/tool_library.h"
#include "io/slabwright.h"
#include "io/write/job_toml.h"
#include "kernels/errors.h"
#include "kernels/forces/deflection.h"
#include "kernels/mesh/weld.h"
#include "nlohmann/json.hpp"
#include "tests/mesh_shapes.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/schema.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using nlohmann::json;
using support::slurp;
using support::spit;
using support::TemporaryFolder;

std::string tool_text(int number, const char* kind, double diameter, const std::string& more) {
    return "[[tool]]\nnumber = " + std::to_string(number) + "\nkind = \"" + kind +
           "\"\ndiameter = " + std::to_string(diameter) + "\nflute_length = 32.0\nstickout = 60.0\n" +
           "shank_diameter = " + std::to_string(diameter) +
           "\nholder_diameter = 30.0\nstepdown_max = 3.0\nname = \"T" + std::to_string(number) + "\"\n" +
           more;
}
const std::string kTapered = tool_text(4, "tapered-ball", 6, "corner_radius = 1.0\ntaper_deg = 5.0\n"),
                  kCone = tool_text(5, "cone", 12, "point_deg = 60.0\n"),
                  kDrill = tool_text(6, "drill", 8, "point_deg = 135.0\n"),
                  kHolder =
                      tool_text(7, "flat", 6, "holder_profile = [10.0, 30.0, 30.0, 15.0, 30.0, 50.0]\n");

std::string refusal_of(const std::string& toml) {
    try {
        validate(job_from_toml(toml, "t"));
    } catch (const Error& error) {
        return error.message();
    }
    return "none";
}

TEST(CutterForms, AreReadFromAJobAndWrittenAgain) {
    const Job job = job_from_toml(kTapered + kCone + kDrill + kHolder, "t");
    validate(job);
    const Job again = job_from_toml(job_toml(job), "again");
    for (const Job* const read : {&job, &again}) {
        ASSERT_EQ(read->tools.size(), 4U);
        const auto degrees = [](double d) { return d * std::numbers::pi / 180; };
        EXPECT_EQ(cutter_shape(read->tools[0]), (CutterShape{3, 1, degrees(5)}));
        EXPECT_EQ(cutter_shape(read->tools[1]), (CutterShape{6, 0, degrees(30)}));
        EXPECT_EQ(cutter_shape(read->tools[2]), (CutterShape{4, 0, degrees(67.5)}));
        EXPECT_EQ(read->tools[3].holder_profile, (std::vector<double>{10, 30, 30, 15, 30, 50}));
        EXPECT_TRUE(read->tools[0].plunges && read->tools[1].plunges);
    }
    EXPECT_TRUE(is_end_mill(ToolKind::tapered_ball) && has_ball_tip(ToolKind::tapered_ball));
    EXPECT_TRUE(mills(ToolKind::cone) && !is_end_mill(ToolKind::cone));
    EXPECT_EQ(tip_diameter(job.tools[0]), 2);
}

TEST(CutterForms, MeasuresThatMakeNoneAreRefused) {
    const auto says = [](const std::string& toml, const char* what) {
        EXPECT_NE(refusal_of(toml).find(what), std::string::npos) << toml << refusal_of(toml);
    };
    says(tool_text(4, "tapered-ball", 6, "corner_radius = 1.0\n"), "taper_deg");
    says(tool_text(4, "tapered-ball", 6, "taper_deg = 5.0\n"), "corner_radius");
    says(tool_text(4, "tapered-ball", 6, "corner_radius = 3.0\ntaper_deg = 5.0\n"), "whole radius");
    says(tool_text(4, "flat", 6, "taper_deg = 5.0\n"), "no taper");
    // As wide as 20 mm it would be 107 mm over its tip, and its flutes have 32.
    says(tool_text(4, "tapered-ball", 20, "corner_radius = 1.0\ntaper_deg = 5.0\n"), "above its flutes");
    says(tool_text(4, "cone", 20, "point_deg = 15.0\n"), "above its flutes");
    says(tool_text(4, "cone", 20, "point_deg = 175.0\n"), "point_deg");
    says(tool_text(4, "flat", 6, "holder_profile = [10.0, 30.0]\n"), "has 2 numbers");
    says(tool_text(4, "flat", 6, "holder_profile = [10.0, 40.0, 40.0]\n"), "holder_diameter is 30");
    says(tool_text(4, "flat", 6, "holder_profile = [0.0, 30.0, 40.0]\n"), "holder_profile");
}

TEST(CutterForms, GoIntoToolTablesAndComeBack) {
    const TemporaryFolder folder;
    const Job job = job_from_toml(kTapered + kCone + kDrill + tool_text(8, "drill", 5, ""), "t");
    const std::string table = tool_table(job, {});
    EXPECT_NE(table.find("T4 P4 D6 Z0 ;T4, tapered-ball R1 A5\n"), std::string::npos) << table;
    EXPECT_NE(table.find("T5 P5 D12 Z0 ;T5, cone A60\n"), std::string::npos) << table;
    EXPECT_NE(table.find("T6 P6 D8 Z0 ;T6, drill A135\n"), std::string::npos) << table;
    EXPECT_NE(table.find("T8 P8 D5 Z0 ;T8\n"), std::string::npos) << table;
    spit(folder / "tool.tbl", table);
    spit(folder / "job.toml",
         "[tools]\nlibrary = \"tool.tbl\"\nflute_length = 32.0\nstickout = 60.0\nshank_diameter = 6.0\n"
         "holder_diameter = 30.0\nstepdown_max = 3.0\n[[tool]]\nnumber = 8\nkind = \"drill\"\n");
    const Job read = read_job(folder / "job.toml");
    ASSERT_EQ(read.tools.size(), 4U);
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(cutter_shape(read.tools[i]), cutter_shape(job.tools[i])) << i;
        EXPECT_EQ(read.tools[i].name, job.tools[i].name) << i;
    }
}

TEST(CutterForms, AreReadFromCsvAndFreecadsBits) {
    const TemporaryFolder folder;
    const auto bit = [&](const std::string& shape, const std::string& parameter) {
        spit(folder / "bit.fctb", R"({"version": 2, "name": "a bit", "shape": ")" + shape +
                                      R"(.fcstd", "parameter": {"CuttingEdgeHeight": "30.0 mm", )" +
                                      parameter + R"("ShankDiameter": "6.0 mm"}, "attribute": {}})");
        spit(folder / "tools.fctl", R"({"version": 1, "tools": [ {"nr": 4, "path": "bit.fctb"}]})");
        spit(folder / "job.toml",
             "[tools]\nlibrary = \"tools.fctl\"\nstickout = 45.0\nholder_diameter = 30.0\nstepdown_max = "
             "3.0\n");
        return read_job(folder / "job.toml").tools.front();
    };
    // Their taper is the whole angle, and their diameter the tip's.
    EXPECT_EQ(cutter_shape(bit("taperedballnose", R"("Diameter": "2.0 mm", "TaperDiameter": "6.0 mm",
                                                     "TaperAngle": "10.0 °", )")),
              cutter_shape(job_from_toml(kTapered, "t").tools[0]));
    const std::string point = R"("Diameter": "12.0 mm", "CuttingEdgeAngle": "60.0 °", )";
    EXPECT_EQ(cutter_shape(bit("v-bit", point + R"("TipDiameter": "0.1 mm", )")),
              cutter_shape(job_from_toml(kCone, "t").tools[0]));
    for (const auto& [shape, parameter] :
         std::map<std::string, std::string>{{"v-bit", point + R"("TipDiameter": "1.0 mm", )"},
                                            {"vbit", R"("Diameter": "12.0 mm", )"},
                                            {"taperedballnose", R"("Diameter": "2.0 mm", )"}})
        try {
            (void)bit(shape, parameter);
            ADD_FAILURE() << shape;
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), "tools.shape") << shape;
        }
    spit(folder / "tools.csv",
         "number;kind;diameter;flute_length;stickout;shank_diameter;holder_diameter;stepdown_max;corner_"
         "radius;"
         "taper_deg;point_deg\n4;tapered-ball;6;32;60;6;30;3;1;5;\n5;cone;12;32;60;12;30;3;;;60\n");
    const Job job = read_job("", folder / "tools.csv");
    ASSERT_EQ(job.tools.size(), 2U);
    EXPECT_EQ(cutter_shape(job.tools[0]), cutter_shape(job_from_toml(kTapered, "t").tools[0]));
    EXPECT_EQ(cutter_shape(job.tools[1]), cutter_shape(job_from_toml(kCone, "t").tools[0]));
}

// A cantilever whose thickness grows evenly from d0 to d1 bends as one of the fourth root of d0·d1³.
TEST(CutterForms, BendAsTheirTaperSays) {
    const Job job = job_from_toml(kTapered + kHolder, "t");
    Tool tool = job.tools[0];
    tool.diameter = 20, tool.shank_diameter = 20, tool.flute_length = tool.stickout = 60;
    tool.corner_radius = 2, tool.taper_deg = 6;
    const double tangent = std::tan(6 * std::numbers::pi / 180), low = 2 * (1 - std::sin(std::atan(tangent)));
    const auto wide = [&](double z) { return 2 * (2 * std::cos(std::atan(tangent)) + (z - low) * tangent); };
    ASSERT_LT(wide(60), 20);
    const double d0 = wide(2), d1 = wide(60);
    const double same = std::pow(60.0 / 58, 0.75) * std::pow(d0 * d1 * d1 * d1, 0.25);
    EXPECT_NEAR(bending_diameter(tool), same, 1e-3 * same);
    EXPECT_LT(bending_diameter(tool), d1);
    // Bent hardest where 3·dz(d) = z·dd: here at half the load's distance to where the flank would end in d0
    // = 0.
    const double at = std::min(58.0, d0 / (2 * 2 * tangent));
    const double hardest = at / std::pow(d0 + 2 * tangent * at, 3);
    EXPECT_NEAR(strength_diameter(tool), std::cbrt(60 / hardest), 2e-2 * std::cbrt(60 / hardest));
}

// Luo's cutter is fluted up to the holder and .8 as thick as it is wide; a shank over the flutes is solid.
TEST(CutterForms, BendAsTheirShankSays) {
    Tool tool = tool_of_kind(Job{}, ToolKind::flat);
    tool.flute_length = tool.stickout;
    EXPECT_EQ(bending_diameter(tool), tool.diameter);
    EXPECT_EQ(strength_diameter(tool), tool.diameter);
    std::mt19937 random(test::seed());
    const auto draw = [&](double low, double high) {
        return std::uniform_real_distribution<>(low, high)(random);
    };
    for (int n = 0; n < 50; ++n) {
        tool.diameter = draw(2, 30), tool.shank_diameter = draw(2, 30);
        tool.stickout = draw(20, 90), tool.flute_length = std::floor(draw(10, 100)) / 100 * tool.stickout;
        // The lever of a force at the tip, slice by slice: its turn at z moves the tip by z times as much.
        const double force = draw(1, 100), modulus = 1e3 * tool.modulus_gpa, dz = tool.stickout / 20000;
        double bent = 0, stress = 0;
        for (double z = dz / 2; z < tool.stickout; z += dz) {
            const double d = z < tool.flute_length ? 0.8 * tool.diameter : tool.shank_diameter;
            bent += force * z / (modulus * std::numbers::pi / 64 * std::pow(d, 4)) * z * dz;
            stress = std::max(stress, force * z / (std::numbers::pi / 32 * std::pow(d, 3)));
        }
        EXPECT_NEAR(tip_bent_by(tool, force), bent, 1e-3 * bent);
        EXPECT_NEAR(cutter_stress(force, tool.stickout, strength_diameter(tool)), stress, 1e-3 * stress);
    }
}

TEST(CutterForms, AHolderInProfileIsCheckedAsItsCones) {
    const Job job = job_from_toml(kHolder, "t");
    const Tool& tool = job.tools[0];
    // A cylinder of 15 mm from 60 to 70, then a cone to 25 mm at 85 over the tip.
    const std::vector<ToolSection> sections = sections_of(tool);
    ASSERT_EQ(sections.size(), 2U);
    EXPECT_EQ(sections[1].above, 70);
    EXPECT_EQ(sections[1].lower, 15);
    EXPECT_EQ(sections[1].radius, 25);
    double radius = 0;
    for (const ToolSection& c : cylinders_of(tool)) {
        EXPECT_GE(c.radius, radius);
        radius = c.radius;
        EXPECT_GE(c.radius, c.above < 70 ? 15 : 15 + (c.above - 70) * 10 / 15 - 1e-9);
    }
    EXPECT_EQ(radius, 25);
    // A post as high as the middle of the cone, 20 mm wide there: 18 mm from the axis it is 2 mm inside.
    Context context;
    const Mesh mesh = weld(context, shapes::box({18, -50, 0}, {40, 50, 77.5F}));
    const StandingPart part(context, mesh.view());
    Program program;
    program.steps = {{0, 0, 200, 0, 1}, {0, 0, 0, 1000, 2}};
    const GougeReport report = check_gouge(context, part, 100, tool, program);
    EXPECT_EQ(report.cutter.depth, 0);
    EXPECT_NEAR(report.holder.depth, 2 * std::cos(std::atan2(10, 15)), 1e-3);
    EXPECT_EQ(report.holder.line, 2U);
    EXPECT_EQ(report.contact_lines, std::vector<std::uint32_t>{2});
    EXPECT_TRUE(report.gouge_lines.empty());
}

TEST(CutterForms, FollowWiderBallsIntoNarrowPlaces) {
    Job job;
    job.tools = forms_library();
    const std::vector<Tool> rest = rest_tools(job, job.tools[1], job.tools[2].diameter);
    ASSERT_EQ(rest.size(), 1U);
    EXPECT_EQ(rest[0].kind, ToolKind::tapered_ball);
    validate(job);
}

TEST(CutterForms, PlansWithALibraryOfEveryFormAreProven) {
    const TemporaryFolder folder;
    Context context;
    const std::string out = folder / "plan", stl = support::checkout("tests/data/pump-cover.stl");
    Job job;
    job.tools = forms_library();
    job.selection.mode = SelectionMode::fixed;
    job.cutting.edges = true;
    job.tools[2].holder_profile = {20, 32, 32, 20, 32, 60};
    write(context, plan(context, stl, job), out);
    EXPECT_EQ(support::schema_complaint(slurp(out + "/plan.json"), support::checkout("io/plan.schema.json")),
              "");
    const VerifyResult result = verify(context, out, stl, {}, 1);
    for (const Diagnostic& d : result.violations) ADD_FAILURE() << d.code << ' ' << d.message;
    const json planned = json::parse(slurp(out + "/plan.json"));
    EXPECT_EQ(planned["tools"][5]["kind"], "tapered-ball");
    EXPECT_EQ(planned["tools"][5]["taper_deg"], 5.0);
    EXPECT_EQ(planned["tools"][6]["point_deg"], 90.0);
    EXPECT_EQ(planned["tools"][2]["holder"]["profile"].size(), 6U);
    std::map<int, int> operations;
    for (const json& layer : planned["layers"])
        for (const json& op : layer["operations"]) {
            ++operations[op["tool"]];
            EXPECT_GT(op["peak_force_n"], 0);
        }
    EXPECT_GT(operations[6], 0) << "the tapered ball has something to do";
}

}  // namespace
}  // namespace slabwright
