// 3MF: the printable objects of its build, placed, by lib3mf. Its package is a ZIP archive, whose sizes are
// looked at before it is unpacked.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <string_view>

#include "io/read/mesh_format.h"
#include "kernels/parallel/context.h"

#ifdef SLABWRIGHT_LIB3MF
#include <Model/COM/NMR_DLLInterfaces.h>
#endif

namespace slabwright {

namespace {

constexpr std::string_view kFamily = "3mf";

std::uint32_t little(std::string_view bytes, std::size_t at, std::size_t size) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i)
        value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[at + i])) << (8 * i);
    return value;
}

bool recognise(std::string_view head, std::uint64_t, std::string_view) {
    return head.substr(0, 4) == std::string_view("PK\x03\x04", 4);
}

void require(std::string_view head, std::uint64_t size, const std::string& place) {
#ifndef SLABWRIGHT_LIB3MF
    refuse_mesh(kFamily, "not_built", "this build of slabwright reads no 3MF", place,
                "install lib3mf-dev and build again, or export it as STL");
#endif
    if (!recognise(head, size, {}))
        refuse_mesh(kFamily, "not_3mf", "does not begin as a 3MF package, which is a ZIP archive",
                    place + ", offset 0", "name a 3MF file");
}

#ifdef SLABWRIGHT_LIB3MF

/// Bytes that the archive unpacks to by its central directory, 32 bits a size: larger parts hold no pattern.
/// @throws Error(input, "3mf.damaged") where it has no directory
std::uint64_t unpacked_bytes(std::string_view bytes, const std::string& place) {
    constexpr std::string_view end_mark("PK\x05\x06", 4), entry_mark("PK\x01\x02", 4);
    constexpr std::size_t end_bytes = 22, entry_bytes = 46;
    const std::size_t end = bytes.rfind(end_mark);
    const auto damaged = [&](const std::string& what, std::size_t offset) {
        refuse_mesh(kFamily, "damaged", what, fmt::format("{}, offset {}", place, offset),
                    "copy or export the file again");
    };
    if (end == std::string_view::npos || bytes.size() - end < end_bytes)
        damaged("the archive has no directory at its end", bytes.size());
    const std::uint32_t entries = little(bytes, end + 10, 2);
    std::size_t at = little(bytes, end + 16, 4);
    std::uint64_t sum = 0;
    for (std::uint32_t i = 0; i < entries; ++i) {
        if (at > bytes.size() || bytes.size() - at < entry_bytes || bytes.substr(at, 4) != entry_mark)
            damaged("the archive's directory is damaged", std::min(at, bytes.size()));
        sum += little(bytes, at + 24, 4);
        at += entry_bytes + little(bytes, at + 28, 2) + little(bytes, at + 30, 2) + little(bytes, at + 32, 2);
    }
    return sum;
}

using NMR::PLib3MFBase;

struct Release {
    void operator()(PLib3MFBase* instance) const { NMR::lib3mf_release(instance); }
};
using Handle = std::unique_ptr<PLib3MFBase, Release>;

/// Rows of an affine map: x' = m[0]·x + m[3], row vectors as 3MF has them.
struct Placing {
    std::array<std::array<double, 3>, 4> m{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};

    [[nodiscard]] FileVertex of(const FileVertex& p) const {
        FileVertex q{};
        for (std::size_t k = 0; k < 3; ++k) q[k] = p[0] * m[0][k] + p[1] * m[1][k] + p[2] * m[2][k] + m[3][k];
        return q;
    }
    /// First `inner`, then this.
    [[nodiscard]] Placing after(const Placing& inner) const {
        Placing both;
        for (std::size_t r = 0; r < 4; ++r) {
            const auto& v = inner.m[r];
            for (std::size_t k = 0; k < 3; ++k)
                both.m[r][k] = v[0] * m[0][k] + v[1] * m[1][k] + v[2] * m[2][k] + (r == 3 ? m[3][k] : 0);
        }
        return both;
    }
    [[nodiscard]] bool mirrors() const {
        return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                   m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                   m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]) <
               0;
    }
};

Placing placing_of(const NMR::MODELTRANSFORM& transform) {
    Placing placing;
    for (std::size_t r = 0; r < 4; ++r)
        for (std::size_t k = 0; k < 3; ++k) placing.m[r][k] = static_cast<double>(transform.m_fFields[k][r]);
    return placing;
}

class ThreeMfReader {
public:
    ThreeMfReader(Context& context, const std::string& place) : context_(context), place_(place) {}

    DecodedMesh read(std::string_view bytes) {
        const Handle model = made([](PLib3MFBase** to) { return NMR::lib3mf_createmodel(to); });
        const Handle reader =
            made([&](PLib3MFBase** to) { return NMR::lib3mf_model_queryreader(model.get(), "3mf", to); });
        std::string copy(bytes);  // the interface takes bytes that it may write
        const auto result = NMR::lib3mf_reader_readfrombuffer(
            reader.get(), reinterpret_cast<BYTE*>(copy.data()), copy.size());
        if (result != 0) {
            DWORD code = 0;
            LPCSTR message = nullptr;
            (void)NMR::lib3mf_getlasterror(reader.get(), &code, &message);
            refuse_mesh(
                kFamily, "unreadable",
                fmt::format("lib3mf refuses it: {}", message != nullptr ? message : "no reason given"),
                place_, kExportAgain);
        }
        decoded_.mm_per_unit = unit_of(model.get());
        const Handle items =
            made([&](PLib3MFBase** to) { return NMR::lib3mf_model_getbuilditems(model.get(), to); });
        for (BOOL more = 0;;) {
            check(NMR::lib3mf_builditemiterator_movenext(items.get(), &more));
            if (!more) break;
            const Handle item = made(
                [&](PLib3MFBase** to) { return NMR::lib3mf_builditemiterator_getcurrent(items.get(), to); });
            const Handle object = made(
                [&](PLib3MFBase** to) { return NMR::lib3mf_builditem_getobjectresource(item.get(), to); });
            NMR::MODELTRANSFORM transform{};
            check(NMR::lib3mf_builditem_getobjecttransform(item.get(), &transform));
            add_object(object.get(), placing_of(transform), 0);
        }
        if (decoded_.facets.empty())
            refuse_mesh(kFamily, "no_facets", "its build has no object with facets", place_, kExportAgain);
        return std::move(decoded_);
    }

private:
    void check(LIB3MFRESULT result) const {
        if (result != 0)
            refuse_mesh(kFamily, "unreadable", fmt::format("lib3mf refuses it (0x{:08x})", result), place_,
                        kExportAgain);
    }
    template <class Make>
    Handle made(Make&& make) const {
        PLib3MFBase* instance = nullptr;
        check(make(&instance));
        return Handle(instance);
    }
    double unit_of(PLib3MFBase* model) const {
        DWORD unit = 0;
        check(NMR::lib3mf_model_getunit(model, &unit));
        constexpr std::array<double, 6> mm{0.001, 1, 10, 25.4, 304.8, 1000};
        return unit < mm.size() ? mm[unit] : 1;
    }
    void add_object(PLib3MFBase* object, const Placing& placing, int depth) {
        context_.throw_if_cancelled();
        constexpr int deepest = 32;
        constexpr std::size_t most = std::size_t{1} << 20;
        if (depth > deepest || ++objects_ > most)
            refuse_mesh(kFamily, "nested", "its components are nested too deep or are too many", place_,
                        "export it as one mesh");
        DWORD type = 0;
        check(NMR::lib3mf_object_gettype(object, &type));
        if (type == static_cast<DWORD>(NMR::MODELOBJECTTYPE_SUPPORT)) return;
        BOOL is_mesh = 0;
        check(NMR::lib3mf_object_ismeshobject(object, &is_mesh));
        if (is_mesh) {
            add_mesh(object, placing);
            return;
        }
        DWORD count = 0;
        check(NMR::lib3mf_componentsobject_getcomponentcount(object, &count));
        for (DWORD i = 0; i < count; ++i) {
            const Handle component = made(
                [&](PLib3MFBase** to) { return NMR::lib3mf_componentsobject_getcomponent(object, i, to); });
            const Handle inner = made([&](PLib3MFBase** to) {
                return NMR::lib3mf_component_getobjectresource(component.get(), to);
            });
            NMR::MODELTRANSFORM transform{};
            check(NMR::lib3mf_component_gettransform(component.get(), &transform));
            add_object(inner.get(), placing.after(placing_of(transform)), depth + 1);
        }
    }
    void add_mesh(PLib3MFBase* object, const Placing& placing) {
        DWORD vertices = 0, facets = 0;
        check(NMR::lib3mf_meshobject_getvertexcount(object, &vertices));
        check(NMR::lib3mf_meshobject_gettrianglecount(object, &facets));
        std::uint64_t bytes = std::uint64_t{vertices} * (sizeof(FileVertex) + sizeof(NMR::MODELMESHVERTEX)) +
                              std::uint64_t{facets} * (sizeof(Index3) + sizeof(NMR::MODELMESHTRIANGLE));
        const MemoryCharge charge(context_, bytes, "the numbers of " + place_);
        std::vector<NMR::MODELMESHVERTEX> corner(vertices);
        std::vector<NMR::MODELMESHTRIANGLE> triangle(facets);
        if (vertices > 0)
            check(NMR::lib3mf_meshobject_getvertices(object, corner.data(), vertices, &vertices));
        if (facets > 0)
            check(NMR::lib3mf_meshobject_gettriangleindices(object, triangle.data(), facets, &facets));
        const std::size_t first = decoded_.vertices.size();
        for (std::size_t v = 0; v < vertices; ++v) {
            const float* p = corner[v].m_fPosition;
            const FileVertex at = placing.of({p[0], p[1], p[2]});
            for (const double value : at)
                if (is_absurd(value, *decoded_.mm_per_unit))
                    refuse_coordinate(kFamily, value, *decoded_.mm_per_unit,
                                      fmt::format("{}, vertex {} of a mesh (counted from 0)", place_, v));
            decoded_.vertices.push_back(at);
        }
        const bool mirrors = placing.mirrors();
        for (std::size_t f = 0; f < facets; ++f) {
            const DWORD* i = triangle[f].m_nIndices;
            for (std::size_t k = 0; k < 3; ++k)
                if (i[k] >= vertices)
                    refuse_mesh(kFamily, "index", fmt::format("names vertex {} of {}", i[k], vertices),
                                fmt::format("{}, facet {} of a mesh (counted from 0)", place_, f),
                                kExportAgain);
            const auto at = [&](std::size_t k) { return static_cast<std::uint32_t>(first + i[k]); };
            decoded_.facets.push_back({at(0), at(mirrors ? 2 : 1), at(mirrors ? 1 : 2)});
        }
    }

    Context& context_;
    const std::string& place_;
    std::size_t objects_ = 0;
    DecodedMesh decoded_;
};

#endif

DecodedMesh decode(Context& context, std::string_view bytes, const DecodeOptions&, const std::string& place) {
#ifdef SLABWRIGHT_LIB3MF
    // The archive, its unpacked text, and lib3mf's own model of it, which takes some three times the text.
    const MemoryCharge charge(context, bytes.size() + 4 * unpacked_bytes(bytes, place), "unpacking " + place);
    return ThreeMfReader(context, place).read(bytes);
#else
    (void)context;
    (void)bytes;
    require({}, 0, place);
    return {};
#endif
}

#ifdef SLABWRIGHT_LIB3MF
constexpr bool kBuilt = true;
#else
constexpr bool kBuilt = false;
#endif

}  // namespace

extern const MeshFormat kThreeMfFormat;
const MeshFormat kThreeMfFormat{"3MF", kFamily, {".3mf", ""}, kBuilt, recognise, require, decode};

}  // namespace slabwright
