// The drawings of the setup sheets: the slab from above with its measures, and the stack from the side.

import {figure, make} from './dom.js';
import {blankOf, data, flaskRings, plan} from './report.js';
import {filledBoxes} from './wood.js';
import {onControl, shownHeights, zeroHeight} from './zero.js';

const ink = '#1f252b', dim = '#525c66', red = '#b0141f', wood = '#f1e6d3', cutWood = '#d9bd8a', glueInk = '#8f6200', purple = '#5b3a8e';

function pathOf(loops) {
    const unit = data.outlines.unit_mm;
    return loops.map(points => {
        let d = '';
        for (let i = 0; i < points.length; i += 2) d += `${i ? 'L' : 'M'}${(points[i] * unit).toFixed(2)} ${(-points[i + 1] * unit).toFixed(2)}`;
        return d + 'Z';
    }).join('');
}

// Text that other lines may cross.
function label(x, y, content, size, attributes = {}) {
    return make('text', {x, y, 'font-size': size, fill: ink, stroke: '#fff', 'stroke-width': size / 4, 'paint-order': 'stroke', 'stroke-linejoin': 'round', ...attributes}, content);
}

// A dimension between two places on a line; u: units of a millimetre on paper.
function dimension(from, to, at, upright, text, u) {
    const short = Math.abs(to - from) < 14 * u, tick = 1.2 * u;
    const line = (a, b, c, d) => upright ? `M${b} ${a}L${d} ${c}` : `M${a} ${b}L${c} ${d}`;
    const slash = p => line(p - tick, at + (upright ? -tick : tick), p + tick, at + (upright ? tick : -tick));
    const middle = (from + to) / 2;
    const words = upright
        ? label(at - 1.2 * u, middle, text, 3.4 * u, {transform: `rotate(-90 ${at - 1.2 * u} ${middle})`, 'text-anchor': 'middle'})
        : label(short ? Math.max(from, to) + 1.6 * u : middle, short ? at + 1.2 * u : at - 1.2 * u, text, 3.4 * u, {'text-anchor': short ? 'start' : 'middle'});
    return [make('path', {d: line(from, at, to, at) + slash(from) + slash(to), stroke: dim, 'stroke-width': 0.25 * u, fill: 'none'}), words];
}

function extension(x, y, x2, y2, u) {
    return make('path', {d: `M${x} ${y}L${x2} ${y2}`, stroke: dim, 'stroke-width': 0.18 * u, fill: 'none'});
}

// Stripes, so that glue and filled air differ in black and white too.
function stripes(id, color, ground, u, turn) {
    return make('pattern', {id, patternUnits: 'userSpaceOnUse', width: 2.4 * u, height: 2.4 * u, patternTransform: `rotate(${turn})`},
        make('rect', {width: 2.4 * u, height: 2.4 * u, fill: ground}), make('path', {d: `M0 0V${2.4 * u}`, stroke: color, 'stroke-width': 0.7 * u}));
}

// Columns of stock that stand in a layer: they are left there, and sawn off when the pattern is done.
export const supportsIn = l => (plan.supports ?? []).filter(s => s.z_low < plan.layers[l].z_top - 0.001 && s.z_high > plan.layers[l].z_bottom + 0.001);

// The dowels that layer l is laid on, and those whose holes are drilled into its top; each with its place as the programs count.
export function dowelsIn(l) {
    const [ox, oy] = plan.zero ?? [0, 0];
    const told = (layer, under) => (layer?.dowels ?? []).map(d => ({...d, under, says: [d.x - ox, d.y - oy].map(v => figure(v, 2).replace('-', '−')).join(', ')}));
    return [...told(plan.layers[l - 1], true), ...told(plan.layers[l], false)];
}

// What no tool may run into in a layer, in the places of the pattern: its outline as a path and as corners, its box, its height, and
// its name with that, briefly and at length.
export function keepOutsIn(l) {
    const [ox, oy] = plan.zero ?? [0, 0], {min, max} = blankOf(l);
    return (plan.keep_outs ?? []).map(k => {
        const [cx, cy, r] = k.circle, [ax, ay, bx, by] = k.rectangle;
        const corners = k.circle.length ? [[cx - r, cy - r], [cx + r, cy + r]] : k.rectangle.length ? [[ax, ay], [bx, ay], [bx, by], [ax, by]] : k.polygon;
        const xs = corners.map(c => c[0] + ox), ys = corners.map(c => c[1] + oy), box = [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
        const d = k.circle.length ? `M${cx + ox - r} ${-cy - oy}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0Z` : `M${xs.map((x, i) => `${x} ${-ys[i]}`).join('L')}Z`;
        const around = k.circle.length ? Array.from({length: 48}, (_, i) => [cx + ox + r * Math.cos(i * Math.PI / 24), cy + oy + r * Math.sin(i * Math.PI / 24)]) : xs.map((x, i) => [x, ys[i]]);
        return {name: k.name, d, around, box, height: k.height, slab: k.from === 'slab', brief: `${k.name}, ${figure(k.height, 1)} mm`, says: `${k.name}, ${figure(k.height, 1)} mm ${k.from === 'slab' ? 'over the slab' : 'over the board'}`};
    }).filter(k => !k.slab || (k.box[0] < max[0] && k.box[2] > min[0] && k.box[1] < max[1] && k.box[3] > min[1]));
}

// The glue head's beads: y, x from and to of each.
function beadsOf(beads) {
    const at = beads.map(v => (v * data.outlines.unit_mm).toFixed(2));
    let d = '';
    for (let i = 0; i < at.length; i += 3) d += `M${at[i + 1]} ${-at[i]}H${at[i + 2]}`;
    return d;
}

// The slab of layer l from above: slab, pattern, glue, zero, and their measures. paper: how large it is printed at most, mm.
export function planView(l, paper) {
    const [x0, y0] = plan.stock.min, [x1, y1] = plan.stock.max, width = x1 - x0, depth = y1 - y0, layer = plan.layers[l];
    const {bottom, top, glue, beads = []} = data.outlines.layers[l];
    const {min: [sx0, sy0], max: [sx1, sy1]} = blankOf(l), smaller = sx1 - sx0 < width - 0.05 || sy1 - sy0 < depth - 0.05;
    // The margin holds the dimensions; what it takes in the drawing's units depends on its scale.
    const margin = {left: 19, right: 10, top: 12, bottom: 17};
    // What stands beside the stock is drawn as far away as the stock is large.
    const kept = keepOutsIn(l), beside = (at, own, size, sign) => Math.max(own, ...kept.map(k => Math.min(sign * k.box[at], own + size)));
    const left = -beside(0, -x0, width, -1), right = beside(2, x1, width, 1), front = -beside(1, -y0, depth, -1), back = beside(3, y1, depth, 1);
    const u = Math.max((right - left) / (paper[0] - margin.left - margin.right), (back - front) / (paper[1] - margin.top - margin.bottom));
    const [ox, oy] = plan.zero ?? [0, 0], zx = Math.min(x1 + 6 * u, Math.max(x0 - 6 * u, ox)), zy = -Math.min(y1 + 6 * u, Math.max(y0 - 6 * u, oy));
    const view = {x: left - margin.left * u, y: -back - margin.top * u, w: right - left + (margin.left + margin.right) * u, h: back - front + (margin.top + margin.bottom) * u};
    const {min, max} = plan.input.bbox, px0 = min[0], px1 = max[0], py0 = min[1], py1 = max[1];
    const filled = filledBoxes(l), dowels = dowelsIn(l);
    const inside = ox >= sx0 - 0.001 && ox <= sx1 && oy >= sy0 - 0.001 && oy <= sy1;
    return make('svg', {class: 'plan-view', viewBox: `${view.x} ${view.y} ${view.w} ${view.h}`, role: 'img',
        'aria-label': `Slab of layer ${layer.index} from above, ${figure(sx1 - sx0, 1)} by ${figure(sy1 - sy0, 1)} mm${smaller ? `, ${figure(sx0 - x0, 1)} mm right of and ${figure(sy0 - y0, 1)} mm behind the base board’s corner` : ''}; glue on ${figure(layer.glue_area_mm2 / 100, 1)} square centimetres; zero ${inside ? 'on' : 'beside'} the slab`},
    make('defs', {}, stripes(`glue-${l}`, '#d69a1e', '#f9dfa0', u, 45), stripes(`air-${l}`, red, '#f4c3c3', u, -45), kept.length ? stripes(`kept-${l}`, ink, '#dfe2e5', u, 90) : null, dowels.length ? stripes(`dowel-${l}`, ink, '#fff', u / 2, 45) : null),
    smaller ? [make('rect', {x: x0, y: -y1, width, height: depth, fill: 'none', stroke: '#8a8375', 'stroke-width': 0.3 * u, 'stroke-dasharray': `${3 * u} ${1.5 * u}`}), label(x0 + 1.5 * u, -y1 + 4 * u, 'base board', 3 * u, {fill: dim})] : null,
    make('rect', {x: sx0, y: -sy1, width: sx1 - sx0, height: sy1 - sy0, fill: wood, stroke: '#8a6a3a', 'stroke-width': 0.5 * u}),
    flaskRings(l).map(ring => make('path', {d: `M${ring.map(([x, y]) => `${x} ${-y}`).join('L')}Z`, fill: 'none', stroke: '#8a6a3a', 'stroke-width': 0.3 * u})),
    make('path', {d: pathOf(bottom.map(loop => loop.points)), fill: cutWood, 'fill-rule': 'evenodd', stroke: 'none'}),
    glue.length ? make('path', {d: pathOf(glue), fill: `url(#glue-${l})`, 'fill-rule': 'evenodd', stroke: glueInk, 'stroke-width': 0.25 * u}) : null,
    beads.length ? make('path', {class: 'beads', d: beadsOf(beads), fill: 'none', stroke: glueInk, 'stroke-width': 0.35 * u}) : null,
    filled.length ? make('path', {d: filled.map(b => `M${b.x0.toFixed(2)} ${(-b.y0).toFixed(2)}H${b.x1.toFixed(2)}V${(-b.y1).toFixed(2)}H${b.x0.toFixed(2)}Z`).join(''), fill: `url(#air-${l})`, stroke: 'none'}) : null,
    make('path', {d: pathOf(bottom.map(loop => loop.points)), fill: 'none', stroke: ink, 'stroke-width': 0.45 * u}),
    supportsIn(l).map(s => make('path', {class: 'support', d: `M${s.x - s.width / 2} ${-s.y - s.width / 2}h${s.width}v${s.width}h${-s.width}Zl${s.width} ${s.width}m0 ${-s.width}l${-s.width} ${s.width}`, fill: 'none', stroke: purple, 'stroke-width': 0.5 * u})),
    dowels.map(d => [make('circle', {class: d.under ? 'dowel under' : 'dowel', cx: d.x, cy: -d.y, r: d.diameter / 2, fill: d.under ? `url(#dowel-${l})` : '#fff', stroke: ink, 'stroke-width': 0.4 * u, 'stroke-dasharray': d.under ? null : `${1.2 * u} ${0.8 * u}`}),
        make('path', {d: `M${d.x - d.diameter} ${-d.y}h${2 * d.diameter}M${d.x} ${-d.y - d.diameter}v${2 * d.diameter}`, stroke: ink, 'stroke-width': 0.2 * u, fill: 'none'}),
        d.under ? label(d.x + d.diameter, -d.y - 0.8 * u, d.says, 2.8 * u) : null]),
    make('path', {d: pathOf(top.map(loop => loop.points)), fill: 'none', stroke: '#17636b', 'stroke-width': 0.4 * u, 'stroke-dasharray': `${2 * u} ${1.3 * u}`}),
    kept.map(k => [make('path', {class: 'keep-out', d: k.d, fill: `url(#kept-${l})`, stroke: ink, 'stroke-width': 0.5 * u}), k.box[0] + 1.8 * k.brief.length * u < view.x + view.w ? label(k.box[0], -k.box[3] - 1.2 * u, k.brief, 3 * u) : label(k.box[2], -k.box[3] - 1.2 * u, k.brief, 3 * u, {'text-anchor': 'end'})]),
    // Measures: the slab below and left, the pattern above and right.
    extension(sx0, -sy0, sx0, -y0 + 15 * u, u), extension(sx1, -sy0, sx1, -y0 + 15 * u, u), extension(sx0, -sy0, x0 - 15 * u, -sy0, u), extension(sx0, -sy1, x0 - 15 * u, -sy1, u),
    dimension(sx0, sx1, -y0 + 14 * u, false, `slab ${figure(sx1 - sx0, 1)}`, u), dimension(-sy0, -sy1, x0 - 14 * u, true, `slab ${figure(sy1 - sy0, 1)}`, u),
    // Where it lies on the base board.
    sx0 - x0 > 0.05 ? [extension(x0, -y0, x0, -y0 + 15 * u, u), dimension(x0, sx0, -y0 + 14 * u, false, figure(sx0 - x0, 1), u)] : null,
    sy0 - y0 > 0.05 ? [extension(x0, -y0, x0 - 15 * u, -y0, u), dimension(-y0, -sy0, x0 - 14 * u, true, figure(sy0 - y0, 1), u)] : null,
    extension(px0, -py1, px0, -y1 - 7 * u, u), extension(px1, -py1, px1, -y1 - 7 * u, u), dimension(px0, px1, -y1 - 6 * u, false, `pattern ${figure(px1 - px0, 1)}`, u),
    extension(px1, -py0, x1 + 7.5 * u, -py0, u), extension(px1, -py1, x1 + 7.5 * u, -py1, u), dimension(-py0, -py1, x1 + 6.5 * u, true, `pattern ${figure(py1 - py0, 1)}`, u),
    // From the slab's corner to zero.
    Math.abs(sx0 - ox) > 0.05 ? [extension(zx, zy, zx, -y0 + 8 * u, u), extension(sx0, -sy0, sx0, -y0 + 8 * u, u), dimension(sx0, zx, -y0 + 7 * u, false, figure(Math.abs(sx0 - ox), 2), u)] : null,
    Math.abs(sy0 - oy) > 0.05 ? [extension(zx, zy, x0 - 8 * u, zy, u), dimension(-sy0, zy, x0 - 6 * u, true, figure(Math.abs(sy0 - oy), 2), u)] : null,
    // Zero with its axes.
    make('path', {d: `M${zx} ${zy}h${13 * u}l${-2.2 * u} ${-1 * u}v${2 * u}l${2.2 * u} ${-1 * u}M${zx} ${zy}v${-13 * u}l${-1 * u} ${2.2 * u}h${2 * u}l${-1 * u} ${-2.2 * u}`, stroke: red, 'stroke-width': 0.6 * u, fill: red}),
    make('circle', {cx: zx, cy: zy, r: 2 * u, fill: '#fff', stroke: red, 'stroke-width': 0.6 * u}), make('circle', {cx: zx, cy: zy, r: 0.6 * u, fill: red}),
    label(zx + 14 * u, zy + 1.2 * u, 'X', 4 * u, {fill: red, 'font-weight': 700}), label(zx - 1.4 * u, zy - 14.4 * u, 'Y', 4 * u, {fill: red, 'font-weight': 700}),
    label(zx + 2.6 * u, zy + 4.6 * u, inside ? 'zero' : 'zero: beside the slab', 3.6 * u, {fill: red, 'font-weight': 700}));
}

const nothing = 0.01; // mm

// The stack from the side, as far as layer l: what stands under it, its slab, and the heights that the control shows.
export function sideView(l, paper) {
    const layer = plan.layers[l], board = plan.job.machine.base_board_thickness, at = shownHeights(l), raw = layer.z_bottom + layer.slab_thickness;
    const low = Math.max(-board, layer.z_bottom - 3 * layer.slab_thickness), height = raw - low, u = height / (paper[1] - 12), w = (paper[0] - 34) * u;
    const y = z => raw - z + 6 * u;
    const mark = (z, shown, name, color, up) => [
        make('path', {d: `M0 ${y(z)}H${w + 3 * u}`, stroke: color, 'stroke-width': 0.45 * u, fill: 'none'}),
        label(w + 4 * u, y(z) + (up ? -0.8 : 3) * u, `z ${onControl(shown)} ${name}`, 3.3 * u, {fill: color, 'font-weight': 600})];
    const below = plan.layers.slice(0, l).filter(other => other.z_top > low);
    const zero = zeroHeight(l);
    return make('svg', {class: 'side-view', viewBox: `${-2 * u} 0 ${paper[0] * u} ${paper[1] * u}`, role: 'img',
        'aria-label': `From the side: raw slab top at z ${figure(at.raw, 2)}, face at z ${figure(at.face, 2)}, bottom at z ${figure(at.bottom, 2)} mm, as the control shows them`},
    make('rect', {x: 0, y: y(0), width: w, height: Math.max(0, -low), fill: '#dedbd3', stroke: '#8a8375', 'stroke-width': 0.3 * u}),
    low < 0 ? label(1.5 * u, y(low) - 1.6 * u, 'base board', 3 * u, {fill: dim}) : null,
    below.map(other => [make('rect', {x: 0, y: y(other.z_top), width: w, height: other.z_top - Math.max(low, other.z_bottom), fill: '#e9e2d4', stroke: '#b3a27f', 'stroke-width': 0.3 * u}),
        label(1.5 * u, (y(other.z_top) + y(Math.max(low, other.z_bottom))) / 2 + 1.2 * u, String(other.index), 3.4 * u, {fill: dim})]),
    make('rect', {x: 0, y: y(raw), width: w, height: raw - layer.z_top, fill: '#f7efe0', stroke: '#8a6a3a', 'stroke-width': 0.3 * u, 'stroke-dasharray': `${1.4 * u} ${1 * u}`}),
    make('rect', {x: 0, y: y(layer.z_top), width: w, height: layer.z_top - layer.z_bottom, fill: cutWood, stroke: '#8a6a3a', 'stroke-width': 0.4 * u}),
    label(1.5 * u, (y(layer.z_top) + y(layer.z_bottom)) / 2 + 1.6 * u, `layer ${layer.index}`, 4.2 * u, {'font-weight': 700}),
    mark(raw, at.raw, 'raw', dim, true), raw - layer.z_top > nothing ? mark(layer.z_top, at.face, 'face', '#17636b', raw - layer.z_top > 5 * u) : null, mark(layer.z_bottom, at.bottom, l === 0 ? 'board' : 'glue', glueInk),
    y(zero) <= paper[1] * u ? make('path', {d: `M${-1.8 * u} ${y(zero)}l${-0.01 * u} 0M${w / 2} ${y(zero)}l${-2 * u} ${-3.4 * u}h${4 * u}Z`, fill: red, stroke: '#fff', 'stroke-width': 0.3 * u}) : null,
    y(zero) <= paper[1] * u ? label(w / 2 + 2.6 * u, y(zero) - 0.9 * u, 'z 0', 3.6 * u, {fill: red, 'font-weight': 700})
        : label(w / 2, y(low) + 4.4 * u, `z 0 ${figure(low - zero, 2)} mm lower`, 3.3 * u, {fill: red, 'font-weight': 700}));
}

// The finished stack seen along y: slabs, what is milled of them, glue as it lies, and in red what stays filled. A low stack is drawn taller
// than it is, so that every layer has room for its number; `taller` says by how much.
let stacks = 0;
export function stackView(paper) {
    const air = `air-stack-${++stacks}`;
    const [x0] = plan.stock.min, [x1] = plan.stock.max, width = x1 - x0, last = plan.layers[plan.layers.length - 1];
    const board = plan.job.machine.base_board_thickness, top = last.z_bottom + last.slab_thickness, height = top + board;
    const room = paper[1] - 6, thinnest = Math.min(...plan.layers.map(layer => layer.z_top - layer.z_bottom));
    const flat = Math.max(width / (paper[0] - 28), height / room); // units of a millimetre on paper, drawn true
    const taller = Math.max(1, Math.min(room * flat / height, 5 * flat / thinnest));
    const u = flat, y = z => (top - z) * taller + 3 * u;
    const {z0, dz} = data.silhouette, unit = data.outlines.unit_mm;
    const box = (a, b, low, high) => `M${a.toFixed(2)} ${y(low).toFixed(2)}H${b.toFixed(2)}V${y(high).toFixed(2)}H${a.toFixed(2)}Z`;
    const rows = data.silhouette.x.map((row, i) => {
        let d = '';
        for (let c = 0; c < row.length; c += 2) d += box(row[c], row[c + 1], z0 + i * dz, z0 + (i + 1) * dz);
        return d;
    }).join('');
    const glueSpans = l => data.outlines.layers[l].glue.map(points => {
        const xs = points.filter((_, i) => i % 2 === 0).map(v => v * unit);
        return [Math.min(...xs), Math.max(...xs)];
    });
    const filled = plan.layers.flatMap((_, l) => filledBoxes(l));
    const svg = make('svg', {class: 'stack-view', viewBox: `${x0 - u} 0 ${width + 28 * u} ${height * taller + 6 * u}`, role: 'img', 'aria-label': `The stack from the front: ${plan.layers.length} layers on the base board`},
        make('defs', {}, stripes(air, red, '#f4c3c3', u, -45)),
        make('path', {d: box(x0, x1, -board, 0), fill: '#dedbd3', stroke: '#8a8375', 'stroke-width': 0.3 * u}),
        plan.layers.map((layer, i) => make('path', {d: box(blankOf(i).min[0], blankOf(i).max[0], layer.z_bottom, layer.z_top), fill: i % 2 ? '#f3ead9' : '#f8f2e6', stroke: '#b59b6a', 'stroke-width': 0.3 * u})),
        make('path', {d: rows, fill: cutWood}),
        filled.length ? make('path', {d: filled.map(b => box(b.x0, b.x1, b.z0, b.z1)).join(''), fill: `url(#${air})`}) : null,
        plan.layers.map((layer, l) => glueSpans(l).map(([a, b]) => make('path', {d: `M${a} ${y(layer.z_bottom)}H${b}`, stroke: '#d69a1e', 'stroke-width': 0.7 * u}))),
        plan.layers.map(layer => [
            label(x1 + 2 * u, (y(layer.z_top) + y(layer.z_bottom)) / 2 + 1.2 * u, String(layer.index), 3.6 * u, {'font-weight': 700}),
            label(x1 + 9 * u, y(layer.z_top) + 1.2 * u, `z ${figure(layer.z_top, 2)}`, 3 * u, {fill: dim})]),
        label(x1 + 9 * u, y(0) + 1.2 * u, 'z 0', 3 * u, {fill: dim}));
    return {svg, taller};
}
