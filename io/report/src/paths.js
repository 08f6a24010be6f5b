// The programs' ways as the page carries them: four 16-bit numbers for each point.

import {bytesOf} from './dom.js';
import {data} from './report.js';

const cache = new Map();

// → {count, x, y, z, share, rapid, leftOut}; share is of the program's time, rapid(i) how the tip came to point i.
export function pathOf(index) {
    if (cache.has(index)) return cache.get(index);
    const {min, max, programs} = data.paths, program = programs[index];
    const bytes = bytesOf(program.data), view = new DataView(bytes.buffer), count = program.points;
    const at = (i, k) => view.getUint16(8 * i + 2 * k, true);
    const place = k => i => min[k] + at(i, k) / 65535 * (max[k] - min[k]);
    const path = {count, leftOut: program.left_out, x: place(0), y: place(1), z: place(2), share: i => (at(i, 3) >> 1) / 32767, rapid: i => (at(i, 3) & 1) === 1};
    cache.set(index, path);
    return path;
}
