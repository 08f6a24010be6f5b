// Plans a pattern through the installed library, from its file, from bytes and as a mesh, and checks that the
// plans make sense and are one.
#include <slabwright/io/slabwright.h>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>

namespace {

// The corners of a binary STL, as a program would have them that makes its own patterns.
struct Corners {
    std::vector<slabwright::PatternSource::Vertex> vertices;
    std::vector<slabwright::PatternSource::Facet> facets;

    explicit Corners(const std::string& stl) {
        std::map<slabwright::PatternSource::Vertex, std::uint32_t> known;
        for (std::size_t at = 84; at + 50 <= stl.size(); at += 50) {
            slabwright::PatternSource::Facet& facet = facets.emplace_back();
            for (std::size_t c = 0; c < 3; ++c) {
                float p[3];
                std::memcpy(p, stl.data() + at + 12 + 12 * c, sizeof p);
                const auto [place, fresh] = known.try_emplace({p[0], p[1], p[2]}, vertices.size());
                if (fresh) vertices.push_back(place->first);
                facet[c] = place->second;
            }
        }
    }
};

bool makes_sense(const slabwright::Plan& plan) {
    double below = 0;
    for (const slabwright::Layer& layer : plan.layers) {
        if (layer.z_bottom != below || layer.z_top <= layer.z_bottom || layer.operations.empty())
            return false;
        below = layer.z_top;
    }
    return below > 49.99 && below < 50.01;
}

// All programs, without the comments, which name the pattern.
std::string programs(const slabwright::Plan& plan) {
    std::string text;
    for (const slabwright::Layer& layer : plan.layers)
        for (const slabwright::Operation& operation : layer.operations) {
            const std::string program = slabwright::program_document(plan, layer, operation);
            for (std::size_t at = 0; at < program.size();) {
                const std::size_t end = program.find('\n', at);
                if (program[at] != '(') text += program.substr(at, end - at + 1);
                at = end + 1;
            }
        }
    return text;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) return 2;
    try {
        slabwright::Context context({.threads = 2});
        const slabwright::Job job = slabwright::default_job();
        const slabwright::Plan of_file = slabwright::plan(context, argv[1], job);
        std::printf("slabwright %s: %zu layers\n", slabwright::version().c_str(), of_file.layers.size());
        if (!makes_sense(of_file)) return 1;
        if (slabwright::plan_document(of_file).find("slabwright.plan/1") == std::string::npos) return 1;

        std::ifstream file(argv[1], std::ios::binary);
        const std::string bytes{std::istreambuf_iterator<char>(file), {}};
        const slabwright::Plan of_bytes =
            slabwright::plan(context, slabwright::PatternSource::of_bytes(bytes, "pattern.stl"), job);
        const Corners corners(bytes);
        const slabwright::Plan of_mesh = slabwright::plan(
            context, slabwright::PatternSource::of_mesh(corners.vertices, corners.facets, "pattern"), job);
        if (of_bytes.input.sha256 != of_file.input.sha256) return 1;
        if (programs(of_bytes) != programs(of_file) || programs(of_mesh) != programs(of_file)) return 1;
    } catch (const slabwright::Error& error) {
        std::printf("%s\n", error.what());
        return static_cast<int>(error.kind());
    }
    // An error must cross the library's border with its type.
    try {
        slabwright::Context context;
        (void)slabwright::plan(context, "/nowhere/no.stl", slabwright::Job{});
    } catch (const slabwright::Error& error) {
        return error.kind() == slabwright::ErrorKind::input ? 0 : 1;
    }
    return 1;
}
