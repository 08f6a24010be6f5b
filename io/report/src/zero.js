// Where the programs' zero lies in each layer, what it can be touched off with, and whether there is wood to touch.

import {figure} from './dom.js';
import {blankOf, data, plan} from './report.js';
import {woodHeights} from './wood.js';

const least = 0.005; // mm; nearer is the same place
const [ox, oy] = plan.zero ?? [0, 0]; // x 0, y 0 of the programs, as the model has it

const [pinX, pinY] = plan.job.machine.pin ?? [0, 0];
const places = {corner: 'x 0, y 0 at the base board’s left front corner', centre: 'x 0, y 0 in the middle of the base board', pin: `x 0, y 0 at the pin ${figure(pinX, 2)} mm right of and ${figure(pinY, 2)} mm behind the base board’s left front corner`};

// Where z 0 of layer l's programs lies above the pattern's bottom, mm.
export function zeroHeight(l) {
    if (plan.frame === 'table-top') return -plan.job.machine.base_board_thickness;
    return plan.frame === 'layer-top' ? plan.layers[l].z_top : 0;
}

// The raw slab's top, the face and the layer's bottom as the control shows them, mm.
export function shownHeights(l) {
    const layer = plan.layers[l], down = zeroHeight(l);
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

const sign = value => value < 0 ? '−' : '';
const millimetres = value => sign(value) + figure(Math.abs(value), 2);

// Whether the control shows inches.
export const inInches = plan.job.machine.units === 'in';
// A coordinate or a height as the control shows it; inches have their unit beside them, since all else on the sheets is mm.
export const onControl = value => inInches ? `${sign(value)}${figure(Math.abs(value) / 25.4, 4)} in` : millimetres(value);
const shown = value => inInches ? `${onControl(value)} (${millimetres(value)} mm)` : onControl(value);

// Whether z 0 of layer l is where it was in layer 1, on the machine as well: it is left alone then.
const stands = l => l > 0 && plan.job.machine.table === 'fixed' && plan.frame !== 'layer-top';

// Which programs find z 0 in layer l, and what they touch; '' where the operator does.
export function probed(l) {
    const {layers, probes = [], job: {probing}} = plan, here = probes.filter(p => p.layer === layers[l].index);
    if (!here.length) return '';
    const [x, y, up] = probing.reference,
        on = `the reference ${figure(up, 2)} mm above the table, ${figure(x, 2)} mm right of and ${figure(y, 2)} mm behind the base board’s corner`;
    return `${here.map(p => `${p.file.slice(3)} (T${p.tool})`).join(', ')} find${here.length > 1 ? '' : 's'} z 0 on ${on}: begin with the tip over it, ${figure(probing.search / 2, 2)} mm above at most`;
}

// {place, xy, z, after, warnings}: sentences for the sheet of layer l.
export function zeroOf(l) {
    const [x0, y0] = blankOf(l).min.map((v, k) => v - [ox, oy][k]), above = plan.frame === 'layer-top', onTable = plan.frame === 'table-top', layer = plan.layers[l], at = shownHeights(l), warnings = [];
    const off = outside(l);
    const own = places[plan.job.machine.zero], across = own ?? 'x 0, y 0 of the STL';
    const place = `${across}; z 0 at ${above ? 'this layer’s finished top' : onTable ? 'the machine table’s top' : 'the pattern’s bottom, the base board’s top'}`;
    const xy = `slab’s left edge is x ${shown(x0)}, its front edge y ${shown(y0)}`;
    const raw = `raw slab top is z ${shown(at.raw)} if the slab is ${figure(layer.slab_thickness, 2)} mm thick: measure it`;
    const z = stands(l) ? `leave z 0 where it has been since layer 1; only where it was lost: ${onTable ? 'touch the machine’s table beside the base board, z 0, or the ' : ''}${raw}` : onTable ? `touch the machine’s table beside the base board: z 0; or the ${raw}` : !above && l === 0 ? `the base board’s top before the slab is laid is z 0; after that the ${raw}` : raw;
    if (off && plan.job.machine.zero !== 'corner' && plan.job.machine.zero !== 'pin') warnings.push(`Zero x 0, y 0 lies in the air, ${off} the slab: there is no wood to touch. Touch off the slab’s edges.`);
    if (!above && !onTable && l > 0 && !stands(l)) warnings.push(`Z 0 lies ${figure(layer.z_bottom, 2)} mm under this slab, inside the stack: it cannot be touched. Touch off by the raw slab’s top, as it is measured.`);
    const after = own === places.pin ? off ? 'touch the pin; it stays clear of the slab' : 'touch the pin before the slab covers it; the control keeps x and y through the build' : own === places.corner ? 'touch the base board’s left and front edges once; they stay through the build' : off ? '' : woodAfter(l) === false ? 'the raw slab covers x 0, y 0; milled, it is in the air there' : 'the slab covers x 0, y 0';
    return {place, xy, z: [z, probed(l)].filter(Boolean).join('; '), after, warnings};
}

// What is ticked once layer l's zero is set.
export const zeroIsSet = l => stands(l) ? 'XY touched off as above, Z left as it was' : probed(l) ? 'XY touched off as above, Z probed by program' : 'XY and Z touched off as above';

// How the control's zero has moved since the first layer, with the table or without it.
export function tableHeight(l) {
    const {table, base_board_thickness: board} = plan.job.machine, moves = table === 'moving', layer = plan.layers[l];
    const risen = layer.z_top - plan.layers[0].z_top, offset = plan.frame === 'layer-top' ? (moves ? 0 : risen) : (moves ? -risen : 0);
    const standing = moves ? `sunk to ${figure(board + layer.z_top, 2)} mm below this layer’s top` : 'fixed';
    const by = `${inInches ? `${figure(Math.abs(offset) / 25.4, 4)} in, ` : ''}${figure(Math.abs(offset), 2)} mm`;
    return offset === 0 ? standing : `${standing}; the work offset’s Z is ${by} ${offset > 0 ? 'above' : 'below'} that of layer 1`;
}
