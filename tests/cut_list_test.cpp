// Slabs on boards: a panel saw can part them, or a cutter can mill them out; nothing is lost, and a price is
// reckoned only where one is stated.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "engine/schedule/cut_list.h"
#include "engine/schedule/nested_boards.h"
#include "io/read/cut_list_check.h"
#include "io/write/cut_list_files.h"
#include "io/write/wood_json.h"
#include "kernels/errors.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

constexpr double kSame = 1e-6;

bool overlap(const SawnRectangle& a, const SawnRectangle& b) {
    return a.x < b.x + b.length - kSame && b.x < a.x + a.length - kSame && a.y < b.y + b.width - kSame &&
           b.y < a.y + a.width - kSame;
}

/// Makes the cuts one after another on a board that is one part at first. @return what is wrong; "" when each
/// goes across the whole of one part
std::string sawn_wrong(const SawnBoard& board, const SawnSize& size, std::vector<SawnRectangle>& parts) {
    parts = {{0, 0, size.length, size.width}};
    for (const SawnRectangle& cut : board.cuts) {
        const auto part = std::find_if(parts.begin(), parts.end(), [&](const SawnRectangle& p) {
            return cut.x >= p.x - kSame && cut.y >= p.y - kSame &&
                   cut.x + cut.length <= p.x + p.length + kSame && cut.y + cut.width <= p.y + p.width + kSame;
        });
        if (part == parts.end()) return "a cut lies on no part";
        const SawnRectangle p = *part;
        parts.erase(part);
        if (std::abs(cut.width - p.width) < kSame) {  // along y
            parts.push_back({p.x, p.y, cut.x - p.x, p.width});
            parts.push_back({cut.x + cut.length, p.y, p.x + p.length - cut.x - cut.length, p.width});
        } else if (std::abs(cut.length - p.length) < kSame) {
            parts.push_back({p.x, p.y, p.length, cut.y - p.y});
            parts.push_back({p.x, cut.y + cut.width, p.length, p.y + p.width - cut.y - cut.width});
        } else return "a cut does not go from edge to edge";
        std::erase_if(parts, [](const SawnRectangle& r) { return r.length < kSame || r.width < kSame; });
    }
    return "";
}

/// All that a layout has to keep.
void check(const std::vector<SawnBoard>& boards, std::span<const SawnSize> pieces, const SawnSize& size,
           double kerf) {
    std::vector<int> seen(pieces.size());
    for (const SawnBoard& board : boards) {
        std::vector<SawnRectangle> all = board.cuts;
        all.insert(all.end(), board.offcuts.begin(), board.offcuts.end());
        for (const SawnPiece& piece : board.pieces) {
            ++seen.at(piece.piece);
            const SawnSize& asked = pieces[piece.piece];
            EXPECT_DOUBLE_EQ(piece.place.length, piece.turned ? asked.width : asked.length);
            EXPECT_DOUBLE_EQ(piece.place.width, piece.turned ? asked.length : asked.width);
            all.push_back(piece.place);
        }
        double area = 0;
        for (std::size_t i = 0; i < all.size(); ++i) {
            area += all[i].mm2();
            EXPECT_GE(all[i].x, -kSame);
            EXPECT_LE(all[i].x + all[i].length, size.length + kSame);
            EXPECT_LE(all[i].y + all[i].width, size.width + kSame);
            for (std::size_t k = i + 1; k < all.size(); ++k) EXPECT_FALSE(overlap(all[i], all[k]));
        }
        EXPECT_NEAR(area, size.length * size.width, 1e-3) << "pieces, cuts and offcuts cover the board";
        for (const SawnRectangle& cut : board.cuts)
            EXPECT_LE(std::min(cut.length, cut.width), kerf + kSame) << "a cut is no wider than the saw";
        std::vector<SawnRectangle> parts;
        EXPECT_EQ(sawn_wrong(board, size, parts), "");
        EXPECT_EQ(parts.size(), board.pieces.size() + board.offcuts.size());
        for (const SawnPiece& piece : board.pieces)
            EXPECT_TRUE(std::any_of(parts.begin(), parts.end(), [&](const SawnRectangle& p) {
                return std::abs(p.x - piece.place.x) < kSame && std::abs(p.y - piece.place.y) < kSame &&
                       std::abs(p.length - piece.place.length) < kSame &&
                       std::abs(p.width - piece.place.width) < kSame;
            })) << "sawn as the cuts say, the piece comes out";
    }
    EXPECT_EQ(seen, std::vector<int>(pieces.size(), 1)) << "every piece once";
}

/// All that a nested layout has to keep: pieces and offcuts lie on their board, a kerf from each other.
void check_nested(const std::vector<SawnBoard>& boards, std::span<const SawnSize> pieces,
                  const SawnSize& size, double kerf) {
    std::vector<int> seen(pieces.size());
    for (const SawnBoard& board : boards) {
        EXPECT_TRUE(board.cuts.empty());
        std::vector<SawnRectangle> all = board.offcuts;
        for (const SawnPiece& piece : board.pieces) {
            ++seen.at(piece.piece);
            const SawnSize& asked = pieces[piece.piece];
            EXPECT_DOUBLE_EQ(piece.place.length, piece.turned ? asked.width : asked.length);
            EXPECT_DOUBLE_EQ(piece.place.width, piece.turned ? asked.length : asked.width);
            all.push_back(piece.place);
        }
        for (std::size_t i = 0; i < all.size(); ++i) {
            EXPECT_GE(std::min(all[i].x, all[i].y), -kSame);
            EXPECT_LE(all[i].x + all[i].length, size.length + kSame);
            EXPECT_LE(all[i].y + all[i].width, size.width + kSame);
            for (std::size_t k = 0; k < i; ++k) {
                const SawnRectangle a{all[k].x - kerf, all[k].y - kerf, all[k].length + 2 * kerf,
                                      all[k].width + 2 * kerf};
                EXPECT_FALSE(overlap(all[i], a)) << "nearer than the kerf";
            }
        }
        for (const SawnRectangle& offcut : board.offcuts)
            EXPECT_GE(std::min(offcut.length, offcut.width), kLeastOffcut);
    }
    EXPECT_EQ(seen, std::vector<int>(pieces.size(), 1)) << "every piece once";
}

/// The largest single offcut of all boards, mm².
double largest_offcut(const std::vector<SawnBoard>& boards) {
    double largest = 0;
    for (const SawnBoard& board : boards)
        for (const SawnRectangle& r : board.offcuts) largest = std::max(largest, r.mm2());
    return largest;
}

/// What the proof finds in a cut list.
std::string codes_of(const std::string& text, const BuildPlan& build) {
    std::string found;
    for (const Violation& v : check_cut_list(text, build)) found += v.code + " ";
    return found;
}

/// Whether one board holds pieces in their order from `next` on, however guillotine cuts part it.
bool holds(std::vector<SawnRectangle> free, std::vector<SawnSize> pieces, double kerf) {
    if (pieces.empty()) return true;
    for (std::size_t p = 0; p < pieces.size(); ++p)
        for (std::size_t f = 0; f < free.size(); ++f)
            for (const bool turn : {false, true}) {
                const SawnSize s = turn ? SawnSize{pieces[p].width, pieces[p].length} : pieces[p];
                const SawnRectangle r = free[f];
                if (s.length > r.length + kSame || s.width > r.width + kSame) continue;
                for (const bool along_y : {false, true}) {
                    std::vector<SawnRectangle> left = free;
                    left.erase(left.begin() + static_cast<std::ptrdiff_t>(f));
                    left.push_back({r.x + s.length + kerf, r.y, r.length - s.length - kerf,
                                    along_y ? r.width : s.width});
                    left.push_back(
                        {r.x, r.y + s.width + kerf, along_y ? s.length : r.length, r.width - s.width - kerf});
                    std::erase_if(left, [](const SawnRectangle& x) { return x.length <= 0 || x.width <= 0; });
                    std::vector<SawnSize> others = pieces;
                    others.erase(others.begin() + static_cast<std::ptrdiff_t>(p));
                    if (holds(left, others, kerf)) return true;
                }
            }
    return false;
}

Plan stack(Job job, std::vector<Blank> blanks) {
    Plan plan;
    plan.job = std::move(job);
    plan.stock_min = {0, 0};
    plan.stock_max = {500, 400};
    double z = 0;
    for (const Blank& blank : blanks) {
        Layer& layer = plan.layers.emplace_back();
        layer.index = static_cast<int>(plan.layers.size());
        layer.z_bottom = z;
        layer.z_top = z += 18;
        layer.slab_thickness = 19;
        layer.blank = blank;
        Joint joint;
        joint.area_mm2 = 50000;
        layer.joints = {joint};
    }
    plan.totals.build_minutes = 90;
    return plan;
}

/// A plan as the proof reads it.
BuildPlan read_back(const Plan& plan) {
    BuildPlan build;
    build.job = plan.job;
    build.job_stated = true;
    build.stock_min = plan.stock_min;
    build.stock_max = plan.stock_max;
    for (const Layer& layer : plan.layers) {
        LayerToBuild& to = build.layers.emplace_back();
        to.index = layer.index;
        to.slab_thickness = layer.slab_thickness;
        to.blank = layer.blank;
    }
    return build;
}

}  // namespace

TEST(CutList, APanelSawPartsAnyPieces) {
    std::mt19937 random(test::seed());
    for (int trial = 0; trial < 60; ++trial) {
        const SawnSize board{std::uniform_real_distribution(600.0, 3000.0)(random),
                             std::uniform_real_distribution(600.0, 2100.0)(random)};
        const double kerf = trial % 4 == 0 ? 0 : std::uniform_real_distribution(0.5, 6.0)(random);
        std::vector<SawnSize> pieces(std::uniform_int_distribution<std::size_t>(1, 30)(random));
        for (SawnSize& s : pieces)
            s = {std::round(std::uniform_real_distribution(20.0, board.length)(random)),
                 std::round(std::uniform_real_distribution(20.0, board.width)(random))};
        if (trial % 5 == 0)
            for (SawnSize& s : pieces) s = pieces[0];
        if (trial % 7 == 0) pieces[0] = board;  // one that leaves nothing
        const std::vector<SawnBoard> boards = lay_on_boards(pieces, board, kerf);
        ASSERT_FALSE(boards.empty());
        check(boards, pieces, board, kerf);
        double area = 0;
        for (const SawnSize& s : pieces) area += s.length * s.width;
        EXPECT_GE(static_cast<double>(boards.size()), area / (board.length * board.width) - 1e-9);
        EXPECT_EQ(boards, lay_on_boards(pieces, board, kerf));
    }
}

TEST(CutList, FindsTheOneBoardThatHoldsAFewPieces) {
    std::mt19937 random(test::seed());
    int held = 0, found = 0;
    while (held < 60) {
        std::vector<SawnSize> pieces(4);
        for (SawnSize& s : pieces)
            s = {std::uniform_real_distribution(150.0, 900.0)(random),
                 std::uniform_real_distribution(150.0, 900.0)(random)};
        const SawnSize board{1200, 1000};
        if (!holds({{0, 0, board.length, board.width}}, pieces, 4)) continue;
        ++held;
        if (lay_on_boards(pieces, board, 4).size() == 1) ++found;
    }
    EXPECT_GE(found, 54) << "of " << held << " that an exhaustive search lays on one board";
}

TEST(CutList, ExactFitsTakeNoKerf) {
    const std::vector<SawnSize> halves{{500, 1000}, {496, 1000}};
    const std::vector<SawnBoard> one = lay_on_boards(halves, {1000, 1000}, 4);
    ASSERT_EQ(one.size(), 1U);
    EXPECT_TRUE(one[0].offcuts.empty());
    EXPECT_EQ(one[0].cuts.size(), 1U);
    const std::vector<SawnSize> too_wide{{500, 1000}, {497, 1000}};
    EXPECT_EQ(lay_on_boards(too_wide, {1000, 1000}, 4).size(), 2U);
    EXPECT_TRUE(lay_on_boards(std::vector<SawnSize>{{1001, 10}}, {1000, 1000}, 4).empty());
    EXPECT_EQ(lay_on_boards(std::vector<SawnSize>{{10, 1500}}, {1500, 800}, 4)[0].pieces[0].turned, true);
}

TEST(CutList, TakesEverySlabAndTheBoard) {
    Job job;
    job.slabs.length = job.slabs.width = 1000;
    job.machine.base_board_thickness = 25;
    Plan plan = stack(job, {{{0, 0}, {500, 400}}, {{100, 100}, {300, 250}}, {{10, 20}, {90, 70}}});
    plan.layers[2].slabs = 2;
    plan.layers[2].slab_thickness = 38;
    const CutList list = cut_list(plan);
    ASSERT_EQ(list.blanks.size(), 5U);
    EXPECT_EQ(list.blanks[0], (BlankToSaw{0, 0, 25, {500, 400}}));
    EXPECT_EQ(list.blanks[2], (BlankToSaw{2, 1, 19, {200, 150}}));
    EXPECT_EQ(list.blanks[4], (BlankToSaw{3, 2, 19, {80, 50}}));
    ASSERT_EQ(list.boards.size(), 2U) << "of 19 and of 25 mm";
    EXPECT_EQ(list.boards[0].thickness, 19);
    EXPECT_NEAR(list.bought_m2(), 2, 1e-9);
    EXPECT_NEAR(list.sawn_m2(), 0.2 + 0.2 + 0.03 + 2 * 0.004, 1e-9);
    const CutList uniform = cut_list(plan, Blanks::pattern);
    EXPECT_NEAR(uniform.sawn_m2(), 5 * 0.2, 1e-9);
    EXPECT_EQ(uniform.boards.size(), 3U) << "three of 500 x 400 go on a board of 1000 x 1000";

    const std::string csv = cut_list_csv(list);
    EXPECT_NE(csv.find("board,1,19,board 1,,,1000,1000,0,0,\n"), std::string::npos) << csv;
    EXPECT_NE(csv.find("piece,2,25,base board,,,500,400,0,0,no\n"), std::string::npos) << csv;
    EXPECT_NE(csv.find(",layer 3 slab 2,3,2,"), std::string::npos) << csv;
    const auto commas = [](std::string_view line) { return std::count(line.begin(), line.end(), ','); };
    for (std::size_t begin = 0; begin < csv.size();) {
        const std::size_t end = csv.find('\n', begin);
        EXPECT_EQ(commas(std::string_view(csv).substr(begin, end - begin)), 10) << csv.substr(begin, end);
        begin = end + 1;
    }
    const std::string dxf = cut_list_dxf(list);
    std::size_t loops = 0;
    for (std::size_t at = dxf.find("POLYLINE"); at != std::string::npos; at = dxf.find("POLYLINE", at + 1))
        ++loops;
    std::size_t drawn = list.boards.size() + list.blanks.size();
    for (const BoardToSaw& board : list.boards) drawn += board.sawn.cuts.size() + board.sawn.offcuts.size();
    EXPECT_EQ(loops, drawn);
}

TEST(CutList, HolesAreDrawnInTheLowestSlabsOfTheirLayers) {
    // The second slab lies turned: its front edge is the right one there.
    CutList list;
    list.blanks = {{2, 1, 19, {200, 150}}, {3, 1, 19, {80, 50}}, {3, 2, 19, {80, 50}}};
    list.boards = {{19, {600, 400}, {{{0, {10, 20, 200, 150}}, {1, {300, 5, 50, 80}, true}}, {}, {}}},
                   {19, {600, 400}, {{{2, {0, 0, 80, 50}}}, {}, {}}}};
    const std::string dxf =
        cut_list_dxf(list, {{2, 1, 30.5, 40, 8, 12}, {3, 1, 20, 12, 6, 9}, {4, 1, 5, 5, 8, 12}});
    EXPECT_NE(dxf.find("CIRCLE\n8\nDOWELS\n10\n40.5\n20\n60.0\n30\n0.0\n40\n4.0\n"
                       "0\nTEXT\n8\nLABEL\n10\n48.5\n20\n60.0\n30\n0.0\n40\n4.0\n1\nD8 x 12 deep\n"),
              std::string::npos)
        << dxf;
    EXPECT_NE(dxf.find("CIRCLE\n8\nDOWELS\n10\n338.0\n20\n25.0\n30\n0.0\n40\n3.0\n"), std::string::npos)
        << dxf;
    std::size_t circles = 0;
    for (std::size_t at = 0; (at = dxf.find("CIRCLE", at)) != std::string::npos; ++at) ++circles;
    EXPECT_EQ(circles, 2U);
}

TEST(CutList, TheProofFollowsItAtTheSaw) {
    Job job;
    job.slabs.length = 1500;
    job.slabs.width = 900;
    const Plan plan = stack(job, {{{0, 0}, {500, 400}}, {{100, 100}, {311, 252}}, {{10, 20}, {95, 71}}});
    BuildPlan build = read_back(plan);
    const std::string csv = cut_list_csv(cut_list(plan));
    const auto codes = [&](const std::string& text) { return codes_of(text, build); };
    ASSERT_EQ(codes(csv), "");
    // Every number that is wrong by a millimetre or more is told, and every line that is missing.
    std::size_t begin = csv.find('\n') + 1, changed = 0;
    for (std::size_t end = 0; begin < csv.size(); begin = end + 1) {
        end = csv.find('\n', begin);
        EXPECT_NE(codes(csv.substr(0, begin) + csv.substr(end + 1)), "") << csv.substr(begin, end - begin);
        int column = 0;
        bool whole = true;
        for (std::size_t at = begin; at < end; ++at) {
            if (csv[at] == ',') ++column, whole = true;
            if (csv[at] == '.') whole = false;
            if (!whole || csv[at] < '0' || csv[at] > '9') continue;
            if (column == 0 || column == 1 || column == 3) continue;  // names
            std::string text = csv;
            text[at] = text[at] == '9' ? '0' : static_cast<char>(text[at] + 1);
            EXPECT_NE(codes(text), "") << csv.substr(begin, end - begin) << ", column " << column;
            ++changed;
        }
    }
    EXPECT_GT(changed, 60u);
    EXPECT_EQ(codes("kind\n"), "cut_list.unreadable ");
    EXPECT_EQ(codes(csv + "piece,1\n"), "cut_list.unreadable ");
    build.layers[1].blank->max[0] += 1;
    EXPECT_EQ(codes(csv), "cut_list.piece ") << "a slab that is sawn smaller than the plan lays it";
}

TEST(CutList, SlabsMilledOutLieAKerfApartAndNeverTakeMoreBoards) {
    std::mt19937 random(test::seed());
    std::size_t sawn_boards = 0, nested_boards = 0;
    double sawn_offcuts = 0, nested_offcuts = 0;
    for (int trial = 0; trial < 10; ++trial) {
        const bool is_whole =
            trial % 3 != 0;  // sizes in whole millimetres, as slabs.blanks = "layer" has them
        const auto mm = [&](double low, double high) {
            const double value = std::uniform_real_distribution(low, high)(random);
            return is_whole ? std::round(value) : value;
        };
        const SawnSize board{mm(600, 2500), mm(600, 1300)};
        const double kerf = trial % 4 == 0 ? 0 : mm(1, 8);
        std::vector<SawnSize> pieces(std::uniform_int_distribution<std::size_t>(1, 16)(random));
        for (SawnSize& s : pieces) s = {mm(20, 0.6 * board.length), mm(20, 0.6 * board.width)};
        if (trial % 5 == 0) pieces[0] = board;
        if (trial % 7 == 0) pieces.back() = {board.width, std::min(board.length, 100.0)};
        const std::vector<SawnBoard> sawn = lay_on_boards(pieces, board, kerf),
                                     boards = nest_on_boards(pieces, board, kerf);
        ASSERT_EQ(sawn.empty(), boards.empty());
        check_nested(boards, pieces, board, kerf);
        EXPECT_LE(boards.size(), sawn.size());
        if (boards.size() == sawn.size() && largest_offcut(sawn) >= kLeastOffcut * kLeastOffcut) {
            sawn_offcuts += largest_offcut(sawn) * 1e-6;
            nested_offcuts += largest_offcut(boards) * 1e-6;
        }
        sawn_boards += sawn.size();
        nested_boards += boards.size();
        EXPECT_EQ(boards, nest_on_boards(pieces, board, kerf));
    }
    std::printf("  %zu boards sawn, %zu milled out; where as many, offcuts %.2f and %.2f m2\n", sawn_boards,
                nested_boards, sawn_offcuts, nested_offcuts);
    EXPECT_GT(nested_offcuts, sawn_offcuts);
    EXPECT_TRUE(nest_on_boards(std::vector<SawnSize>{{1001, 10}}, {1000, 1000}, 4).empty());
}

TEST(CutList, NestedSlabsFillABoardToTheKerf) {
    const std::vector<SawnSize> quarters(4, {498, 298});
    const std::vector<SawnBoard> one = nest_on_boards(quarters, {1000, 600}, 4);
    ASSERT_EQ(one.size(), 1U);
    check_nested(one, quarters, {1000, 600}, 4);
    EXPECT_TRUE(one[0].offcuts.empty());
    EXPECT_EQ(nest_on_boards(std::vector<SawnSize>(4, {499, 298}), {1000, 600}, 4).size(), 2U);
    const std::vector<SawnBoard> alone = nest_on_boards(std::vector<SawnSize>{{300, 200}}, {1000, 600}, 5);
    ASSERT_EQ(alone[0].offcuts.size(), 2U);
    EXPECT_EQ(alone[0].offcuts[0].mm2(), 795 * 600) << "beside the piece, which stands upright";
    EXPECT_EQ(alone[0].offcuts[1].mm2(), 200 * 295) << "above it, a kerf from the first";
}

// Five pieces around each other fill a board to the kerf, and no cut goes from edge to edge between them.
TEST(CutList, NestedSlabsFillBoardsThatNoSawCanPart) {
    std::mt19937 random(test::seed());
    const auto mm = [&](double low, double high) {
        return std::floor(std::uniform_real_distribution(low, high)(random));
    };
    std::size_t filled = 0;
    for (int trial = 0; trial < 60; ++trial) {
        const SawnSize board{mm(400, 1200), mm(400, 1000)};
        const double kerf = mm(2, 9);
        // Of the pieces at the left and at the bottom, and of those at the bottom and at the right.
        const double left = mm(60, board.length / 2), low = mm(60, board.width / 2),
                     long_low = mm(left + kerf + 50, board.length - kerf - 60),
                     high_right = mm(low + kerf + 50, board.width - kerf - 60);
        const std::vector<SawnSize> pieces{{long_low, low},
                                           {board.length - long_low - kerf, high_right},
                                           {board.length - left - kerf, board.width - high_right - kerf},
                                           {left, board.width - low - kerf},
                                           {long_low - left - kerf, high_right - low - kerf}};
        EXPECT_GT(lay_on_boards(pieces, board, kerf).size(), 1U);
        const std::vector<SawnBoard> boards = nest_on_boards(pieces, board, kerf);
        check_nested(boards, pieces, board, kerf);
        filled += boards.size() == 1;
    }
    EXPECT_GT(filled, 5U);
}

TEST(CutList, TheProofHoldsANestToItsKerf) {
    Job job;
    job.slabs.length = 1500;
    job.slabs.width = 900;
    job.slabs.layout = BoardLayout::nested;
    const Plan plan = stack(job, {{{0, 0}, {500, 400}}, {{100, 100}, {311, 252}}, {{10, 20}, {95, 71}}});
    BuildPlan build = read_back(plan);
    const CutList list = cut_list(plan);
    const std::string csv = cut_list_csv(list);
    ASSERT_EQ(codes_of(csv, build), "");
    EXPECT_EQ(csv.find("\ncut,"), std::string::npos);
    EXPECT_EQ(cut_list_dxf(list).find("\n8\nCUT\n"), std::string::npos) << "nothing lies on that layer";
    // A piece moved towards another by less than a millimetre, or off its board.
    CutList moved = list;
    std::vector<SawnPiece>& pieces = moved.boards[0].sawn.pieces;
    for (std::size_t i = 0; i < pieces.size(); ++i)
        for (std::size_t k = 0; k < pieces.size(); ++k) {
            const SawnRectangle was = pieces[i].place, &other = pieces[k].place;
            if (i == k) continue;
            for (const bool over : {false, true}) {
                pieces[i].place.x = other.x + (over ? other.length + 3.5 : 1);
                pieces[i].place.y = other.y;
                if (over && pieces[i].place.x + was.length > 1500) continue;
                EXPECT_NE(codes_of(cut_list_csv(moved), build), "") << i << " beside " << k;
            }
            pieces[i].place = {-0.5, was.y, was.length, was.width};
            EXPECT_NE(codes_of(cut_list_csv(moved), build), "") << "off its board";
            pieces[i].place = was;
            ++pieces[i].place.length;
            EXPECT_NE(codes_of(cut_list_csv(moved), build), "") << "another size than the plan's";
            pieces[i].place = was;
        }
    EXPECT_EQ(codes_of(csv + csv.substr(csv.find("piece,")), build).find("cut_list.piece"), 0U) << "twice";
    std::string with_cut = csv;
    with_cut.insert(csv.find("piece,"), "cut,1,19,cut 1,,,4,900,700,0,\n");
    EXPECT_EQ(codes_of(with_cut, build), "cut_list.cut ");
    build.job.slabs.layout = BoardLayout::guillotine;
    EXPECT_EQ(codes_of(csv, build), "cut_list.cut ") << "the job's boards are sawn";
    build.job_stated = false;
    EXPECT_EQ(codes_of(csv, build), "") << "without the job pieces need not be apart";
}

TEST(CutList, ASlabLargerThanABoardIsRefused) {
    Job job;
    job.slabs.board_length = 450;
    job.slabs.board_width = 450;
    try {
        (void)cut_list(stack(job, {{{0, 0}, {500, 400}}}));
        FAIL() << "laid a slab past the board";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), "slabs.board");
        EXPECT_NE(std::string(error.what()).find("500.0 x 400.0 mm"), std::string::npos) << error.what();
    }
}

TEST(CutList, BoardsAreToldByTheirThickness) {
    CutList list;
    EXPECT_EQ(boards_text(list), "");
    for (const double thickness : {12.5, 19.0, 19.0, 25.0}) {
        list.boards.emplace_back().thickness = thickness;
        list.boards.back().size = {2440, 1220};
    }
    EXPECT_EQ(
        boards_text(list),
        "1 board of 12.5 x 2440 x 1220 mm, 2 boards of 19 x 2440 x 1220 mm, 1 board of 25 x 2440 x 1220 mm");
}

TEST(CutList, ReckonsWithStatedPricesOnly) {
    Job job;
    job.slabs.length = job.slabs.width = 1000;
    const std::vector<Blank> blanks{{{0, 0}, {500, 400}}, {{0, 0}, {500, 400}}};
    const auto cost = [&] {
        const Plan plan = stack(job, blanks);
        return cost_of(job, amounts_of(plan, cut_list(plan)));
    };
    EXPECT_FALSE(cost());
    EXPECT_EQ(cost_text(job, cost()), "");
    job.prices.board_m2 = {12.5};
    ASSERT_TRUE(cost());
    EXPECT_NEAR(*cost()->boards, 12.5, 1e-9) << "board and slabs are both of 19 mm, on one board";
    EXPECT_FALSE(cost()->base_board || cost()->glue || cost()->machine);
    job.machine.base_board_thickness = 25;
    EXPECT_FALSE(cost()->base_board) << "no price is stated for 25 mm";
    job.prices.base_board_m2 = 9;
    EXPECT_NEAR(cost()->base_board.value(), 9, 1e-9);
    job.prices.glue_kg = 40;
    job.bonding.glue_g_per_m2 = 0;
    EXPECT_FALSE(cost()->glue) << "nobody knows how much glue goes on a square metre";
    job.bonding.glue_g_per_m2 = 150;
    EXPECT_NEAR(cost()->glue.value(), 0.1 * 0.150 * 40, 1e-9);
    job.prices.machine_hour = 30;
    job.prices.currency = "EUR";
    EXPECT_NEAR(cost()->machine.value(), 45, 1e-9);
    EXPECT_NEAR(cost()->total, 12.5 + 9 + 0.6 + 45, 1e-9);
    EXPECT_EQ(cost_text(job, cost()),
              "cost    67.10 EUR (boards 12.50, base board 9.00, glue 0.60, machine 45.00)\n");
    job.prices.dowel = 0.2;
    EXPECT_FALSE(cost()->dowels) << "the build has none";
    Plan with = stack(job, blanks);
    with.layers[0].dowels.resize(3);
    const Cost dowelled = cost_of(job, amounts_of(with, cut_list(with))).value();
    EXPECT_NEAR(dowelled.dowels.value(), 0.6, 1e-9);
    EXPECT_NEAR(dowelled.total, cost()->total + 0.6, 1e-9);
    EXPECT_EQ(cost_text(job, dowelled),
              "cost    67.70 EUR (boards 12.50, base board 9.00, glue 0.60, machine 45.00, dowels 0.60)\n");
    job.prices.board_m2 = {1, 2};
    EXPECT_THROW(validate(job), Error) << "two prices for one thickness";
    job.slabs.thicknesses = {12, 19};
    EXPECT_NO_THROW(validate(job));
    EXPECT_NEAR(*cost()->boards, 2, 1e-9) << "the price of 19 mm";
}
