#include "io/write/bond_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include "kernels/statistics/distributions.h"

namespace slabwright {

namespace {

constexpr int kAcross = 3;  ///< plots beside each other
constexpr double kPlotWidth = 320, kPlotHeight = 240;
constexpr double kLeft = 60, kTop = 30, kWide = 230, kHigh = 150;  ///< of what is within the axes

constexpr std::array<const char*, 6> kColours{"#06c", "#c00", "#080", "#a60", "#808", "#444"};

struct Line {
    std::string name;  ///< "": none is told
    std::vector<std::array<double, 2>> points;
    bool joined = true;  ///< or dots alone
};

struct Plot {
    std::string title, x_name, y_name;
    std::vector<std::pair<double, std::string>> x_marks;  ///< none: those of the ends
    std::vector<Line> lines;
    double level = 0;  ///< where a dashed line lies
};

std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text) {
        if (c == '<') out += "&lt;";
        else if (c == '&') out += "&amp;";
        else if (c == '"') out += "&quot;";
        else out += c;
    }
    return out;
}

/// From the least to the greatest, a little wider.
std::array<double, 2> range_of(const Plot& plot, std::size_t axis) {
    double low = 1e300, high = -1e300;
    for (const Line& line : plot.lines)
        for (const auto& p : line.points) low = std::min(low, p[axis]), high = std::max(high, p[axis]);
    if (axis == 1) low = std::min(low, plot.level), high = std::max(high, plot.level);
    const double more = high > low ? 0.08 * (high - low) : 1;
    return {low - more, high + more};
}

void append_plot(std::string& svg, const Plot& plot, std::size_t at) {
    const std::array<double, 2> xs = range_of(plot, 0), ys = range_of(plot, 1);
    const auto px = [&](double x) { return kLeft + kWide * (x - xs[0]) / (xs[1] - xs[0]); };
    const auto py = [&](double y) { return kTop + kHigh * (ys[1] - y) / (ys[1] - ys[0]); };
    const auto text = [&](double x, double y, const char* anchor, const std::string& words) {
        svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", x, y, anchor,
                           escaped(words));
    };
    const std::size_t row = at / kAcross, column = at % kAcross;
    svg += fmt::format("<g transform=\"translate({} {})\">\n", kPlotWidth * double(column),
                       kPlotHeight * double(row));
    svg += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#888\"/>\n",
                       kLeft, kTop, kWide, kHigh);
    text(kLeft + kWide / 2, kTop - 10, "middle", plot.title);
    text(kLeft + kWide / 2, kTop + kHigh + 34, "middle", plot.x_name);
    for (const double y : {ys[0], (ys[0] + ys[1]) / 2, ys[1]})
        text(kLeft - 5, py(y) + 4, "end", fmt::format("{:.4g}", std::abs(y) < 1e-9 * ys[1] ? 0 : y));
    auto marks = plot.x_marks;
    if (marks.empty())
        for (const double x : xs) marks.emplace_back(x, fmt::format("{:.4g}", x));
    for (const auto& [x, words] : marks) text(px(x), kTop + kHigh + 16, "middle", words);
    svg += fmt::format("<path d=\"M{:.1f} {:.1f}H{:.1f}\" stroke=\"#888\" stroke-dasharray=\"4\"/>\n", kLeft,
                       py(plot.level), kLeft + kWide);
    for (std::size_t i = 0; i < plot.lines.size(); ++i) {
        const Line& line = plot.lines[i];
        const char* colour = kColours[i % kColours.size()];
        if (line.joined) {
            std::string d;
            for (const auto& p : line.points)
                d += fmt::format("{}{:.1f} {:.1f}", d.empty() ? "M" : "L", px(p[0]), py(p[1]));
            svg += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\"/>\n", d, colour);
        }
        for (const auto& p : line.points)
            svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"/>\n", px(p[0]),
                               py(p[1]), colour);
        if (line.name.empty()) continue;
        svg += fmt::format("<g fill=\"{}\">", colour);
        text(kLeft + 5, kTop + 13 + 12 * double(i), "start", line.name);
        svg += "</g>\n";
    }
    svg += "</g>\n";
}

double mean_of(const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// The mean strength at each level of a factor, of the rows that a filter lets pass.
template <class Passes>
Line means_by_level(const BondTests& tests, std::size_t factor, const Passes& passes) {
    std::map<int, std::vector<double>> by_level;
    for (std::size_t r = 0; r < tests.strength.size(); ++r)
        if (passes(r)) by_level[tests.levels[r][factor]].push_back(tests.strength[r]);
    Line line;
    for (const auto& [level, strengths] : by_level)
        line.points.push_back({double(level), mean_of(strengths)});
    return line;
}

Plot plot_by_level(const BondTests& tests, std::size_t factor, std::string title) {
    Plot plot{std::move(title), tests.factors[factor].name, tests.strength_name, {}, {}, {}};
    for (std::size_t l = 0; l < tests.factors[factor].levels.size(); ++l)
        plot.x_marks.emplace_back(double(l), tests.factors[factor].levels[l]);
    plot.level = mean_of(tests.strength);
    return plot;
}

std::vector<Plot> effects(const BondTests& tests) {
    std::vector<Plot> plots;
    const std::size_t n = tests.factors.size();
    for (std::size_t f = 0; f < n; ++f) {
        plots.push_back(plot_by_level(tests, f, tests.strength_name + " by " + tests.factors[f].name));
        plots.back().lines.push_back(means_by_level(tests, f, [](std::size_t) { return true; }));
    }
    for (std::size_t f = 0; f < n; ++f)
        for (std::size_t g = f + 1; g < n; ++g) {
            const BondFactor& other = tests.factors[g];
            plots.push_back(plot_by_level(tests, f, tests.factors[f].name + " and " + other.name));
            for (std::size_t l = 0; l < other.levels.size(); ++l) {
                plots.back().lines.push_back(means_by_level(
                    tests, f, [&](std::size_t r) { return tests.levels[r][g] == static_cast<int>(l); }));
                plots.back().lines.back().name = other.name + " " + other.levels[l];
            }
        }
    return plots;
}

/// Of every row what is foretold.
std::vector<double> fitted(const BondTests& tests, const BondStudy& study) {
    std::vector<double> values;
    for (const std::vector<int>& levels : tests.levels) {
        if (study.regression.made) {
            std::vector<double> coded;
            for (std::size_t f = 0; f < levels.size(); ++f)
                coded.push_back(tests.factors[f].coded[static_cast<std::size_t>(levels[f])]);
            values.push_back(predicted(study.regression, coded));
        } else {
            const auto cell = std::find_if(study.cells.begin(), study.cells.end(),
                                           [&](const BondCell& c) { return c.levels == levels; });
            values.push_back(cell->mean);
        }
    }
    return values;
}

std::vector<Plot> residuals(const BondTests& tests, const BondStudy& study) {
    const std::vector<double> values = fitted(tests, study);
    const std::string by = study.regression.made ? "regression" : "means";
    std::vector<Plot> plots{{"left by the " + by, "foretold", "left", {}, {{"", {}, false}}, 0},
                            {"left, in the order of the rows", "row", "left", {}, {{"", {}, false}}, 0},
                            {"left, and a normal distribution", "left", "normal", {}, {{"", {}, false}}, 0}};
    std::vector<double> left;
    for (std::size_t r = 0; r < values.size(); ++r) {
        left.push_back(tests.strength[r] - values[r]);
        plots[0].lines[0].points.push_back({values[r], left[r]});
        plots[1].lines[0].points.push_back({double(r + 1), left[r]});
    }
    std::sort(left.begin(), left.end());
    for (std::size_t i = 0; i < left.size(); ++i)  // Blom's places
        plots[2].lines[0].points.push_back(
            {left[i], normal_quantile((double(i) + 0.625) / (double(left.size()) + 0.25))});
    return plots;
}

}  // namespace

std::string bond_plots_svg(const BondTests& tests, const BondStudy& study) {
    std::vector<Plot> plots = effects(tests);
    for (Plot& plot : residuals(tests, study)) plots.push_back(std::move(plot));
    const std::size_t rows = (plots.size() + kAcross - 1) / kAcross;
    std::string svg = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
        "font-family=\"sans-serif\" font-size=\"11\">\n<rect width=\"{0}\" height=\"{1}\" "
        "fill=\"#fff\"/>\n",
        kAcross * kPlotWidth, double(rows) * kPlotHeight);
    for (std::size_t i = 0; i < plots.size(); ++i) append_plot(svg, plots[i], i);
    return svg + "</svg>\n";
}

}  // namespace slabwright
