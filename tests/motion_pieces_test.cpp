// Each kind of motion against the seconds that LinuxCNC's own motion takes for it. The seconds below are from
// LinuxCNC 2.9 (linuxcnc-uspace 2.9.0~pre1), by
//     SLABWRIGHT_PIECES=DIR build/release/motion_pieces_test
//     bench/motion --times 8 --pieces DIR/alike/*
//     bench/motion --times 8 --pieces DIR/unlike/* --machine "$(cat DIR/unlike.json)"
// The first writes the programs, the others print what stands in kPieces.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>
#include <string>

#include "engine/simulate/simulate.h"
#include "io/posts/gcode_reader.h"

using namespace slabwright;

namespace {

/// A program written as a turtle goes: on by a length, along an arc, after a turn.
class Turtle {
public:
    explicit Turtle(double blend, int feed = 9000) : feed_(feed) {
        text_ = fmt::format(
            "G21 G17 G90 G94 G40 G49 G80\nG8 G97\nG64 P{} Q0\nG54\nT1 M6\nG43 H1\n"
            "S1000 M3\nG4 P0.1\nG91.1\nG0 Z10\nX0 Y0\n",
            blend);
    }
    void turn(double degrees) { heading_ += degrees * std::numbers::pi / 180; }
    void line(double length, double rise = 0) {
        x_ += length * std::cos(heading_), y_ += length * std::sin(heading_), z_ += rise;
        text_ += fmt::format("G1 X{:.4f} Y{:.4f} Z{:.4f} F{}\n", x_, y_, z_, feed_);
    }
    /// @param degrees negative: clockwise
    void arc(double radius, double degrees) {
        const double sweep = degrees * std::numbers::pi / 180, side = sweep > 0 ? 1 : -1;
        const double from_x = std::round(x_ * 1e4) / 1e4, from_y = std::round(y_ * 1e4) / 1e4;
        const double cx = x_ - side * radius * std::sin(heading_),
                     cy = y_ + side * radius * std::cos(heading_);
        heading_ += sweep;
        x_ = cx + side * radius * std::sin(heading_), y_ = cy - side * radius * std::cos(heading_);
        text_ += fmt::format("G{} X{:.4f} Y{:.4f} I{:.4f} J{:.4f} F{}\n", side > 0 ? 3 : 2, x_, y_,
                             cx - from_x, cy - from_y, feed_);
    }
    void rapid(double length, double rise = 0) {
        x_ += length * std::cos(heading_), y_ += length * std::sin(heading_), z_ += rise;
        text_ += fmt::format("G0 X{:.4f} Y{:.4f} Z{:.4f}\n", x_, y_, z_);
    }
    std::string text() const { return text_ + "G0 Z10\nX0 Y0\nM5\nM2\n"; }

private:
    std::string text_;
    int feed_;
    double x_ = 0, y_ = 0, z_ = 10, heading_ = 0;
};

template <class Step>
std::string repeated(int times, Turtle turtle, Step step) {
    for (int i = 0; i < times; ++i) step(turtle, i);
    return turtle.text();
}

std::string lines(double blend, double length, double degrees, bool to_and_fro) {
    return repeated(static_cast<int>(1000 / length), Turtle(blend), [&](Turtle& t, int i) {
        t.turn(to_and_fro && i % 2 == 1 ? -degrees : degrees);
        t.line(length);
    });
}

/// Lines and arcs in turn, with a turn at each meeting, to the arc's side or to the other.
std::string lines_and_arcs(double blend, double degrees) {
    return repeated(60, Turtle(blend), [&](Turtle& t, int) {
        t.turn(degrees), t.line(8);
        t.turn(degrees), t.arc(30, 15);
    });
}

/// Arcs of two radii to one side, or to both in turn.
std::string arcs(double blend, double degrees, bool both_sides) {
    return repeated(60, Turtle(blend), [&](Turtle& t, int) {
        t.turn(degrees), t.arc(30, 15);
        t.turn(both_sides ? -degrees : degrees), t.arc(15, both_sides ? -15 : 15);
    });
}

std::string raster(double blend, double step, double slope) {
    return repeated(8, Turtle(blend, 5000), [&](Turtle& t, int row) {
        for (int k = 0; k < static_cast<int>(80 / step); ++k)
            t.line(step, slope * step * std::sin(0.3 * k * step));
        t.turn(row % 2 == 0 ? 90 : -90), t.line(0.6), t.turn(row % 2 == 0 ? 90 : -90);
    });
}

std::string plunges(double blend) {
    return repeated(15, Turtle(blend, 3000), [&](Turtle& t, int) {
        t.rapid(0, -9), t.line(0, -8), t.line(20);
        t.rapid(0, 17), t.turn(50), t.rapid(30);
    });
}

std::string zigzag_down(double blend) {
    return repeated(40, Turtle(blend, 3000), [](Turtle& t, int) { t.line(12, -0.8), t.turn(180); });
}

std::string rising_into_arcs(double blend, double rise) {
    return repeated(40, Turtle(blend), [&](Turtle& t, int i) {
        t.line(8, i % 2 == 0 ? rise : -rise);
        t.arc(20, 20);
    });
}

std::string rapids(double blend) {
    return repeated(24, Turtle(blend),
                    [](Turtle& t, int i) { t.turn(75), t.rapid(40, i % 2 == 0 ? 8 : -8); });
}

struct Piece {
    const char* name;
    bool alike;  ///< the axes
    std::function<std::string()> text;
    double seconds;  ///< in LinuxCNC
};

Machine machine_of(const Piece& piece) {
    Machine m;
    m.rapid_feed = 12000, m.acceleration = 1000, m.tool_change_s = 0;
    if (!piece.alike) m.rapid_y = 9000, m.rapid_z = 2400, m.acceleration_y = 600, m.acceleration_z = 250;
    return m;
}

const Piece kPieces[] = {
    {"line", true, [] { return lines(0.02, 1000, 30, false); }, 12.25},
    {"straight", true, [] { return lines(0.02, 8, 0, false); }, 12.31},
    {"turns_3", true, [] { return lines(0.02, 8, 3, false); }, 7.48},
    {"turns_12", true, [] { return lines(0.1, 8, 12, false); }, 8.41},
    {"turns_30", true, [] { return lines(0.02, 8, 30, true); }, 23.63},
    {"turns_90", true, [] { return lines(0.1, 8, 90, true); }, 25.56},
    {"back", true, [] { return lines(0.1, 20, 180, false); }, 14.35},
    {"short_2", true, [] { return lines(0.02, 0.4, 2, true); }, 15.72},
    {"short_20", true, [] { return lines(0.02, 0.4, 20, true); }, 37.09},
    {"line_arc_0", true, [] { return lines_and_arcs(0.02, 0); }, 7.66},
    {"arcs_003", true, [] { return arcs(0.02, 0.03, false); }, 6.85},
    {"line_arc_2", true, [] { return lines_and_arcs(0.02, 2); }, 8.84},
    {"line_arc_12", true, [] { return lines_and_arcs(0.1, 12); }, 11.94},
    {"line_arc_away_2", true, [] { return lines_and_arcs(0.1, -2); }, 7.43},
    {"line_arc_away_12", true, [] { return lines_and_arcs(0.02, -12); }, 14.73},
    {"arcs_0", true, [] { return arcs(0.02, 0, false); }, 6.36},
    {"arcs_2", true, [] { return arcs(0.02, 2, false); }, 9.05},
    {"arcs_away_2", true, [] { return arcs(0.1, -2, false); }, 6.78},
    {"arcs_away_12", true, [] { return arcs(0.02, -12, false); }, 11.09},
    {"s_0", true, [] { return arcs(0.02, 0, true); }, 10.20},
    {"s_3", true, [] { return arcs(0.02, 3, true); }, 11.92},
    {"s_12", true, [] { return arcs(0.1, -12, true); }, 13.76},
    {"rising_into_arcs", true, [] { return rising_into_arcs(0.1, 2); }, 16.99},
    {"raster", true, [] { return raster(0.02, 80, 0); }, 8.99},
    {"raster_waves", true, [] { return raster(0.02, 0.5, 0.7); }, 11.27},
    {"zigzag_down", true, [] { return zigzag_down(0.02); }, 12.24},
    {"plunges", true, [] { return plunges(0.1); }, 21.89},
    {"rapids", true, [] { return rapids(0.1); }, 9.24},
    {"turns_30", false, [] { return lines(0.02, 8, 30, false); }, 22.24},
    {"line_arc_2", false, [] { return lines_and_arcs(0.1, 2); }, 9.90},
    {"raster_waves", false, [] { return raster(0.02, 0.5, 0.7); }, 20.81},
    {"zigzag_down", false, [] { return zigzag_down(0.02); }, 13.06},
    {"plunges", false, [] { return plunges(0.1); }, 34.12},
    {"rapids", false, [] { return rapids(0.1); }, 10.86},
};

}  // namespace

TEST(MotionPieces, TakeAsLongAsInLinuxCnc) {
    const char* folder = std::getenv("SLABWRIGHT_PIECES");
    for (const Piece& piece : kPieces) {
        const std::string text = piece.text(), kind = piece.alike ? "alike" : "unlike";
        const Machine m = machine_of(piece);
        if (folder) {
            const std::filesystem::path where = std::filesystem::path(folder) / kind;
            std::filesystem::create_directories(where);
            std::ofstream(where / piece.name) << text;
            if (!piece.alike)
                std::ofstream(where.string() + ".json") << fmt::format(
                    R"({{"rapid_y": {}, "rapid_z": {}, "acceleration_y": {}, "acceleration_z": {}}})",
                    m.rapid_y, m.rapid_z, m.acceleration_y, m.acceleration_z);
        }
        const double said = program_seconds(read_gcode(text, piece.name), m);
        EXPECT_NEAR(said, piece.seconds, 0.03 * piece.seconds) << kind << '/' << piece.name;
    }
}
