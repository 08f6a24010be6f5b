// What the page knows: plan.json and verify.json as they are, and figures drawn from them. Nothing is decided here.

import {duration, figure, plural, words} from './dom.js';

export const data = JSON.parse(document.getElementById('slabwright-data').textContent);
export const {plan, verify} = data;

// Shares of the build time, in the order of the work.
export const phases = [
    {key: 'slabs', name: 'Slabs and glue', color: '#8a94a0'},
    {key: 'press', name: 'Press', color: '#50648f'},
    {key: 'face', name: 'Face', color: '#8a5a2b'},
    {key: 'rough', name: 'Rough', color: '#c0822a'},
    {key: 'finish', name: 'Finish', color: '#23767d'},
    {key: 'tool_change', name: 'Tool changes', color: '#a8455a'},
    {key: 'other', name: 'Other', color: '#6b6b6b'},
];

const ofAction = {
    mount_board: 'slabs', take_slab: 'slabs', clamp: 'slabs', glue: 'slabs', set_dowels: 'slabs', place: 'slabs', press: 'press', face: 'face', tool_change: 'tool_change', load_tool: 'tool_change',
};
const ofKind = {face: 'face', rough: 'rough', semi_rough: 'rough'};

export const operations = plan.layers.flatMap((layer, l) => layer.operations.map((operation, o) => ({
    ...operation, layer: l, place: o, name: operation.file.replace(/^nc\//, '').replace('#', ' · '),
})));
// The programs of plan.layers, with their layer and number.
operations.forEach((operation, i) => { operation.index = i; });
// Those of each program: nc/L003.ngc#1 and nc/L003.ngc#2 lie in nc/L003.ngc.
export const fileOf = operation => operation.file.replace(/#.*/, '');
const inFile = new Map();
for (const operation of operations) inFile.set(fileOf(operation), [...(inFile.get(fileOf(operation)) ?? []), operation]);

// Minutes of every layer by phase.
export function layerMinutes() {
    const rows = plan.layers.map(() => Object.fromEntries(phases.map(phase => [phase.key, 0])));
    const position = new Map(plan.layers.map((layer, l) => [layer.index, l]));
    if (data.steps.length === 0) {
        for (const operation of operations) rows[operation.layer][ofKind[operation.kind] ?? 'finish'] += operation.minutes;
        return rows;
    }
    for (const [index, action, seconds, program] of data.steps) {
        const row = rows[position.get(index) ?? 0];
        const inside = (program && inFile.get(program)) ?? [];
        if (inside.length > 1) {
            for (const operation of inside) row[ofKind[operation.kind] ?? 'finish'] += operation.minutes;
            row.tool_change += Math.max(0, seconds / 60 - inside.reduce((sum, operation) => sum + operation.minutes, 0));
            continue;
        }
        const phase = inside.length === 1 ? ofKind[inside[0].kind] ?? 'finish' : ofAction[action] ?? 'other';
        row[phase] += seconds / 60;
    }
    return rows;
}

// Minutes in words that add up to the total in words: rounded down, and what is missing given to the largest parts.
export function sharedMinutes(list, total) {
    const whole = list.map(m => m < 1 ? m : Math.floor(m)), missing = Math.round(total) - Math.round(whole.reduce((a, b) => a + b, 0));
    const order = list.map((m, i) => [m - whole[i], i]).filter(([, i]) => list[i] >= 1).sort(([a, i], [b, j]) => b - a || i - j);
    for (let k = 0; k < missing && k < order.length; ++k) ++whole[order[k][1]];
    return whole.map(m => duration(m));
}

// What the slabs of layer l cover, {min, max}: its own blank, or the whole stock.
export function blankOf(l) {
    return plan.layers[l].blank ?? plan.stock;
}

// "500 × 400 mm" of layer l's slabs.
export function blankSize(l) {
    const {min, max} = blankOf(l);
    return `${figure(max[0] - min[0], 1)} × ${figure(max[1] - min[1], 1)}`;
}

export function toolOf(number) {
    return plan.tools.find(tool => tool.number === number);
}

// Which tools the plan uses, in the order of their numbers.
export function toolUse() {
    return plan.tools.map(tool => {
        const uses = operations.filter(operation => operation.tool === tool.number);
        return {tool, uses, minutes: uses.reduce((sum, operation) => sum + operation.minutes, 0)};
    }).sort((a, b) => a.tool.number - b.tool.number);
}

// Remarks of the plan and violations of the simulation, one list.
export const remarks = [
    ...plan.diagnostics.map(d => ({...d, source: 'plan'})),
    ...(verify?.violations ?? []).map(v => ({
        severity: 'error', code: v.code, message: v.file ? `${v.file}${v.line ? `:${v.line}` : ''}: ${v.message}` : v.message, where: v.where, source: 'verify',
    })),
];

// What the simulation found that the programs do not make, in words.
function notMade() {
    const totals = verify?.totals ?? {};
    const missing = [];
    if (totals.unmade_mm3 >= 1)
        missing.push(`${totals.unmade_mm3 < 1000 ? `${totals.unmade_mm3.toFixed(0)} mm³` : `${(totals.unmade_mm3 / 1000).toFixed(0)} cm³`} that stay filled under overhangs (up to ${totals.unmade_height_mm.toFixed(1)} mm high, red in the pictures)`);
    if (totals.unreachable_mm2 > 0.01 * totals.pattern_mm2)
        missing.push(`${totals.unreachable_mm2.toFixed(0)} mm² that no tool reaches (${(100 * totals.unreachable_of_pattern_share).toFixed(1)} % of the pattern seen from above, up to ${totals.unreachable_max_mm.toFixed(2)} mm)`);
    return missing;
}

export function verdict() {
    const count = severity => remarks.filter(r => r.severity === severity).length;
    const errors = count('error'), warnings = count('warning');
    if (verify && !verify.passed) return {kind: 'no', title: 'No', text: `The simulation of the programs found ${plural(verify.violations.length, 'fault')}.`};
    if (errors) return {kind: 'no', title: 'No', text: `The plan reports ${plural(errors, 'error')}.`};
    if (!verify) {
        return {
            kind: 'open', title: warnings ? 'Planned, with remarks' : 'Planned',
            text: 'The programs have not been simulated yet: run “slabwright verify” on this folder, then “slabwright report”.',
        };
    }
    const kinds = new Set(remarks.filter(r => r.severity === 'warning').map(r => r.code)).size;
    const toRead = warnings > kinds ? `${plural(warnings, 'warning')} of ${plural(kinds, 'kind')} to read first.` : `${plural(warnings, 'warning')} to read first.`;
    const missing = notMade();
    if (missing.length) {
        return {
            kind: 'remarks', title: 'All but a part of it',
            text: `The simulated programs make the pattern but for ${missing.join(' and ')}.`
                + (warnings ? ` ${toRead}` : ''),
        };
    }
    if (warnings) return {kind: 'remarks', title: 'Yes, with remarks', text: `The simulated programs make the part. ${toRead}`};
    return {kind: 'yes', title: 'Yes', text: 'The simulated programs make the part.'};
}

export function layerName(l) {
    return `Layer ${plan.layers[l].index}`;
}

export function operationName(operation) {
    return `${operation.name.replace(/\.(ngc|nc|gcode|tap|mpf|h|cnc|txt|eia|iso|min|din|anc|fnc|pim|g)(?=$| ·)/, '')}, ${words(operation.kind)}: ${operation.purpose}`;
}

export const featureKinds = {
    peak: {name: 'Peak', color: '#b3541e'},
    valley: {name: 'Valley', color: '#7a4fa3'},
    up_flat: {name: 'Flat, facing up', color: '#2d6fb0'},
    down_flat: {name: 'Flat, facing down', color: '#a01c48'},
    shallow: {name: 'Shallow slope', color: '#3b7d3a'},
    saddle: {name: 'Saddle', color: '#6b6b6b'},
    undercut: {name: 'Undercut', color: '#d02020'},
};

export function featureRange(feature) {
    return Array.isArray(feature.z) ? feature.z : [feature.z, feature.z];
}

// Heights where no boundary may lie: less than the least thickness of material above it (method: z in (h − MTmin, h)).
export function nonDeposition() {
    const least = plan.job.material.min_thickness;
    if (!(least > 0)) return [];
    const ranges = plan.features.filter(f => f.type === 'peak' || f.type === 'valley' || f.type === 'up_flat')
        .map(f => [Math.max(0, featureRange(f)[0] - least), featureRange(f)[0]]).sort((a, b) => a[0] - b[0]);
    const merged = [];
    for (const [low, high] of ranges) {
        const last = merged[merged.length - 1];
        if (last && low <= last[1]) last[1] = Math.max(last[1], high);
        else merged.push([low, high]);
    }
    return merged;
}

export function totals() {
    const t = plan.totals;
    const area = (plan.stock.max[0] - plan.stock.min[0]) * (plan.stock.max[1] - plan.stock.min[1]);
    const slabs = new Map();
    for (const layer of plan.layers) slabs.set(layer.slab_thickness, (slabs.get(layer.slab_thickness) ?? 0) + 1);
    return {
        ...t, slab_area_mm2: area,
        slabs: [...slabs].map(([thickness, count]) => ({thickness, count})).sort((a, b) => a.thickness - b.thickness),
        glue_mm2: plan.layers.reduce((sum, layer) => sum + layer.glue_area_mm2, 0),
        waste_share: t.stock_volume_mm3 > 0 ? 1 - t.part_volume_mm3 / t.stock_volume_mm3 : 0,
    };
}

// The flask's borders in a layer: its outside and its opening.
export function flaskRings(l) {
    const {flask} = plan;
    return flask ? [flask.outer, flask.inner_by_layer?.[l] ?? flask.inner] : [];
}

export function size() {
    const {min, max} = plan.input.bbox;
    return max.map((v, k) => v - min[k]);
}

export {duration, figure};
