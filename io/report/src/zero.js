// Where the programs' zero lies in each layer, what it can be touched off with, and whether there is wood to touch.

import {figure} from './dom.js';
import {blankOf, data, plan} from './report.js';
import {woodHeights} from './wood.js';

const least = 0.005; // mm; nearer is the same place
const [ox, oy] = plan.zero ?? [0, 0]; // x 0, y 0 of the programs, as the model has it

const places = {corner: 'x 0, y 0 at the base board’s left front corner', centre: 'x 0, y 0 in the middle of the base board'};

// The raw slab's top, the face and the layer's bottom as the control shows them, mm.
export function shownHeights(l) {
    const layer = plan.layers[l], down = plan.frame === 'layer-top' ? layer.z_top : 0;
    return {raw: layer.z_bottom + layer.slab_thickness - down, face: layer.z_top - down, bottom: layer.z_bottom - down, base: -down};
}

// How far x 0, y 0 lies outside the slab, in words; '' where the slab covers it.
function outside(l) {
    const {min, max} = blankOf(l), [x0, y0, x1, y1] = [min[0] - ox, min[1] - oy, max[0] - ox, max[1] - oy], parts = [];
    if (x0 > least) parts.push(`${figure(x0, 2)} mm left of`);
    if (x1 < -least) parts.push(`${figure(-x1, 2)} mm right of`);
    if (y0 > least) parts.push(`${figure(y0, 2)} mm in front of`);
    if (y1 < -least) parts.push(`${figure(-y1, 2)} mm behind`);
    return parts.join(' and ');
}

// Whether wood stands at x 0, y 0 when layer l has been milled; null where the page does not know.
function woodAfter(l) {
    const heights = woodHeights(l);
    if (!heights) return null;
    const {nx, ny, cell_mm: cell, x0, y0} = data.stock, i = Math.round((ox - x0) / cell), j = Math.round((oy - y0) / cell);
    if (i < 0 || j < 0 || i >= nx || j >= ny) return null;
    return heights[j * nx + i] > 0;
}

const millimetres = value => `${value < 0 ? '−' : ''}${figure(Math.abs(value), 2)}`;

// {place, xy, z, after, warnings}: sentences for the sheet of layer l.
export function zeroOf(l) {
    const [x0, y0] = blankOf(l).min.map((v, k) => v - [ox, oy][k]), above = plan.frame === 'layer-top', layer = plan.layers[l], at = shownHeights(l), warnings = [];
    const off = outside(l);
    const own = places[plan.job.machine.zero], across = own ?? 'x 0, y 0 of the STL';
    const place = above ? `${across}; z 0 at this layer’s finished top` : `${across}; z 0 at the pattern’s bottom, the base board’s top`;
    const xy = `slab’s left edge is x ${millimetres(x0)}, its front edge y ${millimetres(y0)}`;
    const raw = `raw slab top is z ${millimetres(at.raw)} if the slab is ${figure(layer.slab_thickness, 2)} mm thick: measure it`;
    const z = !above && l === 0 ? `the base board’s top before the slab is laid is z 0; after that the ${raw}` : raw;
    if (off && plan.job.machine.zero !== 'corner') warnings.push(`Zero x 0, y 0 lies in the air, ${off} the slab: there is no wood to touch. Touch off the slab’s edges.`);
    if (!above && l > 0) warnings.push(`Z 0 lies ${figure(layer.z_bottom, 2)} mm under this slab, inside the stack: it cannot be touched.`);
    const after = own === places.corner ? 'touch the base board’s left and front edges once; they stay through the build' : off ? '' : woodAfter(l) === false ? 'the raw slab covers x 0, y 0; milled, it is in the air there' : 'the slab covers x 0, y 0';
    return {place, xy, z, after, warnings};
}

// How the control's zero has moved since the first layer, with the table or without it.
export function tableHeight(l) {
    const {table, base_board_thickness: board} = plan.job.machine, moves = table === 'moving', layer = plan.layers[l];
    const risen = layer.z_top - plan.layers[0].z_top, offset = plan.frame === 'layer-top' ? (moves ? 0 : risen) : (moves ? -risen : 0);
    const standing = moves ? `sunk to ${figure(board + layer.z_top, 2)} mm below this layer’s top` : 'fixed';
    return offset === 0 ? standing : `${standing}; the work offset’s Z is ${figure(Math.abs(offset), 2)} mm ${offset > 0 ? 'above' : 'below'} that of layer 1`;
}
