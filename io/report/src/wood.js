// The stack as the simulated programs leave it: heights of the wood in every layer, and what of it should be air.

import {bytesOf} from './dom.js';
import {data, plan} from './report.js';

const cache = new Map();

// One byte a point: 0 nothing stands, 1 … 255 from the layer's bottom to its top. null in a light page.
export function woodHeights(l) {
    if (!data.wood) return null;
    if (!cache.has(l)) {
        const {rle, data: text} = data.wood.layers[l], bytes = bytesOf(text);
        if (!rle) cache.set(l, bytes);
        else {
            const out = new Uint8Array(data.stock.nx * data.stock.ny);
            let at = 0;
            for (let i = 0; i + 1 < bytes.length; i += 2) { out.fill(bytes[i + 1], at, at + bytes[i]); at += bytes[i]; }
            cache.set(l, out);
        }
    }
    return cache.get(l);
}

// z of the wood's upper end for a byte of layer l, mm.
export function woodTop(l, byte) {
    const layer = plan.layers[l];
    return byte === 0 ? layer.z_bottom : layer.z_bottom + (byte - 1) / 254 * (layer.z_top - layer.z_bottom);
}

// Boxes as they are packed: of row, column, how many columns, and between which shares of the pattern's height.
function unpacked(text) {
    const bytes = bytesOf(text), view = new DataView(bytes.buffer), list = [], {z0, height} = data.filled;
    for (let at = 0; at + 10 <= bytes.length; at += 10) {
        const [row, column, count, low, high] = [0, 2, 4, 6, 8].map(k => view.getUint16(at + k, true));
        list.push({row, column, count, z0: z0 + low / 65535 * height, z1: z0 + high / 65535 * height});
    }
    return list;
}

// Boxes of air that stays filled in layer l: {x0, x1, y0, y1, z0, z1}, mm.
const boxes = new Map();
export function filledBoxes(l) {
    if (!data.filled) return [];
    if (!boxes.has(l)) {
        const {cell_mm: cell, x0, y0} = data.stock;
        boxes.set(l, unpacked(data.filled.layers[l].boxes).map(({row, column, count, z0, z1}) => ({
            x0: x0 + (column - 0.5) * cell, x1: x0 + (column + count - 0.5) * cell, y0: y0 + (row - 0.5) * cell, y1: y0 + (row + 0.5) * cell, z0, z1,
        })));
    }
    return boxes.get(l);
}

// How high the underside of layer l is milled out, one byte a point as woodHeights has it: 0 not at all. null where its slab is not milled from below.
const floors = new Map();
export function woodFloors(l) {
    const text = data.filled?.layers[l].below;
    if (!text) return null;
    if (!floors.has(l)) {
        const {nx, ny} = data.stock, {z_bottom, z_top} = plan.layers[l], out = new Uint8Array(nx * ny);
        for (const {row, column, count, z1} of unpacked(text)) {
            const byte = Math.min(255, Math.max(1, Math.round(1 + (z1 - z_bottom) / (z_top - z_bottom) * 254)));
            out.fill(byte, row * nx + column, row * nx + column + count);
        }
        floors.set(l, out);
    }
    return floors.get(l);
}

// mm³ that stay filled in layer l; 0 where the page does not know.
export function filledVolume(l) {
    return verifiedVolume(l) ?? data.filled?.layers[l].mm3 ?? 0;
}

function verifiedVolume(l) {
    const {verify} = data;
    return (verify?.layers?.find(f => f.index === plan.layers[l].index) ?? verify?.layers?.[l])?.unmade_mm3;
}
