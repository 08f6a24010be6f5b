// What to saw or mill out: each board with its slabs, the saw's cuts in their order, and what is left.

import {figure, make, plural} from './dom.js';
import {plan} from './report.js';

const ink = '#1f252b', dim = '#525c66';

const nameOf = piece => piece.layer === 0 ? 'base board' : `layer ${piece.layer}${piece.slab > 1 ? `, slab ${piece.slab}` : ''}`;
const short = piece => piece.layer === 0 ? 'B' : `L${piece.layer}${piece.slab > 1 ? `/${piece.slab}` : ''}`;
const sizeOf = r => `${figure(r.length, 1)} × ${figure(r.width, 1)}`;

// A board as it lies on the saw, its corner below left; measures in mm.
function boardView(board, number) {
    const {length, width} = board, u = Math.max(length / 120, width / 90);
    const words = (r, lines, color) => {
        const size = Math.min(4.2 * u, r.width / (lines.length + 0.6), r.length / (0.62 * Math.max(...lines.map(l => l.length))));
        if (size < 1.3 * u) return null;
        return lines.map((line, i) => make('text', {x: r.x + r.length / 2, y: width - r.y - r.width / 2 + (i - (lines.length - 1) / 2) * 1.15 * size + 0.35 * size,
            'font-size': size, 'text-anchor': 'middle', fill: color}, line));
    };
    const rect = (r, attributes) => make('rect', {x: r.x, y: width - r.y - r.width, width: r.length, height: r.width, ...attributes});
    const largest = board.offcuts[0];
    return make('svg', {class: 'board-view', viewBox: `${-u} ${-u} ${length + 2 * u} ${width + 2 * u}`, role: 'img',
        'aria-label': `Board ${number}, ${sizeOf(board)} mm: ${board.pieces.map(p => `${nameOf(p)} ${sizeOf(p)}`).join('; ')}`},
    rect({x: 0, y: 0, length, width}, {fill: '#fff', stroke: ink, 'stroke-width': 0.5 * u}),
    board.offcuts.map(r => rect(r, {fill: '#eceae4', stroke: 'none'})),
    board.pieces.map(p => [rect(p, {fill: p.layer === 0 ? '#dedbd3' : '#f1e6d3', stroke: '#8a6a3a', 'stroke-width': 0.35 * u}), words(p, [short(p), sizeOf(p)], ink)]),
    board.cuts.map(r => rect(r, {fill: '#b0141f', stroke: 'none'})),
    largest ? words(largest, ['offcut', sizeOf(largest)], dim) : null);
}

// The table of all pieces, one line for those of one size and thickness.
function pieces() {
    const lines = new Map();
    plan.wood.boards.forEach((board, b) => board.pieces.forEach(p => {
        const [length, width] = p.turned ? [p.width, p.length] : [p.length, p.width];
        const key = `${board.thickness}:${length}:${width}:${p.layer === 0}`;
        if (!lines.has(key)) lines.set(key, {thickness: board.thickness, length, width, names: [], boards: new Set()});
        const line = lines.get(key);
        line.names.push(p.layer === 0 ? 'base board' : String(p.layer));
        line.boards.add(b + 1);
    }));
    return [...lines.values()].sort((a, b) => b.length * b.width - a.length * a.width);
}

const money = value => `${value.toFixed(2)}${plan.cost.currency ? ` ${plan.cost.currency}` : ''}`;

// What the build costs; null where the job states no price.
export function costText() {
    if (!plan.cost) return null;
    const names = {boards: 'boards', base_board: 'base board', glue: 'glue', machine: 'machine', dowels: 'dowels'};
    const parts = Object.keys(names).filter(k => typeof plan.cost[k] === 'number').map(k => `${names[k]} ${money(plan.cost[k])}`);
    return {total: money(plan.cost.total), parts: parts.join(', ')};
}

export function boardsText() {
    const kinds = new Map();
    for (const board of plan.wood.boards) {
        const key = `${figure(board.length, 1)} × ${figure(board.width, 1)} × ${figure(board.thickness, 2)} mm`;
        kinds.set(key, (kinds.get(key) ?? 0) + 1);
    }
    return [...kinds].map(([size, count]) => `${plural(count, 'board')} ${size}`).join(', ');
}

// The sheet for the saw; null where the plan has no cut list.
export function cutListSheet() {
    if (!plan.wood) return null;
    const {wood} = plan, kerf = plan.job.slabs.kerf, saved = wood.uniform.sawn_m2 - wood.sawn_m2;
    return make('article', {class: 'sheet cutlist', id: 'cut-list', 'aria-label': 'Cut list'},
        make('div', {class: 'top'}, make('h3', {}, 'Cut list'), make('p', {}, make('strong', {}, boardsText()), make('br'),
            `${figure(wood.sawn_m2, 2)} m² in slabs and base board, of ${figure(wood.bought_m2, 2)} m²`, saved > 0.005 ? `; slabs as large as the pattern would be ${figure(wood.uniform.sawn_m2, 2)} m² of ${figure(wood.uniform.bought_m2, 2)} m²` : null)),
        make('div', {class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'Pieces to saw'}, make('table', {id: 'cut-list-pieces'}, make('thead', {}, make('tr', {}, ['Pieces', 'Size mm', 'Thick mm', 'For layer', 'On board'].map((h, i) => make('th', {scope: 'col', class: i === 0 || i === 2 ? 'n' : null}, h)))),
            make('tbody', {}, pieces().map(line => make('tr', {}, make('td', {class: 'n', 'data-label': 'Pieces'}, String(line.names.length)), make('td', {}, make('strong', {}, sizeOf(line))), make('td', {class: 'n', 'data-label': 'Thick mm'}, figure(line.thickness, 2)),
                make('td', {}, line.names.join(', ')), make('td', {}, [...line.boards].join(', '))))))),
        make('p', {class: 'key'}, plan.job.slabs.layout === 'nested' ? `Slabs are milled out of their board one by one, with a cutter of ${figure(kerf, 1)} mm or less. Sizes are finished sizes. cut_list.dxf draws their outlines.`
            : `Every cut (red, ${figure(kerf, 1)} mm) goes from edge to edge of what it cuts. Sizes are finished sizes. cut_list.csv holds the cuts in their order.`),
        make('div', {class: 'boards'}, wood.boards.map((board, b) => make('figure', {}, boardView(board, b + 1), make('figcaption', {}, `Board ${b + 1}: ${sizeOf(board)} × ${figure(board.thickness, 2)} mm`)))));
}
