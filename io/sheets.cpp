#include "io/sheets.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "io/posts/sheet_gcode.h"
#include "io/posts/sheet_reader.h"
#include "io/read/input_file.h"
#include "io/read/pattern.h"
#include "io/sheets_html.h"
#include "io/text/job_keys.h"
#include "io/write/output_file.h"
#include "io/write/output_folder.h"
#include "io/write/sheets_drawings.h"
#include "io/write/sheets_json.h"
#include "kernels/errors.h"

namespace slabwright {

namespace fs = std::filesystem;

namespace {

struct SheetsFolder {
    PlannedPattern pattern;
    char axis = 'z';
    bool part_may_lose = false;
    std::vector<std::string> programs;  ///< names in nc/
};

template <class Enum, std::size_t N>
Enum value_of(const Word<Enum> (&words)[N], const std::string& text) {
    for (const Word<Enum>& word : words)
        if (text == word.text) return word.value;
    throw std::out_of_range(text);
}

/// What sheets.json says was done to the model.
Preparation preparation_in(const nlohmann::json& prepared) {
    Preparation preparation;
    preparation.map.rows = prepared.at("matrix").get<std::array<std::array<double, 4>, 3>>();
    if (!prepared.contains("skin")) return preparation;
    const auto& skin = prepared.at("skin");
    preparation.skin.mm = skin.at("mm").get<double>();
    preparation.skin.angle_deg = skin.at("angle_deg").get<double>();
    if (skin.contains("normal")) preparation.skin.normal = skin.at("normal").get<std::array<double, 3>>();
    if (skin.contains("box")) preparation.skin.box = skin.at("box").get<std::array<double, 6>>();
    return preparation;
}

SheetsFolder read_folder(const fs::path& directory) {
    const fs::path path = directory / "sheets.json";
    const char* remedy = "write the folder again with `slabwright sheets`";
    try {
        const auto document =
            nlohmann::json::parse(read_document(path, ErrorKind::verification, "sheets.json.", remedy));
        if (document.at("schema") != "slabwright.sheets/1") throw std::out_of_range("schema");
        SheetsFolder folder;
        const auto& input = document.at("input");
        folder.pattern.file = input.at("file").get<std::string>();
        folder.pattern.sha256 = input.at("sha256").get<std::string>();
        folder.pattern.reading = {value_of(kUnitWords, input.at("units").get<std::string>()),
                                  input.at("weld").get<double>(),
                                  value_of(kRepairWords, input.at("repair").get<std::string>())};
        if (input.contains("prepared"))
            folder.pattern.reading.preparation = preparation_in(input.at("prepared"));
        folder.axis = document.at("axis").get<std::string>().at(0);
        folder.part_may_lose = document.at("side") != "outside";
        for (const auto& program : document.at("programs"))
            folder.programs.push_back(fs::path(program.at("file").get<std::string>()).filename().string());
        return folder;
    } catch (const std::logic_error& error) {
        throw Error(ErrorKind::verification, "sheets.json.unreadable", "is no sheets.json of ours",
                    path.string(), remedy);
    } catch (const nlohmann::json::exception& error) {
        throw Error(ErrorKind::verification, "sheets.json.unreadable", "is no sheets.json of ours",
                    path.string(), remedy);
    }
}

/// The programs of a folder: those that sheets.json names, and none beside them.
std::vector<ReadSheetProgram> read_programs(const fs::path& directory, const SheetsFolder& folder) {
    const std::set<std::string> named(folder.programs.begin(), folder.programs.end());
    std::error_code ignored;
    for (fs::directory_iterator at(directory / "nc", ignored); !ignored && at != fs::directory_iterator();
         ++at)
        if (named.count(at->path().filename().string()) == 0)
            throw Error(ErrorKind::verification, "sheets.stray",
                        "is a program that sheets.json does not name", at->path().string(), "take it away");
    std::vector<ReadSheetProgram> programs;
    for (const std::string& name : named) {
        const fs::path path = directory / "nc" / name;
        programs.push_back(read_sheet_program(
            read_whole(path, {ErrorKind::verification, "sheets.program.", kMostProgramBytes}), "nc/" + name));
    }
    return programs;
}

SheetProof prove_folder(Context& context, const fs::path& directory, const Mesh& along,
                        const std::string& pattern, SheetProofRules rules) {
    const SheetsFolder folder = read_folder(directory);
    rules.part_may_lose = rules.part_may_lose || folder.part_may_lose;
    const std::vector<ReadSheetProgram> programs = read_programs(directory, folder);
    SheetProof proof = prove_sheets(context, along.view(), programs, rules);
    const std::string verdict = sheets_verify_json(proof, pattern);
    write_file_in(directory, "verify.json", verdict);
    const std::string page =
        assembly_html(read_document(directory / "sheets.json", ErrorKind::verification, "sheets.json.", ""),
                      verdict, programs);
    if (!page.empty()) write_file_in(directory, "assembly.html", page);
    return proof;
}

/// @returns the names of what was written to fixture/
std::vector<std::string> write_fixture(Context& context, const fs::path& directory, const Mesh& along,
                                       const SheetsPlan& plan, const SheetExtras& extras) {
    if (!extras.nest && !extras.crate) return {};
    std::vector<FixturePiece> pieces;
    if (extras.nest) {
        std::vector<Loops> outlines;
        for (const SheetStair& stair :
             stairs_of(context, along.view(), plan.stack.sheets, plan.job.slicing.side, false))
            outlines.push_back(stair.outline);
        pieces = full_nest(plan.stack.sheets, outlines, extras.fixture);
    }
    if (extras.crate)
        for (FixturePiece& piece : egg_crate(context, along, extras.fixture))
            pieces.push_back(std::move(piece));
    fs::create_directory(directory / "fixture");
    std::vector<std::string> names;
    for (const FixturePiece& piece : pieces) {
        names.push_back(piece.name + ".dxf");
        write_file_in(directory / "fixture", names.back(), loops_dxf(piece.region, piece.name));
    }
    return names;
}

}  // namespace

SheetsResult make_sheets(Context& context, const std::string& pattern, const Job& reading,
                         const SheetJob& job, const std::string& directory, const SheetProofRules& rules,
                         const SheetExtras& extras) {
    { const OutputFolder probe(directory); }  // before the work, not after it
    context.share_progress(0, 0.3);
    const ReadingOptions options = reading_options(reading);
    PatternMesh read = read_pattern_mesh(context, pattern, options);
    require_solid(context, read, pattern);
    const Mesh along = along_axis(std::move(read.mesh), job.axis);
    context.share_progress(0.3, 0.8);
    SheetsResult result;
    try {
        result.plan = plan_sheets(context, along, job);
    } catch (const Error& error) {  // the engine knows no file; the user wants to hear of it
        if (error.kind() != ErrorKind::no_plan) throw;
        throw Error(error.kind(), error.code(), error.message(),
                    error.place().empty() ? pattern : pattern + ", " + error.place(), error.remedy());
    }
    result.plan.diagnostics.insert(result.plan.diagnostics.begin(), read.diagnostics.begin(),
                                   read.diagnostics.end());
    context.share_progress(0.8, 1);
    OutputFolder out(directory);
    for (const char* inner : {"nc", "dxf", "svg"}) fs::create_directory(out.path() / inner);
    for (std::size_t i = 0; i < result.plan.programs.size(); ++i) {
        context.throw_if_cancelled();
        write_file_in(out.path() / "nc", sheet_file(i) + ".ngc", sheet_program_text(result.plan, i));
        write_file_in(out.path() / "dxf", sheet_file(i) + ".dxf", sheet_dxf(result.plan, i));
        write_file_in(out.path() / "svg", sheet_file(i) + ".svg", sheet_svg(result.plan, i));
    }
    const double density = extras.material != nullptr ? extras.material->density_kg_m3 : 0;
    if (extras.compare) result.costs = compare_costs(context, along, result.plan, density, extras.prices);
    else result.costs = {cost_of(result.plan, "planned", density, extras.prices)};
    std::vector<std::string> fixture = write_fixture(context, out.path(), along, result.plan, extras);
    write_file_in(out.path(), "sheets.json",
                  sheets_json(result.plan, read.input, options,
                              {result.costs, extras.material, extras.bond, std::move(fixture)}));
    result.proof = prove_folder(context, out.path(), along, pattern, rules);
    out.commit();
    return result;
}

bool holds_sheets(const std::string& directory) {
    std::error_code ignored;
    return fs::is_regular_file(fs::path(directory) / "sheets.json", ignored) &&
           !fs::exists(fs::path(directory) / "plan.json", ignored);
}

SheetProof verify_sheets(Context& context, const std::string& directory, const std::string& pattern,
                         const SheetProofRules& rules) {
    const SheetsFolder folder = read_folder(directory);
    const std::shared_ptr<Pattern> read =
        read_planned_pattern(context, directory, folder.pattern, pattern, "verify");
    const Mesh along = along_axis(std::move(read->read.mesh), folder.axis);
    return prove_folder(context, directory, along, read->place, rules);
}

}  // namespace slabwright
