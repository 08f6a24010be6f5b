// One printed page for each layer: what the operator needs at the machine.

import {duration, figure, make, words} from './dom.js';
import {data, flaskRings, layerMinutes, operations, phases, plan, toolOf, verify} from './report.js';

function pathOf(loops) {
    const unit = data.outlines.unit_mm;
    return loops.map(points => {
        let d = '';
        for (let i = 0; i < points.length; i += 2) d += `${i ? 'L' : 'M'}${(points[i] * unit).toFixed(2)} ${(points[i + 1] * unit).toFixed(2)}`;
        return d + 'Z';
    }).join('');
}

// The slab from above: its outline, the pattern's section at the layer's bottom and top, where glue goes, the zero point.
function picture(l) {
    const [x0, y0] = plan.stock.min, [x1, y1] = plan.stock.max, width = x1 - x0, depth = y1 - y0, edge = Math.max(width, depth) / 30;
    const {bottom, top, glue} = data.outlines.layers[l], layer = plan.layers[l];
    const thin = Math.max(width, depth) / 500;
    const loops = glue, bare = loops.length === 0;
    const flask = flaskRings(l);
    return make('svg', {viewBox: `${x0 - edge} ${-y1 - edge} ${width + 2 * edge} ${depth + 2 * edge}`, role: 'img',
        'aria-label': `Slab of layer ${layer.index} from above, ${figure(width, 1)} by ${figure(depth, 1)} mm; glue on ${figure(layer.glue_area_mm2 / 100, 1)} square centimetres`},
    make('g', {transform: 'scale(1 -1)'},
        make('rect', {x: x0, y: y0, width, height: depth, fill: '#f1e6d3', stroke: '#8a6a3a', 'stroke-width': 2 * thin}),
        flask.map(ring => make('path', {d: `M${ring.map(p => p.join(' ')).join('L')}Z`, fill: 'none', stroke: '#8a6a3a', 'stroke-width': thin})),
        bare ? null : make('path', {d: pathOf(loops), fill: '#e8b23c', 'fill-rule': 'evenodd', stroke: '#a06f00', 'stroke-width': thin}),
        make('path', {d: pathOf(bottom.map(loop => loop.points)), fill: 'none', 'fill-rule': 'evenodd', stroke: '#1f252b', 'stroke-width': 1.6 * thin}),
        make('path', {d: pathOf(top.map(loop => loop.points)), fill: 'none', 'fill-rule': 'evenodd', stroke: '#17636b', 'stroke-width': 1.2 * thin, 'stroke-dasharray': `${6 * thin} ${4 * thin}`}),
        make('path', {d: `M${-edge} 0H${edge}M0 ${-edge}V${edge}`, stroke: '#a3202c', 'stroke-width': 2 * thin, fill: 'none'}),
        make('circle', {cx: 0, cy: 0, r: edge / 2, fill: 'none', stroke: '#a3202c', 'stroke-width': 2 * thin})));
}

// Where the build table stands, and by how much the control's zero has moved with it or without it.
function tableHeight(l) {
    const {table, base_board_thickness: board} = plan.job.machine, moves = table === 'moving', layer = plan.layers[l];
    const risen = layer.z_top - plan.layers[0].z_top, offset = plan.frame === 'layer-top' ? (moves ? 0 : risen) : (moves ? -risen : 0);
    const standing = moves ? `sunk to ${figure(board + layer.z_top, 2)} mm below this layer’s top` : 'fixed';
    return offset === 0 ? standing : `${standing}; the work offset’s Z is ${figure(Math.abs(offset), 2)} mm ${offset > 0 ? 'above' : 'below'} that of layer 1`;
}

function sheet(l, minutes) {
    const layer = plan.layers[l], above = plan.frame === 'layer-top', programs = operations.filter(operation => operation.layer === l);
    const tools = [...new Set(layer.operations.map(operation => operation.tool))].sort((a, b) => a - b).map(number => toolOf(number)).filter(Boolean);
    const times = phases.filter(phase => minutes[phase.key] > 0);
    const total = times.reduce((sum, phase) => sum + minutes[phase.key], 0);
    const term = (name, value) => [make('dt', {}, name), make('dd', {}, value)];
    const found = verify?.layers?.find(f => f.index === layer.index) ?? verify?.layers?.[l];
    const many = programs.length > 14;
    const listed = many ? programs.slice(0, 13) : programs;
    return make('article', {class: 'sheet', 'aria-label': `Setup sheet of layer ${layer.index}`},
        make('div', {class: 'top'}, make('h3', {}, `Layer ${layer.index} of ${plan.layers.length}`), make('span', {}, plan.input.file), make('span', {}, duration(total))),
        make('div', {class: 'cols'},
            make('div', {},
                make('dl', {},
                    term('Slab', `${figure(plan.stock.max[0] - plan.stock.min[0], 1)} × ${figure(plan.stock.max[1] - plan.stock.min[1], 1)} × ${figure(layer.slab_thickness, 3)} mm ${plan.job.material.name}`),
                    term('Lies from', `z ${figure(layer.z_bottom, 3)} mm`),
                    term('Face to', `z ${figure(layer.z_top, 3)} mm (${figure(layer.z_bottom + layer.slab_thickness - layer.z_top, 3)} mm off)`),
                    term('Boundary', layer.reason),
                    term('Zero point', `x 0, y 0 as in the STL; z 0 at ${above ? 'this layer’s top' : 'the pattern’s bottom (top of the base board)'}`),
                    term('Table', tableHeight(l)),
                    term('Slab corner', `x ${figure(plan.stock.min[0], 2)}, y ${figure(plan.stock.min[1], 2)} mm`),
                    term('Glue', `${plan.job.bonding.glue}, ${figure(layer.glue_area_mm2 / 100, 1)} cm²`),
                    term('Press', `${figure(layer.press_force_n, 0)} N for ${figure(plan.job.bonding.press_time_s, 0)} s`)),
                make('h4', {}, 'Time'),
                make('dl', {}, times.map(phase => term(phase.name, duration(minutes[phase.key]))))),
            make('div', {}, picture(l), make('p', {class: 'note'}, 'From above. Yellow: glue. Black: section at the bottom; dashed: at the top. Red: zero point.'))),
        make('h4', {}, 'Tools'),
        make('table', {}, make('thead', {}, make('tr', {}, ['Place', 'Tool', 'Diameter', 'Flutes', 'Stick-out'].map(h => make('th', {scope: 'col'}, h)))),
            make('tbody', {}, tools.map(tool => make('tr', {}, [`T${tool.number}`, tool.name, `${figure(tool.diameter, 3)} mm`, `${figure(tool.flute_length, 1)} mm`, `${figure(tool.holder.stickout, 1)} mm`].map(c => make('td', {}, c)))))),
        make('h4', {}, 'Programs'),
        make('table', {}, make('thead', {}, make('tr', {}, ['Done', 'Program', 'Work', 'Tool', 'Time'].map(h => make('th', {scope: 'col'}, h)))),
            make('tbody', {}, listed.map(operation => make('tr', {}, ['☐', operation.name, `${words(operation.kind)}: ${operation.purpose}`, `T${operation.tool}`, duration(operation.minutes)].map(c => make('td', {}, c)))),
                many ? make('tr', {}, make('td', {colspan: 5}, `and ${programs.length - 13} more, in the order of their names`)) : null)),
        make('h4', {}, 'Checks'),
        make('ul', {}, [
            l === 0 ? `base board ${figure(plan.job.machine.base_board_thickness, 1)} mm mounted and level` : `layer ${plan.layers[l - 1].index} clean of dust where the glue goes`,
            `slab at least ${figure(layer.slab_thickness, 2)} mm thick all over`,
            'tools measured, magazine as listed', 'touch-off at the zero point agrees',
            `face height z ${figure(layer.z_top, 2)} mm measured after facing`,
            found ? `simulated: deepest gouge ${figure(found.gouge?.mm, 4)} mm, left over at most ${figure(found.left_over?.mm, 3)} mm` : 'programs simulated with “slabwright verify” before cutting',
        ].map(check => make('li', {}, check))));
}

export function buildSheets(section) {
    const minutes = layerMinutes();
    section.append(make('p', {class: 'note'}, 'Printing this page gives these sheets, one A4 page for each layer. ',
        make('button', {class: 'act', type: 'button', onclick: () => window.print()}, 'Print')),
    ...plan.layers.map((_, l) => sheet(l, minutes[l])));
}
