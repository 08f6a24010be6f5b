// Face milling leaves nothing of the slab above the layer's top, whatever the stock's size.
#include <gtest/gtest.h>

#include "engine/paths/operations/facing.h"
#include "engine/paths/runs/layer_cut.h"
#include "engine/stock/layer_stock.h"
#include "kernels/stock/stock.h"

namespace slabwright {
namespace {

TEST(Facing, EveryCellOfAnyStockComesDownToTheTop) {
    Context context;
    const Job job;
    const Tool& face = tool_of_kind(job, ToolKind::face);
    // Sides around multiples of the cutter's diameter and step-over, where a middle strip is thinnest.
    for (const double width : {8.0, 30.0, 49.0, 50.5, 59.9, 60.8, 100.2, 110.1, 119.9, 161.3, 240.7})
        for (const double depth : {12.0, 50.1, 60.3, 60.8, 109.9, 160.4, 333.3}) {
            SCOPED_TRACE(testing::Message() << width << " x " << depth);
            LayerJob layer;
            layer.job = &job;
            layer.z_top = 10;
            layer.slab_thickness = 19;
            layer.stock_max = {width, depth};
            const LayerCut cut{context, layer, job, LayerSolid{}, 19.0, {}, {}};
            const Operation op = face_layer(cut);
            ASSERT_FALSE(op.moves.empty());
            Stock stock({0.25, 0.25, 0.5, static_cast<int>(width / 0.5), static_cast<int>(depth / 0.5)});
            stock.add_slab(0, 19);
            for (std::size_t i = 1; i < op.moves.size(); ++i) {
                const Move &a = op.moves[i - 1], &b = op.moves[i];
                if (b.feed > 0)
                    stock.cut(cutter_end(face), {to_mm(a.x), to_mm(a.y), to_mm(a.z)},
                              {to_mm(b.x), to_mm(b.y), to_mm(b.z)});
            }
            double highest = 0;
            for (std::size_t c = 0; c < stock.grid().count(); ++c) highest = std::max(highest, stock.top(c));
            EXPECT_DOUBLE_EQ(highest, 10);
        }
}

}  // namespace
}  // namespace slabwright
