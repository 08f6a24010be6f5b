#include "io/read/pattern_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "io/read/input_file.h"
#include "io/read/mesh_format.h"
#include "io/read/placed_corners.h"
#include "io/read/repair.h"
#include "io/text/sha256.h"
#include "kernels/errors.h"
#include "kernels/mesh/facet_roles.h"
#include "kernels/mesh/raw_array.h"
#include "kernels/parallel/parallel.h"
#include "kernels/slicing/solid_volume.h"

namespace slabwright {

namespace {

constexpr std::size_t kRecordBytes = 50;  ///< of a facet in a binary STL, the densest format
constexpr std::size_t kWeldBytes = 56;    ///< of memory a facet, for a mesh and its welding
constexpr double kLeastHeight = 0.01;     ///< mm
constexpr double kSmallBox = 5;           ///< in the declared unit; below, the unit is suspicious
constexpr double kLargeBox = 5000;        ///< likewise, above

double unit_of(LengthUnit units) { return units == LengthUnit::inch ? kInch : 1.0; }

// ---- what a source says

/// A source's bytes, copied into memory that the context accounts for, or its mesh. Mapped memory would end
/// the process where somebody shortens the file while it is read.
class SourceData {
public:
    /// @throws Error(input) where a file is none by its first bytes, Error(no_plan, "memory.limit") where
    /// reading it would pass the limit
    SourceData(Context& context, const PatternSource& source) : source_(source) {
        if (source.kind() == PatternSource::Kind::none)
            throw Error(ErrorKind::usage, "pattern.none", "no pattern was named", "", "name a file");
        if (source.kind() == PatternSource::Kind::mesh) return;
        std::string head;
        if (source.kind() == PatternSource::Kind::file) {
            family_ = format_of_ending(source.name()).family;
            file_.emplace(source.name(),
                          ReadRule{ErrorKind::input, std::string(family_) + ".", kMostMeshBytes});
            size_ = file_->size();
            head.resize(std::min<std::uint64_t>(size_, kHead));
            file_->read(0, head.data(), head.size());
        } else {
            size_ = source.bytes().size();
            head = source.bytes().substr(0, kHead);
        }
        format_ = &format_of(head, size_, source.name());
        family_ = format_->family;
        if (size_ == 0)
            refuse_mesh(family_, "empty", "the file is empty (0 bytes)", source.name(), kExportAgain);
        format_->require(head, size_, source.name());
        // What a mesh of so many bytes takes beside them while it is welded, asked before they are read.
        const MemoryCharge need(context, size_ + size_ / kRecordBytes * kWeldBytes,
                                "reading " + source.name());
        load(context);
    }
    /// Reads all of it, unless it is there already. @throws Error(input, "….changed") where somebody has
    /// written the file since it was opened
    void load(Context& context) {
        if (!file_ || charge_) return;
        charge_.emplace(context, size_, "the bytes of " + source_.name());
        bytes_ = RawArray<char>(size_);
        constexpr std::size_t piece = std::size_t{1} << 22;
        parallel_for(context, bytes_.size(), piece, [&](std::size_t begin, std::size_t end) {
            file_->read(begin, bytes_.data() + begin, end - begin);
        });
        file_->require_unchanged();
    }
    void let_go() {
        bytes_ = {};
        charge_.reset();
    }
    [[nodiscard]] std::uint64_t size() const noexcept { return size_; }
    [[nodiscard]] std::string_view family() const noexcept { return family_; }
    [[nodiscard]] std::string_view bytes() const noexcept {
        return file_ ? std::string_view(bytes_.data(), bytes_.size()) : source_.bytes();
    }
    /// What it says, with usable coordinates and indices. @throws Error(input) where it does not
    [[nodiscard]] DecodedMesh decode(Context& context, const DecodeOptions& options) const {
        if (format_) return format_->decode(context, bytes(), options, source_.name());
        return checked_mesh(context, options);
    }

private:
    [[nodiscard]] DecodedMesh checked_mesh(Context& context, const DecodeOptions& options) const {
        DecodedMesh decoded;
        decoded.vertices.assign(source_.vertices().begin(), source_.vertices().end());
        decoded.facets.assign(source_.facets().begin(), source_.facets().end());
        context.throw_if_cancelled();
        for (std::size_t v = 0; v < decoded.vertices.size(); ++v)
            for (const double value : decoded.vertices[v])
                if (is_absurd(value, options.mm_per_unit))
                    refuse_coordinate(family_, value, options.mm_per_unit,
                                      fmt::format("{}, vertex {} (counted from 0)", source_.name(), v));
        for (std::size_t f = 0; f < decoded.facets.size(); ++f)
            for (const std::uint32_t v : decoded.facets[f])
                if (v >= decoded.vertices.size())
                    refuse_mesh(family_, "index",
                                fmt::format("names vertex {} of {}", v, decoded.vertices.size()),
                                fmt::format("{}, facet {} (counted from 0)", source_.name(), f),
                                "give facets that name vertices of the mesh");
        if (decoded.facets.empty())
            refuse_mesh(family_, "no_facets", "the mesh has no facets", source_.name(), "give a solid");
        return decoded;
    }

    const PatternSource& source_;
    std::optional<InputFile> file_;
    const MeshFormat* format_ = nullptr;  ///< none of a mesh
    std::string_view family_ = "mesh";
    std::uint64_t size_ = 0;
    std::optional<MemoryCharge> charge_;
    RawArray<char> bytes_;
};

std::string hash_of(Context& context, const PatternSource& source, std::string_view bytes) {
    Sha256 hash;
    constexpr std::size_t piece = std::size_t{1} << 24;
    const auto add = [&](std::string_view part) {
        for (std::size_t at = 0; at < part.size(); at += piece) {
            context.throw_if_cancelled();
            hash.update(std::as_bytes(std::span(part.substr(at, piece))));
        }
    };
    if (source.kind() == PatternSource::Kind::mesh) {  // of its arrays, as they lie in memory
        const std::span vertices = std::as_bytes(source.vertices()), facets = std::as_bytes(source.facets());
        add({reinterpret_cast<const char*>(vertices.data()), vertices.size()});
        add({reinterpret_cast<const char*>(facets.data()), facets.size()});
    } else {
        add(bytes);
    }
    return hash.hex();
}

// ---- diagnostics

std::array<double, 3> facet_centre(const Mesh& mesh, std::uint32_t facet) {
    std::array<double, 3> centre{};
    for (const std::uint32_t v : mesh.facets[facet]) {
        centre[0] += mesh.vertices[v].x / 3.0;
        centre[1] += mesh.vertices[v].y / 3.0;
        centre[2] += mesh.vertices[v].z / 3.0;
    }
    return centre;
}

std::string number_of(std::uint64_t count, std::string_view one, std::string_view many) {
    return fmt::format("{} {}", count, count == 1 ? one : many);
}

void describe(const Mesh& mesh, const Finding& finding, Severity severity, std::string code,
              std::string message, std::vector<Diagnostic>& diagnostics) {
    if (finding.count == 0) return;
    diagnostics.push_back({severity, std::move(code),
                           fmt::format("{}, first at facet {}", message, finding.first_facet),
                           facet_centre(mesh, finding.first_facet)});
}

void describe_report(const Mesh& mesh, const MeshReport& report, std::vector<Diagnostic>& diagnostics) {
    auto edges = [](const Finding& finding) { return number_of(finding.count, "edge", "edges"); };
    auto facets = [](const Finding& finding) { return number_of(finding.count, "facet", "facets"); };
    describe(mesh, report.open_edges_off_base, Severity::error, "mesh.open",
             edges(report.open_edges_off_base) + " above the base with one facet only: the mesh is open",
             diagnostics);
    if (report.open_edges.count > report.open_edges_off_base.count && report.open_edges_off_base.count == 0)
        describe(
            mesh, report.open_edges, Severity::warning, "mesh.open_base",
            edges(report.open_edges) + " in the base plane with one facet only: the base is taken as closed",
            diagnostics);
    else if (report.open_edges.count > report.open_edges_off_base.count)
        diagnostics.push_back(
            {Severity::warning, "mesh.open_base",
             number_of(report.open_edges.count - report.open_edges_off_base.count, "edge", "edges") +
                 " in the base plane with one facet only: the base is taken as closed",
             std::nullopt});
    describe(mesh, report.misoriented_edges, Severity::error, "mesh.misoriented",
             edges(report.misoriented_edges) + " whose facets do not face the same side", diagnostics);
    describe(mesh, report.inverted_components, Severity::error, "mesh.inverted",
             number_of(report.inverted_components.count, "body", "bodies") + " inside out (negative volume)",
             diagnostics);
    describe(mesh, report.non_manifold_edges, Severity::warning, "mesh.non_manifold",
             edges(report.non_manifold_edges) + " with more than two facets", diagnostics);
    describe(mesh, report.duplicate_facets, Severity::warning, "mesh.duplicate",
             facets(report.duplicate_facets) + " given twice", diagnostics);
    describe(mesh, report.degenerate_facets, Severity::note, "mesh.degenerate",
             facets(report.degenerate_facets) + " without area", diagnostics);
}

/// The volume of the input: what bodies share counts once, which is told. Of a mesh that is open above its
/// base it is the facets' own, which means little.
void count_overlaps_once(Context& context, PatternMesh& pattern) {
    constexpr double told_from = 1;  // mm³
    const double wound = pattern.report.volume_mm3;
    pattern.input.volume_mm3 = wound;
    if (pattern.mesh.roles.empty() || pattern.report.open_edges_off_base.count > 0) return;
    const SolidVolume solid = solid_volume(context, pattern.mesh.view(), wound);
    pattern.input.volume_mm3 = solid.mm3;
    if (std::abs(solid.mm3 - wound) < std::max(told_from, solid.uncertain_mm3)) return;
    const auto first = std::find_if(pattern.mesh.roles.begin(), pattern.mesh.roles.end(),
                                    [](FacetRole role) { return role != FacetRole::surface; });
    const auto facet = static_cast<std::uint32_t>(first - pattern.mesh.roles.begin());
    pattern.diagnostics.push_back(
        {Severity::note, "mesh.overlap",
         fmt::format(
             "bodies overlap, lie in others or are inside out, first at facet {}: {:.2f} cm3 where each "
             "place counts once, {:.2f} by the facets' sense",
             facet, solid.mm3 / 1000, wound / 1000),
         facet_centre(pattern.mesh, facet)});
}

/// The unit is never guessed; a box that suggests another is only remarked on.
void question_units(const InputInfo& input, LengthUnit units, std::vector<Diagnostic>& diagnostics) {
    const double mm_per_unit = units == LengthUnit::inch ? kInch : 1.0;
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k)
        longest = std::max(longest, (input.max[k] - input.min[k]) / mm_per_unit);
    if (longest >= kSmallBox && longest <= kLargeBox) return;
    const bool inch = units == LengthUnit::inch;
    diagnostics.push_back(
        {Severity::warning, "units.suspicious",
         fmt::format("the pattern's longest side is {:.6g} {}, which is {} {:g} {}; if the file is in {} "
                     "(then {:.6g} mm), say --units {}",
                     longest, inch ? "in" : "mm", longest < kSmallBox ? "under" : "over",
                     longest < kSmallBox ? kSmallBox : kLargeBox, inch ? "in" : "mm",
                     inch ? "millimetres" : "inches", inch ? longest : longest * kInch, inch ? "mm" : "in"),
         std::nullopt});
}

/// Welding may take the lowest vertex away; the pattern is then set down again.
void set_on_base(Mesh& mesh) {
    const float lowest = bounds(mesh.view()).min.z;
    if (lowest == 0) return;
    for (Vec3f& v : mesh.vertices) v.z = static_cast<float>(static_cast<double>(v.z) - lowest);
}

/// Facets without area that hang together with no other lie anywhere and are no part of the solid, but would
/// lift it off its base or enlarge its stock. Draws their corners together in a corner of the solid, where
/// they do nothing; their numbers stay. What hangs together with facets that have area fills a gap between
/// them, and stays.
/// @return how many; 0 where no facet has area
std::uint64_t draw_strays_in(Mesh& mesh, const MeshReport& report) {
    const auto has_area = [&](const Index3& f) {
        const Vec3f &a = mesh.vertices[f[0]], &b = mesh.vertices[f[1]], &c = mesh.vertices[f[2]];
        const double ux = double{b.x} - a.x, uy = double{b.y} - a.y, uz = double{b.z} - a.z,
                     vx = double{c.x} - a.x, vy = double{c.y} - a.y, vz = double{c.z} - a.z;
        return uy * vz != uz * vy || uz * vx != ux * vz || ux * vy != uy * vx;
    };
    std::vector<char> solid(report.components, 0);
    std::uint32_t corner = 0;
    for (std::size_t f = mesh.facets.size(); f-- > 0;)
        if (has_area(mesh.facets[f])) {
            solid[report.component_of[f]] = 1;
            corner = mesh.facets[f][0];
        }
    if (std::find(solid.begin(), solid.end(), 1) == solid.end()) return 0;
    std::vector<char> used(mesh.vertices.size(), 0);
    for (std::size_t f = 0; f < mesh.facets.size(); ++f)
        if (solid[report.component_of[f]])
            for (const std::uint32_t v : mesh.facets[f]) used[v] = 1;
    std::uint64_t strays = 0;
    for (std::size_t f = 0; f < mesh.facets.size(); ++f) {
        if (solid[report.component_of[f]]) continue;
        ++strays;
        mesh.facets[f] = {corner, corner, corner};
        mesh.neighbours[f] = {kNoFacet, kNoFacet, kNoFacet};
    }
    if (strays == 0) return 0;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        if (!used[v]) mesh.vertices[v] = mesh.vertices[corner];
    return strays;
}

/// In which order a mesh has the facets of its file.
enum class FacetOrder : std::uint8_t {
    file,
    near,  ///< the file's where neighbours follow each other in it, or else one in which they do: all that
           ///< follows is many times faster then
};

constexpr std::size_t kFewFacets = 50'000;  // fewer lie in the caches in any order

/// Decodes and welds a source; sets the input's count and box. @param question set where the unit is the
/// job's and not the file's. @param order set to that of the mesh
Mesh load_mesh(Context& context, const SourceData& data, const ReadingOptions& options,
               const std::string& place, InputInfo& input, std::vector<Diagnostic>& diagnostics,
               bool& question, std::vector<std::uint32_t>* odd, FacetOrder& order) {
    // 30 bytes a facet for the mesh; a text has fewer facets than its length could hold in binary.
    const MemoryCharge charge(context, data.size() / kRecordBytes * 30, "reading " + place);
    const PlacedCorners corners = [&] {
        DecodedMesh decoded = data.decode(context, {unit_of(options.units), options.deviation_mm});
        const std::size_t numbers = decoded.vertices.size() * sizeof(FileVertex) +
                                    decoded.facets.size() * sizeof(Index3) +
                                    (decoded.records.count > 0 ? 0 : data.size() / 3);
        const MemoryCharge spelt(context, numbers, "the numbers of " + place);
        diagnostics = std::move(decoded.diagnostics);
        if (decoded.mm_per_unit && *decoded.mm_per_unit != unit_of(options.units))
            diagnostics.push_back(
                {Severity::note, "units.stated",
                 fmt::format("the file states its unit, {:g} mm: what the job says of units "
                             "was not asked",
                             *decoded.mm_per_unit),
                 std::nullopt});
        if (!decoded.mm_per_unit) question = true;
        return place_corners(context, decoded, decoded.mm_per_unit.value_or(unit_of(options.units)),
                             options.preparation.map);
    }();
    const MemoryCharge placed(context, corners.placed.size() * sizeof(corners.placed[0]),
                              "the corners of " + place);
    context.advance();
    input.triangles = corners.facets.count;
    input.min = corners.min;
    input.max = corners.max;
    if (order == FacetOrder::file || corners.facets.count < kFewFacets || neighbours_follow(corners.facets)) {
        order = FacetOrder::file;
        return weld_records(context, corners.facets, odd);
    }
    const auto at = [&](const std::array<double, 3>& p) {
        return Vec3f{static_cast<float>(p[0]), static_cast<float>(p[1]),
                     static_cast<float>(p[2] - corners.min[2])};
    };
    const KeptMemory kept;
    const MemoryCharge together(context, corners.facets.count * sizeof(std::array<Vec3f, 3>),
                                "bringing facets together");
    return weld_and_let_go(context, in_space(context, corners.facets, {at(corners.min), at(corners.max)}),
                           odd);
}

/// Whether something is wrong that is told by a facet.
bool names_a_facet(const MeshReport& r) {
    const Finding findings[] = {r.open_edges,         r.open_edges_off_base, r.non_manifold_edges,
                                r.misoriented_edges,  r.degenerate_facets,   r.duplicate_facets,
                                r.inverted_components};
    return std::any_of(std::begin(findings), std::end(findings),
                       [](const Finding& f) { return f.count > 0; });
}

}  // namespace

ReadingOptions reading_options(const Job& job) {
    return {job.units, job.tolerances.weld, job.input.repair, 0.01, preparation_of(job.prepare)};
}

Mesh read_mesh(Context& context, const PatternSource& source, LengthUnit units) {
    context.begin_phase("read", 0.0, 0.05, 2);
    const SourceData data(context, source);
    InputInfo ignored;
    std::vector<Diagnostic> unheard;
    bool question = false;
    FacetOrder order = FacetOrder::near;
    Mesh mesh = load_mesh(context, data, {units}, source.name(), ignored, unheard, question, nullptr, order);
    context.advance();
    return mesh;
}

namespace {

/// Welds within the tolerance that was asked for, if any, and reports on the mesh.
/// @return what welding did, to be told
std::optional<Diagnostic> weld_and_report(Context& context, PatternMesh& pattern,
                                          const ReadingOptions& options, const std::string& place,
                                          const std::vector<std::uint32_t>& odd) {
    if (options.weld_mm == 0) {
        pattern.report = report_mesh(context, pattern.mesh.view(), &odd);
        return std::nullopt;
    }
    ToleranceWeld welded = weld_within(context, pattern.mesh.view(), options.weld_mm);
    pattern.mesh = std::move(welded.mesh);
    if (pattern.mesh.facets.empty())
        refuse_mesh(pattern.family, "no_facets",
                    fmt::format("no facet is left after welding within {:g} mm", options.weld_mm), place,
                    "weld within less");
    set_on_base(pattern.mesh);
    pattern.report = report_mesh(context, pattern.mesh.view());
    return Diagnostic{Severity::note, "mesh.welded",
                      fmt::format("welding within {:g} mm merged {} and removed {}", options.weld_mm,
                                  number_of(welded.merged, "vertex", "vertices"),
                                  number_of(welded.removed_facets, "facet", "facets")),
                      std::nullopt};
}

/// The box, where it is not that of all corners of the file. @param base z of the pattern's bottom
void measure_again(PatternMesh& pattern, double base) {
    const Box3& box = pattern.report.box;
    pattern.input.min = {box.min.x, box.min.y, base};
    pattern.input.max = {box.max.x, box.max.y, base + box.max.z};
}

void leave_strays_out(Context& context, PatternMesh& pattern) {
    if (pattern.report.degenerate_facets.count == 0) return;
    const std::uint64_t strays = draw_strays_in(pattern.mesh, pattern.report);
    if (strays == 0) return;
    const double base = pattern.input.min[2] + double{bounds(pattern.mesh.view()).min.z};
    set_on_base(pattern.mesh);
    pattern.report = report_mesh(context, pattern.mesh.view());
    measure_again(pattern, base);
    pattern.diagnostics.push_back(
        {Severity::note, "mesh.stray",
         number_of(strays, "facet", "facets") + " without area that hang together with no body: left out",
         std::nullopt});
}

void repair_as_asked(Context& context, PatternMesh& pattern, Repair how, const std::string& place) {
    if (how == Repair::none) return;
    Repaired repaired = repair_mesh(context, pattern.mesh.view(), pattern.report, how, place);
    if (repaired.told.how != "none") {
        pattern.mesh = std::move(repaired.mesh);
        pattern.report = std::move(repaired.report);
        if (pattern.report.box.min.z != 0) {
            set_on_base(pattern.mesh);
            pattern.report = report_mesh(context, pattern.mesh.view());
        }
    }
    pattern.input.repair = std::move(repaired.told);
    pattern.diagnostics.insert(pattern.diagnostics.end(), repaired.diagnostics.begin(),
                               repaired.diagnostics.end());
}

void skin_as_asked(Context& context, PatternMesh& pattern, const Preparation& preparation,
                   const std::string& place) {
    if (preparation.changes_nothing()) return;
    InputPreparation told{preparation.map, preparation.skin.mm, {}, 0, 0};
    if (preparation.skin.mm > 0) {
        require_solid(context, pattern, place);
        Skin skin = preparation.skin;
        const double base = pattern.input.min[2];
        if (skin.box) (*skin.box)[2] -= base, (*skin.box)[5] -= base;
        context.begin_phase("skin", 0.01, 0.02);
        Skinned skinned = add_skin(context, pattern.mesh.view(), skin);
        const bool by_vertices = skinned.method == SkinMethod::vertices;
        told.skin_how = by_vertices ? "vertices" : "level set";
        told.skin_least_mm = skinned.least_mm, told.skin_most_mm = skinned.most_mm;
        pattern.mesh = std::move(skinned.mesh);
        const double lowest = bounds(pattern.mesh.view()).min.z;
        set_on_base(pattern.mesh);
        pattern.report = report_mesh(context, pattern.mesh.view());
        measure_again(pattern, base + lowest);
        pattern.diagnostics.push_back(
            {Severity::note, "skin.added",
             fmt::format("{:g} mm of skin on {}, {}: {:.3f} to {:.3f} mm measured", skin.mm,
                         number_of(skinned.facets_on, "facet", "facets"),
                         by_vertices ? "by vertices"
                                     : fmt::format("made anew in cells of {:.2f} mm because {}",
                                                   skinned.cell_mm, skinned.reason),
                         skinned.least_mm, skinned.most_mm),
             std::nullopt});
    }
    pattern.input.prepared = std::move(told);
}

}  // namespace

PatternMesh read_pattern_mesh(Context& context, const PatternSource& source, const ReadingOptions& options) {
    context.begin_phase("read", 0.0, 0.01, 4);
    const std::string& place = source.name();
    SourceData data(context, source);
    PatternMesh pattern;
    pattern.family = data.family();
    pattern.input.file = std::filesystem::path(place).filename().string();
    std::vector<std::uint32_t> odd;
    bool question = false;
    FacetOrder order = FacetOrder::near;
    // The digest is one long chain, so it takes one thread while the others decode and weld.
    parallel_each(context, 2, [&](std::size_t task) {
        if (task == 0) {
            pattern.input.sha256 = hash_of(context, source, data.bytes());
        } else {
            pattern.mesh = load_mesh(context, data, options, place, pattern.input, pattern.diagnostics,
                                     question, &odd, order);
            context.advance();
        }
    });
    data.let_go();
    if (question) question_units(pattern.input, options.units, pattern.diagnostics);
    context.advance();
    std::optional<Diagnostic> note = weld_and_report(context, pattern, options, place, odd);
    if (order == FacetOrder::near && names_a_facet(pattern.report)) {
        // What is wrong is told by the file's facets.
        order = FacetOrder::file;
        pattern.mesh = {};
        data.load(context);
        std::vector<Diagnostic> told_already;
        pattern.mesh =
            load_mesh(context, data, options, place, pattern.input, told_already, question, &odd, order);
        data.let_go();
        note = weld_and_report(context, pattern, options, place, odd);
    }
    const double height = double(pattern.report.box.max.z) - pattern.report.box.min.z;
    if (!(height >= kLeastHeight))
        refuse_mesh(pattern.family, "flat",
                    fmt::format("the mesh is {:g} mm high: nothing can be built of it", height), place,
                    "check the unit (--units), and which way is up in the file");
    if (note) pattern.diagnostics.push_back(std::move(*note));
    leave_strays_out(context, pattern);
    repair_as_asked(context, pattern, options.repair, place);
    skin_as_asked(context, pattern, options.preparation, place);
    pattern.mesh.roles = facet_roles(context, pattern.mesh.view());
    context.advance();
    describe_report(pattern.mesh, pattern.report, pattern.diagnostics);
    count_overlaps_once(context, pattern);
    return pattern;
}

void require_solid(Context& context, const PatternMesh& pattern, const std::string& path) {
    const MeshReport& report = pattern.report;
    auto place = [&](const Finding& finding) {
        const std::array<double, 3> at = facet_centre(pattern.mesh, finding.first_facet);
        return fmt::format("{}, facet {} at ({:.3f}, {:.3f}, {:.3f}) mm", path, finding.first_facet, at[0],
                           at[1], at[2]);
    };
    if (report.open_edges_off_base.count > 0) {
        // Cracks between vertices that were rounded differently close under a small weld: try, and name what
        // works.
        const Box3& box = report.box;
        const double dx = double(box.max.x) - box.min.x, dy = double(box.max.y) - box.min.y,
                     dz = double(box.max.z) - box.min.z;
        const double diagonal = std::sqrt(dx * dx + dy * dy + dz * dz);
        std::string remedy, largest;
        for (const double share : {1e-6, 1e-5, 1e-4}) {
            // Two digits, rounded up; what is tried is what is printed.
            const double scale = std::pow(10.0, std::floor(std::log10(share * diagonal)) - 1);
            largest = fmt::format("{:g}", std::ceil(share * diagonal / scale) * scale);
            double tolerance = 0;
            std::from_chars(largest.data(), largest.data() + largest.size(), tolerance);
            if (!(tolerance > 0)) continue;
            const ToleranceWeld welded = weld_within(context, pattern.mesh.view(), tolerance);
            if (welded.mesh.facets.empty() ||
                report_mesh(context, welded.mesh.view()).open_edges_off_base.count > 0)
                continue;
            remedy = "--weld " + largest + " (mm) closes them all";
            break;
        }
        if (remedy.empty())
            remedy =
                "no weld up to " + largest + " mm closes them: close the mesh in the program that made it";
        refuse_mesh(pattern.family, "open",
                    number_of(report.open_edges_off_base.count, "edge", "edges") +
                        " above the base with one facet only: the mesh is open",
                    place(report.open_edges_off_base),
                    remedy + "; " + repair_offer(context, pattern.mesh.view(), report));
    }
    if (report.misoriented_edges.count > 0)
        refuse_mesh(pattern.family, "misoriented",
                    number_of(report.misoriented_edges.count, "edge", "edges") +
                        " whose facets do not face the same side",
                    place(report.misoriented_edges),
                    "make the normals consistent in the program that made the mesh; " +
                        repair_offer(context, pattern.mesh.view(), report));
    if (report.inverted_components.count > 0)
        refuse_mesh(pattern.family, "inverted",
                    number_of(report.inverted_components.count, "body is", "bodies are") +
                        " inside out (negative volume)",
                    place(report.inverted_components),
                    "flip its normals in the program that made the mesh; " +
                        repair_offer(context, pattern.mesh.view(), report));
}

}  // namespace slabwright
