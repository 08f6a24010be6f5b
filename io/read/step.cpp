// STEP: the faces of its shapes, cut into facets by OCCT within a stated deviation. The file states its unit.
//
// OCCT 7.6 follows null pointers where a file is damaged. So it reads in a process of its own (a fork, which
// runs nothing but OCCT and ends without running anything of ours), bounded in memory and time: what happens
// to that one is an error here.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "io/read/mesh_format.h"
#include "kernels/errors.h"
#include "kernels/mesh/surface_facets.h"
#include "kernels/parallel/context.h"

#ifdef SLABWRIGHT_OCCT
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <BRepAdaptor_Surface.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRep_Tool.hxx>
#include <IFSelect_ReturnStatus.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <NCollection_DataMap.hxx>
#include <Poly_PolygonOnTriangulation.hxx>
#include <Poly_Triangulation.hxx>
#include <STEPControl_Reader.hxx>
#include <Standard_Failure.hxx>
#include <Standard_Version.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_ShapeMapHasher.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Shape.hxx>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <mutex>
#include <sstream>
#endif

namespace slabwright {

namespace {

constexpr std::string_view kFamily = "step";
constexpr std::string_view kBeginning = "ISO-10303-21";

bool recognise(std::string_view head, std::uint64_t, std::string_view) {
    const std::size_t begin = head.find_first_not_of(" \t\r\n");
    return begin != std::string_view::npos && head.substr(begin, kBeginning.size()) == kBeginning;
}

void require(std::string_view head, std::uint64_t size, const std::string& place) {
#ifndef SLABWRIGHT_OCCT
    refuse_mesh(kFamily, "not_built", "this build of slabwright reads no STEP", place,
                "install libocct-data-exchange-dev and build again, or export it as STL");
#endif
    if (!recognise(head, size, {}))
        refuse_mesh(kFamily, "not_step", "does not begin with 'ISO-10303-21'", place + ", line 1",
                    "name a STEP file");
}

#ifdef SLABWRIGHT_OCCT

/// OCCT keeps its readers' settings, and the units of what it reads, in one place for all: one at a time.
std::mutex& turn() {
    static std::mutex mutex;
    return mutex;
}

/// A face's facets, with nodes as OCCT counts them less one.
SurfaceFacets facets_of(const Handle(Poly_Triangulation) & triangles, const TopLoc_Location& location) {
    SurfaceFacets mesh;
    const bool has_uv = triangles->HasUVNodes();
    for (int n = 1; n <= triangles->NbNodes(); ++n) {
        const gp_Pnt p = triangles->Node(n).Transformed(location.Transformation());
        mesh.at.push_back({p.X(), p.Y(), p.Z()});
        const gp_Pnt2d uv = has_uv ? triangles->UVNode(n) : gp_Pnt2d();
        mesh.uv.push_back({uv.X(), uv.Y()});
    }
    for (int t = 1; t <= triangles->NbTriangles(); ++t) {
        int a = 0, b = 0, c = 0;
        triangles->Triangle(t).Get(a, b, c);
        mesh.facets.push_back({static_cast<std::uint32_t>(a - 1), static_cast<std::uint32_t>(b - 1),
                               static_cast<std::uint32_t>(c - 1)});
    }
    return mesh;
}

/// The facets of faces, whose nodes on an edge are those of the faces beside it. OCCT's mesher takes a
/// deviation as a hint, and goes past it by half and more on real parts: its facets are measured, and
/// divided.
class FacetCollector {
public:
    FacetCollector(Context& context, DecodedMesh& decoded, double deviation_mm, const std::string& place)
        : context_(context), decoded_(decoded), deviation_mm_(deviation_mm), place_(place) {}

    void add(const TopoDS_Face& face) {
        context_.throw_if_cancelled();
        TopLoc_Location location;
        const Handle(Poly_Triangulation) triangles = BRep_Tool::Triangulation(face, location);
        if (triangles.IsNull() || triangles->NbTriangles() == 0) {
            ++missing_;
            return;
        }
        SurfaceFacets mesh = facets_of(triangles, location);
        if (const BRepAdaptor_Surface surface(face, false);
            triangles->HasUVNodes() && surface.GetType() != GeomAbs_Plane) {
            const auto at = [&](double u, double v) -> Point3 {
                const gp_Pnt p = surface.Value(u, v);
                return {p.X(), p.Y(), p.Z()};
            };
            farthest_ = std::max(farthest_, refine_on(at, deviation_mm_, mesh));
        }
        std::vector<std::uint32_t> of_node(mesh.at.size(), kNone);
        for (TopExp_Explorer edges(face, TopAbs_EDGE); edges.More(); edges.Next())
            join(TopoDS::Edge(edges.Current()), triangles, location, mesh, of_node);
        for (std::size_t n = 0; n < of_node.size(); ++n)
            if (of_node[n] == kNone) of_node[n] = vertex(mesh.at[n]);
        const bool turned = (face.Orientation() == TopAbs_REVERSED) !=
                            (location.Transformation().VectorialPart().Determinant() < 0);
        for (const auto& [a, b, c] : mesh.facets) {
            const Index3 facet{of_node[a], of_node[turned ? c : b], of_node[turned ? b : c]};
            if (facet[0] != facet[1] && facet[1] != facet[2] && facet[2] != facet[0])
                decoded_.facets.push_back(facet);
        }
    }
    [[nodiscard]] std::size_t missing() const { return missing_; }
    /// mm from the surfaces to the facets, as measured
    [[nodiscard]] double farthest() const { return farthest_; }

private:
    static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

    std::uint32_t vertex(const FileVertex& at) {
        for (const double value : at)
            if (is_absurd(value, 1)) refuse_coordinate(kFamily, value, 1, place_);
        decoded_.vertices.push_back(at);
        return static_cast<std::uint32_t>(decoded_.vertices.size() - 1);
    }
    /// Faces beside an edge cut it at the same parameters: their nodes there become one.
    void join(const TopoDS_Edge& edge, const Handle(Poly_Triangulation) & triangles,
              const TopLoc_Location& location, const SurfaceFacets& mesh,
              std::vector<std::uint32_t>& of_node) {
        const Handle(Poly_PolygonOnTriangulation) polygon =
            BRep_Tool::PolygonOnTriangulation(edge, triangles, location);
        if (polygon.IsNull()) return;
        const int count = polygon->NbNodes();
        std::vector<std::uint32_t>* shared = edges_.ChangeSeek(edge);
        if (shared == nullptr) shared = edges_.Bound(edge, {});
        const bool first = shared->empty();
        if (!first && shared->size() != static_cast<std::size_t>(count)) return;
        for (int i = 1; i <= count; ++i) {
            const auto node = static_cast<std::size_t>(polygon->Nodes()(i) - 1);
            std::uint32_t& here = of_node[node];
            if (first) {
                if (here == kNone) here = vertex(mesh.at[node]);
                shared->push_back(here);
            } else if (here == kNone) {
                here = (*shared)[static_cast<std::size_t>(i - 1)];
            } else if (here != (*shared)[static_cast<std::size_t>(i - 1)]) {
                // A corner, met by way of two edges: one place, which rounding keeps one.
                decoded_.vertices[here] = decoded_.vertices[(*shared)[static_cast<std::size_t>(i - 1)]];
            }
        }
    }

    Context& context_;
    DecodedMesh& decoded_;
    const double deviation_mm_;
    double farthest_ = 0;
    const std::string& place_;
    NCollection_DataMap<TopoDS_Shape, std::vector<std::uint32_t>, TopTools_ShapeMapHasher> edges_;
    std::size_t missing_ = 0;
};

/// A shape's facets, and how far its surfaces lie from them at most, as measured, mm.
struct ReadShape {
    DecodedMesh mesh;
    double farthest_mm = 0;
};

ReadShape read(Context& context, std::string_view bytes, double deviation_mm, const std::string& place) {
    Message::DefaultMessenger()->ChangePrinters().Clear();  // a library writes nothing to the terminal
    DecodedMesh decoded;
    double farthest = 0;
    decoded.mm_per_unit = 1;  // OCCT scales to millimetres, whatever unit the file states
    try {
        Interface_Static::SetCVal("xstep.cascade.unit", "MM");
        std::istringstream text{std::string(bytes)};
        STEPControl_Reader reader;
        if (reader.ReadStream(place.c_str(), text) != IFSelect_RetDone)
            refuse_mesh(kFamily, "unreadable", "OCCT cannot read it as STEP", place, kExportAgain);
        context.throw_if_cancelled();
        reader.TransferRoots();
        const TopoDS_Shape shape = reader.OneShape();
        if (shape.IsNull())
            refuse_mesh(kFamily, "no_facets", "it holds no shape", place,
                        "export the solid, not its drawing");
        context.throw_if_cancelled();
        constexpr double angle_rad = 0.5;  // between facets of a curve, which else is bound by the deviation
        const BRepMesh_IncrementalMesh meshed(shape, deviation_mm, false, angle_rad, false);
        FacetCollector collector(context, decoded, deviation_mm, place);
        for (TopExp_Explorer faces(shape, TopAbs_FACE); faces.More(); faces.Next())
            collector.add(TopoDS::Face(faces.Current()));
        farthest = collector.farthest();
        if (collector.missing() > 0)
            decoded.diagnostics.push_back(
                {Severity::warning, "step.face",
                 fmt::format("{} faces could not be cut into facets: the mesh may be open",
                             collector.missing()),
                 std::nullopt});
    } catch (const Standard_Failure& failure) {
        refuse_mesh(kFamily, "unreadable", fmt::format("OCCT cannot read it: {}", failure.GetMessageString()),
                    place, kExportAgain);
    }
    if (decoded.facets.empty())
        refuse_mesh(kFamily, "no_facets", "its shapes have no faces", place,
                    "export the solid, not its wires");
    return {std::move(decoded), farthest};
}

/// What the process that reads hands over, before the arrays or the texts of an error.
struct Outcome {
    std::uint64_t vertices = 0, facets = 0, warnings = 0;
    double farthest_mm = 0;
    std::array<std::uint32_t, 4> texts{};  ///< lengths of an error's code, message, place and remedy; 0: none
};

void write_all(int file, const void* data, std::size_t bytes) {
    const char* at = static_cast<const char*>(data);
    while (bytes > 0) {
        const ssize_t done = ::write(file, at, bytes);
        if (done < 0 && errno == EINTR) continue;
        if (done <= 0) ::_exit(1);
        at += done;
        bytes -= static_cast<std::size_t>(done);
    }
}

/// What the process holds writable and to itself, in bytes: what a limit of data counts. Under
/// AddressSanitizer that is terabytes, of which nothing is in memory.
std::uint64_t data_bytes_now() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
        if (line.starts_with("VmData:")) return std::strtoull(line.c_str() + 7, nullptr, 10) * 1024;
    return 0;
}

/// OCCT ends lines on the standard output, which in a forked process also writes what its parent has waiting
/// there. @param file what this process answers into; it moves away where the output was closed
void keep_off_output(int& file) {
    if (file == STDOUT_FILENO) file = ::fcntl(file, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
    const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (nowhere >= 0 && nowhere != STDOUT_FILENO) (void)::dup2(nowhere, STDOUT_FILENO);
}

/// The reading process: never returns.
[[noreturn]] void read_and_tell(int file, Context& context, std::string_view bytes, double deviation_mm,
                                const std::string& place, std::uint64_t memory_bytes) {
    for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGBUS, SIGILL, SIGPIPE, SIGINT, SIGTERM, SIGHUP})
        ::signal(signal, SIG_DFL);
    keep_off_output(file);
    const std::uint64_t most = data_bytes_now() + memory_bytes;
    const rlimit no_core{0, 0}, data{most, most};
    (void)::setrlimit(RLIMIT_CORE, &no_core);
    (void)::setrlimit(RLIMIT_DATA, &data);
    Outcome outcome;
    try {
        const auto [decoded, farthest_mm] = read(context, bytes, deviation_mm, place);
        outcome.farthest_mm = farthest_mm;
        outcome.vertices = decoded.vertices.size();
        outcome.facets = decoded.facets.size();
        outcome.warnings = decoded.diagnostics.size();
        write_all(file, &outcome, sizeof outcome);
        write_all(file, decoded.vertices.data(), decoded.vertices.size() * sizeof(FileVertex));
        write_all(file, decoded.facets.data(), decoded.facets.size() * sizeof(Index3));
    } catch (const Error& error) {
        const std::array<const std::string*, 4> texts{&error.code(), &error.message(), &error.place(),
                                                      &error.remedy()};
        for (std::size_t i = 0; i < texts.size(); ++i)
            outcome.texts[i] = static_cast<std::uint32_t>(texts[i]->size());
        write_all(file, &outcome, sizeof outcome);
        for (const std::string* text : texts) write_all(file, text->data(), text->size());
    } catch (...) {
        ::_exit(1);
    }
    ::_exit(0);
}

/// The reading process, seen from outside: what it writes, until it ends or is no longer wanted.
class ReadingProcess {
public:
    ReadingProcess(Context& context, std::string_view bytes, double deviation_mm, const std::string& place)
        : context_(context), place_(place) {
        std::array<int, 2> ends{};
        if (::pipe2(ends.data(), O_CLOEXEC) != 0) fail("no pipe can be made");
        const std::uint64_t memory =
            context.memory_limit() - std::min(context.memory_limit(), context.memory_charged());
        process_ = ::fork();
        if (process_ == 0) {
            ::close(ends[0]);
            read_and_tell(ends[1], context, bytes, deviation_mm, place, memory + kOwnBytes);
        }
        ::close(ends[1]);
        file_ = ends[0];
        if (process_ < 0) fail("no process can be made");
        // OCCT reads some megabytes a second; a hundredth of that is a hang.
        constexpr std::uint64_t slowest_bytes_s = 20'000, least_s = 30;
        deadline_ =
            std::chrono::steady_clock::now() + std::chrono::seconds(least_s + bytes.size() / slowest_bytes_s);
    }
    ~ReadingProcess() {
        if (file_ >= 0) ::close(file_);
        if (process_ <= 0) return;
        ::kill(process_, SIGKILL);
        while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {}
    }
    ReadingProcess(const ReadingProcess&) = delete;
    ReadingProcess& operator=(const ReadingProcess&) = delete;

    /// @throws Error(input, "step.damaged") where it ended before it wrote so much, Error(cancelled)
    void take(void* data, std::size_t bytes) {
        char* at = static_cast<char*>(data);
        while (bytes > 0) {
            context_.throw_if_cancelled();
            pollfd waiting{file_, POLLIN, 0};
            constexpr int glance_ms = 50;
            const int ready = ::poll(&waiting, 1, glance_ms);
            if (ready <= 0) {
                if (std::chrono::steady_clock::now() > deadline_) fail("OCCT did not come to an end with it");
                continue;
            }
            const ssize_t done = ::read(file_, at, bytes);
            if (done < 0 && errno == EINTR) continue;
            if (done <= 0) fail("OCCT broke down over it, or ran out of memory");
            at += done;
            bytes -= static_cast<std::size_t>(done);
        }
    }

private:
    static constexpr std::uint64_t kOwnBytes = std::uint64_t{1} << 28;  ///< OCCT's tables and schemas
    [[noreturn]] void fail(const std::string& what) const {
        refuse_mesh(kFamily, "damaged", what, place_, "export the file again, or as STL");
    }
    Context& context_;
    const std::string& place_;
    pid_t process_ = -1;
    int file_ = -1;
    std::chrono::steady_clock::time_point deadline_{};
};

DecodedMesh read_apart(Context& context, std::string_view bytes, double deviation_mm,
                       const std::string& place) {
    const std::lock_guard lock(turn());
    ReadingProcess process(context, bytes, deviation_mm, place);
    Outcome outcome;
    process.take(&outcome, sizeof outcome);
    if (outcome.texts[0] > 0) {
        std::array<std::string, 4> texts;
        for (std::size_t i = 0; i < texts.size(); ++i) {
            texts[i].resize(outcome.texts[i]);
            process.take(texts[i].data(), texts[i].size());
        }
        throw Error(ErrorKind::input, texts[0], texts[1], texts[2], texts[3]);
    }
    DecodedMesh decoded;
    decoded.mm_per_unit = 1;
    decoded.vertices.resize(outcome.vertices);
    decoded.facets.resize(outcome.facets);
    process.take(decoded.vertices.data(), outcome.vertices * sizeof(FileVertex));
    process.take(decoded.facets.data(), outcome.facets * sizeof(Index3));
    if (outcome.warnings > 0)
        decoded.diagnostics.push_back({Severity::warning, "step.face",
                                       "faces could not be cut into facets: the mesh may be open",
                                       std::nullopt});
    // What the mesher measures its edges by, and rounding.
    constexpr double kSlack = 1.01;
    const std::size_t facets = decoded.facets.size();
    decoded.diagnostics.push_back(
        outcome.farthest_mm <= kSlack * deviation_mm
            ? Diagnostic{Severity::note, "step.tessellated",
                         fmt::format("its surfaces were cut into {} facets, which lie within {:g} mm of them",
                                     facets, deviation_mm),
                         std::nullopt}
            : Diagnostic{Severity::warning, "step.deviation",
                         fmt::format("its surfaces were cut into {} facets, which lie up to {:.3g} mm from "
                                     "them instead of {:g} mm; ask for less",
                                     facets, outcome.farthest_mm, deviation_mm),
                         std::nullopt});
    return decoded;
}

#endif

DecodedMesh decode(Context& context, std::string_view bytes, const DecodeOptions& options,
                   const std::string& place) {
#ifdef SLABWRIGHT_OCCT
    // Entities take some ten times their text.
    const MemoryCharge charge(context, bytes.size() * 12, "the shapes of " + place);
    return read_apart(context, bytes, options.deviation_mm, place);
#else
    (void)context;
    (void)bytes;
    (void)options;
    require({}, 0, place);
    return {};
#endif
}

#ifdef SLABWRIGHT_OCCT
constexpr bool kBuilt = true;
#else
constexpr bool kBuilt = false;
#endif

}  // namespace

extern const MeshFormat kStepFormat;
const MeshFormat kStepFormat{"STEP", kFamily, {".step", ".stp"}, kBuilt, recognise, require, decode};

}  // namespace slabwright
