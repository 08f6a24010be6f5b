// How much of a plan's feed motion cuts nothing, and how much meets more than cutting.max_engagement: an
// independent replay of the emitted text on a grid of heights. It shares no code with planner or proof: it
// reads LinuxCNC's words itself and knows flat, face and ball cutters.
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

/// What a cutter met at one place.
struct Met {
    bool any = false;
    double width = 0;  ///< across its way, of its diameter: from the first to the last cell that stood well
                       ///< above its tip
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

    /// Takes away what the cutter meets that came from `from` on a straight way, of which the same cutter has
    /// taken all there.
    Met cut(const Place& from, const Place& tip, double radius, bool ball) {
        const double run = std::hypot(tip.x - from.x, tip.y - from.y);
        Front front{.across_x = run > 0 ? -(tip.y - from.y) / run : 0,
                    .across_y = run > 0 ? (tip.x - from.x) / run : 0};
        const bool level = !ball && tip.z == from.z;
        const int j0 = std::max(0, row(tip.y - radius)), j1 = std::min(ny_ - 1, row(tip.y + radius) + 1);
        for (int j = j0; j <= j1; ++j) {
            const double y = y0_ + (j + 0.5) * cell_;
            const auto [i0, i1] = span(tip, y, radius);
            const auto [k0, k1] = level ? span(from, y, radius) : std::pair{0, -1};
            if (k0 > k1) {
                cut_row(tip, y, j, i0, i1, radius, ball, front);
                continue;
            }
            cut_row(tip, y, j, i0, std::min(i1, k0 - 1), radius, ball, front);
            cut_row(tip, y, j, std::max(i0, k1 + 1), i1, radius, ball, front);
        }
        return {front.met, front.low > front.high ? 0 : (front.high - front.low + cell_) / (2 * radius)};
    }

private:
    static constexpr double kStands = 0.2;  // mm: less is no width
    struct Front {
        double across_x = 0, across_y = 0;
        bool met = false;
        double low = 1e9, high = -1e9;  // mm across the way
    };
    [[nodiscard]] int row(double y) const { return static_cast<int>(std::floor((y - y0_) / cell_)); }
    /// The columns whose middles lie within the cutter's circle, on the slab.
    [[nodiscard]] std::pair<int, int> span(const Place& tip, double y, double radius) const {
        const double wide2 = radius * radius - (y - tip.y) * (y - tip.y);
        if (wide2 <= 0) return {0, -1};
        const double wide = std::sqrt(wide2);
        return {std::max(0, static_cast<int>(std::ceil((tip.x - wide - x0_) / cell_ - 0.5))),
                std::min(nx_ - 1, static_cast<int>(std::floor((tip.x + wide - x0_) / cell_ - 0.5)))};
    }
    void cut_row(const Place& tip, double y, int j, int i0, int i1, double radius, bool ball, Front& front) {
        float* const at = height_.data() + static_cast<std::size_t>(j) * static_cast<std::size_t>(nx_);
        const double dy = y - tip.y;
        for (int i = i0; i <= i1; ++i) {
            const double dx = x0_ + (i + 0.5) * cell_ - tip.x;
            const double left2 = std::max(0.0, radius * radius - dx * dx - dy * dy);
            const auto low = static_cast<float>(ball ? tip.z + radius - std::sqrt(left2) : tip.z);
            if (at[i] <= low) continue;
            front.met = front.met || at[i] - low > kLowers;
            if (at[i] - low > kStands) {
                const double across = dx * front.across_x + dy * front.across_y;
                front.low = std::min(front.low, across), front.high = std::max(front.high, across);
            }
            at[i] = low;
        }
    }
    double x0_, y0_, cell_;
    int nx_, ny_;
    std::vector<float> height_;
};

struct Ways {
    double feed = 0, air = 0, wide = 0;   // mm
    double minutes = 0, air_minutes = 0;  // at the feed that is commanded
    void add(const Ways& w) {
        feed += w.feed, air += w.air, wide += w.wide;
        minutes += w.minutes, air_minutes += w.air_minutes;
    }
};

/// A program's motions, modal words and all.
class Replay {
public:
    /// @param most of the cutter's diameter: where it meets more, the way counts as wide
    Replay(Wood& wood, double radius, bool ball, double cell, double most)
        : wood_(wood), radius_(radius), ball_(ball), step_(cell), most_(most + cell / radius) {}

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
        if (words.contains('F')) feed_ = words['F'];
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
        Place from = at_;
        for (int k = 1; k <= steps; ++k) {
            const Place to = place(static_cast<double>(k) / steps);
            const Met met = wood_.cut(from, to, radius_, ball_);
            if (!met.any) ways_.air += length / steps, ways_.air_minutes += length / steps / feed_;
            if (met.width > most_) ways_.wide += length / steps;
            from = to;
        }
        ways_.feed += length;
        ways_.minutes += length / feed_;
    }

    Wood& wood_;
    double radius_;
    bool ball_;
    double step_, most_;
    int motion_ = 0;
    double feed_ = 1;  // mm/min; a program says one before it cuts
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
    const double most = plan.at("job").at("cutting").at("max_engagement");
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
                Replay(wood, tool.at("diameter").get<double>() / 2, tool.at("kind") == "ball", cell, most)
                    .run(text);
            const std::string kind = op.at("kind");
            kinds[kind].add(ways);
            kinds[kind + ": " + op.at("purpose").get<std::string>()].add(ways);
            all.add(ways);
        }
    }
    std::printf(
        "| operations | feed, m | in air, m | in air | of the time | wider than %.2f "
        "|\n|---|---|---|---|---|---|\n",
        most);
    kinds["all"] = all;
    for (const auto& [kind, ways] : kinds)
        if (ways.feed > 0)
            std::printf("| %s | %.1f | %.1f | %.1f %% | %.1f %% | %.1f %% |\n", kind.c_str(),
                        ways.feed / 1000, ways.air / 1000, 100 * ways.air / ways.feed,
                        100 * ways.air_minutes / ways.minutes, 100 * ways.wide / ways.feed);
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
