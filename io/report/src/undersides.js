// Slabs that are milled from below before they are laid: how each lies, what is milled, and by which programs.

import {duration, figure, make, plural} from './dom.js';
import {data, plan, toolOf} from './report.js';

const undersides = data.undersides ?? [];

export const undersideOf = l => undersides.find(u => u.layer === plan.layers[l].index);

// The slab as it lies upside down, from above: what is milled, the dowels' holes, zero. paper: how large it is printed at most, mm.
function view(u, paper) {
    const margin = 14, unit = Math.max(u.length / (paper[0] - 2 * margin), u.width / (paper[1] - 2 * margin)), m = margin * unit;
    const d = u.region.map(points => {
        let path = '';
        for (let i = 0; i < points.length; i += 2) path += `${i ? 'L' : 'M'}${points[i] / 100} ${-points[i + 1] / 100}`;
        return `${path}Z`;
    }).join('');
    return make('svg', {class: 'plan-view', viewBox: `${-m} ${-u.width - m} ${u.length + 2 * m} ${u.width + 2 * m}`, role: 'img',
        'aria-label': `Slab of layer ${u.layer} upside down, ${figure(u.length, 1)} by ${figure(u.width, 1)} mm`},
    make('rect', {x: 0, y: -u.width, width: u.length, height: u.width, fill: '#e8d9b5', stroke: '#8a6a3a', 'stroke-width': 0.5 * unit}),
    make('path', {class: 'recess', d, fill: '#b99a5b', 'fill-rule': 'evenodd', stroke: '#333', 'stroke-width': 0.4 * unit}),
    u.dowels.map(hole => make('circle', {class: 'dowel', cx: hole.x, cy: -hole.y, r: hole.diameter / 2, fill: '#fff', stroke: '#333', 'stroke-width': 0.4 * unit})),
    make('text', {x: u.length / 2, y: 8 * unit, 'font-size': 4 * unit, 'text-anchor': 'middle'}, `${figure(u.length, 1)} mm, upside down`),
    make('circle', {cx: 0, cy: 0, r: 2 * unit, fill: '#fff', stroke: '#c22', 'stroke-width': 0.6 * unit}),
    make('text', {x: 3 * unit, y: -2 * unit, 'font-size': 4 * unit, fill: '#c22'}, 'zero'));
}

function sheet(u) {
    const rows = u.programs.map(p => make('tr', {}, make('td', {}, make('code', {}, p.file)), make('td', {}, p.purpose), make('td', {}, make('strong', {}, `T${p.tool}`), ` ${toolOf(p.tool)?.name ?? ''}`), make('td', {class: 'n'}, duration(p.minutes))));
    return make('article', {class: 'sheet underside', 'aria-label': `Setup sheet of the underside of layer ${u.layer}`},
        make('div', {class: 'top'}, make('h3', {}, `Underside of layer ${u.layer}`), make('p', {}, make('strong', {}, plan.input.file), make('br'), make('code', {}, `${u.folder}/nc`)),
            make('p', {class: 'clock'}, make('strong', {}, duration(u.minutes)))),
        make('div', {class: 'drawings'}, view(u, [132, 92])),
        make('ol', {class: 'steps'}, [
            `Before the build: lay the slab, ${figure(u.length, 1)} × ${figure(u.width, 1)} × ${figure(u.thickness, 2)} mm, upside down on a spoil board and hold it outside of what is milled (dark).`,
            'X 0, Y 0 at its left front corner, Z at its top as the programs say.',
            `Run the programs in the order of their names; ${figure(u.floor, 2)} mm stay over the board${u.strips ? ', more in strips' : ''}.`,
            u.dowels.length ? `The last one drills ${plural(u.dowels.length, 'hole')} Ø ${figure(u.dowels[0].diameter, 2)} mm, ${figure(u.dowels[0].depth, 1)} mm deep, for the joint’s dowels.` : 'There are no dowels under it: it is laid by its edges.',
            'Turn it over from left to right and put it with the other slabs.',
        ].map(text => make('li', {}, text))),
        make('table', {}, make('thead', {}, make('tr', {}, ['Program', 'Work', 'Tool', 'Time'].map(h => make('th', {scope: 'col'}, h)))), make('tbody', {}, rows)));
}

export const undersideSheets = () => undersides.map(sheet);
