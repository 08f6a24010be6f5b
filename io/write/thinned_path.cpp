#include "io/write/thinned_path.h"

#include <cmath>
#include <utility>

#include "kernels/polygons/farthest.h"

namespace slabwright {

namespace {

constexpr std::size_t kRun = 1024;

/// Takes a way point by point and keeps what its picture needs.
class Thinning {
public:
    Thinning(double tolerance_mm, std::vector<ReplayPoint>& kept)
        : tolerance2_(tolerance_mm * tolerance_mm), kept_(kept) {
        run_.reserve(kRun + 1);
    }

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
        for (std::vector<double>* row : {&rows_.x, &rows_.y, &rows_.z}) row->resize(last + 1);
        for (std::size_t k = 0; k <= last; ++k)
            rows_.x[k] = run_[k].x, rows_.y[k] = run_[k].y, rows_.z[k] = run_[k].z;
        // Depth first and from the left, so that points come out in their order.
        open_.assign(1, last);
        std::size_t from = 0;
        while (!open_.empty()) {
            const std::size_t to = open_.back();
            if (const Farthest farthest = farthest_between(rows_, from, to);
                farthest.distance2 > tolerance2_) {
                open_.push_back(farthest.at);
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
    PointRows rows_;  // of the run
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
            const double x = p.x - last.x, y = p.y - last.y, z = p.z - last.z,
                         way = std::sqrt(x * x + y * y + z * z);
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
