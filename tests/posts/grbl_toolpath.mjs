// What gcode-toolpath (npm, MIT), by which the GRBL sender CNCjs shows programs, makes of programs: a line for each
// program, then one for each motion, in mm: its word, the tool, the end's x, y, z and, of an arc, the centre's x, y.
//     node grbl_toolpath.mjs NODE_MODULES PROGRAM…

import fs from 'node:fs';
import {createRequire} from 'node:module';
import path from 'node:path';

const [modules, ...files] = process.argv.slice(2);
const Toolpath = createRequire(path.join(modules, 'any.js'))('gcode-toolpath');
const lines = [];
for (const file of files) {
    lines.push(`program ${path.basename(file)}`);
    new Toolpath({
        addLine: (modal, from, to) => lines.push(`${modal.motion} ${modal.tool} ${to.x} ${to.y} ${to.z}`),
        addArcCurve: (modal, from, to, centre) => lines.push(`${modal.motion} ${modal.tool} ${to.x} ${to.y} ${to.z} ${centre.x} ${centre.y}`),
    }).loadFromStringSync(fs.readFileSync(file, 'utf8'));
}
process.stdout.write(`${lines.join('\n')}\n`);
