#include "io/read/cut_list_check.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>

#include <fmt/format.h>

namespace slabwright {

namespace {

constexpr double kNear = 2e-4;  // mm: places are told to 0.1 µm
constexpr std::string_view kHead =
    "kind,board,thickness_mm,name,layer,slab,length_mm,width_mm,x_mm,y_mm,turned";
constexpr std::size_t kColumns = 11;

/// What lies on a board, mm from its corner.
struct Part {
    double x = 0, y = 0, length = 0, width = 0;
};

bool same(double a, double b) { return std::abs(a - b) <= kNear; }

class CutListFollower {
public:
    explicit CutListFollower(const BuildPlan& build) : build_(build) {
        for (const LayerToBuild& layer : build.layers)
            for (int k = 1; k <= layer.slabs; ++k)
                due_[{layer.index, k}] = {layer.slab_thickness / layer.slabs,
                                          layer.blank.value_or(Blank{build.stock_min, build.stock_max})};
        if (build.job_stated && build.job.machine.base_board_thickness > 0)
            due_[{0, 0}] = {build.job.machine.base_board_thickness, {build.stock_min, build.stock_max}};
    }

    std::vector<Violation> run(std::string_view text) {
        for (std::size_t at = 0; at < text.size() && !lost_;) {
            const std::size_t end = std::min(text.find('\n', at), text.size());
            ++line_;
            follow(text.substr(at, end - at));
            at = end + 1;
        }
        if (lost_) return std::move(found_);
        end_board();
        line_ = 0;
        for (const auto& [which, slab] : due_)
            if (!slab.sawn) complain("cut_list.piece", fmt::format("{} is never sawn", words(which)));
        return std::move(found_);
    }

private:
    using Which = std::pair<int, int>;  // layer and slab
    struct Due {
        double thickness = 0;
        Blank blank{};
        bool sawn = false;
    };

    static std::string words(const Which& which) {
        if (which.first == 0) return "the base board";
        return fmt::format("slab {} of layer {}", which.second, which.first);
    }
    void complain(const char* code, const std::string& message) {
        found_.push_back({code, message, "cut_list.csv", line_, {}, 0});
    }
    void lose(const std::string& message) {
        complain("cut_list.unreadable", message);
        lost_ = true;
    }

    void follow(std::string_view line) {
        if (line_ == 1) {
            if (line != kHead) lose("the first line does not name the columns");
            return;
        }
        std::array<std::string_view, kColumns> cells;
        std::size_t count = 0;
        for (std::size_t at = 0; at <= line.size(); ++count) {
            const std::size_t end = std::min(line.find(',', at), line.size());
            if (count < kColumns) cells[count] = line.substr(at, end - at);
            at = end + 1;
        }
        if (count != kColumns) return lose(fmt::format("has {} cells, not {}", count, kColumns));
        const std::optional<double> thickness = number(cells[2]), length = number(cells[6]),
                                    width = number(cells[7]), x = number(cells[8]), y = number(cells[9]);
        if (!thickness || !length || !width || !x || !y) return lose("has a cell that is no number");
        const Part place{*x, *y, *length, *width};
        const bool is_nest = cells[0] == "nest", is_board = is_nest || cells[0] == "board";
        if (!is_board && !same(*thickness, thickness_))
            complain("cut_list.piece",
                     fmt::format("is of {:g} mm on a board of {:g} mm", *thickness, thickness_));
        if (is_board) {
            end_board();
            begin_board(place, *thickness, is_nest);
        } else if (cells[0] == "cut") cut(place);
        else if (cells[0] == "piece") piece(place, cells);
        else if (cells[0] == "offcut") take(place);
        else lose(fmt::format("says {}, which is none of its words", std::string(cells[0])));
    }

    void begin_board(const Part& board, double thickness, bool is_nest) {
        if (build_.job_stated && is_nest != (build_.job.slabs.layout == BoardLayout::nested))
            complain("cut_list.cut", is_nest ? "slabs are milled out of this board; the job's are sawn"
                                             : "this board is sawn; the job's slabs are milled out");
        is_nest_ = is_nest;
        board_ = board;
        parts_.clear();
        if (!is_nest) parts_ = {board};
        thickness_ = thickness;
    }

    /// All that the cuts leave of a board has been named.
    void end_board() {
        if (is_nest_) return;  // what is milled out leaves a frame
        for (const Part& p : parts_)
            complain("cut_list.piece",
                     fmt::format("{:.1f} x {:.1f} mm at x {:.1f} y {:.1f} of the board before it is neither "
                                 "piece nor offcut",
                                 p.length, p.width, p.x, p.y));
    }

    static std::optional<double> number(std::string_view cell) {
        double value = 0;
        const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
        if (error != std::errc{} || end != cell.data() + cell.size() || !(std::abs(value) < 1e6)) return {};
        return value;
    }
    static int whole(std::string_view cell) {
        int value = 0;
        const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
        return error == std::errc{} && end == cell.data() + cell.size() ? value : 0;
    }

    /// The part that holds a place; none where it lies on no part, or on several.
    std::vector<Part>::iterator part_around(const Part& place) {
        return std::find_if(parts_.begin(), parts_.end(), [&](const Part& p) {
            return place.x >= p.x - kNear && place.y >= p.y - kNear &&
                   place.x + place.length <= p.x + p.length + kNear &&
                   place.y + place.width <= p.y + p.width + kNear;
        });
    }

    void cut(const Part& saw) {
        if (is_nest_) return complain("cut_list.cut", "is a saw's, in a board that slabs are milled out of");
        const auto part = part_around(saw);
        if (part == parts_.end()) return complain("cut_list.cut", "lies on no part that is still whole");
        const Part p = *part;
        const bool along_y = same(saw.width, p.width), along_x = same(saw.length, p.length);
        if (!along_x && !along_y)
            return complain("cut_list.cut", "does not go from edge to edge of what it cuts");
        parts_.erase(part);
        if (along_y) {
            parts_.push_back({p.x, p.y, saw.x - p.x, p.width});
            const double end = saw.x + saw.length;
            parts_.push_back({end, p.y, p.x + p.length - end, p.width});
        } else {
            parts_.push_back({p.x, p.y, p.length, saw.y - p.y});
            const double end = saw.y + saw.width;
            parts_.push_back({p.x, end, p.length, p.y + p.width - end});
        }
        std::erase_if(parts_, [](const Part& r) { return r.length <= kNear || r.width <= kNear; });
    }

    /// Milled out of a nested board, on it and a kerf from all before.
    void mill(const Part& place) {
        const double kerf = build_.job_stated ? build_.job.slabs.kerf : 0;
        if (place.x < board_.x - kNear || place.y < board_.y - kNear ||
            place.x + place.length > board_.x + board_.length + kNear ||
            place.y + place.width > board_.y + board_.width + kNear)
            complain("cut_list.piece", "does not lie on its board");
        for (const Part& p : parts_) {
            const double apart = std::max({place.x - p.x - p.length, p.x - place.x - place.length,
                                           place.y - p.y - p.width, p.y - place.y - place.width});
            if (apart >= kerf - kNear) continue;
            complain("cut_list.piece", fmt::format("lies {:.1f} mm from what is at x {:.1f} y {:.1f}; the "
                                                   "cutter takes {:g} mm",
                                                   apart, p.x, p.y, kerf));
            break;
        }
        parts_.push_back(place);
    }

    void take(const Part& place) {
        if (is_nest_) return mill(place);
        const auto part = part_around(place);
        if (part == parts_.end() || !same(part->length, place.length) || !same(part->width, place.width))
            complain("cut_list.piece", "is no part that the cuts leave");
        else parts_.erase(part);
    }

    void piece(const Part& place, const std::array<std::string_view, kColumns>& cells) {
        take(place);
        const Which which{whole(cells[4]), whole(cells[5])};
        const auto due = due_.find(which);
        if (due == due_.end()) {
            if (which.first != 0 || build_.job_stated)
                complain("cut_list.piece", fmt::format("the plan has no {}", words(which)));
            return;
        }
        Due& slab = due->second;
        if (slab.sawn) complain("cut_list.piece", fmt::format("{} is sawn a second time", words(which)));
        slab.sawn = true;
        const bool turned = cells[10] == "yes";
        const double length = turned ? place.width : place.length,
                     width = turned ? place.length : place.width;
        if (!same(length, slab.blank.length()) || !same(width, slab.blank.width()))
            complain("cut_list.piece",
                     fmt::format("{} is sawn {:.3f} x {:.3f} mm; the plan lays {:.3f} x {:.3f} mm",
                                 words(which), length, width, slab.blank.length(), slab.blank.width()));
        if (!same(thickness_, slab.thickness))
            complain("cut_list.piece", fmt::format("{} is sawn from {:.3f} mm; the plan lays {:.3f} mm",
                                                   words(which), thickness_, slab.thickness));
    }

    const BuildPlan& build_;
    std::map<Which, Due> due_;
    std::vector<Part> parts_;  // of the board at hand: what is left, or milled out where it is a nest
    Part board_{};
    double thickness_ = 0;  // of it
    bool is_nest_ = false;
    std::uint32_t line_ = 0;
    bool lost_ = false;
    std::vector<Violation> found_;
};

}  // namespace

std::vector<Violation> check_cut_list(std::string_view text, const BuildPlan& build) {
    return CutListFollower(build).run(text);
}

}  // namespace slabwright
