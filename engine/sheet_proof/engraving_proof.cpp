#include "engine/sheet_proof/engraving_proof.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>

#include "engine/sheet_proof/hold_proof.h"
#include "engine/sheet_proof/swept.h"
#include "kernels/polygons/pieces.h"

namespace slabwright {

namespace {

/// What the strokes take of the piece's top, in the part's frame.
Loops taken_by(const ReadEngraving& engraving, const ReadPiece& piece, double width) {
    Loops all;
    for (const std::vector<ReadHead>& stroke : engraving.strokes) {
        std::vector<AxisPoint> axis;
        for (const ReadHead& head : stroke) {
            const ReadHead own = unplaced(head, piece);
            axis.push_back({own.x, own.y, 0, 0});
        }
        if (axis.size() == 1) axis.push_back(axis[0]);
        append_loops(swept(axis, width), all);
    }
    return unite(all, {});
}

class EngravingProof {
public:
    EngravingProof(const std::vector<EngravedPiece>& pieces, std::vector<Diagnostic>& violations)
        : violations_(violations) {
        for (const EngravedPiece& piece : pieces) pieces_[piece.piece->number] = &piece;
    }

    void require(const ReadSheetProgram& program, const ReadEngraving& engraving) {
        program_ = &program;
        engraving_ = &engraving;
        const auto found = pieces_.find(engraving.piece);
        if (found == pieces_.end() || found->second->program != &program)
            return violate(fmt::format("piece {}, which the program does not place", engraving.piece));
        const double deepest = std::min(program.engraver->depth + 1e-3, program.thickness / 2);
        if (engraving.deepest > deepest)
            violate(fmt::format("{:.3f} mm deep, where {:.3f} mm are the most", engraving.deepest, deepest));
        for (const ReadWay& way : program.ways)
            if (way.piece == engraving.piece && way.line < engraving.line)
                return violate("made after a cut of its piece, which is loose by then");
        if (!says_its_piece()) violate(fmt::format("\"{}\" on piece {}", engraving.text, engraving.piece));
        const Loops taken = taken_by(engraving, *found->second->piece, program.engraver->width);
        if (!subtract(taken, hidden(*found->second)).empty())
            violate("where neither the next sheet covers it nor a tab is cut off");
    }

private:
    void violate(const std::string& what) {
        violations_.push_back(
            {Severity::error,
             "sheets.engraving",
             fmt::format("{} line {}: an engraving {}", program_->file, engraving_->line, what),
             {}});
    }

    /// "12" and "12-3" on piece 12; marks anywhere.
    [[nodiscard]] bool says_its_piece() const {
        const std::string& text = engraving_->text;
        if (text == "mark") return true;
        int number = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
        return error == std::errc() && number == engraving_->piece &&
               (end == text.data() + text.size() || *end == '-');
    }

    /// Where nothing of a piece's top shows in the end. It is kept while engravings of one piece follow.
    const Loops& hidden(const EngravedPiece& piece) {
        if (last_ == &piece) return hidden_;
        last_ = &piece;
        const auto above = pieces_.find(piece.piece->number + 1);
        hidden_ = above == pieces_.end() ? Loops{} : intersect(piece.top, above->second->bottom);
        if (const ReadHold hold = read_hold(*piece.piece); !hold.tabs.empty())
            hidden_ = unite(hidden_, intersect(hold.tabs, piece.top));
        return hidden_;
    }

    std::map<int, const EngravedPiece*> pieces_;
    std::vector<Diagnostic>& violations_;
    const ReadSheetProgram* program_ = nullptr;
    const ReadEngraving* engraving_ = nullptr;
    const EngravedPiece* last_ = nullptr;
    Loops hidden_;
};

}  // namespace

std::set<int> engraved_pieces(const std::vector<ReadSheetProgram>& programs) {
    std::set<int> numbers;
    for (const ReadSheetProgram& program : programs)
        for (const ReadEngraving& engraving : program.engravings) numbers.insert(engraving.piece);
    return numbers;
}

int require_engravings(const std::vector<ReadSheetProgram>& programs,
                       const std::vector<EngravedPiece>& pieces, std::vector<Diagnostic>& violations) {
    EngravingProof proof(pieces, violations);
    int count = 0;
    for (const ReadSheetProgram& program : programs)
        for (const ReadEngraving& engraving : program.engravings) {
            proof.require(program, engraving);
            ++count;
        }
    return count;
}

}  // namespace slabwright
