// The first screen: can it be made, how long, of what, with which tools.

import {cutterOf, duration, figure, make, plural} from './dom.js';
import {boardsText, costText} from './cutlist.js';
import {stackView} from './drawing.js';
import {layerMinutes, phases, plan, remarks, size, toolUse, totals, verdict, verify} from './report.js';

function reasons(show) {
    const groups = new Map();
    for (const remark of remarks) {
        if (remark.severity === 'note') continue;
        if (!groups.has(remark.code)) groups.set(remark.code, []);
        groups.get(remark.code).push(remark);
    }
    const list = [...groups.values()].sort((a, b) => (b[0].severity === 'error') - (a[0].severity === 'error'));
    const shown = list.slice(0, 6).map(([first, ...others]) => make('li', {},
        make('span', {class: first.severity}, `${first.severity}: `), first.message,
        others.length ? ` (and ${others.length} more of ${first.code})` : null,
        show && first.where ? [' ', make('button', {class: 'link', type: 'button', onclick: () => show({where: first.where, text: first.message}),
            'aria-label': `Show in 3D: ${first.message}`}, 'show')] : null));
    if (list.length > 6) shown.push(make('li', {}, `${list.length - 6} more kinds in the table of remarks`));
    return shown.length ? make('ul', {class: 'reasons'}, shown) : null;
}

function entry(term, value, small, tone) {
    return make('div', {class: tone}, make('dt', {}, term), make('dd', {}, value, small ? make('small', {}, small) : null));
}

export function buildSummary(section, show) {
    const cost = costText(), answer = verdict(), t = totals(), [sx, sy, sz] = size();
    const minutes = Object.fromEntries(phases.map(phase => [phase.key, 0]));
    for (const row of layerMinutes()) for (const phase of phases) minutes[phase.key] += row[phase.key];
    const stack = stackView([190, 56]);
    const used = phases.filter(phase => minutes[phase.key] > 0);
    const total = t.build_minutes;
    const parts = used.map(phase => `${phase.name} ${duration(minutes[phase.key])}`).join(', ');
    const kg = `${figure(t.stack_mass_kg, 1)} kg with the base board`;
    section.append(make('div', {class: 'grid'},
        make('div', {class: `card verdict ${answer.kind}`, id: 'verdict'},
            make('p', {class: 'question'}, 'Can it be made?'), make('p', {class: 'answer'}, answer.title), make('p', {}, answer.text), reasons(show)),
        make('div', {class: 'card time'},
            make('h3', {}, 'Build time'), make('p', {class: 'big', id: 'build-time'}, duration(total)),
            make('div', {class: 'bar', role: 'img', 'aria-label': `Build time by kind of work: ${parts}`},
                used.map(phase => make('span', {style: `flex:${minutes[phase.key]} 0 0;background:${phase.color}`, title: `${phase.name}: ${duration(minutes[phase.key])}`}))),
            make('ul', {class: 'legend'}, used.map(phase => make('li', {},
                make('i', {style: `background:${phase.color}`}), `${phase.name} `, make('strong', {}, duration(minutes[phase.key]))))),
            stack.svg, make('p', {class: 'key'}, make('i', {class: 'wood'}), ' pattern ', make('i', {class: 'glue'}), ' glue ', make('i', {class: 'air'}), ' stays filled; seen from the front',
                stack.taller > 1.01 ? `, heights drawn ${figure(stack.taller, 1)} times` : null)),
        make('dl', {class: 'figures'},
            entry('Pattern', `${figure(sx, 1)} × ${figure(sy, 1)} × ${figure(sz, 1)} mm`, `${figure(plan.input.triangles, 0)} facets`),
            entry('Slabs', t.slabs.map(s => `${s.count} × ${figure(s.thickness, 3)} mm`).join(', '),
                `${plan.job.material.name}, ${plan.job.slabs.blanks === 'layer' ? 'at most ' : ''}${figure(plan.stock.max[0] - plan.stock.min[0], 1)} × ${figure(plan.stock.max[1] - plan.stock.min[1], 1)} mm; ${kg}`),
            plan.wood ? entry('Boards to buy', `${figure(plan.wood.bought_m2, 2)} m²`, `${boardsText()}; ${figure(plan.wood.sawn_m2, 2)} m² of it in slabs and base board`) : null,
            cost ? entry('Cost', cost.total, cost.parts) : null,
            entry('Glue', `${figure(t.glue_mm2 / 100, 1)} cm²`, plan.job.bonding.glue),
            entry('Waste', `${figure(100 * t.waste_share, 1)} %`, `${figure((t.stock_volume_mm3 - t.part_volume_mm3) / 1e6, 2)} dm³ of ${figure(t.stock_volume_mm3 / 1e6, 2)} dm³`),
            entry('Worst gouge', verify ? `${figure(verify.totals.gouge_max_mm, 4)} mm` : 'not simulated', verify ? `${figure(verify.limits.gouge_mm, 4)} mm are allowed` : null),
            entry('Worst left-over', verify ? `${figure(verify.totals.left_over_missed_max_mm, 3)} mm` : 'not simulated',
                verify ? `where a tool reaches; rms of all ${figure(verify.totals.left_over_rms_mm, 3)} mm` : null),
            verify && verify.totals.unreachable_mm2 >= 0.5 ? entry('Out of every tool’s reach', `${figure(verify.totals.unreachable_mm2, 0)} mm²`,
                `${figure(100 * verify.totals.unreachable_of_pattern_share, 2)} % of the pattern seen from above, up to ${figure(verify.totals.unreachable_max_mm, 2)} mm left`) : null,
            verify && verify.totals.unmade_mm3 >= 1 ? entry('Stays filled', verify.totals.unmade_mm3 < 1000 ? `${figure(verify.totals.unmade_mm3, 0)} mm³` : `${figure(verify.totals.unmade_mm3 / 1000, 1)} cm³`,
                `air under overhangs, up to ${figure(verify.totals.unmade_height_mm, 1)} mm high; red in the pictures`, 'red') : null),
        make('div', {class: 'card', style: 'grid-column: span 12'}, toolTable()), adviceCard(show)));
}

// Which tool would reach what none of the library does.
function adviceCard(show) {
    const missing = verify?.missing_tools ?? [];
    if (missing.length === 0) return null;
    const head = ['Tool', 'Flutes', 'Stick-out', 'Gains', 'Of what is out of reach', 'Up to', 'Takes about', 'In layers', 'Now kept away by'], numeric = new Set([1, 2, 3, 4, 5, 6]);
    const all = verify.totals.unreachable_mm2;
    const rows = missing.map(m => [
        show ? make('button', {class: 'link', type: 'button', 'aria-label': `${m.name}: show where in 3D`, onclick: () => show({where: m.where, text: `${m.name} would reach this`})}, m.name) : m.name,
        `${figure(m.flute_length_mm, 1)} mm`, `${figure(m.stickout_mm, 1)} mm`, `${figure(m.gain_mm2, 0)} mm²`, `${figure(Math.min(100, 100 * m.gain_mm2 / all), 0)} %`, `${figure(m.depth_mm, 2)} mm deep`,
        duration(Math.max(1, m.minutes)), m.layers.join(', '), m.reason === 'radius' ? 'thicker tools' : 'shorter tools']);
    return make('div', {class: 'card', style: 'grid-column: span 12'}, make('div', {class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'Tools that would reach more'}, make('table', {id: 'advice'},
        make('caption', {}, 'Tools that would reach more: each line is that tool alone, added to the library'),
        make('thead', {}, make('tr', {}, head.map((h, i) => make('th', {scope: 'col', class: numeric.has(i) ? 'n' : null}, h)))),
        make('tbody', {}, rows.map(row => make('tr', {}, row.map((cell, i) => make('td', {class: numeric.has(i) ? 'n' : null}, cell))))))));
}

function toolTable() {
    const head = ['Number', 'Tool', 'Kind', 'Diameter', 'Flutes', 'Flute length', 'Stick-out', 'Spindle', 'Programs', 'Time'];
    const numeric = new Set([3, 4, 5, 6, 7, 8, 9]);
    const rows = toolUse().filter(({uses}) => uses.length > 0).map(({tool, uses, minutes}) => [
        `T${tool.number}`, tool.name, cutterOf(tool), `${figure(tool.diameter, 3)} mm`, tool.flutes, `${figure(tool.flute_length, 1)} mm`,
        `${figure(tool.holder.stickout, 1)} mm`, `${figure(Math.max(...uses.map(u => u.spindle_rpm)), 0)} rpm`, plural(uses.length, 'program'), duration(minutes),
    ]);
    return make('div', {class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'Tools to load'}, make('table', {id: 'magazine'},
        make('caption', {}, 'Tools to load'),
        make('thead', {}, make('tr', {}, head.map((h, i) => make('th', {scope: 'col', class: numeric.has(i) ? 'n' : null}, h)))),
        make('tbody', {}, rows.map(row => make('tr', {}, row.map((cell, i) => make('td', {class: numeric.has(i) ? 'n' : null}, String(cell))))))));
}
