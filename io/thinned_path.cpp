#include "io/thinned_path.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "kernels/wide.h"

namespace slabwright {

namespace {

constexpr std::size_t kRun = 1024;

/// A run's places as rows of numbers.
struct Rows {
    std::array<double, kRun + 1> x, y, z, off;
};

/// Of the points after a and before b the first of those that lie farthest from the straight line between these two, if that is more than the
/// root of `least`; else a.
SLABWRIGHT_WIDE std::size_t farthest_between(Rows& rows, std::size_t a, std::size_t b, double least) {
    const double ax = rows.x[a], ay = rows.y[a], az = rows.z[a], ux = rows.x[b] - ax, uy = rows.y[b] - ay, uz = rows.z[b] - az;
    const double uu = ux * ux + uy * uy + uz * uz;
    const double share = uu > 0 ? 1 / uu : 0;
    const auto measure = [&](std::size_t k) {
        const double wx = rows.x[k] - ax, wy = rows.y[k] - ay, wz = rows.z[k] - az;
        double t = (wx * ux + wy * uy + wz * uz) * share;
        t = t < 0 ? 0 : t;
        t = t > 1 ? 1 : t;
        const double dx = wx - t * ux, dy = wy - t * uy, dz = wz - t * uz;
        return rows.off[k] = dx * dx + dy * dy + dz * dz;
    };
    constexpr std::size_t kLanes = 8;
    std::array<double, kLanes> most;
    most.fill(least);
    std::size_t k = a + 1;
    for (; k + kLanes <= b; k += kLanes)
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const double d = measure(k + lane);
            most[lane] = d > most[lane] ? d : most[lane];
        }
    double greatest = least;
    for (; k < b; ++k) greatest = std::max(greatest, measure(k));
    for (const double m : most) greatest = std::max(greatest, m);
    if (!(greatest > least)) return a;
    k = a + 1;
    while (rows.off[k] != greatest) ++k;
    return k;
}

/// Takes a way point by point and keeps what its picture needs.
class Thinning {
public:
    Thinning(double tolerance_mm, std::vector<ReplayPoint>& kept) : tolerance2_(tolerance_mm * tolerance_mm), kept_(kept) { run_.reserve(kRun + 1); }

    void add(const ReplayPoint& p) {
        if (run_.size() > 1 && (run_.size() > kRun || p.rapid != run_.back().rapid)) end_run();
        run_.push_back(p);
    }
    void end() {
        if (run_.size() > 1) end_run();
        kept_.insert(kept_.end(), run_.begin(), run_.end());
    }

private:
    /// Keeps the run's points but for its last, which begins the next run.
    void end_run() {
        const std::size_t last = run_.size() - 1;
        if (last > 1) {
            for (std::size_t k = 0; k <= last; ++k) rows_->x[k] = run_[k].x, rows_->y[k] = run_[k].y, rows_->z[k] = run_[k].z;
        }
        // Depth first and from the left, so that points come out in their order.
        open_.assign(1, last);
        std::size_t from = 0;
        while (!open_.empty()) {
            const std::size_t to = open_.back(), farthest = to > from + 1 ? farthest_between(*rows_, from, to, tolerance2_) : from;
            if (farthest != from) {
                open_.push_back(farthest);
                continue;
            }
            kept_.push_back(run_[from]);
            from = to;
            open_.pop_back();
        }
        run_.front() = run_.back();
        run_.resize(1);
    }

    double tolerance2_;
    std::vector<ReplayPoint>& kept_;
    std::vector<ReplayPoint> run_;
    std::vector<std::size_t> open_;
    std::unique_ptr<Rows> rows_ = std::make_unique<Rows>();
};

}  // namespace

std::vector<ReplayPoint> path_of(const Program& program, double rapid_feed, double tolerance_mm) {
    std::vector<ReplayPoint> path;
    Thinning thinning(tolerance_mm, path);
    ReplayPoint last;
    bool any = false;
    for (const ProgramStep& s : program.steps) {
        if (!s.known()) continue;
        ReplayPoint p{s.x, s.y, s.z, 0, s.rapid()};
        if (any) {
            const double x = p.x - last.x, y = p.y - last.y, z = p.z - last.z, way = std::sqrt(x * x + y * y + z * z);
            if (way == 0) continue;
            p.seconds = last.seconds + way / (s.rapid() ? rapid_feed : s.feed) * 60;
        }
        any = true;
        last = p;
        if (tolerance_mm > 0) thinning.add(p);
        else path.push_back(p);
    }
    thinning.end();
    path.shrink_to_fit();
    return path;
}

void thin(std::vector<ReplayPoint>& path, double tolerance_mm) {
    std::vector<ReplayPoint> kept;
    Thinning thinning(tolerance_mm, kept);
    for (const ReplayPoint& p : path) thinning.add(p);
    thinning.end();
    kept.shrink_to_fit();
    path = std::move(kept);
}

}  // namespace slabwright
