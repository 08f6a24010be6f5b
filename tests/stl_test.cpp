// STL in and out: both forms, every refusal, units, and files damaged at random.
#include "io/read/pattern_mesh.h"
#include "io/write/stl_writer.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <clocale>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <locale>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "io/text/sha256.h"
#include "kernels/errors.h"
#include "tests/mesh_shapes.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using shapes::Facets;

/// A folder of its own for each test.
class Stl : public ::testing::Test {
protected:
    std::string save(const std::string& name, const std::string& bytes) const {
        const std::string path = (folder / name).string();
        std::filesystem::remove(
            path);  // a fresh file costs microseconds, truncating a written one milliseconds
        std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
        return path;
    }
    support::TemporaryFolder temporary;
    const std::filesystem::path& folder = temporary.path;
};

std::string binary(const Facets& facets, std::string header = "binary", std::uint32_t count = 0xFFFFFFFFu) {
    header.resize(80, ' ');
    if (count == 0xFFFFFFFFu) count = static_cast<std::uint32_t>(facets.size());
    header.append(reinterpret_cast<const char*>(&count), 4);
    for (const auto& facet : facets) {
        header.append(12, '\0');
        for (const Vec3f& p : facet)
            for (const float c : {p.x, p.y, p.z}) header.append(reinterpret_cast<const char*>(&c), 4);
        header.append(2, '\0');
    }
    return header;
}

Facets corners_of(const Mesh& mesh) {
    Facets facets;
    for (const Index3& f : mesh.facets)
        facets.push_back({mesh.vertices[f[0]], mesh.vertices[f[1]], mesh.vertices[f[2]]});
    return facets;
}

struct AsciiStyle {
    const char* line = "\n";
    bool upper = false;
    const char* normal = "0 0 0";
    const char* plus = "";  ///< before numbers that are not negative
    std::string name = "box";
};

std::string ascii(const Facets& facets, const AsciiStyle& style = {}) {
    std::string text;
    auto word = [&](const char* keyword) {
        std::string w = keyword;
        if (style.upper)
            for (std::size_t i = 0; i < w.size(); i += 2) w[i] = static_cast<char>(std::toupper(w[i]));
        text += w;
    };
    auto end = [&] { text += style.line; };
    word("solid"), text += " " + style.name, end();
    for (const auto& facet : facets) {
        word("facet normal"), text += std::string(" ") + style.normal, end();
        text += "  ", word("outer loop"), end();
        for (const Vec3f& p : facet) {
            text += "\t";
            word("vertex");
            for (const float c : {p.x, p.y, p.z}) {
                char number[64];
                std::snprintf(number, sizeof number, " %s%.17g", c < 0 ? "" : style.plus,
                              static_cast<double>(c));
                text += number;
            }
            end();
        }
        word("endloop"), end();
        word("endfacet"), end();
    }
    word("endsolid"), text += " " + style.name, end();
    return text;
}

Error refusal(const std::string& path, const ReadingOptions& options = {}, int threads = 2) {
    Context context({.threads = threads});
    try {
        static_cast<void>(read_pattern_mesh(context, path, options));
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::input) << error.what();
        EXPECT_FALSE(error.message().empty());
        EXPECT_NE(error.place().find(path), std::string::npos) << error.what();
        EXPECT_FALSE(error.remedy().empty()) << error.what();
        return error;
    }
    ADD_FAILURE() << path << " was read";
    return Error(ErrorKind::usage, "none", "none");
}

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

const Diagnostic* find(const std::vector<Diagnostic>& diagnostics, const std::string& code) {
    for (const Diagnostic& d : diagnostics)
        if (d.code == code) return &d;
    return nullptr;
}

const Facets kBox = shapes::box({10, 20, 30}, {20, 40, 60});

void expect_box(const PatternMesh& stl) {
    EXPECT_EQ(stl.mesh.vertices.size(), 8u);
    EXPECT_EQ(stl.mesh.facets.size(), 12u);
    EXPECT_EQ(stl.input.triangles, 12u);
    EXPECT_EQ(stl.input.min, (std::array<double, 3>{10, 20, 30}));
    EXPECT_EQ(stl.input.max, (std::array<double, 3>{20, 40, 60}));
    EXPECT_EQ(stl.report.box.min, (Vec3f{10, 20, 0})) << "set on z = 0, x and y as in the file";
    EXPECT_EQ(stl.report.box.max, (Vec3f{20, 40, 30}));
    EXPECT_NEAR(stl.report.volume_mm3, 6000, 1e-9);
    EXPECT_TRUE(stl.diagnostics.empty());
}

// ------------------------------------------------------------------------------------------------- what is
// read

TEST_F(Stl, Binary) {
    Context context({.threads = 2});
    const std::string bytes = binary(kBox), path = save("box.stl", bytes);
    const PatternMesh stl = read_pattern_mesh(context, path);
    expect_box(stl);
    EXPECT_EQ(stl.input.file, "box.stl");
    EXPECT_EQ(stl.input.sha256, sha256(std::as_bytes(std::span(bytes))));
    require_solid(context, stl, path);
}

TEST_F(Stl, SolidInABinaryHeaderIsNoProofOfAscii) {
    Context context({.threads = 2});
    expect_box(read_pattern_mesh(context, save("a.stl", binary(kBox, "solid box"))));
    expect_box(read_pattern_mesh(
        context,
        save("b.stl", binary(kBox, "solid box\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex "))));
}

TEST_F(Stl, AsciiInManyStyles) {
    Context context({.threads = 2});
    expect_box(read_pattern_mesh(context, save("a.stl", ascii(kBox))));
    expect_box(read_pattern_mesh(
        context,
        save("b.stl",
             ascii(kBox, {.line = "\r\n", .upper = true, .normal = "NaN nan -nan(ind)", .plus = "+"}))));
    expect_box(read_pattern_mesh(context, save("c.stl", ascii(kBox, {.line = "\r", .name = ""}))));
    expect_box(read_pattern_mesh(context, save("d.stl", "\xEF\xBB\xBF  \n" + ascii(kBox))));
    expect_box(read_pattern_mesh(context, save("e.stl", ascii(kBox, {.normal = ""}))));
    expect_box(
        read_pattern_mesh(context, save("f.stl", ascii(kBox, {.name = "facet normal 1 2 3 endsolid"}))));
    std::string last = ascii(kBox);
    while (last.back() == '\n') last.pop_back();
    expect_box(read_pattern_mesh(context, save("g.stl", last)));
}

TEST_F(Stl, SeveralSolidsInOneFile) {
    Context context({.threads = 2});
    const PatternMesh stl = read_pattern_mesh(
        context, save("two.stl",
                      ascii(shapes::box({0, 0, 0}, {9, 9, 9})) + "\n" +
                          ascii(shapes::box({20, 0, 0}, {29, 9, 9}), {.upper = true, .name = "second one"})));
    EXPECT_EQ(stl.report.components, 2u);
    EXPECT_EQ(stl.input.triangles, 24u);
}

TEST_F(Stl, NumbersInEverySpelling) {
    Context context({.threads = 1});
    const std::string text =
        "solid s\nfacet normal 0 0 1 outer loop\nvertex 1e1 +2.5E+00 -.5\nvertex 0010.0 1e-999 .25e1\nvertex "
        "-0 7. 5\nendloop endfacet\nendsolid";
    const PatternMesh stl = read_pattern_mesh(context, save("n.stl", text));
    ASSERT_EQ(stl.mesh.vertices.size(), 3u);
    EXPECT_EQ(stl.mesh.vertices[0], (Vec3f{10, 2.5f, 0}));
    EXPECT_EQ(stl.mesh.vertices[1], (Vec3f{10, 0, 3}));
    EXPECT_EQ(stl.mesh.vertices[2], (Vec3f{0, 7, 5.5f}));
}

TEST_F(Stl, TheLocaleDoesNotMatter) {
    struct Comma : std::numpunct<char> {
        char do_decimal_point() const override { return ','; }
        char do_thousands_sep() const override { return '.'; }
        std::string do_grouping() const override { return "\3"; }
    };
    const std::string path = save("a.stl", ascii(shapes::box({0.5f, 0.25f, 0.125f}, {10.5f, 20.5f, 30.5f})));
    const std::string open = save("open.stl", binary({kBox.begin(), kBox.end() - 1}));
    const std::locale before = std::locale::global(std::locale(std::locale::classic(), new Comma));
    const std::string c_before = std::setlocale(LC_ALL, nullptr);
    for (const char* name : {"de_DE.UTF-8", "de_DE", "fr_FR.UTF-8"})
        if (std::setlocale(LC_ALL, name) != nullptr) break;
    Context context({.threads = 2});
    const PatternMesh stl = read_pattern_mesh(context, path);
    EXPECT_EQ(stl.report.box.min, (Vec3f{0.5f, 0.25f, 0}));
    EXPECT_EQ(stl.report.box.max, (Vec3f{10.5f, 20.5f, 30.375f}));
    std::string message;
    try {
        require_solid(context, read_pattern_mesh(context, open), open);
    } catch (const Error& error) {
        message = error.what();
    }
    std::setlocale(LC_ALL, c_before.c_str());
    std::locale::global(before);
    EXPECT_TRUE(contains(message, "0.")) << message;
    EXPECT_FALSE(contains(message, "0,")) << message;
}

TEST_F(Stl, InchesAreScaledInDoubleAndRoundedOnce) {
    Context context({.threads = 2});
    const Facets box = shapes::box({0.1f, 0.2f, -7.3f}, {12.3f, 6.1f, 9.7f});
    const PatternMesh stl =
        read_pattern_mesh(context, save("in.stl", binary(box)), {.units = LengthUnit::inch});
    EXPECT_EQ(stl.input.min[0], static_cast<double>(0.1f) * 25.4);
    EXPECT_EQ(stl.input.max[2], static_cast<double>(9.7f) * 25.4);
    EXPECT_EQ(stl.report.box.min.x, static_cast<float>(static_cast<double>(0.1f) * 25.4));
    EXPECT_EQ(stl.report.box.max.z,
              static_cast<float>(static_cast<double>(9.7f) * 25.4 - static_cast<double>(-7.3f) * 25.4));
    EXPECT_EQ(stl.report.box.min.z, 0.0f);
}

TEST_F(Stl, UnitsThatLookWrongAreRemarkedOnNotGuessed) {
    Context context({.threads = 1});
    struct Case {
        float size;
        LengthUnit unit;
        const char* names;
    };
    for (const Case& c :
         {Case{4.9f, LengthUnit::mm, "inches"}, Case{5001, LengthUnit::mm, "inches"},
          Case{4.9f, LengthUnit::inch, "millimetres"}, Case{5001, LengthUnit::inch, "millimetres"},
          Case{5, LengthUnit::mm, nullptr}, Case{5000, LengthUnit::inch, nullptr}}) {
        const PatternMesh stl = read_pattern_mesh(
            context, save("u.stl", binary(shapes::box({0, 0, 0}, {c.size, 1, 1}))), {.units = c.unit});
        const Diagnostic* remark = find(stl.diagnostics, "units.suspicious");
        ASSERT_EQ(remark != nullptr, c.names != nullptr) << c.size;
        if (remark == nullptr) continue;
        EXPECT_EQ(remark->severity, Severity::warning);
        EXPECT_TRUE(contains(remark->message, c.names)) << remark->message;
        EXPECT_EQ(stl.input.max[0], static_cast<double>(c.size) * (c.unit == LengthUnit::inch ? 25.4 : 1.0));
    }
}

TEST_F(Stl, LargeAsciiEqualsItsBinaryOnAnyNumberOfThreads) {
    const Facets torus = shapes::torus(105);  // some 4 MB of text, several pieces
    const std::string text = ascii(torus), text_path = save("t.stl", text),
                      binary_path = save("b.stl", binary(torus));
    ASSERT_GT(text.size(), std::size_t{3} << 20);
    Context one({.threads = 1});
    const PatternMesh expected = read_pattern_mesh(one, binary_path);
    EXPECT_EQ(expected.report.open_edges.count, 0u);
    for (const int threads : {1, 2, 4}) {
        Context context({.threads = threads});
        const PatternMesh stl = read_pattern_mesh(context, text_path);
        ASSERT_EQ(stl.mesh.facets, expected.mesh.facets) << threads;
        ASSERT_EQ(stl.mesh.vertices, expected.mesh.vertices);
        ASSERT_EQ(stl.mesh.neighbours, expected.mesh.neighbours);
        EXPECT_EQ(stl.input.min, expected.input.min);
        EXPECT_EQ(stl.report.volume_mm3, expected.report.volume_mm3);
        EXPECT_EQ(context.memory_charged(), 0u);
    }
}

// ------------------------------------------------------------------------------------------------- what is
// refused

TEST_F(Stl, NoFileAFolderNothing) {
    EXPECT_EQ(refusal((folder / "none.stl").string()).code(), "stl.missing");
    EXPECT_EQ(refusal(folder.string()).code(), "stl.directory");
    EXPECT_EQ(refusal(save("empty.stl", "")).code(), "stl.empty");
    EXPECT_EQ(refusal(save("none.stl", binary({}))).code(), "stl.no_facets");
    EXPECT_EQ(refusal(save("none.txt", "solid x\nendsolid x\n")).code(), "stl.no_facets");
    EXPECT_EQ(refusal(save("page.stl", "<html><body>not found</body></html>")).code(), "stl.not_stl");
    const std::string pipe = (folder / "pipe").string();
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    EXPECT_EQ(refusal(pipe).code(), "stl.unreadable");
}

TEST_F(Stl, CountsThatContradictTheLength) {
    const std::string bytes = binary(kBox, "binary", 66);
    Error error = refusal(save("count.stl", bytes));
    EXPECT_EQ(error.code(), "stl.facet_count");
    EXPECT_TRUE(contains(error.message(), "66 facets")) << error.message();
    EXPECT_TRUE(contains(error.message(), "after 12 facets")) << error.message();
    EXPECT_TRUE(contains(error.message(), "offset 684")) << error.message();

    error = refusal(save("less.stl", binary(kBox, "binary", 3)));
    EXPECT_EQ(error.code(), "stl.facet_count");
    EXPECT_TRUE(contains(error.message(), "3 facets (234 bytes)")) << error.message();

    error = refusal(save("more.stl", binary(kBox) + "tail"));
    EXPECT_EQ(error.code(), "stl.facet_count");
    EXPECT_TRUE(contains(error.message(), "4 bytes more")) << error.message();

    error = refusal(save("cut.stl", binary(kBox).substr(0, 84 + 50 * 7 + 13)));
    EXPECT_EQ(error.code(), "stl.truncated");
    EXPECT_TRUE(contains(error.message(), "after 7 facets and 13 bytes")) << error.message();

    error = refusal(save("solid.stl", binary(kBox, "solid box").substr(0, 500)));
    EXPECT_EQ(error.code(), "stl.truncated") << "still binary";

    error = refusal(save("head.stl", binary(kBox).substr(0, 83)));
    EXPECT_EQ(error.code(), "stl.truncated");
    // A count that would need more memory than there is must not be believed.
    EXPECT_EQ(refusal(save("huge.stl", binary(kBox, "binary", 4000000000u))).code(), "stl.facet_count");
}

TEST_F(Stl, CoordinatesThatAreNoLengths) {
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    for (const float bad : {nan, inf, -inf, 3e38f, 1.1e6f, -2e6f}) {
        Facets facets = kBox;
        facets[7][2].y = bad;
        facets[9][0].x = bad;
        const Error error = refusal(save("bad.stl", binary(facets)));
        EXPECT_EQ(error.code(), std::isfinite(bad) ? "stl.absurd" : "stl.non_finite");
        EXPECT_TRUE(contains(error.place(), "facet 7 ")) << error.place();
        EXPECT_TRUE(contains(error.place(), "y of corner 2")) << error.place();
        EXPECT_TRUE(contains(error.place(), "offset " + std::to_string(84 + 7 * 50 + 12 + 2 * 12 + 4)))
            << error.place();
        const Error in_text = refusal(save("bad.txt", ascii(facets)));
        EXPECT_EQ(in_text.code(), error.code());
        EXPECT_TRUE(contains(in_text.place(), "facet 7 ")) << in_text.place();
        EXPECT_TRUE(contains(in_text.place(), "line 55")) << in_text.place();
    }
    // In inches the limit is met sooner.
    Facets facets = shapes::box({0, 0, 0}, {50000, 1, 1});
    EXPECT_EQ(refusal(save("inch.stl", binary(facets)), {.units = LengthUnit::inch}).code(), "stl.absurd");
    // Written out of range for any double.
    std::string text = ascii(kBox);
    text.replace(text.find("vertex 10"), 9, "vertex 1e999");
    EXPECT_EQ(refusal(save("range.stl", text)).code(), "stl.non_finite");
}

TEST_F(Stl, TextThatIsNoStl) {
    const std::string text = ascii(kBox);
    struct Case {
        const char *from, *to, *code, *found;
        int line;
    };
    for (const Case& c :
         {Case{"vertex", "vertix", "stl.unparsable", "'vertix' where 'vertex'", 4},
          Case{"vertex 10", "vertex 1,0", "stl.unparsable", "'1,0' where a number", 4},
          Case{"vertex 10", "vertex +-10", "stl.unparsable", "'+-10'", 4},
          Case{"vertex 10", "vertex", "stl.unparsable", "'vertex' where a number", 5},
          Case{"vertex 10", "vertex 10 10 10 10", "stl.unparsable", "'10' where 'vertex'", 4},
          Case{"vertex 10", "vertex 0x10", "stl.unparsable", "'0x10'", 4},
          Case{"endloop", "vertex 1 2 3\nendloop", "stl.unparsable", "'vertex' where 'endloop'", 7},
          Case{"outer", "inner", "stl.unparsable", "'inner'", 3},
          Case{"endfacet\n", "", "stl.unparsable", "'facet' where 'endfacet'", 8},
          Case{"vertex 10", "vertex \x10\x80", "stl.unparsable", "\\x10\\x80", 4},
          Case{"endsolid", "endfacet", "stl.unparsable", "'endfacet' where 'solid', 'facet' or 'endsolid'",
               86},
          Case{"endsolid box\n", "", "stl.truncated", "12 facets without 'endsolid'", 86}}) {
        std::string damaged = text;
        damaged.replace(damaged.find(c.from), std::strlen(c.from), c.to);
        const Error error = refusal(save("bad.stl", damaged));
        EXPECT_EQ(error.code(), c.code) << c.to;
        EXPECT_TRUE(contains(error.message(), c.found)) << error.message();
        EXPECT_TRUE(contains(error.place(), "line " + std::to_string(c.line) + ",")) << error.what();
    }
    for (const char* ending : {"\n", "\r\n", "\r"}) {
        std::string damaged = ascii(kBox, {.line = ending});
        damaged.replace(damaged.find("vertex"), 6, "vertix");
        EXPECT_TRUE(contains(refusal(save("bad.stl", damaged)).place(), "line 4,"));
    }
    const Error cut = refusal(save("cut.stl", text.substr(0, text.size() / 2)));
    EXPECT_TRUE(cut.code() == "stl.truncated" || cut.code() == "stl.unparsable") << cut.what();
}

TEST_F(Stl, TheFirstFaultOfALargeTextIsNamedOnAnyNumberOfThreads) {
    const Facets torus = shapes::torus(90);
    std::string text = ascii(torus);
    // Faults in the last and in the middle piece: facets 16000 and 8000, seven lines each after the first.
    for (const std::size_t facet : {16000u, 8000u}) {
        std::size_t at = 0;
        for (std::size_t line = 0; line < 1 + 7 * facet + 3; ++line) at = text.find('\n', at) + 1;
        text.insert(text.find("vertex", at), "x");
    }
    const std::string path = save("faults.stl", text);
    for (const int threads : {1, 2, 4}) {
        const Error error = refusal(path, {}, threads);
        EXPECT_TRUE(contains(error.place(), "facet 8000 ")) << error.place();
        EXPECT_TRUE(contains(error.place(), "line " + std::to_string(1 + 7 * 8000 + 4) + ","))
            << error.place();
        EXPECT_TRUE(contains(error.message(), "'xvertex' where 'vertex'")) << error.message();
    }
}

TEST_F(Stl, MemoryAndCancel) {
    const std::string path = save("t.stl", binary(shapes::torus(100))),
                      text = save("t.txt", ascii(shapes::torus(100)));
    for (const std::string& file : {path, text}) {
        Context small({.threads = 2, .memory_bytes = 100000});
        try {
            static_cast<void>(read_pattern_mesh(small, file));
            FAIL() << "over the limit";
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), "memory.limit");
        }
        Context cancelled({.threads = 2});
        cancelled.cancel();
        try {
            static_cast<void>(read_pattern_mesh(cancelled, file));
            FAIL() << "cancelled";
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::cancelled);
        }
    }
}

TEST_F(Stl, AFileThatIsWrittenWhileItIsReadIsAnErrorNotASignal) {
    const Facets torus = shapes::torus(300);
    const std::string bytes = binary(torus), path = save("t.stl", bytes);
    std::atomic<bool> stop{false};
    std::thread writer([&] {
        for (int i = 0; !stop; ++i) {
            if (::truncate(path.c_str(), static_cast<off_t>(84 + 50 * (i % 7) * torus.size() / 9)) != 0)
                break;
            std::this_thread::sleep_for(std::chrono::microseconds(300 * (i % 11)));
            std::ofstream(path, std::ios::binary) << bytes;
            std::this_thread::sleep_for(std::chrono::microseconds(700 * (i % 5)));
        }
    });
    std::map<std::string, int> outcomes;
    Context context({.threads = 2});
    for (int i = 0; i < 100'000 && (outcomes["read"] < 20 || outcomes["stl.changed"] < 5); ++i) {
        try {
            EXPECT_EQ(read_pattern_mesh(context, path).mesh.facets.size(), torus.size());
            ++outcomes["read"];
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::input) << error.what();
            ++outcomes[error.code()];
        }
    }
    stop = true;
    writer.join();
    for (const auto& [what, count] : outcomes) std::printf("%s: %d\n", what.c_str(), count);
    EXPECT_GT(outcomes["stl.changed"], 0) << "no read met a write";
}

TEST_F(Stl, WhatIsTooLargeForTheMemoryIsToldBeforeItIsRead) {
    // Ten gigabytes on the disk's books, none of them written; the header announces as many facets as fit.
    const std::uint32_t count = 200'000'000;
    std::string head(80, ' ');
    head.append(reinterpret_cast<const char*>(&count), sizeof count);
    const std::string path = save("sparse.stl", head), zeros = save("zeros.stl", "");
    ASSERT_EQ(::truncate(path.c_str(), 84 + off_t{50} * count), 0);
    ASSERT_EQ(::truncate(zeros.c_str(), off_t{10'000'000'000}), 0);
    Context context({.threads = 2, .memory_bytes = std::uint64_t{12} << 30});
    try {
        static_cast<void>(read_pattern_mesh(context, path));
        FAIL() << "over the limit";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), "memory.limit");
        EXPECT_NE(error.message().find("sparse.stl"), std::string::npos);
    }
    try {
        static_cast<void>(read_pattern_mesh(context, zeros));
        FAIL() << "no STL";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), "stl.facet_count");
    }
    rusage used{};
    ::getrusage(RUSAGE_SELF, &used);
    EXPECT_LT(used.ru_maxrss, 1 << 20) << "KiB; neither was read";
}

// ------------------------------------------------------------------------------------------------- solids

Error not_solid(const Facets& facets, const std::string& path) {
    std::ofstream(path, std::ios::binary) << binary(facets);
    Context context({.threads = 2});
    const PatternMesh stl = read_pattern_mesh(context, path);
    try {
        require_solid(context, stl, path);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::input);
        EXPECT_TRUE(contains(error.place(), path)) << error.what();
        EXPECT_FALSE(error.remedy().empty());
        return error;
    }
    ADD_FAILURE() << "was taken for a solid";
    return Error(ErrorKind::usage, "none", "none");
}

TEST_F(Stl, RequireSolidRefusesWhatIsNone) {
    const std::string path = (folder / "p.stl").string();
    Facets facets = kBox;
    facets.erase(facets.begin() + 5);
    Error error = not_solid(facets, path);
    EXPECT_EQ(error.code(), "stl.open");
    EXPECT_TRUE(contains(error.message(), "3 edges")) << error.message();
    EXPECT_TRUE(contains(error.remedy(), "no weld")) << error.remedy();

    facets = kBox;
    std::swap(facets[5][0], facets[5][1]);
    error = not_solid(facets, path);
    EXPECT_EQ(error.code(), "stl.misoriented");
    EXPECT_TRUE(contains(error.message(), "3 edges")) << error.message();

    error = not_solid(shapes::flipped(kBox), path);
    EXPECT_EQ(error.code(), "stl.inverted");
    EXPECT_TRUE(contains(error.place(), "facet 0")) << error.place();
}

TEST_F(Stl, RequireSolidAcceptsAnOpenBaseCavitiesAndBlemishes) {
    Context context({.threads = 2});
    Facets facets = kBox;
    facets.erase(facets.begin(), facets.begin() + 2);  // the bottom
    const std::string path = save("p.stl", binary(facets));
    PatternMesh stl = read_pattern_mesh(context, path);
    require_solid(context, stl, path);
    const Diagnostic* remark = find(stl.diagnostics, "mesh.open_base");
    ASSERT_NE(remark, nullptr);
    EXPECT_EQ(remark->severity, Severity::warning);
    EXPECT_TRUE(contains(remark->message, "4 edges")) << remark->message;
    EXPECT_TRUE(remark->where.has_value());

    facets = kBox;
    shapes::append(facets, shapes::flipped(shapes::box({12, 22, 32}, {18, 38, 58})));  // a cavity
    facets.push_back({facets[0][0], facets[0][1], facets[0][0]});                      // without area
    facets.push_back(facets[3]);  // twice, and once more reversed
    facets.push_back({facets[3][0], facets[3][2], facets[3][1]});
    save("p.stl", binary(facets));
    stl = read_pattern_mesh(context, path);
    require_solid(context, stl, path);
    EXPECT_NE(find(stl.diagnostics, "mesh.degenerate"), nullptr);
    EXPECT_NE(find(stl.diagnostics, "mesh.duplicate"), nullptr);
    EXPECT_NE(find(stl.diagnostics, "mesh.non_manifold"), nullptr);
    EXPECT_EQ(find(stl.diagnostics, "mesh.open"), nullptr);
}

TEST_F(Stl, TheWeldThatIsNamedCloses) {
    // Every corner is moved a little on its own: nothing meets bit for bit.
    std::mt19937_64 random(test::seed());
    for (const double crack : {2e-7, 2e-6, 2e-5}) {  // of the diagonal
        Facets facets = shapes::torus(24, 30, 10);
        for (auto& facet : facets)
            for (Vec3f& p : facet)
                for (float* c : {&p.x, &p.y, &p.z})
                    *c = static_cast<float>(*c +
                                            115 * crack * std::uniform_real_distribution(-1.0, 1.0)(random));
        const std::string path = (folder / "cracks.stl").string();
        const Error error = not_solid(facets, path);
        EXPECT_EQ(error.code(), "stl.open");
        ASSERT_EQ(error.remedy().rfind("--weld ", 0), 0u) << error.remedy();
        const double tolerance = std::stod(error.remedy().substr(7));
        Context context({.threads = 2});
        const PatternMesh welded = read_pattern_mesh(context, path, {.weld_mm = tolerance});
        require_solid(context, welded, path);
        EXPECT_EQ(welded.report.open_edges.count, 0u);
        EXPECT_EQ(welded.report.box.min.z, 0.0f) << "still set on z = 0";
        EXPECT_EQ(welded.mesh.vertices.size(), 24u * 24u);
        const Diagnostic* remark = find(welded.diagnostics, "mesh.welded");
        ASSERT_NE(remark, nullptr);
        EXPECT_TRUE(contains(remark->message, "merged")) << remark->message;
    }
}

TEST_F(Stl, WeldingEverythingAwayIsRefused) {
    Context context({.threads = 1});
    const std::string path = save("p.stl", binary(kBox));
    EXPECT_EQ(refusal(path, {.weld_mm = 1000}).code(), "stl.no_facets");
    EXPECT_THROW(static_cast<void>(read_pattern_mesh(context, path, {.weld_mm = -1})), Error);
}

// ------------------------------------------------------------------------------------------------- writing

// Facets in any order give the same report, and what is wrong is told by the file's own facets.
TEST_F(Stl, ShuffledFacetsAreReadAsOrderedOnes) {
    Facets facets = shapes::torus(180);
    ASSERT_GT(facets.size(), 60000U);
    std::mt19937_64 random(test::seed());
    Facets shuffled = facets;
    std::shuffle(shuffled.begin(), shuffled.end(), random);
    Context context({.threads = 2});
    const PatternMesh ordered = read_pattern_mesh(context, save("ordered.stl", binary(facets))),
                      mixed = read_pattern_mesh(context, save("mixed.stl", binary(shuffled)));
    EXPECT_EQ(mixed.mesh.vertices.size(), ordered.mesh.vertices.size());
    EXPECT_EQ(mixed.report.open_edges.count, 0U);
    EXPECT_EQ(mixed.report.components, 1U);
    EXPECT_NEAR(mixed.report.volume_mm3, ordered.report.volume_mm3, 1e-6 * ordered.report.volume_mm3);
    EXPECT_EQ(mixed.diagnostics.size(), ordered.diagnostics.size());
    // Neighbours lie together, so that the mesh is no longer in the file's order.
    const Facets together = corners_of(mixed.mesh);
    EXPECT_NE(together, shuffled);
    EXPECT_TRUE(neighbours_follow({reinterpret_cast<const char*>(together.data()), together.size()}));

    shuffled[12345] = {shuffled[12345][0], shuffled[12345][0], shuffled[12345][1]};
    const PatternMesh broken = read_pattern_mesh(context, save("broken.stl", binary(shuffled)));
    EXPECT_EQ(broken.report.degenerate_facets.count, 1U);
    EXPECT_EQ(broken.report.degenerate_facets.first_facet, 12345U);
    EXPECT_EQ(broken.report.open_edges.count, 3U);
}

TEST_F(Stl, WrittenAndReadBackIsTheSame) {
    Context context({.threads = 2});
    const Mesh mesh = weld(context, shapes::torus(40));
    const std::string path = (folder / "out.stl").string();
    write_stl(path, mesh);
    write_stl(path, mesh);  // over itself
    std::size_t files = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder)) ++files;
    EXPECT_EQ(files, 1u) << "nothing is left beside it";
    std::ostringstream bytes;
    bytes << std::ifstream(path, std::ios::binary).rdbuf();
    EXPECT_EQ(bytes.str().size(), 84 + 50 * mesh.facets.size());
    EXPECT_NE(bytes.str().substr(0, 5), "solid");
    const PatternMesh back = read_pattern_mesh(context, path);
    EXPECT_EQ(back.mesh.facets, mesh.facets);
    ASSERT_EQ(back.mesh.vertices.size(), mesh.vertices.size());
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
        EXPECT_EQ(back.mesh.vertices[v].x, mesh.vertices[v].x);
        EXPECT_EQ(back.mesh.vertices[v].z,
                  static_cast<float>(double(mesh.vertices[v].z) - back.input.min[2]));
    }
    // The normals are right as well.
    for (std::size_t f = 0; f < mesh.facets.size(); ++f) {
        float n[12];
        std::memcpy(n, bytes.str().data() + 84 + 50 * f, sizeof n);
        EXPECT_NEAR(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1, 1e-6);
        if (f > 20) break;
    }
}

TEST_F(Stl, WritingWhereNothingCanBeWritten) {
    try {
        write_stl((folder / "none" / "out.stl").string(), Mesh{});
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), "out.unwritable");
    }
    std::filesystem::create_directory(folder / "taken");
    EXPECT_THROW(write_stl((folder / "taken").string(), Mesh{}), Error);
    std::size_t files = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder)) ++files;
    EXPECT_EQ(files, 1u);
}

// ------------------------------------------------------------------------------------------------- damage at
// random

/// Reads a damaged file: a mesh or a refusal, never anything else.
void survive(const std::string& path) {
    Context context({.threads = 1});
    try {
        const PatternMesh stl = read_pattern_mesh(context, path);
        EXPECT_EQ(stl.mesh.facets.size(), stl.input.triangles);
        require_solid(context, stl, path);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::input) << error.what();
        EXPECT_EQ(error.code().rfind("stl.", 0), 0u) << error.code();
        EXPECT_FALSE(error.place().empty());
        EXPECT_FALSE(error.remedy().empty());
    }
}

TEST_F(Stl, DamagedFilesAreRefusedOrRead) {
    std::mt19937_64 random(test::seed());
    Facets facets = shapes::box({0, 0, 0}, {10, 10, 10});
    shapes::append(facets, shapes::box({10, 10, 0}, {20, 20, 10}));
    const std::string originals[] = {binary(facets), binary(facets, "solid"), ascii(facets),
                                     ascii(facets, {.line = "\r\n", .upper = true})};
    for (int round = 0; round < 6000; ++round) {
        std::string bytes = originals[round % 4];
        for (std::uint64_t change = 1 + random() % 4; change > 0 && !bytes.empty(); --change) {
            const std::size_t at = random() % bytes.size();
            switch (random() % 6) {
                case 0:
                    bytes[at] = static_cast<char>(random());
                    break;
                case 1:
                    bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
                    break;
                case 2:
                    bytes.resize(at);
                    break;
                case 3:
                    bytes.erase(at, 1 + random() % 60);
                    break;
                case 4:
                    bytes.insert(at, bytes.substr(random() % bytes.size(), random() % 120));
                    break;
                default:
                    bytes.replace(at, std::min<std::size_t>(4, bytes.size() - at),
                                  std::string(4, static_cast<char>(random() % 2 == 0 ? 0xFF : 0)));
                    break;
            }
        }
        survive(save("damaged.stl", bytes));
        if (HasFailure()) FAIL() << "round " << round;
    }
}

TEST_F(Stl, EveryTruncationIsRefusedOrRead) {
    const Facets facets = shapes::box({0, 0, 0}, {10, 10, 10});
    for (const std::string& bytes : {binary(facets), binary(facets, "solid"), ascii(facets)})
        for (std::size_t size = 0; size < bytes.size(); ++size) {
            const std::string path = save("short.stl", bytes.substr(0, size));
            survive(path);
            // Only the name behind endsolid and the line's end can go unnoticed.
            if (size + 12 < bytes.size()) static_cast<void>(refusal(path, {}, 1));
            if (HasFailure()) FAIL() << "size " << size;
        }
}

// ------------------------------------------------------------------------------------------------- the
// digest

TEST(Sha256, KnownVectors) {
    auto both = [](const std::string& text, const std::string& digest) {
        EXPECT_EQ(sha256(std::as_bytes(std::span(text))), digest);
        EXPECT_EQ(sha256_portable(std::as_bytes(std::span(text))), digest);
    };
    both("", "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    both("abc", "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    both("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq",
         "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
    both(std::string(1000000, 'a'), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, PiecesAndProcessorsDoNotMatter) {
    std::mt19937_64 random(test::seed());
    for (int round = 0; round < 300; ++round) {
        std::vector<std::byte> bytes(random() % 1000);
        for (std::byte& b : bytes) b = static_cast<std::byte>(random());
        const std::string expected = sha256_portable(bytes);
        EXPECT_EQ(sha256(bytes), expected);
        Sha256 hash;
        for (std::span<const std::byte> rest = bytes; !rest.empty();) {
            const std::size_t take = std::min<std::size_t>(rest.size(), random() % 150);
            hash.update(rest.first(take));
            rest = rest.subspan(take);
        }
        EXPECT_EQ(hash.hex(), expected);
    }
}

}  // namespace
}  // namespace slabwright
