// Every number of a job at its edges: it is refused by name, or a plan comes of it, or an error that a person
// understands. Never a wait, a crash, or an error that is to be reported.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "io/slabwright.h"
#include "io/text/job_keys.h"
#include "kernels/errors.h"
#include "tests/data/models.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

using namespace slabwright;

namespace {

/// Sets the number that comes at a place in the walk over the keys; walks over all to count them.
struct NumberSetter {
    std::size_t place;
    double value;
    std::size_t seen = 0;
    std::string table{}, name{};

    void set(const char* key, double& number, double scale) {
        if (seen++ != place) return;
        number = value * scale;
        name = table + key;
    }
    void table_name(const std::string& of) { table = of + "."; }
    void table_begins(const char* of) { table_name(of); }
    void key(const char* key, double& number, const char*) { set(key, number, 1); }
    void key(const char* key, std::vector<double>& numbers, const char*) {
        if (!numbers.empty()) set(key, numbers.front(), 1);  // an empty list holds no number
    }
    void degrees(const char* key, double& radians, const char*) { set(key, radians, std::acos(-1.0) / 180); }
    void key(const char* key, int& number, const char*) {
        double real = number;
        set(key, real, 1);
        if (std::abs(real) < 2e9) number = static_cast<int>(real);
    }
    void key(const char*, bool&, const char*) {}
    void key(const char*, std::string&, const char*) {}
    template <class Enum, std::size_t N>
    void word(const char*, Enum&, const Word<Enum> (&)[N], const char*) {}
    void required() {}
};

/// NumberSetter, told of tables.
struct JobSetter : NumberSetter {
    using NumberSetter::key;
    void table(const char* of, const char*) { table_begins(of); }
};

struct Changed {
    Job job;
    std::string name;  ///< of the key; empty past the last
};
Changed changed(std::size_t place, double value) {
    Changed c;
    JobSetter setter{{place, value}};
    visit_job_keys(c.job, setter);
    for (std::size_t t = 0; t < c.job.tools.size(); ++t) {
        setter.table_name("tool[" + std::to_string(t + 1) + "]");
        visit_tool_keys(c.job.tools[t], setter);
    }
    c.name = setter.name;
    return c;
}

/// Whether validate() takes it; a refusal must be clear.
bool accepted(std::size_t place, double value) {
    const Changed c = changed(place, value);
    try {
        validate(c.job);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::usage) << c.name << " = " << value << ": " << error.what();
        EXPECT_FALSE(error.remedy().empty()) << c.name << " = " << value << ": " << error.what();
        return false;
    }
    EXPECT_TRUE(std::isfinite(value)) << c.name;
    return true;
}

/// The last value on the way from a good one to one that is refused.
double edge(std::size_t place, double good, double refused) {
    for (int i = 0; i < 60; ++i) {
        const double middle = good + (refused - good) / 2;
        (accepted(place, middle) ? good : refused) = middle;
    }
    return good;
}

/// A ramp on a block, 24 x 18 x 12 mm: walls, a floor, a slope.
std::vector<Facet> ramp() {
    const std::array<std::array<float, 2>, 5> outline{{{0, 0}, {24, 0}, {24, 4}, {12, 12}, {4, 12}}};
    const auto at = [&](std::size_t i, float y) { return Vec3f{outline[i % 5][0], y, outline[i % 5][1]}; };
    std::vector<Facet> facets;
    for (std::size_t i = 1; i < 4; ++i) {
        facets.push_back({at(0, 0), at(i, 0), at(i + 1, 0)});
        facets.push_back({at(0, 18), at(i + 1, 18), at(i, 18)});
    }
    for (std::size_t i = 0; i < 5; ++i) {
        facets.push_back({at(i, 0), at(i, 18), at(i + 1, 18)});
        facets.push_back({at(i, 0), at(i + 1, 18), at(i + 1, 0)});
    }
    return facets;
}

/// What a number must not do: an error for the makers, or a plan without measure.
void expect_plan_or_reason(const Changed& c, double value, const std::string& stl, const std::string& out) {
    constexpr std::size_t kMostMoves = 10'000'000;
    Context context({.threads = 2, .memory_bytes = std::uint64_t{1} << 30});
    try {
        const Plan made = plan(context, stl, c.job);
        std::size_t moves = 0;
        for (const Layer& layer : made.layers)
            for (const Operation& operation : layer.operations) moves += operation.moves.size();
        EXPECT_LT(moves, kMostMoves) << c.name << " = " << value;
        write(context, made, out);
    } catch (const Error& error) {
        EXPECT_EQ(error.remedy().find("report this"), std::string::npos)
            << c.name << " = " << value << ": " << error.code() << ": " << error.what();
        EXPECT_FALSE(error.remedy().empty()) << c.name << " = " << value << ": " << error.what();
    }
}

}  // namespace

TEST(JobSweep, EveryNumberIsRefusedByNameOrMeansSomething) {
    const support::TemporaryFolder folder;
    const std::string stl = folder / "ramp.stl";
    std::ofstream(stl, std::ios::binary) << stl_bytes("ramp", ramp());
    std::mt19937 random(test::seed());
    constexpr double inf = std::numeric_limits<double>::infinity();
    std::size_t numbers = 0, plans = 0;
    for (;; ++numbers) {
        const std::string name = changed(numbers, 1).name;
        if (name.empty()) break;
        const bool whole = name == "machine.magazine" || name == "dowels.per_joint" ||
                           name == "probing.tool" || name.find("number") != std::string::npos ||
                           name.find("flutes") != std::string::npos;
        std::optional<double> low, high;
        for (const double value : {0.0, -1.0, 1e-9, 1e-6, 1e-3, 0.01,  0.05,  0.1,    0.3, 0.5, 1.0, 2.0,
                                   5.0, 10.0, 20.0, 45.0, 60.0, 100.0, 118.0, 1000.0, 1e4, 1e6, 1e9}) {
            if (!accepted(numbers, value)) continue;
            if (!low) low = value;
            high = value;
        }
        if (!whole) {
            EXPECT_FALSE(accepted(numbers, std::nan(""))) << name;
            EXPECT_FALSE(accepted(numbers, inf)) << name;
            EXPECT_FALSE(accepted(numbers, -inf)) << name;
        }
        ASSERT_TRUE(low) << name;
        std::vector<double> values = {edge(numbers, *low, -2e9), edge(numbers, *high, 2e9)};
        std::uniform_real_distribution<double> between(std::log(std::max(1e-3, values[0])),
                                                       std::log(std::max(2e-3, values[1])));
        values.push_back(std::exp(between(random)));
        for (const double value : values) {
            const Changed c = changed(numbers, value);
            if (!accepted(numbers, value)) continue;
            expect_plan_or_reason(c, value, stl, folder / "out");
            ++plans;
        }
    }
    std::printf("%zu numbers, %zu plans\n", numbers, plans);
    EXPECT_GT(numbers, 100u);
}
