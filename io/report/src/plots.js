// Plots, drawn by Observable Plot as SVG.

import * as Plot from '@observablehq/plot';
import {figure, make} from './dom.js';
import {filledBoxes} from './wood.js';
import {data, featureKinds, featureRange, layerMinutes, nonDeposition, operationName, operations, phases, plan, size} from './report.js';

const style = {fontFamily: 'inherit', fontSize: '12px', color: '#1f252b', background: 'transparent'};
const toolColors = ['#8a5a2b', '#c0822a', '#23767d', '#50648f', '#a8455a', '#5b7f3a', '#6f4f9b', '#3a3f45'];
const toolColor = number => toolColors[Math.max(0, plan.tools.findIndex(tool => tool.number === number)) % toolColors.length];

// Round values within a range, about eight of them.
function roundValues(low, high) {
    const raw = (high - low) / 8, unit = 10 ** Math.floor(Math.log10(raw)), step = unit * [1, 2, 5, 10].find(k => k * unit >= raw);
    const list = [];
    for (let v = Math.ceil(low / step) * step; v <= high; v += step) list.push(v);
    return list;
}

function framed(title, label, caption, draw, wide = false) {
    const svg = draw();
    const drawing = svg.tagName.toLowerCase() === 'svg' ? svg : svg.querySelector(':scope > svg'); // beside its legend
    for (const part of svg.querySelectorAll('[aria-label]')) part.removeAttribute('aria-label'); // Plot names its marks; the picture has one name
    for (const part of svg.querySelectorAll('[aria-description]')) part.removeAttribute('aria-description');
    drawing.setAttribute('role', 'img');
    drawing.setAttribute('aria-label', label);
    return make('figure', {class: wide ? 'card wide' : 'card'}, make('h3', {}, title), svg, make('figcaption', {}, caption));
}

// The picture a planner argues with: the silhouette, the boundaries, and beside them what asks for boundaries or forbids them.
// k: which axis runs to the right, 0 for x (seen along y) and 1 for y (seen along x).
function stack(k) {
    const {z0, dz} = data.silhouette;
    const rows = data.silhouette['xy'[k]].flatMap((row, i) => {
        const cells = [];
        for (let c = 0; c < row.length; c += 2) cells.push({x1: row[c], x2: row[c + 1], y1: z0 + i * dz, y2: z0 + (i + 1) * dz});
        return cells;
    });
    const s0 = plan.stock.min[k], s1 = plan.stock.max[k], width = s1 - s0;
    const lane = n => [s1 + width * (0.03 + 0.13 * n), s1 + width * (0.03 + 0.13 * n + 0.1)];
    const none = lane(0), shallow = lane(1), points = lane(2), end = points[1] + width * 0.02;
    const height = Math.max(...plan.layers.map(l => l.z_bottom + l.slab_thickness));
    const marks = plan.features.filter(f => f.type !== 'shallow').map(f => ({x: points[0] + (points[1] - points[0]) * ((f.xy[k] - s0) / width), z: featureRange(f)[0], type: featureKinds[f.type]?.name ?? f.type}));
    const names = Object.values(featureKinds).filter(kind => marks.some(m => m.type === kind.name));
    const above = height * 1.03;
    // Glue as it lies, not over air.
    const joints = plan.layers.flatMap((layer, l) => data.outlines.layers[l].glue.map(points => {
        const along = points.filter((_, i) => i % 2 === k).map(v => v * data.outlines.unit_mm);
        return {a: Math.min(...along), b: Math.max(...along), z: layer.z_bottom};
    }));
    return Plot.plot({
        width: 1180, height: 470, marginLeft: 55, marginTop: 26, style,
        x: {label: null, domain: [s0, end], axis: null}, y: {label: 'z, mm', domain: [0, height * 1.06], grid: false},
        color: {domain: names.map(n => n.name), range: names.map(n => n.color), legend: names.length > 0},
        marks: [
            Plot.axisX(roundValues(s0, s1), {label: null}),
            Plot.rect(plan.layers, {x1: s0, x2: s1, y1: l => l.z_top, y2: l => l.z_bottom + l.slab_thickness, fill: '#efe3cd', stroke: '#c9b48c', strokeDasharray: '3,3'}),
            Plot.rect(plan.layers, {x1: s0, x2: s1, y1: 'z_bottom', y2: 'z_top', fill: (_, i) => i % 2 ? '#f3ead9' : '#f8f2e6', stroke: '#c9b48c'}),
            Plot.rect(rows, {x1: 'x1', x2: 'x2', y1: 'y1', y2: 'y2', fill: '#93a1ac', insetTop: -0.4, insetBottom: -0.4}),
            Plot.rect(plan.layers.flatMap((_, l) => filledBoxes(l)), {x1: b => k === 0 ? b.x0 : b.y0, x2: b => k === 0 ? b.x1 : b.y1, y1: 'z0', y2: 'z1', fill: '#d3202f'}),
            Plot.ruleY(plan.layers, {x1: s0, x2: end, y: 'z_top', stroke: '#17636b', strokeWidth: 0.8, strokeDasharray: '4,3'}),
            Plot.ruleY(joints, {x1: 'a', x2: 'b', y: 'z', stroke: '#d69a1e', strokeWidth: 3}),
            Plot.text(plan.layers, {x: s0, y: l => (l.z_bottom + l.z_top) / 2, text: l => String(l.index), textAnchor: 'start', dx: 6, fill: '#1f252b', fontWeight: 600}),
            Plot.rect(nonDeposition(), {x1: none[0], x2: none[1], y1: d => d[0], y2: d => d[1], fill: '#c65d5d', fillOpacity: 0.75}),
            Plot.rect(plan.features.filter(f => f.type === 'shallow'), {x1: shallow[0], x2: shallow[1], y1: f => featureRange(f)[0], y2: f => featureRange(f)[1], fill: '#3b7d3a', fillOpacity: 0.25, stroke: '#3b7d3a', strokeOpacity: 0.5}),
            Plot.dot(marks, {x: 'x', y: 'z', fill: 'type', r: 3.2}),
            Plot.text([[none, 'no boundary'], [shallow, 'shallow'], [points, 'features']], {x: d => (d[0][0] + d[0][1]) / 2, y: above, text: d => d[1], fill: '#525c66'}),
        ],
    });
}

function alphaMap() {
    const {z0, dz, least_deg: least} = data.slopes;
    const rows = least.map((a, i) => ({a, z1: z0 + i * dz, z2: z0 + (i + 1) * dz}));
    const limits = [{a: plan.job.material.shallow_limit_deg, name: 'shallow'}, {a: plan.job.cutting.steep_limit_deg, name: 'steep'}];
    return Plot.plot({
        width: 520, height: 360, marginBottom: 42, marginLeft: 50, marginTop: 26, style, x: {label: 'least slope α, degrees', domain: [0, 90], ticks: 7, grid: true}, y: {label: 'z, mm'},
        marks: [
            Plot.rect(rows, {x1: 0, x2: 'a', y1: 'z1', y2: 'z2', fill: '#4b9197', insetTop: -0.4, insetBottom: -0.4}),
            Plot.ruleX(limits, {x: 'a', stroke: '#a3202c', strokeDasharray: '4,3'}),
            Plot.text(limits, {x: 'a', frameAnchor: 'top', dy: -9, text: d => `${d.name} ${figure(d.a, 1)}°`, fill: '#a3202c'}),
            Plot.ruleY(plan.layers, {y: 'z_top', stroke: '#17636b', strokeOpacity: 0.5}),
        ],
    });
}

function slopeAreas() {
    const rows = data.slopes.area_mm2.map((area, i) => ({area: area / 100, d1: i, d2: i + 1}));
    return Plot.plot({
        width: 520, height: 360, marginBottom: 42, marginLeft: 60, style, x: {label: 'slope, degrees', domain: [0, 90], ticks: 7}, y: {label: 'area, cm²', grid: true, type: 'sqrt', ticks: 5},
        marks: [Plot.rect(rows, {x1: 'd1', x2: 'd2', y1: 0, y2: 'area', fill: '#50648f', inset: 0.3}), Plot.ruleY([0])],
    });
}

function toolOverHeight() {
    const rows = [];
    for (const layer of plan.layers)
        for (const tool of plan.tools) {
            const minutes = layer.operations.filter(o => o.tool === tool.number).reduce((sum, o) => sum + o.minutes, 0);
            if (minutes > 0) rows.push({name: `T${tool.number}`, tool: tool.number, z1: layer.z_bottom, z2: layer.z_top, minutes});
        }
    return Plot.plot({
        width: 520, height: 360, marginBottom: 42, marginLeft: 50, style, x: {type: 'band', label: null, domain: plan.tools.map(t => `T${t.number}`), padding: 0.15}, y: {label: 'z, mm', grid: true},
        marks: [
            Plot.barY(rows, {x: 'name', y1: 'z1', y2: 'z2', fill: r => toolColor(r.tool), insetTop: 1, insetBottom: 1}),
            Plot.text(rows, {x: 'name', y: r => (r.z1 + r.z2) / 2, text: r => `${figure(r.minutes, 1)} min`, fill: '#fff', stroke: '#1f252b', strokeWidth: 3, fontWeight: 600}),
        ],
    });
}

function timePerLayer() {
    const rows = layerMinutes().flatMap((row, l) => phases.filter(p => row[p.key] > 0).map(p => ({layer: plan.layers[l].index, phase: p.name, minutes: row[p.key]})));
    const used = phases.filter(p => rows.some(r => r.phase === p.name));
    return Plot.plot({
        width: 1180, height: Math.max(140, 30 * plan.layers.length + 70), marginBottom: 42, marginLeft: 50, style,
        color: {domain: used.map(p => p.name), range: used.map(p => p.color), legend: true},
        x: {label: 'minutes', grid: true}, y: {type: 'band', label: 'layer', domain: plan.layers.map(l => l.index).reverse(), tickFormat: d => String(d)},
        marks: [Plot.barX(rows, {x: 'minutes', y: 'layer', fill: 'phase', inset: 0.5})],
    });
}

function along(index, key, label, limits, color) {
    const operation = operations[index], values = data.engagement[index]?.[key] ?? [];
    const step = operation.minutes / Math.max(1, values.length);
    const rows = values.map((v, i) => ({v, t1: i * step, t2: (i + 1) * step}));
    return Plot.plot({
        width: 520, height: 270, marginBottom: 42, marginLeft: 60, marginRight: 20, marginTop: 24, style, x: {label: 'minutes', domain: [0, operation.minutes || 1]}, y: {label, grid: true, domain: [0, 1.12 * Math.max(1e-9, ...values, ...limits.map(l => l.v))]},
        marks: [
            Plot.rect(rows, {x1: 't1', x2: 't2', y1: 0, y2: 'v', fill: color, fillOpacity: 0.85}),
            Plot.ruleY(limits, {y: 'v', stroke: '#a3202c', strokeDasharray: '5,3', strokeWidth: 1.4}),
            Plot.text(limits, {y: 'v', frameAnchor: 'right', text: 'name', dy: -7, fill: '#a3202c', stroke: '#fff', strokeWidth: 4}),
            Plot.ruleY([0]),
        ],
    });
}

function forces() {
    const pictures = make('div', {class: 'plots'});
    const select = make('select', {id: 'force-operation', onchange: () => draw()}, operations.map(o => make('option', {value: o.index}, operationName(o))));
    select.value = String(Math.max(0, operations.findIndex(o => o.kind === 'rough')));
    function draw() {
        const i = Number(select.value), o = operations[i];
        const allowed = {v: o.bending_limit, name: 'allowed bending'};
        const deflections = data.engagement[i]?.deflection_mm ?? [], most = Math.max(0, ...deflections, o.deflection_mm);
        // A limit far above everything would flatten the curve; then it is told, not drawn.
        const limits = [{v: o.deflection_mm, name: 'plan: heaviest cut'}, ...(allowed.v < 4 * most ? [allowed] : [])];
        pictures.replaceChildren(
            framed('Force', `Peak force along ${o.name}`, `Plan: ${figure(o.peak_force_n, 2)} N at the heaviest cut.`,
                () => along(i, 'force_n', 'peak force, N', [{v: o.peak_force_n, name: 'plan: heaviest cut'}], toolColor(o.tool))),
            framed('Deflection', `Deflection of the tip along ${o.name}`, `Plan: ${figure(o.deflection_mm, 4)} mm; limit: ${allowed.name} ${figure(allowed.v, 3)} mm.`,
                () => along(i, 'deflection_mm', 'deflection, mm', limits, toolColor(o.tool))));
    }
    draw();
    return make('div', {class: 'card wide'}, make('h3', {}, 'Force and deflection along a program'),
        make('p', {}, make('label', {for: 'force-operation'}, 'Program '), select), pictures,
        make('p', {class: 'note'}, `Depth and width of cut are read off the stock as simulated at ${figure(data.stock.cell_mm, 2)} mm between its points, over pieces of equal time; the force model (edge forces, ${plan.job.material.name}) `
            + 'then gives the peak over one turn at the piece’s fastest feed. The plan’s own figure is for the heaviest cut of the whole operation, found from a finer stock. Between the stock’s points cuts go unseen, so fine passes show gaps.'));
}

function stacks(height) {
    const box = make('div');
    const select = make('select', {id: 'stack-side', onchange: () => draw()}, make('option', {value: 0}, 'along y'), make('option', {value: 1}, 'along x'));
    function draw() {
        const material = plan.job.material.min_thickness;
        const least = material > 0 ? `heights where a boundary would leave less than ${figure(material, 2)} mm of material`
            : 'no heights without boundaries, since the job leaves the least thickness to the forces and plan.json does not state it';
        const k = Number(select.value), [right, seen] = k === 0 ? ['x', 'y'] : ['y', 'x'];
        box.replaceChildren(framed('Layer stack', `Layers beside the silhouette of the pattern, seen along ${seen}: ${plan.layers.length} layers over ${figure(height, 1)} mm`,
            `Grey: the pattern seen along ${seen}, ${right} to the right, mm. Red: what stays filled. Yellow: glue. Dashed lines: boundaries, and what facing takes off. Beside: ${least}, shallow slopes under ${figure(plan.job.material.shallow_limit_deg, 1)}°, and features by height (left to right as they lie in ${right}).`,
            () => stack(k), true));
        box.querySelector('h3').after(make('p', {}, make('label', {for: 'stack-side'}, 'Seen '), select));
    }
    draw();
    box.className = 'wide';
    return box;
}

export function buildPlots(section) {
    const height = size()[2];
    section.append(make('div', {class: 'plots'},
        stacks(height),
        framed('α-map', 'Least slope at each height', 'The least slope of what is to be machined at each height; thin lines are boundaries.', alphaMap),
        framed('Area by slope', 'Area of the surface by its slope', `0° is flat, 90° upright. Facing down: ${figure(data.slopes.down_flat_mm2 / 100, 1)} cm² level (the base among them), ${figure(data.slopes.undercut_mm2 / 100, 2)} cm² undercut.`, slopeAreas),
        framed('Tool over height', 'Which tool cuts at which height, and for how long', plan.tools.map(t => `T${t.number} ${t.name}`).join(' · '), toolOverHeight),
        framed('Time for each layer', 'Build time of each layer by kind of work', 'From sequence.json: bonding, cutting and tool changes.', timePerLayer, true),
        forces()));
}
