// What hangs at the machine: a cover with what to load and how long it takes, and one printed page for each layer.

import {duration, figure, formOf, make, plural, words} from './dom.js';
import {boardsText, costText, cutListSheet} from './cutlist.js';
import {dowelsIn, keepOutsIn, planView, sideView, stackView, supportsIn} from './drawing.js';
import {blankOf, blankSize, data, fileOf, layerMinutes, operations, phases, plan, remarks, sharedMinutes, toolOf, toolUse, totals, verdict, verify} from './report.js';
import {undersideOf, undersideSheets} from './undersides.js';
import {filledVolume} from './wood.js';
import {inInches, onControl, probed, tableHeight, zeroHeight, zeroIsSet, zeroOf} from './zero.js';

const cubic = mm3 => mm3 < 1000 ? `${figure(mm3, 0)} mm³` : `${figure(mm3 / 1000, 1)} cm³`;

// A box that can be ticked on paper and on a screen, where the browser keeps it for this plan.
function tick(key, text, hidden = false) {
    const name = `slabwright:${plan.input.sha256.slice(0, 12)}:${figure(plan.totals.build_minutes, 3)}:${key}`;
    const box = make('input', {type: 'checkbox', 'aria-label': hidden ? text : null});
    // A page that lies in a folder may have no memory.
    try { box.checked = globalThis.localStorage?.getItem(name) === '1'; } catch { /* then it forgets */ }
    box.addEventListener('change', () => {
        try { box.checked ? globalThis.localStorage?.setItem(name, '1') : globalThis.localStorage?.removeItem(name); } catch { /* then it forgets */ }
    });
    return hidden ? box : make('label', {class: 'check'}, box, make('span', {}, text));
}

// The layer that a remark is about, or −1 where it is about the whole build.
function layerOf(remark) {
    const said = /\bL0*(\d+)_/.exec(remark.message) ?? /\blayer (\d+)\b/.exec(remark.message);
    if (said) return plan.layers.findIndex(layer => layer.index === Number(said[1]));
    if (!remark.where) return -1;
    return plan.layers.findIndex(layer => remark.where[2] <= layer.z_top + 1e-6);
}

// Warnings and errors of layer l (−1: of the whole build), those of one kind together.
function warningsOf(l) {
    const groups = new Map();
    for (const remark of remarks) {
        if (remark.severity === 'note' || layerOf(remark) !== l) continue;
        if (!groups.has(remark.code)) groups.set(remark.code, []);
        groups.get(remark.code).push(remark.message);
    }
    return [...groups.values()].map(([first, ...others]) => others.length ? `${first} (and ${others.length} more like it)` : first);
}

function warningBox(list, most) {
    if (list.length === 0) return null;
    const shown = list.slice(0, most);
    if (list.length > most) shown.push(`and ${plural(list.length - most, 'more kind', 'more kinds')}, in the table of remarks`);
    return make('div', {class: 'warnings'}, make('strong', {}, shown.length === 1 ? 'Warning' : 'Warnings'), make('ul', {}, shown.map(text => make('li', {}, text))));
}

const span = (values, unit) => {
    const known = values.filter(v => v !== null && v !== undefined);
    if (known.length === 0) return '–';
    const low = Math.min(...known), high = Math.max(...known);
    return `${low === high ? figure(high, 0) : `${figure(low, 0)}–${figure(high, 0)}`}${unit}`;
};
const feedsOf = list => span(list.flatMap(o => [data.feeds?.[o.index]?.low, data.feeds?.[o.index]?.high]), '');

function table(head, rows, numeric = []) {
    const tone = i => numeric.includes(i) ? 'n' : null;
    return make('table', {}, make('thead', {}, make('tr', {}, head.map((h, i) => make('th', {scope: 'col', class: tone(i)}, h)))),
        make('tbody', {}, rows.map(row => make('tr', {}, row.map((cell, i) => make('td', {class: tone(i), 'data-label': tone(i) && cell !== '' ? head[i] : null}, cell))))));
}

function toolRows(uses, key) {
    const numbers = [...new Set(uses.map(o => o.tool))].sort((a, b) => a - b);
    return numbers.map(number => ({number, tool: toolOf(number), list: uses.filter(o => o.tool === number)})).filter(r => r.tool).map(({number, tool, list}) => [
        tick(`${key}:T${number}`, `T${number} loaded and measured`, true), make('strong', {}, `T${number}`), tool.name, figure(tool.diameter, 3) + formOf(tool), make('strong', {}, figure(tool.holder.stickout, 1)),
        figure(tool.flute_length, 1), span(list.map(o => o.spindle_rpm), ''), feedsOf(list)]);
}
const toolHead = ['✓', 'Number', 'Tool', 'Ø mm', 'Stick-out mm', 'Flutes mm', 'rpm', 'Feed mm/min'];

// Which control the programs are for, where it is not LinuxCNC in millimetres, and what they leave to its settings.
function control() {
    const {post, units} = plan.job.machine;
    if (!post || (post === 'linuxcnc' && units === 'mm')) return '';
    const settings = {fanuc: 'corners rounded by 0.02 mm at most', iso: 'corners rounded by 0.02 mm at most', mach: 'corners rounded by 0.02 mm at most, G4 in seconds', grbl: '$11 = 0.02 at most, $32 = 0'}[post];
    return ` (${post}, ${units}${settings ? `; set there: ${settings}` : ''})`;
}

function fact(name, ...content) {
    return make('div', {class: 'fact'}, make('h4', {}, name), content);
}

function foundIn(l) {
    return verify?.layers?.find(f => f.index === plan.layers[l].index) ?? verify?.layers?.[l];
}

// What the simulation says of the layer, each figure with what it is of.
function simulated(l) {
    const found = foundIn(l);
    if (!found) return ['not simulated: run “slabwright verify” before cutting'];
    const left = found.missed?.mm > 0 ? `at most ${figure(found.missed.mm, 3)} mm` : `no more than the ${figure(verify.limits.left_over_mm, 3)} mm allowed`;
    const lines = [`deepest gouge ${figure(found.gouge.mm, 4)} mm; left over where a tool reaches ${left}`];
    if (found.unreachable_mm2 >= 0.5) lines.push(`out of every tool’s reach ${figure(found.unreachable_mm2, 1)} mm², up to ${figure(found.unreachable?.mm, 2)} mm`);
    return lines;
}

// What the machine's glue head does on layer l's joint; by hand: nothing.
function glueHead(l) {
    const head = data.outlines.layers[l].glue_head;
    if (!head) return null;
    const grams = head.glue_g === undefined ? '' : `${figure(head.glue_g, 1)} g, pump ${figure(head.pump_g_min, 0)} g/min, `;
    return make('p', {class: 'glue-head'}, `by the head on the ${head.side === 'slab' ? 'slab’s underside' : 'stack’s top'}: ${grams}${figure(head.bead_mm / 1000, 2)} m of beads at ${figure(head.speed_mm_min, 0)} mm/min`);
}

// What is put into the machine's magazine for layer l: at the start all of it, then what is swapped before which program.
function magazine(l) {
    const loads = [];
    let next = '';
    for (const [layer, action, , detail] of [...data.steps].reverse()) {
        if (typeof detail === 'string') next = detail;
        if (action === 'load_tool' && layer === plan.layers[l].index) loads.unshift({...detail, before: next});
    }
    if (!loads.length) return null;
    const rows = loads.map(({place, tool, tool_out: out, from, before}, i) => [
        tick(`L${l}:M${i}`, `T${tool} in place ${place}`, true), figure(place, 0), make('strong', {}, `T${tool}`), toolOf(tool)?.name ?? '',
        out ? `T${out}${from ? ', out of the spindle' : ''}` : 'empty', out ? make('code', {}, before.replace(/^nc\//, '')) : 'the start']);
    return make('div', {}, make('h4', {}, `Magazine of ${plan.job.machine.magazine} places`), table(['✓', 'Place', 'Put in', 'Tool', 'In place of', 'Before'], rows, [1]));
}

// What is said of dowels under layer l's slab, and of those whose holes are drilled into its top; nothing where it has none.
function dowelFacts(l) {
    const of = under => dowelsIn(l).filter(d => d.under === under), under = of(true), over = of(false), lines = [];
    const size = d => `Ø ${figure(d.diameter, 2)} mm`, places = list => list.map(d => `(${d.says})`).join(', ');
    if (under.length) lines.push(make('p', {}, make('strong', {}, `laid on ${plural(under.length, 'dowel')} ${size(under[0])}, ${figure(Math.floor(under[0].below + under[0].above - 1 + 1e-6), 0)} mm long`),
        ` at x, y ${places(under)}; ${undersideOf(l) ? 'the programs of its underside drill its own holes' : `first drill its underside ${figure(under[0].above, 1)} mm deep, places in dowels.csv`}`));
    if (over.length) lines.push(make('p', {}, `its last program drills ${plural(over.length, 'hole')} ${size(over[0])}, ${figure(over[0].below, 1)} mm deep, at ${places(over)}`));
    return lines;
}

// How deep the base board is cut, for whoever screws it down; '' where it is not.
function boardCut() {
    const deep = verify?.totals?.board_cut_mm ?? 0;
    return deep > 0.005 ? `, no screw or pin less than ${figure(deep, 2)} mm under its top: programs cut so deep` : '';
}

function sheet(l, minutes) {
    const layer = plan.layers[l], programs = operations.filter(operation => operation.layer === l), zero = zeroOf(l), filled = filledVolume(l);
    const off = layer.z_bottom + layer.slab_thickness - layer.z_top, files = [...new Set(programs.map(o => fileOf(o).replace(/^nc\//, '')))], first = files[0], final = files[files.length - 1];
    const warnings = [...zero.warnings, ...(filled >= 1 ? [`${cubic(filled)} under overhangs stay filled in this layer (red in the drawing).`] : []), ...warningsOf(l)];
    const glued = layer.glue_area_mm2 > 0, {min} = blankOf(l), [bx, by] = [0, 1].map(k => min[k] - plan.stock.min[k]);
    const laid = bx > 0.05 || by > 0.05 ? `, its corner ${figure(bx, 1)} mm right of and ${figure(by, 1)} mm behind the base board’s` : '';
    return make('article', {class: 'sheet', 'aria-label': `Setup sheet of layer ${layer.index}`},
        make('div', {class: 'top'},
            make('h3', {}, `Layer ${layer.index}`, make('small', {}, ` of ${plan.layers.length}`)),
            make('p', {}, make('strong', {}, plan.input.file), make('br'), programs.length ? make('code', {}, first === final ? first : `${first} … ${final}`) : 'no programs'),
            make('p', {class: 'clock'}, make('strong', {}, duration(minutes)))),
        warningBox(warnings, 5),
        make('div', {class: 'drawings'}, planView(l, [132, 92]), sideView(l, [58, 92])),
        make('p', {class: 'key'}, make('i', {class: 'glue'}), ' glue ', make('i', {class: 'solid'}), ' pattern at the bottom ', make('i', {class: 'dash'}), ' at the top ',
            filled >= 1 ? [make('i', {class: 'air'}), ' stays filled '] : null, supportsIn(l).length ? [make('i', {class: 'support'}), ' support, stays till the end '] : null, keepOutsIn(l).length ? [make('i', {class: 'keep-out'}), ' no tool enters '] : null, dowelsIn(l).length ? [make('i', {class: 'dowel'}), ' dowel under the slab, dashed: hole in its top '] : null, make('i', {class: 'zero'}), inInches ? ' zero. Measures in mm, but what the control shows in inches.' : ' zero. Measures in mm; z as the control shows it.'),
        make('div', {class: 'facts'},
            fact('Zero', make('p', {}, zero.place), make('p', {}, make('strong', {}, 'XY: '), zero.xy, zero.after ? `; ${zero.after}` : null), make('p', {}, make('strong', {}, 'Z: '), zero.z), make('p', {}, make('strong', {}, 'Table: '), tableHeight(l))),
            fact('Slab', make('p', {}, make('strong', {}, `${blankSize(l)} × ${figure(layer.slab_thickness, 2)} mm`), ` ${plan.job.material.name}${laid}`),
                make('p', {}, `pattern z ${figure(layer.z_bottom, 3)} to ${figure(layer.z_top, 3)}; facing takes ${figure(off, 2)} mm`), make('p', {class: 'soft'}, layer.reason), dowelFacts(l)),
            fact(glued ? 'Glue and press' : 'No glue', glued
                ? [make('p', {}, make('strong', {}, `${figure(layer.glue_area_mm2 / 100, 1)} cm²`), ` ${plan.job.bonding.glue}, on the yellow`), glueHead(l),
                    make('p', {}, make('strong', {}, `${figure(layer.press_force_n, 0)} N`), ` for ${figure(plan.job.bonding.press_time_s, 0)} s`)]
                : make('p', {}, 'clamp the slab'))),
        make('div', {class: 'lists'},
            make('div', {}, make('h4', {}, 'Tools'), table(toolHead, toolRows(programs, `L${l}`), [3, 4, 5, 6, 7])),
            magazine(l),
            make('div', {}, make('h4', {}, 'Programs, in this order'), table(['✓', 'Program', 'Work', 'Tool', 'rpm', 'Feed mm/min', 'Time'], programs.map(o => [
                tick(`L${l}:${o.name}`, `${o.name} done`, true), make('code', {}, o.name), `${words(o.kind)}: ${o.purpose}`, make('strong', {}, `T${o.tool}`), figure(o.spindle_rpm, 0), feedsOf([o]), duration(o.minutes)]), [4, 5, 6]))),
        make('h4', {}, 'Checks'),
        make('div', {class: 'checks'}, [
            l === 0 ? `base board ${figure(plan.job.machine.base_board_thickness, 1)} mm mounted and level${boardCut()}` : `layer ${plan.layers[l - 1].index} faced, free of dust where the glue goes`,
            `slab at least ${figure(layer.slab_thickness, 2)} mm thick all over, no warp`,
            ...keepOutsIn(l).filter(k => k.slab || l === 0).map(k => `stands where it is drawn, no higher: ${k.says}`),
            ...(undersideOf(l) ? ['slab milled from below as its own sheet says, and turned over from left to right'] : []),
            ...(dowelsIn(l).some(d => d.under) ? [undersideOf(l) ? 'dowels set and dry-fitted' : 'holes in the slab’s underside drilled as dowels.csv says, dowels set and dry-fitted'] : []),
            ...(glued ? [`glue on, pressed ${figure(plan.job.bonding.press_time_s, 0)} s`] : []),
            zeroIsSet(l),
            ...((plan.post ? plan.post.base : plan.job.machine.post) === 'grbl' && !probed(l) ? ['at each change of tool: the new tip touched off where the last one was'] : []),
            'dust extraction on',
            `after facing: top measured at z ${onControl(layer.z_top - zeroHeight(l))}`,
        ].map((text, i) => tick(`L${l}:check${i}`, text))),
        make('p', {class: 'proof'}, make('strong', {}, 'Simulated: '), simulated(l).join('; ')));
}

// Slabs of one size, the largest first: {count, size, thickness}.
function slabsToLay() {
    const lines = new Map();
    plan.layers.forEach((layer, l) => {
        const size = blankSize(l), thickness = layer.slab_thickness / layer.slabs, key = `${size}:${thickness}`, {min, max} = blankOf(l);
        if (!lines.has(key)) lines.set(key, {count: 0, size, thickness, area: (max[0] - min[0]) * (max[1] - min[1])});
        lines.get(key).count += layer.slabs;
    });
    return [...lines.values()].sort((a, b) => b.area - a.area || b.thickness - a.thickness);
}

// Dowels of one size, the shortest first.
function dowelsToCut() {
    const counts = new Map();
    for (const d of plan.layers.flatMap(layer => layer.dowels ?? [])) {
        const length = Math.floor(d.below + d.above - 1 + 1e-6), key = `Ø ${figure(d.diameter, 2)} × ${figure(length, 0)} mm`;
        counts.set(key, {length, count: (counts.get(key)?.count ?? 0) + 1});
    }
    return [...counts].sort((a, b) => a[1].length - b[1].length).map(([size, {count}]) => `${plural(count, 'dowel')} ${size}`);
}

function cover(minutes) {
    const stack = stackView([112, 84]), cost = costText();
    const t = totals(), answer = verdict(), whole = warningsOf(-1), shown = sharedMinutes(minutes, plan.totals.build_minutes);
    const wide = `${figure(plan.stock.max[0] - plan.stock.min[0], 1)} × ${figure(plan.stock.max[1] - plan.stock.min[1], 1)} mm`;
    const used = toolUse().filter(({uses}) => uses.length > 0);
    const perLayer = plan.layers.map((_, l) => warningsOf(l).length + zeroOf(l).warnings.length);
    return make('article', {class: 'sheet cover', 'aria-label': 'Cover sheet of the build'},
        make('div', {class: 'top'}, make('h3', {}, plan.input.file), make('p', {class: 'clock'}, make('strong', {}, duration(plan.totals.build_minutes)), make('br'), plural(plan.layers.length, 'layer'), ', ', plural(operations.length, 'program'))),
        make('p', {class: `answer ${answer.kind}`}, make('strong', {}, `${answer.title}. `), answer.text),
        warningBox(whole, 5),
        cost ? make('p', {}, 'Cost ', make('strong', {}, cost.total), `: ${cost.parts}`) : null,
        make('div', {class: 'cols'},
            make('div', {}, stack.svg, make('p', {class: 'key'}, make('i', {class: 'wood'}), ' pattern ', make('i', {class: 'glue'}), ' glue ', make('i', {class: 'air'}), ' stays filled',
                stack.taller > 1.01 ? `; heights drawn ${figure(stack.taller, 1)} times` : null)),
            fact('Lay out', make('div', {class: 'checks one'}, [
                `base board ${wide} × ${figure(plan.job.machine.base_board_thickness, 1)} mm`,
                ...slabsToLay().map(s => `${plural(s.count, 'slab')} ${plan.job.material.name}, ${s.size} × ${figure(s.thickness, 2)} mm`),
                ...(plan.wood ? [`sawn from ${boardsText()} (cut list below)`] : []),
                `${plan.job.bonding.glue} for ${figure(t.glue_mm2 / 100, 0)} cm²`,
                ...dowelsToCut(),
                `${plural(used.length, 'tool')} as below, programs of nc/ on the control${control()}`,
                `press up to ${figure(Math.max(...plan.layers.map(layer => layer.press_force_n)), 0)} N, ${figure(plan.job.bonding.press_time_s, 0)} s a joint`,
                `machine carries ${figure(t.stack_mass_kg, 0)} kg`,
            ].map((text, i) => tick(`cover:${i}`, text))))),
        make('h4', {}, 'Tools'),
        table(toolHead, toolRows(operations, 'cover'), [3, 4, 5, 6, 7]),
        make('h4', {}, 'Layers, from below'),
        table(['✓', 'Layer', 'Slab mm', 'From z', 'Face to z', 'Glue cm²', 'Press N', 'Programs', 'Warnings', 'Time'], [
            ...plan.layers.map((layer, l) => [tick(`cover:L${l}`, `layer ${layer.index} done`, true), make('strong', {}, String(layer.index)), figure(layer.slab_thickness, 2), figure(layer.z_bottom, 2), figure(layer.z_top, 2),
                figure(layer.glue_area_mm2 / 100, 1), figure(layer.press_force_n, 0), String(layer.operations.length), perLayer[l] ? String(perLayer[l]) : '–', shown[l]]),
            ['', make('strong', {}, 'All'), '', '', '', figure(t.glue_mm2 / 100, 1), '', String(operations.length), '', make('strong', {}, duration(plan.totals.build_minutes))]], [2, 3, 4, 5, 6, 7, 8, 9]),
        make('h4', {}, 'Every layer goes'),
        make('ol', {class: 'steps'}, [glueHead(0) ? 'Clean the joint; the machine glues, lays and presses the slab.' : 'Clean the joint, spread the glue, lay the slab, press.', plan.job.machine.table === 'fixed' ? 'Set the zero as the layer’s sheet says.' : 'Set the table, touch off as the layer’s sheet says.', 'Run its programs in the order of their names; the first faces the slab.', 'Measure the faced top, tick the sheet, go on to the next.', ...(plan.supports?.length ? [`When the last is done: saw off ${plural(plan.supports.length, 'support')}, at ${plan.supports.map(s => `x ${figure(s.x, 0)} y ${figure(s.y, 0)}`).slice(0, 6).join(', ')}${plan.supports.length > 6 ? ' …' : ''}.`] : [])].map(s => make('li', {}, s))));
}

export function buildSheets(section) {
    const minutes = layerMinutes().map(row => phases.reduce((sum, phase) => sum + row[phase.key], 0));
    section.append(...[make('p', {class: 'note'}, 'Printing this page gives these sheets: a cover, the cut list, and a page for each layer. Boxes that you tick stay ticked in this browser. ',
        make('button', {class: 'act', type: 'button', onclick: () => window.print()}, 'Print')),
    make('nav', {class: 'jump', 'aria-label': 'Setup sheets'}, plan.layers.map((layer, l) => make('a', {href: `#sheet-${l + 1}`}, `Layer ${layer.index}`))),
    cover(minutes), cutListSheet(), ...undersideSheets(), ...plan.layers.map((_, l) => {
        const made = sheet(l, minutes[l]);
        made.id = `sheet-${l + 1}`;
        return made;
    })].filter(part => part));
}
