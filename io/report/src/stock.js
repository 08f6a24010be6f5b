// A slab as a height field that a cutter carves as it goes: the coarse twin of the simulation, for looking at.

export class StockField {
    // grid: {nx, ny, cell_mm, x0, y0}
    constructor(grid, bottom, top) {
        this.grid = grid;
        this.bottom = bottom;
        this.heights = new Float32Array(grid.nx * grid.ny).fill(top);
    }

    copyFrom(heights) { this.heights.set(heights); }

    // The tip goes straight from a to b. Over each point the lowest z of the cutter is exact: its end is convex along the way, so the least
    // lies where the derivative vanishes or at an end of where the cutter covers the point.
    cut(cutter, ax, ay, az, bx, by, bz) {
        const {nx, ny, cell_mm: cell, x0, y0} = this.grid, heights = this.heights, R = cutter.radius, ball = cutter.ball;
        let dx = bx - ax, dy = by - ay;
        const run = Math.hypot(dx, dy);
        let slope = 0, z = Math.min(az, bz);
        if (run > 1e-6) { dx /= run; dy /= run; slope = (bz - az) / run; z = az; } else { dx = 1; dy = 0; }
        const lead = slope / Math.sqrt(1 + slope * slope);
        const j0 = Math.max(0, Math.ceil((Math.min(ay, by) - R - y0) / cell)), j1 = Math.min(ny - 1, Math.floor((Math.max(ay, by) + R - y0) / cell));
        const low = Math.min(ax, bx) - R, high = Math.max(ax, bx) + R;
        for (let j = j0; j <= j1; ++j) {
            const py = y0 + j * cell - ay;
            // On a slanting way only a part of the row is near it.
            let from = low, to = high;
            if (run > 1e-6 && Math.abs(dy) > 1e-3) {
                const foot = ax + py * dx / dy, half = R / Math.abs(dy);
                from = Math.max(from, foot - half - 1e-6);
                to = Math.min(to, foot + half + 1e-6);
            }
            const i0 = Math.max(0, Math.ceil((from - x0) / cell)), i1 = Math.min(nx - 1, Math.floor((to - x0) / cell));
            for (let i = i0; i <= i1; ++i) {
                const px = x0 + i * cell - ax, s0 = px * dx + py * dy, w2 = R * R - Math.max(0, px * px + py * py - s0 * s0);
                if (w2 < 0) continue;
                const w = Math.sqrt(w2), first = Math.max(0, s0 - w), last = Math.min(run > 1e-6 ? run : 0, s0 + w);
                if (first > last) continue;
                let s = slope >= 0 ? first : last, end = 0;
                if (ball) {
                    s = Math.min(last, Math.max(first, s0 - w * lead));
                    end = R - Math.sqrt(Math.max(0, w2 - (s - s0) * (s - s0)));
                }
                const cutTo = z + slope * s + end, c = j * nx + i;
                if (cutTo < heights[c]) heights[c] = cutTo;
            }
        }
    }
}

// One program's way, run forwards over a field; going back starts over from what stood before it.
export class Run {
    // path: {count, x(i), y(i), z(i), share(i)}; share is of the program's time
    constructor(field, cutter, path) {
        this.field = field;
        this.cutter = cutter;
        this.path = path;
        this.before = field.heights.slice();
        this.segment = 0;
        this.at = 0;
    }

    // Where the tip is at a share of the time: [x, y, z, segment, part of it].
    tip(share) {
        const {path} = this, last = path.count - 1;
        let low = 0, high = last;
        while (low < high) {
            const middle = (low + high + 1) >> 1;
            if (path.share(middle) <= share) low = middle; else high = middle - 1;
        }
        const i = Math.min(low, Math.max(0, last - 1)), next = Math.min(last, i + 1);
        const span = path.share(next) - path.share(i), part = span > 0 ? Math.min(1, Math.max(0, (share - path.share(i)) / span)) : 1;
        const mix = axis => path[axis](i) + (path[axis](next) - path[axis](i)) * part;
        return [mix('x'), mix('y'), mix('z'), i, part];
    }

    to(share) {
        if (share < this.at) {
            this.field.copyFrom(this.before);
            this.segment = 0;
        }
        const {path} = this;
        const [x, y, z, segment] = this.tip(share);
        for (let i = this.segment; i < segment; ++i) this.field.cut(this.cutter, path.x(i), path.y(i), path.z(i), path.x(i + 1), path.y(i + 1), path.z(i + 1));
        if (path.count > 1) this.field.cut(this.cutter, path.x(segment), path.y(segment), path.z(segment), x, y, z);
        this.segment = segment;
        this.at = share;
        return [x, y, z, segment];
    }
}
