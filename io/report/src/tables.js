// Tables that sort, lead to their place in the 3D view, and can be taken along as CSV.

import {cutterOf, duration, figure, make, plural, words} from './dom.js';
import {drawPlaces, drawSums} from './draw.js';
import {data, layerMinutes, operationName, operations, phases, plan, remarks, toolUse, verify} from './report.js';

// columns: {name, of: row => value, text: row => shown, numeric}
function sortable(id, title, columns, rows, place, show) {
    const body = make('tbody');
    const elements = rows.map(row => {
        const target = place(row);
        const element = make('tr', {}, columns.map((column, c) => {
            const text = String((column.text ?? column.of)(row) ?? '');
            const shown = c === 0 && show && target
                ? make('button', {class: 'link', type: 'button', 'aria-label': `${text}: show in 3D`, onclick: () => choose(element, target)}, text) : text;
            return make('td', {class: column.numeric ? 'n' : (column.tone ? column.tone(row) : null)}, shown);
        }));
        return {row, element};
    });
    function choose(element, target) {
        for (const old of document.querySelectorAll('tr[data-chosen]')) old.removeAttribute('data-chosen');
        element.setAttribute('data-chosen', '');
        show(target);
    }
    let sorted = -1, direction = 1;
    const heads = columns.map((column, c) => make('th', {scope: 'col', class: column.numeric ? 'n' : null},
        make('button', {type: 'button', onclick: () => sort(c)}, column.name)));
    function sort(c) {
        direction = sorted === c ? -direction : 1;
        sorted = c;
        const value = columns[c].of;
        // Equal rows keep the plan's order.
        elements.map((e, i) => [e, i]).sort(([a, i], [b, j]) => {
            const x = value(a.row), y = value(b.row);
            const order = typeof x === 'number' && typeof y === 'number' ? x - y : String(x ?? '').localeCompare(String(y ?? ''), 'en', {numeric: true});
            return direction * order || i - j;
        }).forEach(([e]) => body.append(e.element));
        heads.forEach((head, k) => k === c ? head.setAttribute('aria-sort', direction > 0 ? 'ascending' : 'descending') : head.removeAttribute('aria-sort'));
    }
    body.append(...elements.map(e => e.element));
    const csv = () => {
        const quote = value => /[",\n]/.test(value) ? `"${value.replaceAll('"', '""')}"` : value;
        const lines = [columns.map(c => c.name), ...rows.map(row => columns.map(c => c.of(row) ?? ''))].map(line => line.map(v => quote(String(v))).join(','));
        const link = make('a', {download: `${id}.csv`, href: URL.createObjectURL(new Blob([lines.join('\r\n') + '\r\n'], {type: 'text/csv'}))});
        link.click();
        setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    };
    return make('div', {class: 'card'},
        make('div', {class: 'tools-head'}, make('h3', {id: `${id}-title`}, title),
            make('button', {class: 'act', type: 'button', onclick: csv, 'aria-label': `${title} as CSV`}, 'CSV')),
        rows.length === 0 ? make('p', {class: 'note'}, 'None.') : make('div', {class: 'scroll tall', tabindex: 0, role: 'region', 'aria-labelledby': `${id}-title`},
            make('table', {id}, make('thead', {}, make('tr', {}, heads)), body)));
}

const number = (name, of, decimals = 2) => ({name, of, text: row => figure(of(row), decimals), numeric: true});
const text = (name, of, shown) => ({name, of, text: shown});

// How the tools of each layer were chosen, where there was anything to choose.
function selectionTables(show) {
    const chosen = plan.layers.map((layer, l) => ({layer, l})).filter(r => r.layer.selection);
    if (chosen.length === 0) return [];
    const rows = key => chosen.flatMap(r => r.layer.selection[key].map(entry => ({...r, entry})));
    const layer = number('Layer', r => r.layer.index, 0);
    const verdict = {...text('Verdict', r => r.entry.chosen ? 'chosen' : 'not chosen'), tone: r => r.entry.chosen ? 'chosen' : null};
    const tool = number => {
        const known = plan.tools.find(t => t.number === number);
        return known ? `T${number} ${known.name}` : `T${number}`;
    };
    const place = r => ({layer: r.l});
    return [
        sortable('candidates', 'Tools looked at', [
            layer, text('For', r => words(r.entry.purpose)), text('Tool', r => r.entry.tool, r => tool(r.entry.tool)), verdict,
            number('Reached (AR), %', r => r.entry.accessibility === null ? null : 100 * r.entry.accessibility, 2),
            number('Left to semi-rough (AS), mm²', r => r.entry.semi_rough_mm2, 1), number('Step down, mm', r => r.entry.stepdown, 3),
            number('Minutes', r => r.entry.minutes, 2), text('Reason', r => r.entry.reason),
        ], rows('candidates'), place, show),
        sortable('sets', 'Sets of tools compared', [
            layer, text('Set', r => r.entry.name), text('Tools, in their order', r => r.entry.tools.map(t => `T${t}`).join(' ')), verdict,
            number('Minutes', r => r.entry.minutes, 2), number('Left over the limit, mm²', r => r.entry.left_mm2, 1), text('Reason', r => r.entry.reason),
        ], rows('sets'), place, show),
    ];
}

// Where a program's level passes change their distance.
function bands(operation) {
    return (operation.bands ?? []).map(b => `${figure(b.z_low, 1)} to ${figure(b.z_high, 1)}: ${figure(b.stepdown, 3)} at ${figure(b.least_slope_deg, 1)}°`).join('; ');
}

// The slenderest slots, gaps and small holes, and what to cut them with.
function cavityTable(show) {
    const {cavities} = data;
    if (!cavities?.places) return [];
    // Where the proof finds nothing out of reach there is nothing to do, whatever tool the plan has taken for it.
    const made = (verify?.totals?.unreachable_mm2 ?? 1) < 0.5;
    const advice = r => made ? 'nothing: the proof finds it made' : r.advice;
    const title = `Narrow cavities (${plural(cavities.places, 'place')} up to ${figure(cavities.limits.width, 1)} mm wide)`;
    return [sortable('cavities', title, [
        number('Width, mm', r => r.width, 3), number('Widest, mm', r => r.widest, 3), number('Depth, mm', r => r.depth, 2), number('Depth to width', r => r.ratio, 1),
        number('Length, mm', r => r.length, 1), number('Area, mm²', r => r.area, 1), text('Layers', r => r.layers[0].layer, r => r.layers.map(l => l.layer).join(', ')),
        number('Stick-out needed, mm', r => r.stickout, 1), text('Tool', r => r.tool?.number ?? 0, r => r.tool ? `T${r.tool.number}` : 'none'),
        number('It leaves, mm²', r => r.tool?.left, 1), text('Missing', r => made ? '' : r.missing?.name ?? ''), text('What to do', advice),
        number('x', r => r.where[0]), number('y', r => r.where[1]), number('z', r => r.where[2]),
    ], cavities.slenderest, r => ({where: r.where, text: advice(r)}), show)];
}

export function buildTables(section, show) {
    section.classList.add('tables');
    const minutes = layerMinutes().map(row => phases.reduce((sum, phase) => sum + row[phase.key], 0));
    const layers = plan.layers.map((layer, l) => ({layer, l}));
    const height = row => row.layer.z_top - row.layer.z_bottom;
    section.append(
        sortable('layers', 'Layers', [
            number('Layer', r => r.layer.index, 0), number('Bottom, mm', r => r.layer.z_bottom, 3), number('Top, mm', r => r.layer.z_top, 3),
            number('Height, mm', height, 3), number('Slab, mm', r => r.layer.slab_thickness, 3), text('Boundary', r => r.layer.reason),
            number('Glue, cm²', r => r.layer.glue_area_mm2 / 100, 1), number('Press, N', r => r.layer.press_force_n, 0),
            number('Programs', r => r.layer.operations.length, 0), {...number('Minutes', r => minutes[r.l]), text: r => duration(minutes[r.l])},
        ], layers, r => ({layer: r.l}), show),
        sortable('operations', 'Operations', [
            text('Program', r => r.name), number('Layer', r => plan.layers[r.layer].index, 0), text('Kind', r => words(r.kind)), text('Purpose', r => r.purpose),
            text('Tool', r => r.tool, r => `T${r.tool}`), number('Step down, mm', r => r.stepdown, 3), number('Step over, mm', r => r.stepover, 3),
            number('Spindle, rpm', r => r.spindle_rpm, 0), number('Cutting, m', r => r.cutting_mm / 1000), number('Rapid, m', r => r.rapid_mm / 1000),
            {...number('Minutes', r => r.minutes), text: r => duration(r.minutes)}, number('Peak force, N', r => r.peak_force_n, 1), number('Deflection, mm', r => r.deflection_mm, 4),
            text('Steps by height, mm', bands),
        ], operations, r => ({layer: r.layer, operation: r.index, text: operationName(r)}), show),
        sortable('tools', 'Tools', [
            text('Tool', r => r.tool.number, r => `T${r.tool.number}`), text('Name', r => r.tool.name), text('Kind', r => cutterOf(r.tool)), number('Diameter, mm', r => r.tool.diameter, 3),
            number('Flutes, mm', r => r.tool.flute_length, 1), number('Shank, mm', r => r.tool.shank_diameter, 3), number('Stick-out, mm', r => r.tool.holder.stickout, 1),
            number('Holder, mm', r => r.tool.holder.diameter, 1), number('Programs', r => r.uses.length, 0), {...number('Minutes', r => r.minutes), text: r => duration(r.minutes)},
        ], toolUse(), r => r.uses.length ? {layer: r.uses[0].layer, operation: r.uses[0].index, text: `first use of T${r.tool.number}: ${operationName(r.uses[0])}`} : null, show),
        ...selectionTables(show),
        sortable('draw', drawSums.length ? `Draft and draw (${drawSums.join('; ')})` : 'Draft and draw', [
            text('Finding', r => r.kind), number('Area, mm²', r => r.area, 1), number('Length, mm', r => r.length, 1), text('Worst', r => r.worst),
            number('x', r => r.where[0]), number('y', r => r.where[1]), number('z', r => r.where[2]),
        ], drawPlaces, r => ({where: r.where, text: `${r.kind}, ${r.worst}`}), show),
        ...cavityTable(show),
        sortable('remarks', 'Remarks and findings', [
            text('Code', r => r.code), {...text('Severity', r => r.severity), tone: r => r.severity}, text('From', r => r.source), text('Message', r => r.message),
            number('x', r => r.where?.[0]), number('y', r => r.where?.[1]), number('z', r => r.where?.[2]),
        ], remarks, r => r.where ? {where: r.where, text: r.message} : null, show));
}
