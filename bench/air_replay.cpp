// How much of a plan's feed motion cuts nothing: an independent replay of the emitted text on a grid of
// heights. It shares no code with planner or proof: it reads LinuxCNC's words itself and knows flat, face and
// ball cutters.
//     air_replay OUT [CELL_MM]        Markdown, a row for each kind of operation and each purpose
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace {

using Json = nlohmann::json;

constexpr double kLowers = 1e-3;  // mm: what takes off less cuts nothing

struct Place {
    double x = 0, y = 0, z = 0;
};

/// The slab of one layer, by the heights that stand at the middles of cells.
class Wood {
public:
    Wood(double x0, double y0, double x1, double y1, double cell, float top)
        : x0_(x0),
          y0_(y0),
          cell_(cell),
          nx_(static_cast<int>(std::ceil((x1 - x0) / cell))),
          ny_(static_cast<int>(std::ceil((y1 - y0) / cell))),
          height_(static_cast<std::size_t>(nx_) * static_cast<std::size_t>(ny_), top) {}

    /// Takes away what the cutter meets; whether there was anything.
    bool cut(const Place& tip, double radius, bool ball) {
        bool met = false;
        const int j0 = row(tip.y - radius), j1 = row(tip.y + radius) + 1;
        for (int j = std::max(0, j0); j <= std::min(ny_ - 1, j1); ++j) {
            const double dy = y0_ + (j + 0.5) * cell_ - tip.y, wide2 = radius * radius - dy * dy;
            if (wide2 <= 0) continue;
            const double wide = std::sqrt(wide2);
            const int i0 = std::max(0, column(tip.x - wide)),
                      i1 = std::min(nx_ - 1, column(tip.x + wide) + 1);
            float* at = height_.data() + static_cast<std::size_t>(j) * static_cast<std::size_t>(nx_);
            for (int i = i0; i <= i1; ++i) {
                const double dx = x0_ + (i + 0.5) * cell_ - tip.x, left2 = wide2 - dx * dx;
                if (left2 <= 0) continue;
                const auto low = static_cast<float>(ball ? tip.z + radius - std::sqrt(left2) : tip.z);
                if (at[i] <= low) continue;
                met = met || at[i] - low > kLowers;
                at[i] = low;
            }
        }
        return met;
    }

private:
    [[nodiscard]] int row(double y) const { return static_cast<int>(std::floor((y - y0_) / cell_)); }
    [[nodiscard]] int column(double x) const { return static_cast<int>(std::floor((x - x0_) / cell_)); }
    double x0_, y0_, cell_;
    int nx_, ny_;
    std::vector<float> height_;
};

struct Ways {
    double feed = 0, air = 0;  // mm
    void add(const Ways& w) { feed += w.feed, air += w.air; }
};

/// A program's motions, modal words and all.
class Replay {
public:
    Replay(Wood& wood, double radius, bool ball, double cell)
        : wood_(wood), radius_(radius), ball_(ball), step_(cell) {}

    Ways run(std::istream& text) {
        std::string line;
        while (std::getline(text, line)) block(line);
        return ways_;
    }

private:
    void block(const std::string& line) {
        std::map<char, double> words;
        bool other = false;  // G codes with axis words that move nothing
        for (std::size_t k = 0; k < line.size();) {
            if (line[k] == '(') {
                k = line.find(')', k);
                if (k == std::string::npos) return;
                ++k;
            } else if (std::isalpha(static_cast<unsigned char>(line[k])) != 0) {
                char* end = nullptr;
                const double value = std::strtod(line.c_str() + k + 1, &end);
                const char letter = line[k];
                k = static_cast<std::size_t>(end - line.c_str());
                if (letter != 'G') words[letter] = value;
                else if (value >= 0 && value <= 3 && value == std::floor(value))
                    motion_ = static_cast<int>(value);
                else if (value == 4 || value == 53 || value == 43) other = true;
            } else ++k;
        }
        if (other || !(words.contains('X') || words.contains('Y') || words.contains('Z'))) return;
        Place to = at_;
        if (words.contains('X')) to.x = words['X'];
        if (words.contains('Y')) to.y = words['Y'];
        if (words.contains('Z')) to.z = words['Z'];
        if (motion_ == 1) straight(to);
        else if (motion_ > 1) arc(to, at_.x + words['I'], at_.y + words['J'], motion_ == 3);
        at_ = to;
    }
    void straight(const Place& to) {
        const double length = std::hypot(to.x - at_.x, to.y - at_.y, to.z - at_.z);
        along(length, [&](double s) {
            return Place{at_.x + s * (to.x - at_.x), at_.y + s * (to.y - at_.y), at_.z + s * (to.z - at_.z)};
        });
    }
    void arc(const Place& to, double cx, double cy, bool left) {
        const double radius = std::hypot(at_.x - cx, at_.y - cy);
        const double from = std::atan2(at_.y - cy, at_.x - cx);
        double turn = std::atan2(to.y - cy, to.x - cx) - from;
        constexpr double whole = 2 * std::numbers::pi, closed = 1e-9;
        if (left && turn <= closed) turn += whole;
        if (!left && turn >= -closed) turn -= whole;
        along(std::hypot(radius * turn, to.z - at_.z), [&](double s) {
            return Place{cx + radius * std::cos(from + s * turn), cy + radius * std::sin(from + s * turn),
                         at_.z + s * (to.z - at_.z)};
        });
    }
    template <class At>
    void along(double length, const At& place) {
        const int steps = std::max(1, static_cast<int>(std::ceil(length / step_)));
        for (int k = 1; k <= steps; ++k)
            if (!wood_.cut(place(static_cast<double>(k) / steps), radius_, ball_))
                ways_.air += length / steps;
        ways_.feed += length;
    }

    Wood& wood_;
    double radius_;
    bool ball_;
    double step_;
    int motion_ = 0;
    Place at_;
    Ways ways_;
};

int print(const std::string& out, double cell) {
    const Json plan = Json::parse(std::ifstream(out + "/plan.json"));
    const Json& machine = plan.at("job").at("machine");
    if (machine.at("post") != "linuxcnc" || machine.at("units") != "mm" ||
        machine.value("programs", "operation") != "operation")
        throw std::runtime_error("only LinuxCNC's programs in mm, one for each operation, are read");
    const double zero_x = plan.at("zero").at(0), zero_y = plan.at("zero").at(1);
    const bool from_top = plan.at("frame") == "layer-top";
    std::map<int, Json> tools;
    for (const Json& tool : plan.at("tools")) tools[tool.at("number").get<int>()] = tool;
    std::map<std::string, Ways> kinds;
    Ways all;
    for (const Json& layer : plan.at("layers")) {
        const double bottom = layer.at("z_bottom"), origin = from_top ? layer.at("z_top").get<double>() : 0;
        const Json &low = layer.at("blank").at("min"), &high = layer.at("blank").at("max");
        Wood wood(low.at(0).get<double>() - zero_x, low.at(1).get<double>() - zero_y,
                  high.at(0).get<double>() - zero_x, high.at(1).get<double>() - zero_y, cell,
                  static_cast<float>(bottom + layer.at("slab_thickness").get<double>() - origin));
        for (const Json& op : layer.at("operations")) {
            const Json& tool = tools.at(op.at("tool").get<int>());
            const std::string shape = tool.at("kind");
            if (shape != "flat" && shape != "face" && shape != "ball")
                throw std::runtime_error("cutters other than flat, face and ball are not known: " + shape);
            std::ifstream text(out + "/" + op.at("file").get<std::string>());
            if (!text) {
                std::fprintf(stderr, "air_replay: no %s\n", op.at("file").get<std::string>().c_str());
                return 2;
            }
            const Ways ways =
                Replay(wood, tool.at("diameter").get<double>() / 2, tool.at("kind") == "ball", cell)
                    .run(text);
            const std::string kind = op.at("kind");
            kinds[kind].add(ways);
            kinds[kind + ": " + op.at("purpose").get<std::string>()].add(ways);
            all.add(ways);
        }
    }
    std::printf("| operations | feed, m | in air, m | in air |\n|---|---|---|---|\n");
    kinds["all"] = all;
    for (const auto& [kind, ways] : kinds)
        if (ways.feed > 0)
            std::printf("| %s | %.1f | %.1f | %.1f %% |\n", kind.c_str(), ways.feed / 1000, ways.air / 1000,
                        100 * ways.air / ways.feed);
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 2) {
        std::fprintf(stderr, "usage: air_replay OUT [CELL_MM]\n");
        return 2;
    }
    try {
        return print(argv[1], argc > 2 ? std::atof(argv[2]) : 0.1);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "air_replay: %s\n", e.what());
        return 1;
    }
}
